"""Where one line of a scan ends and the next begins, from the order of its points."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from laserimg.projection import angles_from_directions, widest_arc

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.intp]

# A step back by this part of a line's extent is the return to its beginning, not jitter.
_BACK = 0.25
# With less than this share of forward steps the points stand in no scan order.
_STEADY = 0.8
_AZIMUTH = 2
_MIN_LINES = 4
_MIN_POINTS_PER_LINE = 4


@dataclass(frozen=True, eq=False, slots=True)
class Lines:
    """Points in scan order, split into lines.

    Parameters
    ----------
    starts, counts : (L,) arrays of int
        First point and number of points of every line.
    along_azimuth : bool
        Azimuth was the steadiest angle: the lines may be rings of a spinning beam.
    begin : float, optional
        The lines are rings, full turns that begin at this azimuth.
    """

    starts: IntArray
    counts: IntArray
    along_azimuth: bool = False
    begin: float | None = None

    @property
    def of_point(self) -> IntArray:
        """(N,) number of the line of every point."""
        return np.repeat(np.arange(len(self.starts)), self.counts)

    def sums(self, values: NDArray) -> NDArray:
        """(L, ...) sums over the points of every line."""
        return np.add.reduceat(values, self.starts, axis=0)


def split_lines(directions: FloatArray) -> Lines | None:
    """Split points in scan order into lines, where the scan angle jumps back.

    Along a line one angle moves steadily: the elevation (a fan that pans), the angle from the y
    axis (a fan that tilts) or the azimuth (a beam that spins, or a fan that tilts far). The
    steadiest of the three splits.

    Parameters
    ----------
    directions : (N, 3) array
        Unit vectors in the order they were measured.

    Returns
    -------
    Lines, or None if no angle moves steadily.
    """
    azimuth, elevation = angles_from_directions(directions)
    begin, turns = _cut(azimuth, elevation)
    around = (azimuth - begin) % (2 * np.pi)
    angles = [elevation, np.arcsin(np.clip(directions[:, 1], -1, 1)), around]  # the last is _AZIMUTH
    steadiness = [_steady_share(angle) for angle in angles]
    best = int(np.argmax(steadiness))
    if steadiness[best] < _STEADY:
        return None
    starts = np.r_[0, _breaks(angles[best]) + 1]
    counts = np.diff(np.r_[starts, len(directions)])
    if len(starts) < _MIN_LINES or np.median(counts) < _MIN_POINTS_PER_LINE:
        return None
    return Lines(starts, counts, best == _AZIMUTH, begin if turns and best == _AZIMUTH else None)


def _cut(azimuth: FloatArray, elevation: FloatArray) -> tuple[float, bool]:
    """Azimuth where lines begin, and whether they are full turns."""
    left, across = widest_arc(azimuth)
    if across < 2 * np.pi:
        return left - across / 2 - np.pi, False
    # The beam climbs to its next ring where a new turn begins.
    begins = [0.0, np.pi / 2, np.pi, -np.pi / 2, float(azimuth[0])]
    climbs = [_usual_climb((azimuth - begin) % (2 * np.pi), elevation) for begin in begins]
    return begins[int(np.argmax(climbs))], True


def _usual_climb(angle: FloatArray, elevation: FloatArray) -> float:
    climbs = np.abs(np.diff(elevation)[_breaks(angle)])
    return float(np.median(climbs)) if len(climbs) else 0.0


def _forward(angle: FloatArray) -> FloatArray:
    steps = np.diff(angle)
    return steps * np.sign(np.median(steps))


def _limit(angle: FloatArray) -> float:
    low, high = np.percentile(angle, [0.5, 99.5])
    return _BACK * float(high - low)


def _breaks(angle: FloatArray) -> IntArray:
    return np.flatnonzero(_forward(angle) < -_limit(angle))


def _steady_share(angle: FloatArray) -> float:
    """Share of the steps inside lines that go forward."""
    steps, limit = _forward(angle), _limit(angle)
    inside = steps >= -limit
    return float((steps[inside] > 0).mean()) if limit > 0 and inside.any() else 0.0
