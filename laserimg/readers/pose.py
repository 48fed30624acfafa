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


def pose_from_quaternion(wxyz: ArrayLike, translation: ArrayLike) -> NDArray[np.float64]:
    """Return the 4x4 transform of a quaternion ``w, x, y, z`` of any length and a translation.

    Raises
    ------
    ScanError
        If the quaternion has no length.
    """
    from scipy.spatial.transform import Rotation

    w, x, y, z = np.array(wxyz, np.float64)
    length = float(np.linalg.norm((w, x, y, z)))
    if not 0 < length < np.inf:
        raise ScanError("the rotation of the pose is no quaternion")
    return _assemble(Rotation.from_quat([x, y, z, w]).as_matrix(), translation)


def pose_from_euler(angles: ArrayLike, translation: ArrayLike) -> NDArray[np.float64]:
    """Return the 4x4 transform of turns in radians about z, then y, then x, and a translation."""
    from scipy.spatial.transform import Rotation

    array = np.array(angles, np.float64)
    if not np.isfinite(array).all():
        raise ScanError("the angles of the pose are not finite")
    return _assemble(Rotation.from_euler("XYZ", array).as_matrix(), translation)


def _assemble(rotation: NDArray[np.float64], translation: ArrayLike) -> NDArray[np.float64]:
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = rotation, translation
    return rigid(pose)
