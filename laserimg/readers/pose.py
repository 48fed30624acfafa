"""Poses from files, checked."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from laserimg.errors import ScanError

# Files write rotations with few digits.
_TOLERANCE = 1e-2


def rigid(matrix: ArrayLike) -> NDArray[np.float64]:
    """Return a 4x4 transform, its rotation made exact.

    Raises
    ------
    ScanError
        If it is not a rotation and a translation.
    """
    pose = np.array(matrix, np.float64)
    rotation = pose[:3, :3]
    with np.errstate(over="ignore", invalid="ignore"):
        apart = np.abs(rotation @ rotation.T - np.eye(3)).max()
    if not np.isfinite(pose).all() or not apart < _TOLERANCE or np.linalg.det(rotation) < 0:
        raise ScanError("the pose is not a rotation and a translation")
    u, _, v = np.linalg.svd(rotation)
    exact = np.eye(4)
    exact[:3, :3], exact[:3, 3] = u @ v, pose[:3, 3]
    return exact


def rotation_from_quaternion(quaternion: ArrayLike) -> NDArray[np.float64]:
    """Return the 3x3 rotation of a quaternion ``w, x, y, z``, normalised first.

    Raises
    ------
    ScanError
        If it has no length.
    """
    values = np.array(quaternion, np.float64)
    length = float(np.linalg.norm(values))
    if not 0 < length < np.inf:
        raise ScanError("the rotation of the pose is not a quaternion")
    w, x, y, z = values / length
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def pose_of(rotation: ArrayLike, translation: ArrayLike) -> NDArray[np.float64]:
    """Return the 4x4 transform of a 3x3 rotation and a translation."""
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = rotation, translation
    return rigid(pose)
