"""The angle between neighbouring rays, pixel by pixel, in both directions of the grid."""

import cv2
import numpy as np
from numpy.typing import NDArray

from laserimg.scan import BoolArray, Float32Array, Scan

Floats = NDArray[np.floating]

# Enough for medians over a scan.
SAMPLES = 5_000


def angular_pitch(scan: Scan) -> tuple[Float32Array, Float32Array]:
    """Return the angle between neighbouring rays across and up, per pixel.

    A tilting laser's grid is not azimuth x elevation, and a turning head moves in uneven steps, so
    the pitch is taken from the directions: the mean of the angles to the neighbours on both sides,
    of the one there is at the border of the grid.

    Returns
    -------
    across, up : (H, W) arrays of float32
        Radians to the neighbours in the same row and in the same column. `across` is 0 where all
        rays of a row point at the zenith.

    Examples
    --------
    >>> scan = Scan.from_range_image(np.ones((3, 4)), np.radians([3, 1, -1, -3]), np.radians([61, 60, 59]))
    >>> across, up = angular_pitch(scan)
    >>> np.degrees([across[1, 1], up[1, 1]]).round(3).tolist()
    [1.0, 1.0]
    """
    return pitch_of(scan.directions, scan.wraps)


def pitch_of(directions: Float32Array, wraps: bool) -> tuple[Float32Array, Float32Array]:
    """Return the pitch of any grid of directions, such as every fourth row and column of a scan's.

    Parameters
    ----------
    directions : (H, W, 3) array of float32
        Unit vectors; H and W at least 2.
    wraps : bool
        The last column is a neighbour of the first.

    Returns
    -------
    across, up : (H, W) arrays of float32
        As `angular_pitch`.
    """
    planes = [np.asarray(plane, np.float32) for plane in cv2.split(directions)]
    up = _mean_of_sides(_bordered(_angles([(plane[:-1], plane[1:]) for plane in planes])))
    steps = _bordered(_angles([(plane[:, :-1], plane[:, 1:]) for plane in planes]).T).T
    if wraps:
        steps[:, [0, -1]] = _angles([(plane[:, -1:], plane[:, :1]) for plane in planes])
    return _mean_of_sides(steps.T).T, up


def sample_pitch(scan: Scan, valid: BoolArray) -> tuple[Floats, Floats, Floats]:
    """Return range and pitch of a sample of the valid returns, spread over the grid.

    Returns
    -------
    range_m, across, up : three (n,) arrays of float32
        Metres, radians.
    """
    step = max(1, int(np.sqrt(scan.range.size / SAMPLES)))
    rows, columns = (min(step, size - 1) for size in scan.shape)
    across, up = pitch_of(scan.directions[::rows, ::columns], wraps=False)
    chosen = valid[::rows, ::columns]
    return scan.range[::rows, ::columns][chosen], across[chosen] / columns, up[chosen] / rows


def _angles(pairs: list[tuple[Float32Array, Float32Array]]) -> Float32Array:
    """Angle between unit vectors, given by planes; the chord keeps digits that the arc cosine loses."""
    chord = sum((a - b) ** 2 for a, b in pairs) ** 0.5
    return 2 * np.arcsin(np.minimum(chord / 2, 1))


def _bordered(steps: Float32Array) -> Float32Array:
    """Repeat the first and the last step: at the border there is only one."""
    return np.concatenate([steps[:1], steps, steps[-1:]])


def _mean_of_sides(steps: Float32Array) -> Float32Array:
    return np.float32(0.5) * (steps[:-1] + steps[1:])
