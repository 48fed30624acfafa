"""Between angles, directions and the pixels of a grid: plain arrays in, plain arrays out."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from laserimg.errors import ScanError

# Points outside are codes for "no return", not measurements.
MIN_RANGE_M = 1e-3
MAX_RANGE_M = 1e5

# Bounds of an estimated grid: a coarser one is no image, a finer one no scanner's.
_MAX_PITCH = np.radians(5.0)
_MIN_PITCH = 1e-5
_MAX_ESTIMATED_CELLS = 1 << 22
_MAX_CELLS = 1 << 26
# The pitch is estimated from the neighbourhoods of so many points.
_SAMPLES = 2000
_NEIGHBOURS = 24
_FULL_TURN = 2 * np.pi
# Azimuths all round, but for a gap of this many degrees, are a full turn.
_MAX_GAP_DEG = 10


def directions_from_angles(azimuth: ArrayLike, elevation: ArrayLike) -> NDArray[np.float32]:
    """Return unit vectors for azimuth and elevation.

    Parameters
    ----------
    azimuth : (W,) or (H, W) array
        Radians, counter-clockwise from x.
    elevation : (H,) or (H, W) array
        Radians from the horizontal, positive upwards.

    Returns
    -------
    (H, W, 3) array of float32

    Raises
    ------
    ScanError
        If an array has neither one nor two dimensions, or the shapes do not fit.

    Examples
    --------
    >>> directions_from_angles([0.0, -np.pi / 2], [0.0]).round(6).tolist()
    [[[1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]]
    """
    azimuth, elevation = np.asarray(azimuth, np.float64), np.asarray(elevation, np.float64)
    columns = azimuth[None, :] if azimuth.ndim == 1 else azimuth
    rows = elevation[:, None] if elevation.ndim == 1 else elevation
    try:
        columns, rows = np.broadcast_arrays(columns, rows)
    except ValueError:
        raise ScanError(f"azimuth {azimuth.shape} and elevation {elevation.shape} do not fit") from None
    if columns.ndim != 2:
        raise ScanError(f"angles must have one or two dimensions, got {columns.ndim}")
    level = np.cos(rows)
    return np.stack([level * np.cos(columns), level * np.sin(columns), np.sin(rows)], axis=-1).astype(
        np.float32
    )


def angles_from_directions(directions: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return azimuth in (-pi, pi] and elevation in [-pi/2, pi/2] of vectors of any length.

    Parameters
    ----------
    directions : (..., 3) array

    Examples
    --------
    >>> azimuth, elevation = angles_from_directions([[0.0, 2.0, 0.0]])
    >>> np.degrees(azimuth).tolist(), elevation.tolist()
    ([90.0], [0.0])
    """
    x, y, z = np.moveaxis(np.asarray(directions, np.float64), -1, 0)
    return np.arctan2(y, x), np.arctan2(z, np.hypot(x, y))


def ranges_of(points: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Return the length of every point and which of them can be measurements.

    Parameters
    ----------
    points : (..., 3) array
    """
    with np.errstate(over="ignore", invalid="ignore"):
        length = np.sqrt(np.einsum("...k,...k->...", points, points))
        return length, (length >= MIN_RANGE_M) & (length <= MAX_RANGE_M)


def measured(range_m: ArrayLike) -> NDArray[np.float32]:
    """Return ranges in metres, 0 where the value cannot be a measurement.

    Examples
    --------
    >>> measured([1.5, np.nan, -1.0, 1e30]).tolist()
    [1.5, 0.0, 0.0, 0.0]
    """
    values = np.asarray(range_m, np.float64)
    with np.errstate(invalid="ignore"):
        usable = (values >= MIN_RANGE_M) & (values <= MAX_RANGE_M)
    return np.where(usable, values, 0).astype(np.float32)


def reflectance_of(values: ArrayLike, returned: NDArray[np.bool_]) -> NDArray[np.float32]:
    """Return the sensor's values where there is a return and a value, 0 elsewhere."""
    with np.errstate(over="ignore", invalid="ignore"):
        single = np.asarray(values, np.float64).astype(np.float32)
    if single.shape != returned.shape:
        raise ScanError(f"reflectance must be {returned.shape}, got {single.shape}")
    return np.where(returned & np.isfinite(single), single, np.float32(0))


class Projected(NamedTuple):
    """Points put on a spherical grid."""

    range: NDArray[np.float32]
    directions: NDArray[np.float32]
    reflectance: NDArray[np.float32] | None
    filled: NDArray[np.bool_]
    wraps: bool


def project(
    points: ArrayLike,
    origin: ArrayLike = (0.0, 0.0, 0.0),
    reflectance: ArrayLike | None = None,
    shape: tuple[int, int] | None = None,
    pitch: float | None = None,
    fill_gaps: bool = False,
) -> Projected:
    """Put points in any order on a grid even in azimuth and elevation; the nearest return wins.

    Parameters
    ----------
    points : (N, 3) array
        Metres. Points that are not finite, nearer than 1 mm or further than 100 km are no measurements.
    origin : (3,) array
        Where the scanner stood.
    reflectance : (N,) array, optional
    shape : (int, int), optional
        Rows and columns that cover all points.
    pitch : float, optional
        Radians from ray to ray, when no `shape` is given; else estimated from the points.
    fill_gaps : bool
        Give the rays of one-pixel gaps the mean range of their two neighbours. They are marked in
        `filled` in any case.

    Returns
    -------
    Projected
        ``range (H, W)``, ``directions (H, W, 3)`` (of the return, else of the cell), ``reflectance``,
        ``filled (H, W)`` and ``wraps``. Columns close a turn when all azimuths are taken.

    Raises
    ------
    ScanError
        If there are too few points for a grid, or `shape` or `pitch` ask for too large a one.

    Examples
    --------
    >>> grid = project([[4, 4, 0], [2, 0, 0], [3, 0, 0], [1, -1, 1]], pitch=0.8)
    >>> grid.range.astype(float).round(2).tolist()
    [[0.0, 0.0, 1.73], [5.66, 2.0, 0.0]]
    """
    array = np.asarray(points, np.float64)
    if array.ndim != 2 or array.shape[1] != 3:
        raise ScanError(f"points must be (n, 3), got {array.shape}")
    array = array - np.asarray(origin, np.float64)
    length, known = ranges_of(array)
    if not known.any():
        raise ScanError("no point is a return: none lies from 1 mm to 100 km from the scanner")
    directions, length = array[known] / length[known, None], length[known]
    azimuth, elevation, wraps = _axes(directions, shape, pitch)
    row = _nearest_cell(elevation, np.arcsin(np.clip(directions[:, 2], -1, 1)))
    around = np.arctan2(directions[:, 1], directions[:, 0])
    column = _nearest_cell(azimuth, azimuth[0] - (azimuth[0] - around) % (2 * np.pi), wraps)
    # Written from far to near: the nearest is written last.
    far_to_near = np.argsort(-length, kind="stable")
    cell = (row[far_to_near], column[far_to_near])
    range_m = np.zeros((len(elevation), len(azimuth)), np.float32)
    range_m[cell] = length[far_to_near]
    rays = directions_from_angles(azimuth, elevation)
    rays[cell] = directions[far_to_near]
    values = None
    if reflectance is not None:
        values = np.zeros(range_m.shape, np.float32)
        values[cell] = reflectance_of(reflectance, known)[known][far_to_near]
    filled, between = _one_pixel_gaps(range_m, wraps)
    return Projected(
        np.where(filled, between, range_m) if fill_gaps else range_m, rays, values, filled, wraps
    )


def _axes(
    directions: NDArray[np.float64], shape: tuple[int, int] | None, pitch: float | None
) -> tuple[NDArray[np.float64], NDArray[np.float64], bool]:
    """Azimuths of the columns and elevations of the rows, both falling, and whether they close a turn."""
    azimuth = np.arctan2(directions[:, 1], directions[:, 0])
    elevation = np.arcsin(np.clip(directions[:, 2], -1, 1))
    high = float(elevation.max())
    low = min(float(elevation.min()), high - _MIN_PITCH)
    left, across = widest_arc(azimuth)
    across, wraps = max(across, _MIN_PITCH), across == _FULL_TURN
    if shape is None:
        step = _bounded_pitch(estimate_pitch(directions), across, high - low) if pitch is None else pitch
        if not step > 0:
            raise ScanError(f"the pitch must be above 0 radians, got {step}")
        shape = round((high - low) / step) + 1, round(across / step) + (not wraps)
    rows, columns = (max(int(size), 2) for size in shape)
    if rows * columns > _MAX_CELLS:
        raise ScanError(f"a grid of {rows} x {columns} is too large: give a wider pitch")
    step = across / (columns if wraps else columns - 1)
    first = np.pi - step / 2 if wraps else left
    return first - step * np.arange(columns, dtype=np.float64), np.linspace(high, low, rows), wraps


def widest_arc(azimuth: NDArray[np.float64]) -> tuple[float, float]:
    """Return leftmost azimuth and width of the shortest arc that holds all; 2 pi when they go all round.

    Examples
    --------
    >>> widest_arc(np.radians([170.0, -170.0, 180.0]))[1].__round__(3)
    0.349
    """
    around = np.sort(azimuth)
    gaps = np.diff(np.r_[around, around[0] + _FULL_TURN])
    widest = int(np.argmax(gaps))
    if gaps[widest] < np.radians(_MAX_GAP_DEG):
        return np.pi, _FULL_TURN
    return float(around[widest]), float(_FULL_TURN - gaps[widest])


def _bounded_pitch(pitch: float, across: float, up: float) -> float:
    return float(np.clip(pitch, np.sqrt((across + pitch) * (up + pitch) / _MAX_ESTIMATED_CELLS), _MAX_PITCH))


def estimate_pitch(directions: NDArray[np.float64]) -> float:
    """Return the side in radians of the square that one ray has for itself, from points without order.

    The median over points of the circle that holds their nearest 24: area over count.

    Parameters
    ----------
    directions : (N, 3) array
        Unit vectors.
    """
    from scipy.spatial import KDTree

    sample = directions[:: max(len(directions) // _SAMPLES, 1)]
    count = min(_NEIGHBOURS, len(directions) - 1)
    if count < 1:
        return float(_MAX_PITCH)
    chord = KDTree(directions).query(sample, k=count + 1)[0][:, -1]
    # The point itself is the first of the count + 1.
    pitch = float(np.median(chord)) * np.sqrt(np.pi / (count + 1))
    return pitch if pitch > 0 else float(_MAX_PITCH)


def _nearest_cell(
    axis: NDArray[np.float64], values: NDArray[np.float64], wraps: bool = False
) -> NDArray[np.intp]:
    index = np.round((axis[0] - values) / (axis[0] - axis[1])).astype(np.intp)
    return index % len(axis) if wraps else np.clip(index, 0, len(axis) - 1)


def _one_pixel_gaps(
    range_m: NDArray[np.float32], wraps: bool
) -> tuple[NDArray[np.bool_], NDArray[np.float32]]:
    """Which rays lie between two returns of their row or column, and the mean range of these two."""
    sides = np.pad(range_m, ((0, 0), (1, 1)), mode="wrap" if wraps else "constant")
    ends = np.pad(range_m, ((1, 1), (0, 0)))
    in_row = (sides[:, :-2] > 0) & (sides[:, 2:] > 0)
    in_column = (ends[:-2] > 0) & (ends[2:] > 0)
    between = np.where(in_row, sides[:, :-2] + sides[:, 2:], ends[:-2] + ends[2:]) / 2
    empty = range_m == 0
    return empty & (in_row | in_column), np.where(empty, between, range_m).astype(np.float32)
