"""How a scanner is mounted: which way is up, given by hand."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from laserimg.errors import ConfigError
from laserimg.scan import Scan

_AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


def with_up(scan: Scan, axis: str) -> Scan:
    """Return the scan with a pose in which an axis of the scanner points up.

    Parameters
    ----------
    scan : Scan
    axis : str
        ``x``, ``y``, ``z`` or one of them with a minus.

    Raises
    ------
    ConfigError
        If it is no axis.

    Examples
    --------
    >>> scan = Scan.from_range_image(np.ones((2, 2)), [0.1, 0.0], [0.1, 0.0])
    >>> with_up(scan, "-y").up.round(6).tolist() == [0, -1, 0]
    True
    """
    up = axis_of(axis)
    from scipy.spatial.transform import Rotation  # 60 ms that few runs need

    rotation = Rotation.align_vectors([[0.0, 0.0, 1.0]], [up])[0]
    return _posed(scan, rotation.as_matrix())


def axis_of(name: str) -> NDArray[np.float64]:
    """Return the unit vector (3,) of ``x``, ``y``, ``z`` or one of them with a minus.

    Raises
    ------
    ConfigError
        If it is no axis.
    """
    axis = name.strip().lower()
    if axis.lstrip("+-") not in _AXES or len(axis) > 2:
        raise ConfigError(f"up must be x, y, z, -x, -y or -z, not {name!r}")
    return np.array(_AXES[axis.lstrip("+-")]) * (-1 if axis.startswith("-") else 1)


def rotated(scan: Scan, roll_deg: float, pitch_deg: float, yaw_deg: float) -> Scan:
    """Return the scan with a pose of three angles about x, y and z, applied in this order.

    Examples
    --------
    >>> scan = Scan.from_range_image(np.ones((2, 2)), [0.1, 0.0], [0.1, 0.0])
    >>> rotated(scan, 90, 0, 0).up.round(6).tolist()
    [0.0, 1.0, 0.0]
    """
    from scipy.spatial.transform import Rotation

    return _posed(scan, Rotation.from_euler("xyz", (roll_deg, pitch_deg, yaw_deg), degrees=True).as_matrix())


def _posed(scan: Scan, rotation: NDArray[np.float64]) -> Scan:
    pose = scan.world_from_scan.copy()
    pose[:3, :3] = rotation
    return replace(scan, world_from_scan=pose)
