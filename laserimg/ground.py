"""Ground outdoors: a plane and its slow unevenness, over points in any order or in the image of a scan."""

from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from laserimg.errors import ScanError
from laserimg.geometry.planes import Plane, heights_over, planes_through, refit_plane
from laserimg.scan import BoolArray, Float32Array, Scan

# A return this high over the ground is no ground: kerbs and mown grass are lower.
CLEARANCE_M = 0.2
# Hills tilt more than floors: 20 degrees.
MAX_TILT_RAD = float(np.radians(20))
# Share of the returns that must lie on the plane, and must at most lie below it, for it to be ground.
MIN_SHARE = 0.05
MAX_BELOW = 0.5

_TRIALS = 400
_SAMPLE = 2000
_SEARCHED = 20_000
# The unevenness is a mean over cells of this many metres and their neighbours. Windows of the image in their
# place climbed up what stands near, 0.8 m up a wall at 3 m: there a window is all wall.
_CELL_M = 2.0
_ROUNDS = 4
# Weight of the plane among the returns of a window: where there are few, it decides.
_PRIOR = 5.0
# Of a scan about so many returns are summed.
_SUMMED = 100_000
_MAX_CELLS = 1 << 20
# What is farther away lies in the outermost cells: one stray point must not make all cells large.
_FARTHEST_M = 1000.0


@dataclass(frozen=True, eq=False, slots=True)
class Ground:
    """Which returns are ground.

    Parameters
    ----------
    plane : Plane
        Through the ground as a whole; its normal points up.
    height : array of float32
        Metres over the uneven ground, of every return.
    mask : array of bool
        Returns that are ground, or below it.
    """

    plane: Plane
    height: Float32Array
    mask: BoolArray


def ground_of_points(
    points: ArrayLike, up: ArrayLike = (0.0, 0.0, 1.0), clearance_m: float = CLEARANCE_M
) -> Ground | None:
    """Return the ground of points in any order, or None if they have none.

    1. The plane within 20 degrees of level with most points near it, among the points below the scanner
       (random triples with a fixed seed), refitted.
    2. Its unevenness: the mean height of the points near the ground in cells of 2 m, smoothed
       over their neighbours, a few times over, so that it follows slopes outwards.
    3. What is no more than `clearance_m` above is ground.

    Parameters
    ----------
    points : (n, 3) array
        Metres from the scanner.
    up : (3,) array
    clearance_m : float

    Returns
    -------
    Ground or None
        Arrays of (n,); points that are not finite have no height and are no ground. None without a plane
        that holds 5 % of the points, or with most points below it.

    Raises
    ------
    ScanError
        If the points are not (n, 3).

    Notes
    -----
    Paper 1, section 4.1: "assuming the ground is flat, we can extract it by fitting a plane to the
    points lower than the position of the laser scanner". Differs from the paper: the fit is robust,
    and the ground may be uneven.

    Examples
    --------
    >>> x, y = np.meshgrid(np.arange(-5.0, 5), np.arange(-5.0, 5))
    >>> floor = np.stack([x, y, np.full_like(x, -1.5)], axis=-1).reshape(-1, 3)
    >>> ground_of_points(np.concatenate([floor, [[2, 2, -1.0]]])).mask[-2:].tolist()
    [True, False]
    """
    array = np.asarray(points, np.float64)
    if array.ndim != 2 or array.shape[1] != 3:
        raise ScanError(f"points must be (n, 3), got {array.shape}")
    finite = np.isfinite(array).all(axis=1)
    known = array[finite]
    plane = ground_plane(known, np.asarray(up, np.float64))
    if plane is None:
        return None
    over_plane = plane.distance(known).astype(np.float32)
    cells = _Cells.over(known, plane)
    place = cells.place(known)
    height = np.full(len(array), np.nan, np.float32)
    height[finite] = over_plane - _sampled(_unevenness(cells, place, over_plane, clearance_m), place)
    return Ground(plane, height, height <= clearance_m)


def ground_of_scan(scan: Scan, clearance_m: float = CLEARANCE_M) -> Ground | None:
    """Return the ground of a scan, or None if it has none.

    As `ground_of_points`, with the plane and the unevenness of about 100,000 of its returns.

    Parameters
    ----------
    scan : Scan
    clearance_m : float

    Returns
    -------
    Ground or None
        Arrays of (H, W); pixels without a return are not ground.
    """
    valid = scan.valid
    pixels = np.flatnonzero(valid)
    step = max(1, len(pixels) // _SUMMED)
    pixels = pixels[::step]
    points = scan.range.ravel()[pixels, None] * scan.directions.reshape(-1, 3)[pixels]
    plane = ground_plane(points[:: max(1, len(points) // _SEARCHED)].astype(np.float64), scan.up)
    if plane is None:
        return None
    height = heights_over(plane, scan.range, scan.directions)
    cells = _Cells.over(points, plane)
    grid = _unevenness(cells, cells.place(points), height.ravel()[pixels], clearance_m, step)
    height -= _sampled(grid, cells.place_of_rays(scan.range, scan.directions)).reshape(scan.shape)
    return Ground(plane, height, valid & (height <= clearance_m))


def ground_plane(points: NDArray[np.float64], up: NDArray[np.float64]) -> Plane | None:
    """Return the plane through most points below the scanner, nearly level; None if it holds too few.

    Parameters
    ----------
    points : (n, 3) array
        Metres from the scanner.
    up : (3,) array
        Unit vector.
    """
    below = points[points @ up < 0]
    if len(below) < 3:
        return None
    below = below[:: max(1, len(below) // _SEARCHED)]
    plane = _most_held(below, up)
    if plane is None:
        return None
    plane = refit_plane(plane, below, CLEARANCE_M / 2)
    distance = plane.distance(points)
    on_plane = float((np.abs(distance) <= CLEARANCE_M / 2).mean())
    level = float(plane.normal @ up) >= np.cos(MAX_TILT_RAD)
    under = float((distance < -CLEARANCE_M).mean())
    return plane if level and on_plane >= MIN_SHARE and under <= MAX_BELOW * on_plane else None


def _most_held(points: NDArray[np.float64], up: NDArray[np.float64]) -> Plane | None:
    random = np.random.default_rng(0)
    normals, offsets = planes_through(points[random.integers(0, len(points), (_TRIALS, 3))])
    sign = np.where(normals @ up < 0, -1.0, 1.0)
    normals, offsets = normals * sign[:, None], offsets * sign
    level = (normals @ up >= np.cos(MAX_TILT_RAD)) & (offsets < 0)
    if not level.any():
        return None
    normals, offsets = normals[level], offsets[level]
    sample = points[random.permutation(len(points))[:_SAMPLE]]
    # Near ground is denser: a return counts with its distance, as it stands for more of the ground.
    weight = np.sqrt(np.linalg.norm(sample, axis=1))
    distance = sample @ normals.T - offsets
    held = weight @ (np.abs(distance) <= CLEARANCE_M / 2)
    # Nothing lies under the ground: a level slice through facades may hold as much, but has much below.
    under = weight @ (distance < -CLEARANCE_M)
    best = int(np.argmax(held - under))
    return Plane(normals[best], float(offsets[best]))


class _Cells(NamedTuple):
    """A grid of square cells over a plane; places are (n, 2) rows and columns in cells."""

    along: Float32Array
    low_m: Float32Array
    cell_m: float
    shape: tuple[int, int]

    @classmethod
    def over(cls, points: NDArray, plane: Plane) -> "_Cells":
        along = np.linalg.svd(plane.normal[None])[2][1:].astype(np.float32)
        place = _clipped(points.astype(np.float32) @ along.T)
        low, high = place.min(axis=0), place.max(axis=0)
        cell = max(_CELL_M, float(np.sqrt(np.prod(high - low) / _MAX_CELLS)))
        rows, columns = (int(size / cell) + 2 for size in high - low)
        return cls(along, low, cell, (rows, columns))

    def place(self, points: NDArray) -> Float32Array:
        return self._scaled(points.astype(np.float32) @ self.along.T)

    def place_of_rays(self, range_m: Float32Array, directions: Float32Array) -> Float32Array:
        """Place of every pixel."""
        return self._scaled(directions.reshape(-1, 3) @ self.along.T * range_m.reshape(-1, 1))

    def _scaled(self, place_m: Float32Array) -> Float32Array:
        return (_clipped(place_m) - self.low_m) / np.float32(self.cell_m)


def _clipped(place_m: Float32Array) -> Float32Array:
    return np.clip(place_m, -_FARTHEST_M, _FARTHEST_M)


def _unevenness(
    cells: _Cells, place: Float32Array, height: Float32Array, clearance_m: float, each: int = 1
) -> Float32Array:
    """Return how far the ground is above the plane at the corners of cells; a point stands for `each`."""
    row, column = np.rint(place).astype(np.intp).T
    flat, total = row * cells.shape[1] + column, cells.shape[0] * cells.shape[1]
    grid = np.zeros(cells.shape, np.float32)
    for _ in range(_ROUNDS):
        near = np.abs(height - _sampled(grid, place)) <= clearance_m
        sums = np.bincount(flat[near], height[near], total).reshape(cells.shape)
        counts = np.bincount(flat[near], minlength=total).reshape(cells.shape)
        grid = _windowed_mean(sums * each, counts * each)
    return grid


def _sampled(grid: Float32Array, place: Float32Array) -> Float32Array:
    """Interpolate a grid at n places."""
    # remap takes no more than 32767 rows, so the places go in rows of their own.
    columns = 1024
    rows = -(-len(place) // columns)
    maps = np.zeros((2, rows * columns), np.float32)
    maps[:, : len(place)] = place.T[::-1]
    x, y = maps.reshape(2, rows, columns)
    sampled = cv2.remap(grid, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(sampled, np.float32).ravel()[: len(place)]


def _windowed_mean(sums: NDArray, counts: NDArray) -> Float32Array:
    """Return sums over 3 x 3 cells divided by counts, drawn to 0 where there is little to count."""
    total, number = (
        np.asarray(
            cv2.boxFilter(
                part.astype(np.float32), -1, (3, 3), normalize=False, borderType=cv2.BORDER_CONSTANT
            )
        )
        for part in (sums, counts)
    )
    return (total / (number + np.float32(_PRIOR))).astype(np.float32)
