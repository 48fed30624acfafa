"""Between angles, directions and the pixels of a grid: plain arrays in, plain arrays out."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from laserimg.errors import ScanError


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
