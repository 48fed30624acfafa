"""Tables for the terminal."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from laserimg.formats.coco import Annotation, CocoFile

MAX_ROWS = 60


def print_findings(coco: "CocoFile") -> None:
    """Print detections and rejected candidates, one a line, detections first within each scan."""
    from rich import box
    from rich.console import Console
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for heading in ("scan", "class", "score", "width x depth x height", "range", "verdict"):
        table.add_column(
            heading, justify="right" if heading in ("score", "range") else "left", overflow="fold"
        )
    entries = sorted(coco.annotations, key=lambda e: (e.image_id, not e.accepted, -(e.score or 0)))
    for entry in entries[:MAX_ROWS]:
        image = coco.images_by_id[entry.image_id]
        name = image.file_name + (f" [{image.scan}]" if image.scan else "")
        style = "green" if entry.accepted else "dim"
        table.add_row(name, coco.labels[entry.category_id], *_measured(entry), _verdict(entry), style=style)
    console = Console(width=None if Console().is_terminal else 140)
    if entries:
        console.print(table)
    if len(entries) > MAX_ROWS:
        console.print(f"... and {len(entries) - MAX_ROWS} more in detections.csv")


def _measured(entry: "Annotation") -> tuple[str, str, str]:
    score = "" if entry.score is None else f"{entry.score:.2f}"
    size, at = entry.size, entry.position
    sizes = f"{size.width:.2f} x {size.depth:.2f} x {size.height:.2f} m" if size else "no return"
    return score, sizes, f"{at.range:.1f} m" if at else ""


def _verdict(entry: "Annotation") -> str:
    return "detected" if entry.accepted else f"rejected: {entry.reason}"
