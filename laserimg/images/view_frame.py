"""Normals in the frame of each ray's azimuth: an object looks the same wherever it stands."""

import cv2
import numpy as np
from numpy.typing import NDArray

from laserimg.scan import Float32Array


def view_frame(directions: Float32Array, normals: Float32Array, up: NDArray[np.float64]) -> Float32Array:
    """Return normals as components towards the scanner, to the right and up.

    Towards is horizontal, from the point to the vertical axis through the scanner; right is as seen
    from the scanner. Turning the scanner about `up` changes nothing. Rays that point straight up
    or down have no azimuth: both horizontal components are 0 there.

    Parameters
    ----------
    directions, normals : (H, W, 3) arrays of float32
        Unit vectors in the scanner's frame.
    up : (3,) array
        Unit vector, such as `Scan.up`.

    Returns
    -------
    (H, W, 3) array of float32

    Examples
    --------
    >>> ahead, wall = np.float32([[[0.0, 1.0, 0.0]]]), np.float32([[[0.0, -1.0, 0.0]]])
    >>> view_frame(ahead, wall, np.array([0.0, 0.0, 1.0])).tolist()
    [[[1.0, 0.0, 0.0]]]
    """
    upright = upright_frame(up)
    vx, vy, _ = cv2.split(_turn(directions, upright))
    nx, ny, nz = cv2.split(_turn(normals, upright))
    level = np.sqrt(vx * vx + vy * vy)
    np.maximum(level, np.float32(1e-9), out=level)
    vx /= level
    vy /= level
    return np.asarray(cv2.merge([-vx * nx - vy * ny, vy * nx - vx * ny, nz]), np.float32)


def upright_frame(up: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the rotation (3, 3) of least angle that turns `up` into z."""
    x, y, z = up / np.linalg.norm(up)
    if z < -1 + 1e-12:
        return np.diag([1.0, -1.0, -1.0])
    share = 1 / (1 + z)
    return np.array(
        [[1 - x * x * share, -x * y * share, -x], [-x * y * share, 1 - y * y * share, -y], [x, y, z]]
    )


def _turn(vectors: Float32Array, rotation: NDArray[np.float64]) -> Float32Array:
    if np.array_equal(rotation, np.eye(3)):
        return vectors
    return np.asarray(cv2.transform(vectors, rotation), np.float32)
