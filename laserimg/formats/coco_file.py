"""Reading and writing COCO files."""

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields, is_dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from laserimg.errors import LabelError, LaserImgError
from laserimg.files import read_bytes, write_text
from laserimg.formats.coco import READING, Annotation, Category, CocoFile, CocoImage
from laserimg.formats.validation import problem

if TYPE_CHECKING:
    from pydantic import TypeAdapter

# A thousand boxes need half a megabyte.
MAX_BYTES = 1 << 30
# Micrometres, and millionths of a pixel.
DECIMALS = 6
# What an annotation that nobody has judged has beside its box.
_TRUTH_KEYS = (
    "id",
    "image_id",
    "category_id",
    "bbox",
    "area",
    "iscrowd",
    "score",
    "size",
    "position",
    "visibility",
    "segmentation",
)


@dataclass(frozen=True, slots=True)
class _Parts:
    """The top level of a file, before its parts are held against each other."""

    __pydantic_config__ = READING
    images: tuple[CocoImage, ...]
    categories: tuple[Category, ...]
    annotations: tuple[Annotation, ...]
    info: Mapping[str, Any] = field(default_factory=dict)


def read_coco(path: Path) -> CocoFile:
    """Read truth, candidates or detections; keys that other tools added are passed over.

    Raises
    ------
    LabelError
        If the file cannot be read or is not such a file; names the annotation.
    """
    from pydantic import ValidationError

    try:
        data = read_bytes(path, MAX_BYTES)
    except LaserImgError as error:
        raise LabelError(f"{path}: {error}") from None
    try:
        parts = _adapter().validate_json(data)
    except ValidationError as error:
        raise LabelError(f"{path}: {_message(data, error.errors(include_url=False)[0])}") from None
    return CocoFile(parts.images, parts.categories, parts.annotations, parts.info, str(path))


@cache
def _adapter() -> "TypeAdapter[_Parts]":
    """Made once: it takes longer than to read the results of a scan."""
    from pydantic import TypeAdapter

    return TypeAdapter(_Parts)


def write_coco(path: Path, coco: CocoFile) -> None:
    """Write a COCO file whole or not at all, one image, category and annotation a line."""
    write_text(path, coco_text(coco))


def coco_text(coco: CocoFile) -> str:
    """Return a COCO file as JSON.

    Numbers are rounded to 6 decimals; what is None is left out; a judged annotation has all that
    is known of it, one of truth its box, size, place, mask and visibility.

    Raises
    ------
    LabelError
        If a number is not finite.
    """
    sections = {
        "images": map(_plain, coco.images),
        "categories": map(_plain, coco.categories),
        "annotations": map(_plain_annotation, coco.annotations),
    }
    try:
        info = json.dumps(_rounded(coco.info), allow_nan=False)
        written = [f'"{name}": {_lines(entries)}' for name, entries in sections.items()]
    except ValueError as error:
        raise LabelError(f"{coco.source}: a number is not finite: {error}") from None
    return "{\n" + ",\n".join([f'"info": {info}', *written]) + "\n}\n"


def _lines(entries: Iterable[dict[str, Any]]) -> str:
    lines = [json.dumps(entry, allow_nan=False) for entry in entries]
    return "[\n " + ",\n ".join(lines) + "\n]" if lines else "[]"


def _plain_annotation(annotation: Annotation) -> dict[str, Any]:
    entry = _plain(annotation)
    return entry if annotation.accepted is not None else {k: v for k, v in entry.items() if k in _TRUTH_KEYS}


def _plain(record: Any) -> dict[str, Any]:
    """Return the fields of a dataclass ready for JSON, without optional ones that are None."""
    values = {one: getattr(record, one.name) for one in fields(record)}
    return {
        one.name: _rounded(value)
        for one, value in values.items()
        if value is not None or one.default is not None
    }


def readable(text: str) -> str:
    """Return the text with what UTF-8 cannot hold, as in some file names, written out."""
    return text.encode("utf-8", "backslashreplace").decode()


def _rounded(value: Any) -> Any:
    if isinstance(value, str):
        return readable(value)
    if isinstance(value, float):
        return round(value, DECIMALS) + 0.0  # never -0.0
    if is_dataclass(value):
        return _plain(value)
    if isinstance(value, Mapping):
        return {key: _rounded(entry) for key, entry in value.items()}
    if isinstance(value, Sequence):
        return [_rounded(entry) for entry in value]
    return value


def _message(data: bytes, problem_found: Any) -> str:
    """Return what is wrong, with the id of the annotation, image or category it is wrong with."""
    place, kind = problem_found["loc"], problem_found["type"]
    if kind == "json_invalid":
        return f"not JSON: {problem_found['msg'].removeprefix('Invalid JSON: ')}"
    if not place:
        return 'not a COCO file: it must hold "images", "categories" and "annotations"'
    keys = [str(part) for part in place]
    if len(place) > 2:
        return f"{_entry_name(data, *place[:2])}: {problem(kind, keys[2:], problem_found['msg'])}"
    return problem(kind, keys, problem_found["msg"])


def _entry_name(data: bytes, section: str, index: int) -> str:
    from pydantic_core import from_json

    entry = from_json(data)[section][index]
    what = {"images": "image", "categories": "category", "annotations": "annotation"}[section]
    number = entry.get("id") if isinstance(entry, dict) else None
    return f"{what} {number}" if type(number) is int else f"{what} number {index + 1} of the list"
