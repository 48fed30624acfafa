"""`laserimg evaluate`: detections against truth."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from laserimg.evaluate import Confusion, Curve, Evaluation
    from laserimg.formats.coco import Annotation


def evaluate(
    detections: Annotated[Path, typer.Argument(help="COCO file of detections (detections.json).")],
    truth: Annotated[Path, typer.Argument(help="COCO file of truth.")],
    out: Annotated[Path | None, typer.Option("-o", "--out", help="HTML page with curves.")] = None,
    candidates: Annotated[
        bool, typer.Option("--candidates", help="Count rejected candidates too: before the checks.")
    ] = False,
    min_points: Annotated[
        int, typer.Option(min=0, help="Objects of the truth with fewer returns need not be found.")
    ] = 0,
    min_visibility: Annotated[
        float, typer.Option(min=0, max=1, help="Nor those of which a smaller share is in sight.")
    ] = 0.0,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON, with the curves.")] = False,
    quiet: Annotated[bool, typer.Option(help="Print nothing but errors.")] = False,
) -> None:
    """Compare detections with truth: average precision, curves, range bands, confusion.

    Examples:

    \b
      laserimg evaluate out/detections.json truth.coco.json
      laserimg evaluate out/detections.json truth.coco.json -o evaluation.html
      laserimg evaluate out/detections.json truth.coco.json --json
      laserimg evaluate found/detections.json streets/truth.coco.json --min-points 50 --min-visibility 0.5
    """
    import json

    from laserimg.evaluate import confusion
    from laserimg.evaluate import evaluate as compare
    from laserimg.evaluate.page import evaluation_page
    from laserimg.evaluate.scores import accepted
    from laserimg.files import write_text
    from laserimg.formats.coco_file import read_coco

    found, wanted = read_coco(detections), read_coco(truth)
    accept = (lambda entry: True) if candidates else accepted

    def asked(entry: "Annotation") -> bool:
        in_sight = entry.visibility is None or entry.visibility >= min_visibility
        return in_sight and (entry.area is None or entry.area >= min_points)

    result = compare(found, wanted, accept=accept, asked=asked)
    table = confusion(found, wanted, accept=accept, asked=asked)
    if out is not None:
        write_text(out, evaluation_page(result, table, str(detections), str(truth)))
    if as_json:
        typer.echo(json.dumps(_plain(result, table), indent=1))
    elif not quiet:
        _print(result, table)
        if out is not None:
            typer.echo(f"curves: {out}")
        if not any(entry.position for entry in wanted.annotations):
            typer.echo("no range bands: the truth has no positions (laserimg truth and simulate write them)")
    for name in result.missing:
        typer.echo(f"laserimg: {name}: no such scan among the detections, left out", err=True)
    if result.missing:
        raise typer.Exit(1)


def _print(result: "Evaluation", table: "Confusion") -> None:
    from rich import box
    from rich.console import Console
    from rich.table import Table

    from laserimg.evaluate import BANDS_M, IOUS

    console = Console(width=None if Console().is_terminal else 140)
    scores = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for heading in ("class", "objects", *(f"AP@{iou:g}" for iou in IOUS), "hits", "false", "missed"):
        scores.add_column(heading, justify="left" if heading == "class" else "right")
    for near, far in BANDS_M:
        scores.add_column(f"AP@0.5 {near:g}-{far:g} m", justify="right")
    for label in result.labels:
        curves = [result.curves[label, iou, None] for iou in IOUS]
        bands = [result.curves[label, 0.5, band] for band in BANDS_M]
        counts = result.curves[label, 0.5, None].counts
        scores.add_row(
            label,
            str(curves[0].objects),
            *map(_ap, curves),
            *(str(number) for number in (counts.hits, counts.false_positives, counts.misses)),
            *map(_ap, bands),
        )
    console.print(scores)
    console.print("hits, false, missed: at IoU 0.5. Confusion at IoU 0.5, rows are the truth:")
    matrix = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for heading in ("", *table.labels):
        matrix.add_column(heading, justify="right")
    for label, row in zip(table.labels, table.counts.tolist(), strict=True):
        matrix.add_row(label, *map(str, row))
    console.print(matrix)


def _ap(curve: "Curve") -> str:
    return "-" if curve.objects == 0 else f"{curve.average_precision:.3f}"


def _plain(result: "Evaluation", table: "Confusion") -> dict[str, Any]:
    curves = [
        {
            "class": label,
            "iou": iou,
            "band_m": list(band) if band else None,
            "objects": curve.objects,
            "average_precision": curve.average_precision if curve.objects else None,
            "scores": curve.scores.tolist(),
            "recall": curve.recall.tolist(),
            "precision": curve.precision.tolist(),
            "false_positives_per_image": curve.false_positives_per_image.tolist(),
        }
        for (label, iou, band), curve in result.curves.items()
    ]
    return {
        "curves": curves,
        "confusion": {"labels": list(table.labels), "counts": table.counts.tolist()},
        "missing": list(result.missing),
    }
