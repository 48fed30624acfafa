"""Heads that tilt or turn a fan of beams, and where the beams really go when a head moves."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from laserimg.projection import directions_from_angles
from laserimg.scan import Float32Array


class Head(NamedTuple):
    """A head whose tilt is not what it reports.

    Parameters
    ----------
    late_deg : (W,) array of float64
        How far the head has moved down when a column is measured.
    wave_deg : float
        Standard deviation of an error of the tilt that goes up and down from row to row.
    wave_rows : float
        Rows over which it does so once.
    """

    late_deg: NDArray[np.float64]
    wave_deg: float
    wave_rows: float


def tilting_fan(fan: NDArray, tilt: NDArray) -> Float32Array:
    """Return (H, W, 3) beams of a fan at angles (W,) that tilts about y by (H,) radians, up positive."""
    a, t = np.meshgrid(fan, tilt)
    beams = np.stack([np.cos(a) * np.cos(t), np.sin(a), np.cos(a) * np.sin(t)], axis=-1)
    return beams.astype(np.float32)


def turning_fan(elevation_deg: NDArray, columns: int) -> Float32Array:
    """Return (H, W, 3) beams of an upright fan on a head that turns by one column in a mirror turn.

    The mirror looks from the zenith down to the nadir in half its turn, while the head goes on: columns lean
    by half their distance, from a quarter before their azimuth to a quarter behind. These are the angles at
    which beams go, and those reported: where the head is at the time of each beam.

    Parameters
    ----------
    elevation_deg : (H,) array of float64
        Downwards.
    columns : int
        Of a full turn, clockwise from just below azimuth 180 degrees.
    """
    late = (90 - elevation_deg[:, None]) / 360 - 0.25
    azimuth_deg = 180 - 360 * (np.arange(columns) + 0.5 + late) / columns
    return directions_from_angles(np.radians(azimuth_deg), np.radians(elevation_deg))


def beams_shot(directions: Float32Array, head: Head | None, rng: np.random.Generator) -> Float32Array:
    """Return where the beams of a fan that tilts about y really went.

    Parameters
    ----------
    directions : (H, W, 3) array of float32
        As reported.
    head : Head or None
        None reports its tilt without error.
    rng : Generator
        Draws the phase of the wave, and its height and length within half and double.

    Returns
    -------
    (H, W, 3) array of float32
    """
    if head is None:
        return directions
    height, length = (
        head.wave_deg * 2**0.5 * 2 ** rng.uniform(-1, 1),
        head.wave_rows * 2 ** rng.uniform(-1, 1),
    )
    row = np.arange(len(directions))
    wave = height * np.sin(2 * np.pi * (row / length + rng.random()))
    angle = np.radians(wave[:, None] - head.late_deg)
    cos, sin = np.cos(angle).astype(np.float32), np.sin(angle).astype(np.float32)
    x, y, z = np.moveaxis(directions, -1, 0)
    return np.stack([x * cos - z * sin, y, x * sin + z * cos], axis=-1)
