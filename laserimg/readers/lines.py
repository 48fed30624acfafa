"""Where one line of a scan ends and the next begins, from the order of its points."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

# A step back by this part of a line's extent is the return to its beginning, not jitter.
_BACK = 0.25
# Less than this share of steady forward steps is no scan order.
_STEADY = 0.8
_MIN_POINTS_PER_LINE = 4


@dataclass(frozen=True, eq=False, slots=True)
class Lines:
    """Points in scan order, split into lines.

    Parameters
    ----------
    starts : (L,) array of int
        First point of every line.
    counts : (L,) array of int
        Points of every line.
    pole : str
        "z" or "y": the axis about which the fan turns from line to line (then the angle from the
        pole grows along a line), or "ring": every line is a turn of a spinning beam.
    """

    starts: NDArray[np.intp]
    counts: NDArray[np.intp]
    pole: str

    @property
    def line_of_point(self) -> NDArray[np.intp]:
        """(N,) number of the line of every point."""
        return np.repeat(np.arange(len(self.starts)), self.counts)


def split_lines(directions: FloatArray) -> Lines | None:
    """Split points in scan order into lines, where the scan angle jumps back.

    Along a line one angle moves steadily: the elevation (a fan that pans), the angle from the y
    axis (a fan that tilts) or the azimuth (a beam that spins). The steadiest of the three splits.

    Parameters
    ----------
    directions : (N, 3) array
        Unit vectors in the order they were measured.

    Returns
    -------
    Lines, or None if no angle moves steadily.
    """
    x, y, z = directions.T
    angles = {
        "y": np.arcsin(np.clip(y, -1, 1)),
        "z": np.arcsin(np.clip(z, -1, 1)),
        "ring": np.arctan2(y, x) % (2 * np.pi),
    }
    steadiness = {pole: _steady_share(angle) for pole, angle in angles.items()}
    pole = max(steadiness, key=lambda name: steadiness[name])
    if steadiness[pole] < _STEADY:
        return None
    starts = np.r_[0, _breaks(angles[pole]) + 1]
    counts = np.diff(np.r_[starts, len(directions)])
    if len(starts) < 2 or np.median(counts) < _MIN_POINTS_PER_LINE:
        return None
    return Lines(starts, counts, pole)


def _forward(angle: FloatArray) -> FloatArray:
    steps = np.diff(angle)
    return steps * np.sign(np.median(steps))


def _extent(angle: FloatArray) -> float:
    low, high = np.percentile(angle, [0.5, 99.5])
    return float(high - low)


def _breaks(angle: FloatArray) -> NDArray[np.intp]:
    return np.flatnonzero(_forward(angle) < -_BACK * _extent(angle))


def _steady_share(angle: FloatArray) -> float:
    """Share of the steps that go forward, by a twentieth of the extent at most."""
    steps, extent = _forward(angle), _extent(angle)
    return float(((steps > 0) & (steps < _BACK * extent)).mean()) if extent > 0 else 0.0
