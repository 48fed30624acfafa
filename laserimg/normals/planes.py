"""One plane for every cell, fitted over a window that stays on one surface."""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from laserimg.geometry.windows import Indices, WindowSums
from laserimg.normals.cells import Cells
from laserimg.normals.noise import Noise
from laserimg.scan import Float32Array

Array = NDArray[np.float64]

MAX_HALF_WINDOW = 24
# Sizes of the windows that are tried.
SCALES = (1.0, 0.5, 0.25)
# The residual of a fit may exceed the noise by this factor, which real sensors need, ...
SENSOR_SLACK = 1.3
# ... and its square by this many standard deviations of what chance adds to few cells.
CHANCE = 1.5
FEWEST_CELLS = 6
# A plane seen at a larger 1 / cosine of the incidence, 89.9 degrees, is a fit to a line.
STEEPEST = 500.0
# A plane passes through a cell when it misses the mean of its returns by this many standard errors.
NEAR = 3.0
# Cells worked on at a time, few enough for the processor's cache.
CHUNK = 1 << 13
NEIGHBOURS = [(i, j) for i in (-1, 0, 1) for j in (-1, 0, 1) if (i, j) != (0, 0)]


def fit_planes(cells: Cells, noise: Noise) -> Float32Array:
    """Return the plane seen in every cell, as a = n / d.

    A plane n.p = d has the inverse range 1/r = a.v along the unit ray v: exactly linear, and v is
    free of noise. A cell takes the plane of the window around it if that is clean: one plane and
    nothing else. If not, it takes the plane of a clean window that reaches it from one of 8 sides and
    passes through it (the idea of Kuwahara's filter). If there is none, it tries again with
    windows of half the size, and a quarter.

    Returns
    -------
    (3, h, w) array of float32
        1/m; 0 where no plane was found.
    """
    search = _Search(cells, noise)
    planes = np.zeros((3, *cells.shape), np.float32)
    for scale in SCALES:
        for find in (search.own_window, search.borrow):
            planes = _filled(cells, planes, scale, find)
    return planes


def _filled(cells: Cells, planes: Float32Array, scale: float, find: Callable[..., NDArray]) -> Float32Array:
    """Return the planes, and what `find` gives where there is none yet."""
    half_height = _half(cells.window_height, scale)
    half_width = _half(cells.window_width, scale, cells)
    rows, columns = np.nonzero((cells.count > 0) & ~planes.any(axis=0))
    more = planes.copy()
    for first in range(0, len(rows), CHUNK):
        at = rows[first : first + CHUNK], columns[first : first + CHUNK]
        more[:, *at] = find(planes, at, half_height[at], half_width[at])
    return more


def _half(size: Float32Array, scale: float, turn: Cells | None = None) -> Indices:
    """Cells on each side of the middle one; across, no more than a full turn has."""
    most = MAX_HALF_WINDOW
    if turn is not None and turn.wraps:
        most = min(most, (turn.shape[1] - 1) // 2)
    return np.clip(np.rint((size * scale - 1) / 2), min(1, most), most).astype(np.int64)


class _Search:
    """The two ways for cells to find a plane."""

    def __init__(self, cells: Cells, noise: Noise) -> None:
        self._cells, self._noise = cells, noise
        reach = int(_half(cells.window_width, SCALES[0], cells).max())
        self._sums = WindowSums(_moments(cells), cells.wraps, reach)

    def own_window(
        self, planes: Float32Array, at: tuple[Indices, Indices], half_height: Indices, half_width: Indices
    ) -> NDArray:
        """Fit the windows around n cells; (3, n), 0 where the residual shows more than one plane."""
        count, *products, square = np.ascontiguousarray(self._sums.around(*at, half_height, half_width).T)
        matrix, right = products[:6], products[6:]
        a, b, c = fits = solve_symmetric(matrix, right)
        freedom = np.maximum(count - 3, 1)
        returns = np.maximum(matrix[0] + matrix[3] + matrix[5], 1e-12)
        with np.errstate(over="ignore", invalid="ignore"):
            residual = (square - a * right[0] - b * right[1] - c * right[2]) / freedom
            mean_square, steepness = square / returns, a * a + b * b + c * c
            variance = self._noise.variance(np.sqrt(mean_square), steepness)
            limit = variance * SENSOR_SLACK**2 * (1 + CHANCE * np.sqrt(2 / freedom))
            clean = (residual <= limit) & (steepness <= STEEPEST**2 * mean_square) & (count >= FEWEST_CELLS)
        return np.where(clean, fits, 0)

    def borrow(
        self, planes: Float32Array, at: tuple[Indices, Indices], half_height: Indices, half_width: Indices
    ) -> NDArray:
        """Take the plane half a window away, on one of 8 sides, that passes nearest; (3, n), 0 if none."""
        (height, width), (rows, columns) = self._cells.shape, at
        x, y, z = self._cells.directions[:, *at]
        inverse_range, returns = self._cells.inverse_range[at], self._cells.count[at]
        flat = planes.reshape(3, -1)
        chosen, best = np.zeros((3, len(rows)), np.float32), np.full(len(rows), NEAR**2, np.float32)
        for up, across in NEIGHBOURS:
            other_rows = np.clip(rows + up * half_height, 0, height - 1)
            other_columns = shifted(columns, across * half_width, width, self._cells.wraps)
            a, b, c = plane = flat.take(other_rows * width + other_columns, axis=1)
            miss = inverse_range - (a * x + b * y + c * z)
            miss = miss * miss * returns / self._noise.variance(inverse_range, a * a + b * b + c * c)
            better = (miss < best) & plane.any(axis=0)
            chosen, best = np.where(better, plane, chosen), np.where(better, miss, best)
        return chosen


def _moments(cells: Cells) -> list[NDArray]:
    """What adds up over windows: cells with returns, v v^T (6), v / r (3), 1 / r^2."""
    weight = np.sqrt(cells.count.astype(np.float64))
    x, y, z = cells.directions * weight
    q = cells.inverse_range * weight
    return [cells.count > 0, x * x, x * y, x * z, y * y, y * z, z * z, x * q, y * q, z * q, q * q]


def solve_symmetric(matrix: Sequence[Array], right: Sequence[Array]) -> Array:
    """Solve n symmetric 3 x 3 systems by cofactors.

    Parameters
    ----------
    matrix : six (n,) arrays
        xx, xy, xz, yy, yz, zz.
    right : three (n,) arrays

    Returns
    -------
    (3, n) array
        Not finite where the matrix is singular.
    """
    xx, xy, xz, yy, yz, zz = matrix
    x, y, z = right
    cofactor_xx, cofactor_xy, cofactor_xz = yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy
    cofactor_yy, cofactor_yz, cofactor_zz = xx * zz - xz * xz, xy * xz - xx * yz, xx * yy - xy * xy
    with np.errstate(divide="ignore", invalid="ignore"):
        inverse = 1 / (xx * cofactor_xx + xy * cofactor_xy + xz * cofactor_xz)
        return np.stack(
            [
                (cofactor_xx * x + cofactor_xy * y + cofactor_xz * z) * inverse,
                (cofactor_xy * x + cofactor_yy * y + cofactor_yz * z) * inverse,
                (cofactor_xz * x + cofactor_yz * y + cofactor_zz * z) * inverse,
            ]
        )


def shifted(columns: Indices, by: Indices | int, width: int, wraps: bool) -> Indices:
    """Return columns moved sideways: round the full turn, or as far as the border."""
    return (columns + by) % width if wraps else np.clip(columns + by, 0, width - 1)
