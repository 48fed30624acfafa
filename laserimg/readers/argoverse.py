"""Argoverse 2 sweeps (``sensors/lidar/TIMESTAMP.feather``): two scans, of the upper and the lower lidar.

The file holds points in the frame of the vehicle; ``calibration/egovehicle_SE3_sensor.feather``, two folders
up, takes each lidar's to its own frame and is `world_from_scan`. The lower one hangs upside down: `Scan.up`
is its -z, and its grid is stored upright, row 0 at the upper end of the world.
"""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from laserimg.errors import LaserImgError, ScanError
from laserimg.files import read_bytes
from laserimg.formats.feather import MAX_BYTES, read_feather
from laserimg.readers.points import scan_from_points
from laserimg.readers.pose import pose_from_quaternion
from laserimg.scan import Scan

FloatArray = NDArray[np.float64]

# Name in the calibration, and the first of its lasers in the sweep (Argoverse 2 user guide, "Lidar").
LIDARS = (("up_lidar", 0), ("down_lidar", 32))
LASERS = 32
SWEEP = ("x", "y", "z", "intensity", "laser_number")
CALIBRATION = Path("calibration", "egovehicle_SE3_sensor.feather")
POSE = ("qw", "qx", "qy", "qz", "tx_m", "ty_m", "tz_m")
_HALF_TURN = np.diag([1.0, -1.0, -1.0, 1.0])


def read_argoverse(path: Path) -> Iterator[Scan]:
    """Yield the scans of a sweep: of the upper, then of the lower lidar.

    Raises
    ------
    ScanError
        If the file is no sweep, or its log's calibration is missing.
    MissingExtraError
        Without pyarrow.
    """
    sweep = read_feather(path, SWEEP)
    points = np.stack([sweep[axis].astype(np.float64) for axis in "xyz"], axis=1)
    laser, intensity = sweep["laser_number"].astype(np.intp), sweep["intensity"].astype(np.float64)
    poses = _poses(path)
    for name, first in LIDARS:
        own = (laser >= first) & (laser < first + LASERS)
        if own.any():
            pose = poses[name]
            yield _scan(points[own], intensity[own], laser[own], pose)


def _scan(points: FloatArray, intensity: FloatArray, laser: NDArray[np.intp], pose: FloatArray) -> Scan:
    """A lidar's scan in its own frame, on a grid that stands upright."""
    turn = _HALF_TURN if pose[2, 2] < 0 else np.eye(4)
    upright = pose @ turn
    with np.errstate(invalid="ignore", over="ignore"):
        seen = (points - upright[:3, 3]) @ upright[:3, :3]
    scan = scan_from_points(seen, intensity, laser, world_from_scan=upright)
    rays = scan.directions @ turn[:3, :3].T.astype(np.float32)
    return replace(scan, directions=rays, world_from_scan=scan.world_from_scan @ turn.T)


def holds_sweep(path: Path) -> bool:
    """Tell whether a feather file is a sweep: tables of poses and annotations have the suffix too."""
    try:
        data = read_bytes(path, MAX_BYTES)
        return not data or b"laser_number" in data
    except LaserImgError:
        return True


def log_folder(path: Path) -> Path:
    """Return the folder of the log that a sweep belongs to.

    Examples
    --------
    >>> log_folder(Path("7fab/sensors/lidar/315.feather")).as_posix()
    '7fab'
    """
    return path.parent.parent.parent


def _poses(path: Path) -> dict[str, FloatArray]:
    file = log_folder(path) / CALIBRATION
    if not file.is_file():
        raise ScanError(f"needs {file}, where the log says how its lidars are mounted")
    try:
        table = read_feather(file, ("sensor_name", *POSE))
    except ScanError as error:
        raise ScanError(f"with {file}: {error}") from error
    rows = dict(zip(table["sensor_name"].tolist(), np.stack([table[k] for k in POSE], axis=1), strict=True))
    missing = [name for name, _ in LIDARS if name not in rows]
    if missing:
        raise ScanError(f"with {file}: has no sensor {' '.join(missing)}")
    return {name: pose_from_quaternion(rows[name][:4], rows[name][4:]) for name, _ in LIDARS}
