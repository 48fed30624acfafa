"""PCD: organised grids, and points in scan order whose grid is recovered.

VIEWPOINT is the pose of the sensor in the frame of the points. A pinhole grid in the optical
frame (x right, y down, z forward) shows itself by its rays; it is turned to ours and its VIEWPOINT,
which camera drivers use to turn the picture upright, is left aside. With ``colour`` true beside the file, the
grey of its colours stands for the reflectance.
"""

import io
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from laserimg.errors import ScanError
from laserimg.files import read_bytes
from laserimg.readers.colour import grey_of_points
from laserimg.readers.fields import intensity_field, ring_field
from laserimg.readers.grid import scan_from_grid
from laserimg.readers.limits import own_colours
from laserimg.readers.pcd_padding import without_padding
from laserimg.readers.points import scan_from_points
from laserimg.readers.pose import pose_from_quaternion
from laserimg.scan import Scan

FloatArray = NDArray[np.float64]

_MAX_HEADER_BYTES = 1 << 14
_MAX_RECORD_BYTES = 1 << 12
# LZF packs at most 264 bytes into 3.
_MAX_LZF_RATIO = 88
# x forward, y left, z up from the optical frame.
_OURS_FROM_OPTICAL = np.array([[0.0, 0, 1], [-1, 0, 0], [0, -1, 0]])
# Rays of a pinhole grid follow column and row this closely (correlation).
_PINHOLE = 0.999


def read_pcd(path: Path) -> Iterator[Scan]:
    """Yield the one scan of a PCD file.

    Raises
    ------
    ScanError
        If the file is cut off, not a PCD file, or has no x, y, z.
    """
    cloud = _read_cloud(read_bytes(path))
    records, header = cloud.pc_data, cloud.metadata
    ring = ring_field(records.dtype.names)
    # Bytes of a broken file may be no number at all.
    with np.errstate(invalid="ignore"):
        points = np.stack([records[axis].astype(np.float64) for axis in "xyz"], axis=1)
        values = _values(records, path)
        beams = None if ring is None else records[ring].astype(np.intp)
    if header.height > 1:
        yield _organised(points, values, (header.height, header.width), header.viewpoint)
    else:
        pose = pose_from_quaternion(header.viewpoint[3:], header.viewpoint[:3])
        yield scan_from_points(_seen_from(pose, points), values, beams, world_from_scan=pose)


def read_points(path: Path) -> tuple[FloatArray, FloatArray | None] | None:
    """Return the (n, 3) points of a PCD file in the frame of the file, and their intensity if it has one.

    None if the file holds a grid, as depth cameras write it: that is a scan.

    Raises
    ------
    ScanError
        If the file is cut off, not a PCD file, or has no x, y, z.
    """
    cloud = _read_cloud(read_bytes(path))
    if cloud.metadata.height > 1:
        return None
    records = cloud.pc_data
    with np.errstate(invalid="ignore"):
        points = np.stack([records[axis].astype(np.float64) for axis in "xyz"], axis=1)
        return points, _values(records, path)


def _values(records: NDArray[np.void], path: Path) -> FloatArray | None:
    """Return the intensity, or the grey of the colours where that is asked for."""
    if own_colours(path):
        return grey_of_points(records)
    intensity = intensity_field(records.dtype.names or ())
    return None if intensity is None else records[intensity].astype(np.float64)


def _organised(
    points: FloatArray, values: FloatArray | None, shape: tuple[int, int], viewpoint: tuple[float, ...]
) -> Scan:
    grid = points.reshape(*shape, 3)
    planes = None if values is None else values.reshape(shape)
    if _is_optical(grid):
        return scan_from_grid(grid @ _OURS_FROM_OPTICAL.T, planes)
    pose = pose_from_quaternion(viewpoint[3:], viewpoint[:3])
    grid = _seen_from(pose, points).reshape(grid.shape)
    if _beams_lie_along_rows(grid):
        grid, planes = grid.transpose(1, 0, 2), None if planes is None else planes.T
    return scan_from_grid(grid, planes, world_from_scan=pose)


def _seen_from(pose: FloatArray, points: FloatArray) -> FloatArray:
    """Points in the frame of the pose; what is no measurement stays none."""
    if np.array_equal(pose, np.eye(4)):
        return points
    measured = np.isfinite(points).all(axis=1, keepdims=True) & (points != 0).any(axis=1, keepdims=True)
    moved = (np.where(measured, points, 0) - pose[:3, 3]) @ pose[:3, :3]
    return np.where(measured, moved, 0)


def _is_optical(grid: FloatArray) -> bool:
    """Whether x / z follows the column and y / z the row, everything in front."""
    row, column = np.nonzero(np.isfinite(grid).all(axis=2) & (grid[..., 2] != 0))
    x, y, z = grid[row, column].T
    if len(z) < 3 or float(z.min()) <= 0:
        return False
    return _correlation(x / z, column) > _PINHOLE and _correlation(y / z, row) > _PINHOLE


def _correlation(a: FloatArray, b: NDArray) -> float:
    a, b = a - a.mean(), b - b.mean()
    size = float(np.sqrt((a @ a) * (b @ b)))
    return float(a @ b) / size if size > 0 else 0.0


def _beams_lie_along_rows(grid: FloatArray) -> bool:
    """Whether neighbours in a row differ in height more than neighbours in a column, as drivers that
    write firing after firing leave it."""
    length = np.linalg.norm(grid, axis=-1)
    with np.errstate(invalid="ignore", divide="ignore"):
        height = grid[..., 2] / length
    return _typical_step(height, axis=1) > _typical_step(height, axis=0)


def _typical_step(values: FloatArray, axis: int) -> float:
    steps = np.abs(np.diff(values, axis=axis))
    steps = steps[np.isfinite(steps)]
    return float(np.median(steps)) if len(steps) else 0.0


def _read_cloud(data: bytes) -> Any:
    from pypcd4.pypcd4 import PointCloud

    data = without_padding(data)
    _check_header(data)
    try:
        cloud = PointCloud.from_fileobj(io.BytesIO(data))  # type: ignore[arg-type]
    except Exception as error:  # pypcd4 raises whatever the bytes lead it to
        raise ScanError(f"not a PCD file: {_short(error)}") from error
    missing = [axis for axis in "xyz" if axis not in (cloud.pc_data.dtype.names or ())]
    if missing:
        raise ScanError(f"has no field {' '.join(missing)}")
    if len(cloud.pc_data) != cloud.metadata.points:
        raise ScanError(f"is cut off: {len(cloud.pc_data)} of {cloud.metadata.points} points")
    return cloud


def _check_header(data: bytes) -> None:
    """Compare what the header announces with what the file holds, before anything is allocated."""
    from pypcd4.pypcd4 import MetaData

    text, mark, rest = data[:_MAX_HEADER_BYTES].partition(b"\nDATA ")
    if not mark:
        raise ScanError("not a PCD file: no DATA line")
    kind = rest.split(maxsplit=1)[:1]
    try:
        lines = [*text.decode("ascii").splitlines(), f"DATA {b''.join(kind).decode('ascii')}"]
        header = MetaData.parse_header(lines)
    except Exception as error:
        raise ScanError(f"not a PCD header: {_short(error)}") from error
    if not len(header.fields) == len(header.size) == len(header.type) == len(header.count):
        raise ScanError("not a PCD header: FIELDS, SIZE, TYPE and COUNT differ in length")
    record = sum(size * count for size, count in zip(header.size, header.count, strict=True))
    if record > _MAX_RECORD_BYTES or header.width * header.height != header.points:
        raise ScanError("not a PCD header: WIDTH x HEIGHT is not POINTS, or a record is too long")
    body = data[len(text) + len(mark) + rest.find(b"\n") + 1 :]
    needed = header.points * (2 * len(header.fields) if header.data.value == "ascii" else record)
    held = len(body) * (_MAX_LZF_RATIO if "compressed" in header.data.value else 1) + 1
    if needed > held:
        raise ScanError(f"is cut off: the header says {header.points} points")
    if "compressed" in header.data.value:
        packed, unpacked = struct.unpack("<II", body[:8].ljust(8, b"\0"))
        if packed > len(body) - 8 or unpacked != needed:
            raise ScanError(f"is cut off: {packed} compressed bytes announced, {len(body)} there")


def _short(error: Exception) -> str:
    if isinstance(error, ValidationError):
        first = error.errors()[0]
        return f"{first['loc'][0] if first['loc'] else 'header'}: {first['msg']}"
    return " ".join(str(error).split())[:120] or type(error).__name__
