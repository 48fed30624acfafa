"""`laserimg detect`: objects in scans, with their sizes, and why other candidates are none."""

from pathlib import Path
from typing import Annotated

import typer


def detect(
    paths: Annotated[list[Path], typer.Argument(help="Scan files, folders or globs.")],
    out: Annotated[Path, typer.Option("-o", "--out", help="Folder for the results.")],
    rules: Annotated[Path | None, typer.Option(help="Rule file. Default: the shipped rules.")] = None,
    cascades: Annotated[
        str | None, typer.Option(help="Folder or file of detectors, or 'none'. Default: the shipped ones.")
    ] = None,
    image: Annotated[str | None, typer.Option(help="Image for a cascade without a card.")] = None,
    label: Annotated[
        str | None, typer.Option(help="Class for a cascade without a card, or of all given candidates.")
    ] = None,
    source: Annotated[
        list[str] | None,
        typer.Option("--from", help="Where candidates come from: cascade, hog, regions, clusters."),
    ] = None,
    candidates: Annotated[
        Path | None, typer.Option(help="COCO file: check its boxes in place of all sources.")
    ] = None,
    partition: Annotated[str, typer.Option(help="Regions: default, or reference (paper 2).")] = "default",
    scale: Annotated[str, typer.Option(help="Window search: metric or plain.")] = "metric",
    min_range: Annotated[float | None, typer.Option(help="Metres; nearer returns do not count.")] = None,
    max_range: Annotated[float | None, typer.Option(help="Metres; farther returns do not count.")] = None,
    up: Annotated[str | None, typer.Option(help="Axis of the scanner that points up, such as -y.")] = None,
    rotate: Annotated[
        tuple[float, float, float] | None, typer.Option(help="Roll, pitch, yaw of the scanner in degrees.")
    ] = None,
    rejected: Annotated[
        str, typer.Option(help="Rejected candidates to write: all, near (those close to the limits) or none.")
    ] = "near",
    overlays: Annotated[bool, typer.Option(help="Write a picture of every scan.")] = True,
    split_seam: Annotated[bool, typer.Option(help="Write boxes across the seam as two.")] = False,
    jobs: Annotated[int, typer.Option(min=1, help="Worker processes.")] = 1,
    force: Annotated[bool, typer.Option(help="Redo scans that an earlier run has finished.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print detections.json, not a table.")] = False,
    quiet: Annotated[bool, typer.Option(help="Print nothing but errors.")] = False,
) -> None:
    """Find objects in scans: a table, detections.json and .csv, and a picture of every scan.

    Examples:

    \b
      laserimg detect office.pcd -o out
      laserimg detect scans/ -o out --jobs 4
      laserimg detect 1.ptx -o out --from regions --rules rules.toml
      laserimg detect office.pcd -o out --candidates boxes.coco.json --label wastebasket
    """
    from laserimg.cli.progress import track
    from laserimg.cli.scan_files import scan_files
    from laserimg.cli.tables import print_findings
    from laserimg.cli.usage import settings_of
    from laserimg.workers import start_early

    if jobs > 1:
        start_early()
    settings = settings_of(
        rules=str(rules) if rules else None,
        cascades=cascades,
        image=image,
        label=label,
        sources=tuple(source or ()),
        candidates=str(candidates) if candidates else None,
        partition=partition,
        scale=scale,
        min_range=min_range,
        max_range=max_range,
        up=up,
        rotate=rotate,
        rejected=rejected,
        overlays=overlays,
        split_seam=split_seam,
    )
    from laserimg import batch

    files, missing = scan_files(paths, out)
    tasks = batch.tasks_of(files, settings) if files else []
    done = list(track(batch.run(tasks, settings, out, jobs, force), len(tasks), "detecting", quiet))
    coco = batch.assemble(tasks, done, settings, out) if tasks else None
    if coco and as_json:
        typer.echo((out / "detections.json").read_text(encoding="utf-8"), nl=False)
    elif coco and not quiet:
        print_findings(coco)
        typer.echo(f"{_summary(done, coco)}; written to {out}")
    for line in [*missing, *(entry.error for entry in done if entry.error)]:
        typer.echo(f"laserimg: {line}", err=True)
    if missing or any(entry.error for entry in done):
        raise typer.Exit(1)


def _summary(done: list, coco) -> str:
    kept = sum(entry.resumed for entry in done)
    accepted = sum(bool(entry.accepted) for entry in coco.annotations)
    counts = _counted(len(coco.images), "scan"), _counted(accepted, "detection")
    text = f"{', '.join(counts)}, {len(coco.annotations) - accepted} rejected"
    return text + (f" ({_counted(kept, 'file')} kept from an earlier run)" if kept else "")


def _counted(count: int, what: str) -> str:
    return f"{count} {what}" if count == 1 else f"{count} {what}s"
