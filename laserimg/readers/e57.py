"""E57 through pye57: every scan of the file, on the grid of its row and column index.

Missing points are left out of the file, rows may grow upwards, and ``sphericalBounds`` may be in any
unit or wrong: only the points themselves are trusted.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from laserimg.errors import LaserImgError, MissingExtraError, ScanError
from laserimg.readers.grid import scan_from_grid
from laserimg.readers.points import scan_from_points
from laserimg.readers.pose import pose_from_quaternion
from laserimg.scan import Scan

FloatArray = NDArray[np.float64]

_CARTESIAN = ("cartesianX", "cartesianY", "cartesianZ")
_SPHERICAL = ("sphericalRange", "sphericalAzimuth", "sphericalElevation")
_OPTIONAL = ("intensity", "rowIndex", "columnIndex", "cartesianInvalidState", "sphericalInvalidState")
# A grid with fewer returns than one in so many rays is a broken index.
_MAX_CELLS_PER_POINT = 200
# 1: only the direction is valid; 2: nothing is.
_DIRECTION_ONLY, _INVALID = 1, 2


def read_e57(path: Path) -> Iterator[Scan]:
    """Yield the scans of an E57 file.

    Raises
    ------
    MissingExtraError
        If pye57 is not installed.
    ScanError
        If the file is cut off, damaged, or not an E57 file.
    """
    try:
        import pye57
    except ImportError:
        raise MissingExtraError("E57 files", "io") from None
    if not path.is_file():
        raise ScanError("no such file")
    try:
        with pye57.E57(str(path)) as file:
            for index in range(file.scan_count):
                yield _read_scan(file, index, path.stat().st_size)
    except LaserImgError:
        raise
    except Exception as error:  # libE57 raises its own, and pye57 whatever the content leads it to
        raise ScanError(f"not a readable E57 file: {_short(error)}") from error


def _read_scan(file: Any, index: int, size: int) -> Scan:
    header = file.get_header(index)
    columns = _read_columns(file, header, size)
    points, returned = _points(columns)
    pose = _pose(header)
    intensity = columns.get("intensity")
    if "rowIndex" not in columns or "columnIndex" not in columns:
        return scan_from_points(points, intensity, returned=returned, world_from_scan=pose)
    row, column = columns["rowIndex"].astype(np.intp), columns["columnIndex"].astype(np.intp)
    row, column = row - row.min(), column - column.min()
    shape = int(row.max()) + 1, int(column.max()) + 1
    if shape[0] * shape[1] > _MAX_CELLS_PER_POINT * len(points):
        raise ScanError(f"row and column index span {shape[0]} x {shape[1]} for {len(points)} points")
    grid, hit = np.zeros((*shape, 3)), np.zeros(shape, bool)
    # Written backwards: of several returns of a ray the first stays.
    grid[row[::-1], column[::-1]], hit[row[::-1], column[::-1]] = points[::-1], returned[::-1]
    values = None
    if intensity is not None:
        values = np.zeros(shape)
        values[row[::-1], column[::-1]] = intensity[::-1]
    return scan_from_grid(grid, values, hit, world_from_scan=pose)


def _read_columns(file: Any, header: Any, size: int) -> dict[str, NDArray]:
    """Read the fields that matter, after a look whether the file can hold so many points."""
    present = set(header.point_fields)
    xyz = next((names for names in (_CARTESIAN, _SPHERICAL) if present.issuperset(names)), None)
    if xyz is None:
        raise ScanError("has neither Cartesian nor spherical coordinates")
    count = header.point_count
    if not 0 < count <= size:
        raise ScanError(f"announces {count} points in {size} bytes")
    data, buffers = file.make_buffers([*xyz, *(name for name in _OPTIONAL if name in present)], count)
    read = header.points.reader(buffers).read()
    if read != count:
        raise ScanError(f"is cut off: {read} of {count} points")
    return data


def _points(columns: dict[str, NDArray]) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Points in metres, zero where nothing is valid, and which of them returned."""
    state = np.zeros(len(next(iter(columns.values()))), int)
    for name in ("cartesianInvalidState", "sphericalInvalidState"):
        state = np.maximum(state, columns.get(name, state))
    if _CARTESIAN[0] in columns:
        points = np.stack([columns[name] for name in _CARTESIAN], axis=1)
    else:
        length, azimuth, elevation = (columns[name] for name in _SPHERICAL)
        level = length * np.cos(elevation)
        points = np.stack(
            [level * np.cos(azimuth), level * np.sin(azimuth), length * np.sin(elevation)], axis=1
        )
    points[state >= _INVALID] = 0
    return points, state < _DIRECTION_ONLY


def _pose(header: Any) -> FloatArray:
    if not header.has_pose():
        return np.eye(4)
    pose = header["pose"]
    rotation = (
        [pose["rotation"][name].value() for name in "wxyz"] if pose.isDefined("rotation") else (1, 0, 0, 0)
    )
    shift = (
        [pose["translation"][name].value() for name in "xyz"] if pose.isDefined("translation") else (0, 0, 0)
    )
    return pose_from_quaternion(rotation, shift)


def _short(error: Exception) -> str:
    return " ".join(str(error).split())[:120] or type(error).__name__
