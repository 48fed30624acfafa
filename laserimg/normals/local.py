"""Normals of returns that lie on no plane of the cells around them: thin things, clutter, rims."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from laserimg.geometry.windows import Indices
from laserimg.normals.noise import Noise
from laserimg.normals.planes import shifted, solve_symmetric
from laserimg.scan import Float32Array, Scan

# The returns looked at are at most this many rows and columns off ...
STEPS = 2
# ... and nothing counts that is farther off than this many steps of the grid and these metres, whichever
# is more: it may lie beyond a depth jump.
REACH_STEPS = 2.5
REACH_M = 0.15
# Pixels worked on at a time; 25 returns each.
CHUNK = 1 << 11


def local_planes(
    scan: Scan, inverse_range: Float32Array, noise: Noise, rows: Indices, columns: Indices
) -> NDArray[np.float64]:
    """Fit a plane to the returns around each of n pixels.

    The fit is pulled towards the plane that faces the scanner as if a slope of 45 degrees were one
    standard deviation: that decides when the returns are on a line or alone, and hardly counts otherwise.

    Returns
    -------
    (3, n) array
        a = n / d in 1/m, facing the scanner.
    """
    planes = np.zeros((3, len(rows)))
    for first in range(0, len(rows), CHUNK):
        part = slice(first, first + CHUNK)
        planes[:, part] = _fit(_around(scan, inverse_range, rows[part], columns[part]), noise)
    return planes


class _Around(NamedTuple):
    """The (2 STEPS + 1)^2 = k returns around n pixels."""

    directions: NDArray[np.float32]  # (3, k, n)
    inverse_range: NDArray[np.float32]  # (k, n)
    near: NDArray[np.bool_]  # (k, n)


def _around(scan: Scan, inverse_range: Float32Array, rows: Indices, columns: Indices) -> _Around:
    height, width = scan.shape
    steps = np.arange(-STEPS, STEPS + 1)
    up, across = (grid.reshape(-1, 1) for grid in np.meshgrid(steps, steps, indexing="ij"))
    other_rows = np.clip(rows + up, 0, height - 1)
    other_columns = shifted(columns, across, width, scan.wraps)
    index = other_rows * width + other_columns
    directions = np.ascontiguousarray(scan.directions.reshape(-1, 3).take(index, axis=0).transpose(2, 0, 1))
    ranges = scan.range.ravel().take(index)
    middle = len(up) // 2
    pitch = _distance(directions)[np.abs(up[:, 0]) + np.abs(across[:, 0]) == 1].max(axis=0)
    reach = np.maximum(REACH_STEPS * pitch * ranges[middle], REACH_M)
    near = (ranges > 0) & (_distance(directions * ranges) <= reach)
    # A border repeats its pixels; each counts once.
    near &= other_rows == rows + up
    if not scan.wraps:
        near &= other_columns == columns + across
    return _Around(directions, inverse_range.ravel().take(index), near)


def _distance(vectors: NDArray) -> NDArray:
    """(k, n) distances of (3, k, n) vectors from the middle one."""
    x, y, z = vectors - vectors[:, vectors.shape[1] // 2][:, None]
    return np.sqrt(x * x + y * y + z * z)


def _fit(around: _Around, noise: Noise) -> NDArray[np.float64]:
    """Solve for what must be added to the plane that faces the scanner."""
    v, q = around.directions, around.inverse_range
    middle = len(q) // 2
    facing = v[:, middle] * q[middle]
    excess = q - (facing[0] * v[0] + facing[1] * v[1] + facing[2] * v[2])
    used = v * around.near
    matrix = [(used[i] * v[j]).sum(axis=0, dtype=np.float64) for i in range(3) for j in range(i, 3)]
    for diagonal in (0, 3, 5):
        matrix[diagonal] += (noise.range * q[middle]) ** 2
    right = [(part * excess).sum(axis=0, dtype=np.float64) for part in used]
    planes = facing + solve_symmetric(matrix, right)
    return np.where((planes * v[:, middle]).sum(axis=0) > 0, planes, facing)
