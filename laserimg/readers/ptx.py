"""Leica PTX: text, several scans in one file, every beam present.

Each scan: columns, rows, position, three axes, a 4x4 transform (row vectors: the translation is
its last row), then ``x y z intensity [r g b]`` column by column from bottom to top. A ray
without return is ``0 0 0``; its intensity of 0.5 means nothing.
"""

import io
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from laserimg.errors import ScanError
from laserimg.files import read_bytes
from laserimg.formats.ptx import NO_INTENSITY
from laserimg.readers.grid import scan_from_grid
from laserimg.readers.pose import rigid
from laserimg.readers.table import read_table
from laserimg.scan import Scan

# The shortest line of a point: "0 0 0", newline.
_MIN_BYTES_PER_POINT = 6


def read_ptx(path: Path) -> Iterator[Scan]:
    """Yield the scans of a PTX file.

    Raises
    ------
    ScanError
        If the file is cut off or not a PTX file.
    """
    data = read_bytes(path)
    lines = io.BytesIO(data)
    while data[lines.tell() :].strip():
        yield _read_scan(lines, len(data))


def _read_scan(lines: io.BytesIO, size: int) -> Scan:
    columns, rows = _count(lines, "columns"), _count(lines, "rows")
    if columns * rows * _MIN_BYTES_PER_POINT > size - lines.tell():
        raise ScanError(f"is cut off: the header says {rows} x {columns} points")
    header = [_numbers(lines) for _ in range(8)]
    if [len(line) for line in header] != [3] * 4 + [4] * 4:
        raise ScanError("not a PTX header: position, three axes and four lines of transform expected")
    pose = rigid(np.array(header[4:]).T)
    table = read_table(lines, rows=columns * rows)
    if table.shape[1] not in (3, 4, 6, 7):
        raise ScanError(f"a PTX point has 3, 4, 6 or 7 numbers, got {table.shape[1]}")
    # Columns come from bottom to top: the transposed grid is upside down, which the grid's own
    # directions tell too.
    grid = table.reshape(columns, rows, -1).transpose(1, 0, 2)[::-1]
    measured = table.shape[1] in (4, 7) and (table[:, 3] != NO_INTENSITY).any()
    reflectance = grid[..., 3] if measured else None
    return scan_from_grid(grid[..., :3], reflectance, world_from_scan=pose)


def _count(lines: io.BytesIO, what: str) -> int:
    text = lines.readline(1000).strip()
    if not text.isdigit() or len(text) > 9 or int(text) < 1:
        raise ScanError(f"not a PTX file: the number of {what} expected, got {text[:30].decode('latin1')!r}")
    return int(text)


def _numbers(lines: io.BytesIO) -> NDArray[np.float64]:
    try:
        return np.array(lines.readline(1000).split(), np.float64)
    except ValueError as error:
        raise ScanError(f"not a PTX header: {error}") from error
