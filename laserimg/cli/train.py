"""``laserimg train``: train detectors."""

from pathlib import Path
from typing import TYPE_CHECKING

import typer

if TYPE_CHECKING:
    from laserimg.cascade.folder import Run
    from laserimg.cascade.training import Trained

app = typer.Typer(
    name="train",
    no_args_is_help=True,
    rich_markup_mode=None,
    help="Train detectors: cascades for OpenCV.",
)


@app.callback()
def _train() -> None:
    pass


@app.command()
def cascade(
    positives: Path = typer.Option(
        ..., "--positives", help="A .vec, a folder of crops, COCO .json, or OpenCV's info.dat."
    ),
    negatives: Path = typer.Option(
        ..., "--negatives", help="A folder, a list (.txt), or labels: then what is outside all boxes."
    ),
    out: Path = typer.Option(..., "--out", "-o", help="Folder for the cascade and its state."),
    window: str = typer.Option("24x24", help="Width x height of the window in pixels."),
    features: str = typer.Option("basic", help="basic, core, all (with tilted features) or lbp."),
    num_pos: int = typer.Option(0, min=0, help="Positives a stage; 0 takes all that are left."),
    num_neg: int = typer.Option(2000, min=1, help="Negatives a stage."),
    stages: int = typer.Option(20, min=1, help="Stages at most."),
    min_hit_rate: float = typer.Option(0.995, help="Share of positives that each stage must keep."),
    max_false_alarm: float = typer.Option(0.5, help="Share of negatives that each stage may keep."),
    target: float = typer.Option(0.0, help="Stop when false alarms per window are surely no more than this."),
    boost: str = typer.Option("gentle", help="gentle, real, discrete or logit."),
    depth: int = typer.Option(1, min=1, help="Questions in a row that a tree may ask; 1 makes stumps."),
    max_trees: int = typer.Option(100, min=1, help="Trees of a stage at most."),
    weight_trim: float = typer.Option(1.0, help="Share of the weight that a round looks at; 1 is all."),
    search: str = typer.Option("screened", help="screened, or exhaustive: every feature in every round."),
    zero_mean: bool = typer.Option(
        False, "--zero-mean", help="Three-part features that plain brightness does not move."
    ),
    margin: float = typer.Option(0.0, min=0.0, help="Border round a labelled box, as a share of it."),
    label: str | None = typer.Option(None, "--class", help="The class of the labels to learn."),
    validate: Path | None = typer.Option(
        None, help="Positives kept aside: the report judges by them. Same kinds as --positives."
    ),
    image: str = typer.Option("reflectance", help="What image of a scan the samples are, for the card."),
    turned: bool = typer.Option(
        False, "--turned-negatives", help="Also search mirrored and turned copies of the negatives."
    ),
    images_of_scans: Path | None = typer.Option(
        None, "--images", help="Labels of scans: the folder that laserimg images wrote; --image says which."
    ),
    scale_step: float = typer.Option(1.2, min=1.05, help="Ratio of the sizes negatives are looked for at."),
    seed: int = typer.Option(0, min=0, help="Another seed gives another cascade of the same kind."),
    memory: str = typer.Option("2G", help="Memory at most, such as 500M or 4G."),
    jobs: int = typer.Option(0, min=0, help="Threads; 0 is one a core. The result does not depend on it."),
    restart: bool = typer.Option(False, "--restart", help="Forget the stages in the folder."),
    dry_run: bool = typer.Option(False, "--dry-run", help="Count samples and windows, estimate, and stop."),
    as_json: bool = typer.Option(False, "--json", help="Print the stages as JSON."),
    quiet: bool = typer.Option(False, "--quiet", "-q", help="Print nothing when all is well."),
) -> None:
    """Train a Haar or LBP cascade that every cv2.CascadeClassifier loads.

    The folder gets cascade.xml, its card cascade.toml, report.html, log.jsonl, and state/. Stopped at any
    moment and started again with the same options, training goes on behind the last whole stage and ends in
    the same cascade.

    \b
      laserimg train cascade --positives pos.vec --negatives bg.txt --window 20x20 -o faces
      laserimg train cascade --positives chairs.json --class chair --negatives chairs.json \\
          --images pictures --image normals_view --window 24x32 --features all -o chairs
      laserimg train cascade --positives crops/ --negatives photos/ --features lbp --dry-run -o out
    """
    from laserimg.cascade.features import Pool
    from laserimg.cascade.folder import Run, run_in_folder, tables_share
    from laserimg.cascade.stage import StageGoal
    from laserimg.cascade.training import Plan
    from laserimg.cli.sizes import bytes_of, window_of
    from laserimg.cli.training_display import Display
    from laserimg.errors import ConfigError
    from laserimg.formats.card import IMAGES, PLANES
    from laserimg.samples.negatives import read_negatives
    from laserimg.samples.positives import read_positives

    if image not in (*IMAGES, *PLANES):
        raise typer.BadParameter(f"known: {', '.join((*IMAGES, *PLANES))}", param_hint="--image")
    bytes_allowed = bytes_of(memory)
    try:
        goal = StageGoal(min_hit_rate, max_false_alarm, boost, depth, weight_trim, max_trees)  # type: ignore[arg-type]
        pool = Pool(features, *window_of(window), zero_mean)  # type: ignore[arg-type]
        tables = tables_share(bytes_allowed)
        plan = Plan(pool, goal, stages, num_pos, num_neg, target, search, seed, tables)  # type: ignore[arg-type]
    except ConfigError as error:
        raise typer.BadParameter(str(error)) from None
    pictures = (images_of_scans, image) if images_of_scans else None
    objects = read_positives(positives, (pool.width, pool.height), margin, label, pictures)
    images = read_negatives(negatives, pictures)
    aside = (
        read_positives(validate, (pool.width, pool.height), margin, label, pictures).windows
        if validate
        else None
    )
    threads = jobs or _cores()
    run = Run(plan, objects.windows, images.images, out, threads, bytes_allowed, scale_step, aside, turned)
    if dry_run:
        _dry_run(run, [*objects.skipped, *images.skipped])
        return
    with Display(run, quiet or as_json) as display:
        display.left_out([*objects.skipped, *images.skipped])
        trained = run_in_folder(run, display, restart)
    _finish(run, trained, label or "object", image, f"{len(objects.windows)} positives of {positives.name}")
    if as_json:
        _print_json(trained)
    elif not quiet:
        display.end(trained)
    if len(trained.cascade) == 0:
        raise typer.Exit(1)


def _finish(run: "Run", trained: "Trained", label: str, image: str, trained_on: str) -> None:
    if len(trained.cascade) == 0:
        return
    from importlib.metadata import version

    import cv2

    from laserimg.formats.card import Card, card_path, file_sha256, write_card

    pool = run.plan.pool
    card = Card(
        label=label,
        kind="lbp" if pool.mode == "lbp" else "haar",
        image=image,  # type: ignore[arg-type]
        window=(pool.width, pool.height),
        sha256=file_sha256(run.cascade),
        stages=len(trained.cascade),
        trained_on=trained_on,
        seed=run.plan.seed,
        versions={"laserimg": version("laserimg"), "opencv": cv2.__version__},
    )
    write_card(card_path(run.cascade), card)


def _dry_run(run: "Run", skipped: list[str]) -> None:
    from laserimg.cascade.estimate import forecast
    from laserimg.cascade.pyramid import windows_of
    from laserimg.samples.images import read_grey

    window = (run.plan.pool.width, run.plan.pool.height)
    windows, usable = 0, 0
    for entry in run.backgrounds:
        pixels = read_grey(entry.path)
        if pixels is None:
            skipped.append(f"{entry.source or entry.path}: {entry.path.name} cannot be read as an image")
            continue
        count = windows_of(pixels.shape[::-1], window, run.scale_step)
        if count == 0:
            size = f"{pixels.shape[1]}x{pixels.shape[0]}"
            skipped.append(f"{entry.source or entry.path}: {size} is smaller than the window")
        windows, usable = windows + count * (8 if run.turned else 1), usable + (count > 0)
    for line in skipped:
        print(f"left out: {line}")
    ahead = forecast(run.plan, windows, jobs=run.jobs)
    print(f"{len(run.positives)} positives; {usable} images with {windows:,d} windows a pass")
    print(f"{len(run.plan.pool):,d} features")
    print(
        f"negatives last for about {ahead.stages} of {run.plan.stages} stages, to {ahead.rate:.1g} per window"
    )
    print(f"about {ahead.seconds:.0f} s on {run.jobs} threads, at most {run.memory >> 20} MB")


def _print_json(trained: "Trained") -> None:
    import json
    from dataclasses import asdict

    rate = asdict(trained.rate) if trained.rate else None
    stages = [asdict(record) for record in trained.records]
    print(json.dumps({"end": trained.end, "rate": rate, "stages": stages}))


def _cores() -> int:
    import os

    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
