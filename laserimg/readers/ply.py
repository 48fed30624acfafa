"""PLY: the vertices, ascii or binary, with whatever packed fields the header declares.

Clouds of spinning scanners keep their place by the field ``ring``: the columns come from the azimuth, which
also undoes the stagger of sensors whose beams point to the side by turns (RELLIS-3D, Ouster).
"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from laserimg.errors import ScanError
from laserimg.files import read_bytes
from laserimg.readers.fields import intensity_field, ring_field
from laserimg.readers.points import scan_from_points
from laserimg.scan import Scan

_MAX_HEADER_BYTES = 1 << 16
_TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2",
    "ushort": "u2", "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4",
    "float": "f4", "float32": "f4", "double": "f8", "float64": "f8",
}  # fmt: skip
_ORDERS = {"ascii": "=", "binary_little_endian": "<", "binary_big_endian": ">"}


def read_ply(path: Path) -> Iterator[Scan]:
    """Yield the one scan of a PLY file.

    Raises
    ------
    ScanError
        If the file is cut off, not a PLY file, or has no x, y, z.
    """
    yield scan_from_points(*points_of(read_vertices(read_bytes(path))))


def points_of(
    records: NDArray[np.void],
) -> tuple[NDArray[np.float64], NDArray[np.float64] | None, NDArray[np.intp] | None]:
    """Return the (n, 3) points of vertices, their reflectance and their ring, where they have one."""
    names = records.dtype.names or ()
    intensity, ring = intensity_field(names), ring_field(names)
    with np.errstate(invalid="ignore", over="ignore"):
        points = np.stack([records[axis].astype(np.float64) for axis in "xyz"], axis=1)
        values = None if intensity is None else records[intensity].astype(np.float64)
        beams = None if ring is None else records[ring].astype(np.intp)
    return points, values, beams


def read_vertices(data: bytes) -> NDArray[np.void]:
    """Return the vertices of a PLY file as a structured array with the fields of its header.

    Raises
    ------
    ScanError
        If the file is cut off, not a PLY file, or has no x, y, z.
    """
    text, end, rest = data[:_MAX_HEADER_BYTES].partition(b"end_header")
    line_end = rest.find(b"\n")
    if not data.startswith(b"ply") or not end or line_end < 0:
        raise ScanError("not a PLY file: no header")
    lines = [line.split() for line in text.decode("ascii", "replace").splitlines()]
    order = next((line[1] for line in lines if line[:1] == ["format"] and len(line) > 1), "")
    if order not in _ORDERS:
        raise ScanError(f"not a PLY file: format {order[:40]!r} is not known")
    count, record = _vertex_element(lines, _ORDERS[order])
    missing = [axis for axis in "xyz" if axis not in (record.names or ())]
    if missing:
        raise ScanError(f"its vertices have no property {' '.join(missing)}")
    body = data[len(text) + len(end) + line_end + 1 :]
    return _ascii_vertices(body, count, record) if order == "ascii" else _packed(body, count, record)


def _vertex_element(lines: list[list[str]], order: str) -> tuple[int, np.dtype]:
    """Number and record of the vertices, which must be the first element, as every writer has it."""
    first = next((k for k, line in enumerate(lines) if line[:1] == ["element"]), len(lines))
    head = lines[first] if first < len(lines) else []
    if head[1:2] != ["vertex"] or len(head) != 3 or not head[2].isdecimal():
        raise ScanError("not a PLY file of points: the first element must be the vertices")
    fields = []
    for line in lines[first + 1 :]:
        if line[:1] == ["element"]:
            break
        if line[:1] != ["property"]:
            continue
        if len(line) != 3 or line[1] not in _TYPES:
            raise ScanError(f"cannot read the property {' '.join(line[1:])[:60]!r} of its vertices")
        fields.append((line[2], order + _TYPES[line[1]]))
    try:
        return int(head[2]), np.dtype(fields)
    except ValueError as error:
        raise ScanError(f"not a PLY header: {error}") from error


def _packed(body: bytes, count: int, record: np.dtype) -> NDArray[np.void]:
    held = len(body) // max(record.itemsize, 1)
    if held < count:
        raise ScanError(f"is cut off: {held} of {count} points")
    return np.frombuffer(body, record, count=count)


def _ascii_vertices(body: bytes, count: int, record: np.dtype) -> NDArray[np.void]:
    lines = body.decode("ascii", "replace").splitlines()[:count]
    if len(lines) < count:
        raise ScanError(f"is cut off: {len(lines)} of {count} points")
    try:
        table = np.array([line.split() for line in lines], np.float64).reshape(count, -1)
    except ValueError:
        raise ScanError("its points are not lines of numbers, all of the same length") from None
    names = record.names or ()
    if count and table.shape[1] != len(names):
        raise ScanError(f"its points have {table.shape[1]} numbers, the header says {len(names)}")
    found = np.zeros(count, record)
    with np.errstate(invalid="ignore", over="ignore"):
        for column, name in enumerate(names):
            found[name] = table[:, column]
    return found
