"""The angle between neighbouring rays, pixel by pixel, in both directions of the grid."""

import numpy as np

from laserimg.scan import Float32Array, Scan


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
    steps_across = _angles(scan.directions, np.roll(scan.directions, -1, axis=1))
    steps_up = _angles(scan.directions[:-1], scan.directions[1:])
    up = _mean_of_sides(np.concatenate([steps_up[:1], steps_up, steps_up[-1:]]))
    if not scan.wraps:
        steps_across[:, -1] = steps_across[:, -2]
    before = steps_across[:, -1:] if scan.wraps else steps_across[:, :1]
    across = _mean_of_sides(np.concatenate([before, steps_across], axis=1).T).T
    return np.ascontiguousarray(across), up


def _angles(a: Float32Array, b: Float32Array) -> Float32Array:
    """Angle between unit vectors; the chord keeps its digits where the arc cosine loses them."""
    difference = a - b
    chord = np.sqrt(np.einsum("ijk,ijk->ij", difference, difference))
    return (2 * np.arcsin(np.minimum(chord / 2, 1))).astype(np.float32, copy=False)


def _mean_of_sides(steps: Float32Array) -> Float32Array:
    return np.float32(0.5) * (steps[:-1] + steps[1:])
