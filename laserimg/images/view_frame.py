"""Normals in the frame of each ray's azimuth: an object looks the same wherever it stands."""

import cv2
import numpy as np
from numpy.typing import NDArray

from laserimg.geometry.blocks import by_row_blocks
from laserimg.scan import Float32Array, Scan


def view_frame(scan: Scan, normals: Float32Array) -> Float32Array:
    """Return normals as components towards the scanner, to the right and up.

    Up is the world's (`Scan.up`), towards is horizontal, from the point to the scanner's axis, and right
    as seen from the scanner. Turning the scanner about "up" changes nothing. Rays that point
    straight up or down have no azimuth: both horizontal components are 0 there.

    Parameters
    ----------
    scan : Scan
    normals : (H, W, 3) array of float32
        In the scanner's frame.

    Returns
    -------
    (H, W, 3) array of float32

    Examples
    --------
    >>> scan = Scan.from_range_image(np.ones((2, 2)), np.radians([90, 88]), np.radians([1, -1]))
    >>> wall = np.broadcast_to(np.float32([0, -1, 0]), (2, 2, 3))
    >>> view_frame(scan, wall)[0, 0].round(3).tolist()
    [1.0, 0.0, 0.0]
    """
    upright = upright_frame(scan.up)
    turned = np.empty((*scan.shape, 3), np.float32)

    def work(rows: slice) -> None:
        vx, vy, _ = cv2.split(_turn(scan.directions[rows], upright))
        nx, ny, nz = cv2.split(_turn(normals[rows], upright))
        level = np.sqrt(vx * vx + vy * vy)
        np.maximum(level, 1e-9, out=level)
        towards = (nx * vx + ny * vy) / -level
        right = (nx * vy - ny * vx) / level
        cv2.merge([towards, right, nz], dst=turned[rows])

    by_row_blocks(work, scan.shape)
    return turned


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
