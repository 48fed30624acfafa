"""Points as text: xyz, txt, asc, dat, pts, csv; one point a line, ``x y z [intensity] [r g b]``.

Leading lines that hold no point are a header; one that names x, y and z tells the columns. A line
with one whole number (pts) is the count of the points that follow.
"""

import io
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from laserimg.errors import LaserImgError, ScanError
from laserimg.files import read_bytes, read_start
from laserimg.readers.fields import intensity_field
from laserimg.readers.points import scan_from_points
from laserimg.readers.table import read_table
from laserimg.scan import Scan

_MAX_HEADER_LINES = 100
_MAX_LINE_BYTES = 10_000
_SNIFFED_BYTES = 4096
_MIN_BYTES_PER_POINT = 6
_SEPARATORS = re.compile(rb"[\s,;]+")
# Four numbers: x y z intensity; five: time after them; seven: x y z intensity r g b. Six are x y z r g b.
_COLUMNS_WITH_INTENSITY = (4, 5, 7)


@dataclass(frozen=True)
class _Layout:
    """Where the points begin, how a line is split, and which columns hold what."""

    offset: int
    count: int | None
    delimiter: str | None
    xyz: tuple[int, ...]
    intensity: int | None


def read_ascii(path: Path) -> Iterator[Scan]:
    """Yield the scans of a text file; only pts files hold several.

    Raises
    ------
    ScanError
        If a line is not a point.
    """
    for points, values in read_points(path):
        yield scan_from_points(points, values)


def read_points(path: Path) -> Iterator[tuple[NDArray[np.float64], NDArray[np.float64] | None]]:
    """Yield the (n, 3) points of a text file, in its own unit, and their intensity if it has one.

    Raises
    ------
    ScanError
        If a line is not a point.
    """
    data = read_bytes(path)
    lines = io.BytesIO(data)
    while True:
        layout = _layout(data, lines.tell())
        lines.seek(layout.offset)
        if layout.count is not None and layout.count * _MIN_BYTES_PER_POINT > len(data) - layout.offset + 1:
            raise ScanError(f"is cut off: {layout.count} points announced")
        table = read_table(lines, rows=layout.count, delimiter=layout.delimiter)
        yield table[:, layout.xyz], None if layout.intensity is None else table[:, layout.intensity]
        if layout.count is None or not data[lines.tell() :].strip():
            return


def holds_points(path: Path) -> bool:
    """Tell whether a text file begins like points or is broken, for folders that hold other text too."""
    try:
        start = read_start(path, _SNIFFED_BYTES)
    except LaserImgError:
        return True
    try:
        _layout(start, 0)
    except LaserImgError:
        return False
    return True


def _layout(data: bytes, offset: int) -> _Layout:
    lines = io.BytesIO(data)
    lines.seek(offset)
    names: list[str] = []
    count = None
    for _ in range(_MAX_HEADER_LINES):
        start = lines.tell()
        line = lines.readline(_MAX_LINE_BYTES)
        if not line:
            break
        words = [word for word in _SEPARATORS.split(line.strip()) if word]
        if len(words) >= 3 and all(_is_number(word) for word in words):
            return _layout_of(start, count, line, len(words), names)
        if len(words) == 1 and words[0].isdigit() and len(words[0]) < 12:
            count = int(words[0])
        elif {"x", "y", "z"} <= set(_names(words)):
            names = _names(words)
    raise ScanError("no line with x y z found")


def _layout_of(offset: int, count: int | None, line: bytes, width: int, names: list[str]) -> _Layout:
    delimiter = next((mark for mark in ",;" if mark.encode() in line), None)
    if names and len(names) == width:
        found = intensity_field(names)
        xyz = tuple(names.index(axis) for axis in "xyz")
        return _Layout(offset, count, delimiter, xyz, None if found is None else names.index(found))
    return _Layout(offset, count, delimiter, (0, 1, 2), 3 if width in _COLUMNS_WITH_INTENSITY else None)


def _names(words: list[bytes]) -> list[str]:
    return [name for name in (word.decode("latin1").lower().strip("/#\"'") for word in words) if name]


def _is_number(word: bytes) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True
