"""Points on a grid of any orientation become a scan: upright, not mirrored, every ray known."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from laserimg.errors import ScanError
from laserimg.projection import ranges_of, reflectance_of
from laserimg.readers.rays import complete_directions
from laserimg.scan import BoolArray, Scan

# Columns close a turn when the step over the seam is like any other step.
_MAX_SEAM_STEPS = 2.0


def scan_from_grid(
    xyz: ArrayLike,
    reflectance: ArrayLike | None = None,
    returned: BoolArray | None = None,
    wraps: bool = False,
    **fields: Any,
) -> Scan:
    """Make a scan from points on a grid in the scanner's frame.

    Parameters
    ----------
    xyz : (H, W, 3) array
        Metres; NaN, infinity or the origin where nothing returned.
    reflectance : (H, W) array, optional
    returned : (H, W) array of bool, optional
        False where a point only tells the direction of its ray.
    wraps : bool
        The columns are known to close a full turn; else their directions tell.
    **fields
        Other fields of `Scan`, such as ``world_from_scan``.

    Raises
    ------
    ScanError
        If the grid is too small or nothing returned.

    Examples
    --------
    >>> grid = np.zeros((2, 3, 3))
    >>> grid[0, 0], grid[1, 2] = (2.0, -1.0, 0.0), (2.0, 1.0, 1.0)
    >>> scan_from_grid(grid).range.round(3)
    array([[2.449, 0.   , 0.   ],
           [0.   , 0.   , 2.236]], dtype=float32)
    """
    points = np.asarray(xyz, np.float64)
    if points.ndim != 3 or min(points.shape) < 2:
        raise ScanError(f"a scan needs at least 2 rows and 2 columns, got {points.shape[:2]}")
    length, known = ranges_of(points)
    if not known.any():
        raise ScanError("no ray has a return: no point lies from 1 mm to 100 km from the scanner")
    directions = np.divide(points, length[..., None], out=np.zeros(points.shape), where=known[..., None])
    aim = complete_directions(directions, known)
    kept = known if returned is None else known & returned
    planes = [np.where(kept, length, 0).astype(np.float32), aim]
    if reflectance is not None:
        planes.append(reflectance_of(reflectance, kept))
    planes = upright(planes)
    closes, first = turn_of(planes[1])
    if wraps or closes:
        planes = [np.roll(plane, -first, axis=1) for plane in planes]
    return Scan(planes[0], planes[1], planes[2] if len(planes) > 2 else None, wraps=wraps or closes, **fields)


def upright(planes: list[NDArray]) -> list[NDArray]:
    """Flip rows and columns so that row 0 is up and azimuth decreases with the column.

    Parameters
    ----------
    planes : list of (H, W, ...) arrays
        The second holds the directions.
    """
    directions = planes[1]
    middle = directions.shape[0] // 2
    if float(directions[:middle, :, 2].mean()) < float(directions[-middle:, :, 2].mean()):
        planes = [plane[::-1] for plane in planes]
    before, after = directions[:, :-1], directions[:, 1:]
    turning = before[..., 0] * after[..., 1] - before[..., 1] * after[..., 0]
    if float(turning.sum()) > 0:
        planes = [plane[:, ::-1] for plane in planes]
    return planes


def turn_of(directions: NDArray[np.float32]) -> tuple[bool, int]:
    """Tell whether the columns close a full turn, and which is the one just below azimuth +180 degrees.

    Parameters
    ----------
    directions : (H, W, 3) array
        Azimuth decreasing with the column.
    """
    x, y, _ = directions.sum(axis=0, dtype=np.float64).T
    azimuth = np.arctan2(y, x)
    steps = (azimuth[:-1] - azimuth[1:] + np.pi) % (2 * np.pi) - np.pi
    usual = float(np.median(steps))
    over_seam = 2 * np.pi - float(steps.sum())
    wraps = abs(over_seam - usual) < _MAX_SEAM_STEPS * usual
    return wraps, int(np.argmax(azimuth))
