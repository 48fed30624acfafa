"""Beams that spin: every ring is a row, its azimuths are the columns."""

import numpy as np
from numpy.typing import NDArray

from laserimg.projection import angles_from_directions, widest_arc
from laserimg.readers.beams import cell_index, usual_step

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.intp]

_MAX_RINGS = 512
# Elevations of one ring lie this much nearer to each other than to those of the next.
_APART = 4.0
_MIN_POINTS_PER_RING = 8


def ring_places(
    directions: FloatArray, ring: NDArray[np.integer], begin: float
) -> tuple[IntArray, IntArray, NDArray[np.bool_], bool] | None:
    """Return row and column of every point of a spinning scanner, which have their own place, and
    whether the columns close a full turn; None if the numbers are none of rings.

    Rings become rows by their mean elevation. Columns are even in azimuth; rings measure at azimuths
    of their own, so a point may stand beside its cell where they crowd.

    Parameters
    ----------
    directions : (N, 3) array
        Unit vectors, those of a ring in the order they were measured.
    ring : (N,) array of int
        Number of the ring of every point.
    begin : float
        Azimuth in radians where the turn begins, if it is a full one.
    """
    azimuth, elevation = angles_from_directions(directions)
    _, row, counts = np.unique(ring, return_inverse=True, return_counts=True)
    if len(counts) > _MAX_RINGS:
        return None
    row = np.argsort(np.argsort(-np.bincount(row, elevation) / counts))[row]
    order = np.argsort(row, kind="stable")
    left, across = widest_arc(azimuth)
    turns = across == 2 * np.pi
    along = _unrolled(azimuth[order] - (begin if turns else left - across / 2 - np.pi), row[order])
    step = usual_step(along, row[order])
    if step == 0:
        return None
    column, own = np.empty(len(ring), np.intp), np.empty(len(ring), bool)
    column[order], own[order] = cell_index(along, row[order], step, turns)
    return row, _without_lone_gaps(column), own, turns


def _without_lone_gaps(column: IntArray) -> IntArray:
    """Close single columns in which no ring has a point: no beam was fired there."""
    used = np.bincount(column) > 0
    lone = ~used & np.roll(used, 1) & np.roll(used, -1)
    return (np.cumsum(~lone) - 1)[column]


def _unrolled(azimuth: FloatArray, row: IntArray) -> FloatArray:
    """Angle that grows along every ring from 0 to 2 pi, for points sorted by ring.

    Jitter where a ring begins or ends leads out of this interval, not to its other end.
    """
    steps = (np.diff(azimuth) + np.pi) % (2 * np.pi) - np.pi
    sense = np.sign(np.median(steps[np.diff(row) == 0]))
    along = (sense * azimuth) % (2 * np.pi)
    starts = np.searchsorted(row, np.arange(row[-1] + 1))
    counts = np.diff(np.r_[starts, len(row)])
    passed = (np.arange(len(row)) - starts[row]) / counts[row] * 2 * np.pi
    return along - 2 * np.pi * ((along - passed > 1.5 * np.pi) * 1.0 - (passed - along > 1.5 * np.pi))


def rings_of_elevation(directions: FloatArray) -> IntArray | None:
    """Return the ring of every point where elevations come in few sharp groups, else None.

    Parameters
    ----------
    directions : (N, 3) array
        Unit vectors.
    """
    _, elevation = angles_from_directions(directions)
    order = np.argsort(elevation)
    steps = np.diff(elevation[order])
    widest = np.sort(steps)[::-1][:_MAX_RINGS]
    # The drop from the gaps between rings to the jitter inside them.
    drop = widest[:-1] / np.maximum(widest[1:], 1e-12)
    last = int(np.argmax(drop))
    if drop[last] < _APART or last < 2:
        return None
    ring = np.empty(len(elevation), np.intp)
    ring[order] = np.r_[0, np.cumsum(steps >= widest[last])]
    return ring if np.median(np.bincount(ring)) >= _MIN_POINTS_PER_RING else None
