"""``laserimg train hog``: train a HOG window with a linear SVM."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING

import typer

if TYPE_CHECKING:
    from collections.abc import Sequence

    from laserimg.formats.card import Card
    from laserimg.hog_training.folder import HogRun
    from laserimg.hog_training.training import HogWatcher, TrainedHog


def hog(
    positives: Path = typer.Option(
        ..., "--positives", help="A .vec, a folder of crops, COCO, VOC, imglab, YOLO, or OpenCV's info.dat."
    ),
    negatives: Path = typer.Option(
        ..., "--negatives", help="A folder, a list (.txt), or labels: then what is outside all boxes."
    ),
    out: Path = typer.Option(..., "--out", "-o", help="Folder for the detector."),
    window: str = typer.Option("64x128", help="Width x height of the window in pixels."),
    cell: str = typer.Option("8x8", help="Pixels that share a histogram."),
    block: str = typer.Option("16x16", help="Pixels that are normalised together: whole cells."),
    stride: str = typer.Option("8x8", help="From block to block."),
    bins: int = typer.Option(9, help="Directions of a histogram."),
    signed: bool = typer.Option(False, "--signed", help="Dark on light is not light on dark."),
    rounds: int = typer.Option(3, min=0, help="Times that negatives taken for the object are added."),
    num_neg: int = typer.Option(2000, min=1, help="Negatives at random, and at most in each round."),
    c: float = typer.Option(0.1, help="What a sample on the wrong side costs."),
    margin: float = typer.Option(0.0, min=0.0, help="Border round a labelled box, as a share of it."),
    label: str | None = typer.Option(None, "--class", help="The class of the labels to learn."),
    image: str = typer.Option("reflectance", help="What image of a scan the samples are, for the card."),
    object_size: str | None = typer.Option(
        None, metavar="WxH", help="Usual width and height of the object in metres, for the card: 0.25x0.36."
    ),
    images_of_scans: Path | None = typer.Option(
        None, "--images", help="Labels of scans: the folder that laserimg images wrote; --image says which."
    ),
    validate: Path | None = typer.Option(None, help="Positives kept aside, for the hit rate on the card."),
    validate_negatives: Path | None = typer.Option(
        None, help="Images kept aside, for the false alarms on the card; with --validate."
    ),
    scale_step: float = typer.Option(1.2, min=1.05, help="Ratio of the sizes negatives are looked for at."),
    seed: int = typer.Option(0, min=0, help="Another seed gives another detector of the same kind."),
    jobs: int = typer.Option(0, min=0, help="Threads; 0 is one a core. The result does not depend on it."),
    as_json: bool = typer.Option(False, "--json", help="Print the rounds as JSON."),
    quiet: bool = typer.Option(False, "--quiet", "-q", help="Print nothing when all is well."),
) -> None:
    """Train a HOG window with a linear SVM, for cv2.HOGDescriptor.

    The folder gets hog.npz, its card hog.toml, and log.jsonl, all at the end. Samples are those of laserimg
    train cascade. Small windows need small cells.

    \b
      laserimg train hog --positives people.vec --negatives photos/ -o people
      laserimg train hog --positives pos.vec --negatives bg.txt --window 24x24 \\
          --cell 4x4 --block 8x8 --stride 4x4 -o faces
      laserimg train hog --positives chairs.json --class chair --negatives chairs.json \\
          --images pictures --image normals_view --window 48x64 -o chairs
    """
    from dataclasses import replace

    import joblib

    from laserimg.cli.sizes import window_of
    from laserimg.errors import ConfigError
    from laserimg.hog_training.folder import HogRun, HogSamples, train_into_folder
    from laserimg.hog_training.training import HogPlan
    from laserimg.hog_training.window import HogWindow

    if validate_negatives and not validate:
        raise typer.BadParameter("--validate-negatives needs --validate")
    size = window_of(window)
    try:
        parts = HogWindow(size, window_of(cell), window_of(block), window_of(stride), bins, signed)
        plan = HogPlan(parts, rounds, num_neg, c, seed)
    except ConfigError as error:
        raise typer.BadParameter(str(error)) from None
    _check_image(image)
    metres = _metres(object_size) if object_size else None
    how = (size, margin, label, (images_of_scans, image) if images_of_scans else None)
    learnt = HogSamples.read(positives, negatives, *how)
    judged = HogSamples.read(validate, validate_negatives, *how) if validate else None
    about = _card(label or "object", image, size, f"{len(learnt.positives)} positives of {positives.name}")
    card = replace(about, margin=margin, object_size_m=metres)
    run = HogRun(plan, learnt, out, card, jobs or joblib.cpu_count(), scale_step, judged)
    _name_left_out([*learnt.skipped, *(judged.skipped if judged else ())])
    trained, card = train_into_folder(run, _watcher(run, quiet or as_json))
    if as_json:
        _print_json(trained, card)
    elif not quiet:
        _print_rounds(trained, card, run.detector)


def _metres(text: str) -> tuple[float, float]:
    try:
        width, height = (float(part) for part in text.lower().split("x"))
    except ValueError:
        width = height = 0.0
    if not (0 < width <= 1000 and 0 < height <= 1000):
        raise typer.BadParameter(
            f"'{text}' is not WIDTHxHEIGHT in metres, such as 0.25x0.36", param_hint="--object-size"
        )
    return width, height


def _check_image(image: str) -> None:
    from laserimg.formats.card import IMAGES, PLANES

    if image not in (*IMAGES, *PLANES):
        raise typer.BadParameter(
            f"'{image}' is none of {', '.join((*IMAGES, *PLANES))}", param_hint="--image"
        )


def _card(label: str, image: str, window: tuple[int, int], trained_on: str) -> "Card":
    import cv2

    from laserimg import __version__
    from laserimg.formats.card import Card

    versions = {"laserimg": __version__, "opencv": cv2.__version__}
    return Card(label, "hog", image, window, "", trained_on=trained_on, versions=versions)  # type: ignore[arg-type]


def _name_left_out(skipped: "Sequence[str]") -> None:
    for line in skipped[:20]:
        print(f"left out: {line}", file=sys.stderr)
    if len(skipped) > 20:
        print(f"left out: {len(skipped) - 20} more", file=sys.stderr)


def _watcher(run: "HogRun", quiet: bool) -> "HogWatcher":
    """Return what shows how many images a round has looked at, and the time left if it looks at all."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    from laserimg.hog_training.training import HogWatcher, Round

    console = Console(stderr=True)
    columns = (TextColumn("{task.description}"), BarColumn(), TimeRemainingColumn())
    progress = Progress(*columns, console=console, transient=True, disable=quiet or not console.is_terminal)
    task = progress.add_task("")

    class Shown(HogWatcher):
        def left_out(self, lines: "Sequence[str]") -> None:
            _name_left_out(lines)

        def mining(self, number: int, images: int, found: int) -> None:
            told = f"round {number}: {found} of {run.plan.negatives} negatives"
            share = max(found / run.plan.negatives, images / len(run.samples.backgrounds))
            progress.start()
            progress.update(task, description=told, completed=100 * share)

        def round(self, record: Round) -> None:
            progress.stop()
            progress.reset(task)

    return Shown()


def _print_rounds(trained: "TrainedHog", card: "Card", path: Path) -> None:
    print("round  negatives    new  windows looked at  false alarms before  hit rate  seconds")
    for record in trained.rounds:
        seconds = record.mining_s + record.training_s
        print(
            f"{record.number:5d}  {record.negatives:9d}  {record.added:5d}  {record.before.windows:17,d}"
            f"  {record.before.value:19.3g}  {record.hit_rate:8.4f}  {seconds:7.1f}"
        )
    if trained.rate:
        print(f"no new false alarm in {trained.rate.windows:,d} windows: more images let training go on")
    for name, value in card.scores.items():
        print(f"{name.replace('_', ' ')}: {value:.4g}")
    print(path)


def _print_json(trained: "TrainedHog", card: "Card") -> None:
    import json
    from dataclasses import asdict

    print(json.dumps({"rounds": [asdict(record) for record in trained.rounds], "scores": card.scores}))
