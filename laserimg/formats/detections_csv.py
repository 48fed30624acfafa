"""`detections.csv`: what `detections.json` holds of every candidate, one line each."""

import csv
import io
from collections.abc import Iterator
from dataclasses import fields
from pathlib import Path

from laserimg.files import atomic_write
from laserimg.formats.coco import Annotation, CheckRecord, CocoFile, Position, Size
from laserimg.formats.coco_file import DECIMALS, readable

# Everything of an annotation that is one value.
_SINGLE = ("id", "accepted", "reason", "score", "source", "area", "iscrowd")


def write_detections_csv(path: Path, coco: CocoFile) -> None:
    """Write the flat form of a COCO file whole or not at all."""
    with atomic_write(path) as temporary:
        temporary.write_bytes(detections_csv(coco).encode())


def detections_csv(coco: CocoFile) -> str:
    """Return the flat form: one line an annotation, one column a value.

    Columns are named as the keys lead to them: ``size.height``, ``checks.height.value``,
    ``checks.height.low``, ``checks.height.high``, ``checks.height.passed``. What an annotation
    does not have is empty. Lines end as RFC 4180 has it.
    """
    rows = [dict(_row(coco, annotation)) for annotation in coco.annotations]
    columns = dict.fromkeys([*_columns(), *(name for row in rows for name in row)])
    text = io.StringIO(newline="")
    writer = csv.DictWriter(text, list(columns))
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()


def _columns() -> Iterator[str]:
    yield from ("file_name", "scan", "label", *_SINGLE)
    yield from (f"{name}.{side}" for name in ("bbox", "region_bbox") for side in "xywh")
    yield from (f"size.{one.name}" for one in fields(Size))
    yield from (f"position.{one.name}" for one in fields(Position))


def _row(coco: CocoFile, annotation: Annotation) -> Iterator[tuple[str, str]]:
    image = coco.images_by_id[annotation.image_id]
    yield "file_name", _cell(image.file_name)
    yield "scan", str(image.scan)
    yield "label", _cell(coco.labels[annotation.category_id])
    for name in _SINGLE:
        yield name, _cell(getattr(annotation, name))
    for name in ("bbox", "region_bbox"):
        yield from zip(
            (f"{name}.{side}" for side in "xywh"), map(_cell, getattr(annotation, name) or ()), strict=False
        )
    for name in ("size", "position"):
        record = getattr(annotation, name)
        for one in fields(record) if record else ():
            yield f"{name}.{one.name}", _cell(getattr(record, one.name))
    for check in annotation.checks:
        yield from _check_cells(check)


def _check_cells(check: CheckRecord) -> Iterator[tuple[str, str]]:
    low, high = check.limit
    values = {"value": check.value, "low": low, "high": high, "passed": check.passed}
    for key, value in values.items():
        yield f"checks.{readable(check.name)}.{key}", _cell(value)


def _cell(value: object) -> str:
    if value is None:
        return ""
    if isinstance(value, bool):
        return str(value).lower()
    return str(round(value, DECIMALS) + 0.0) if isinstance(value, float) else readable(str(value))
