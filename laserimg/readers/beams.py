"""The number of every beam along its line, from angles measured with gaps."""

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.intp]

# Angles that lie on a lattice differ from it by less than this part of a step (rms).
_SHARP = 0.15
# A longer step, in median steps, jumped over a missing beam.
_GAP = 1.5
# Nearer than this, in usual steps, two points are returns of one beam.
_SAME_BEAM = 0.05


def usual_step(angles: FloatArray, line: IntArray) -> float:
    """Return the mean step from beam to beam along lines, where no beam is missing.

    The mean, not the median: a spinning scanner that measures its angle in coarse units gives six
    steps of two units and one of one.

    Parameters
    ----------
    angles, line : (N,) arrays
        Angle and number of the line of every point, sorted by line, in the order they were measured.

    Returns
    -------
    float
        0 if no two points of a line differ in angle.
    """
    steps = np.abs(np.diff(angles))
    steps = steps[(np.diff(line) == 0) & (steps > 0)]
    if not len(steps):
        return 0.0
    in_medians = steps / np.median(steps)
    return float(steps[(in_medians > _SAME_BEAM) & (in_medians < _GAP)].mean())


def lattice_index(angles: FloatArray, step: float) -> tuple[IntArray, bool]:
    """Return the number of every angle on the even lattice that fits best, and whether it fits.

    Parameters
    ----------
    angles : (N,) array
    step : float
        A first estimate, in the unit of `angles`.
    """
    phase = float(np.angle(np.exp(2j * np.pi * angles / step).sum())) * step / (2 * np.pi)
    index = np.round((angles - phase) / step)
    for _ in range(3):
        off_centre = index - index.mean()
        step = float((off_centre * angles).sum()) / max(float((off_centre**2).sum()), 1.0)
        if not step > 0:
            return np.zeros(len(angles), np.intp), False
        phase = float(angles.mean() - step * index.mean())
        index = np.round((angles - phase) / step)
    sharp = float(np.sqrt(((angles - phase - index * step) ** 2).mean())) < _SHARP * step
    return (index - index.min()).astype(np.intp), sharp


def cell_index(
    angles: FloatArray, line: IntArray, step: float, turn: bool = False
) -> tuple[IntArray, NDArray[np.bool_]]:
    """Number angles that lie on no even lattice by cells of about one step, one point a cell.

    The points of a line keep their order, also where jitter or the motion of the scanner turned it
    around in angle, and move from their own cell as little as that takes (least squares).

    Parameters
    ----------
    angles, line : (N,) arrays
        Angle and number of the line of every point, in the order they were measured; angles grow
        along lines.
    step : float
    turn : bool
        The cells close a full turn from 0 to 2 pi; else they reach from the least to the greatest angle.

    Returns
    -------
    index : (N,) array of int
    own : (N,) array of bool
        False for further returns of a beam that has its place.
    """
    from scipy.optimize import isotonic_regression

    order = np.argsort(line, kind="stable")
    again = (np.abs(np.diff(angles[order])) < _SAME_BEAM * step) & (np.diff(line[order]) == 0)
    own = np.ones(len(angles), bool)
    own[order[1:][again]] = False
    order = order[own[order]]
    low, high = (0.0, 2 * np.pi) if turn else (float(angles.min()), float(angles.max()))
    _, starts, counts = np.unique(line[order], return_index=True, return_counts=True)
    cells = max(round((high - low) / step), int(counts.max()))
    rank = np.arange(len(order)) - np.repeat(starts, counts)
    wanted = (angles[order] - low) / (high - low) * cells
    # Cells of a turn lie where most beams are; those of a fan cover it from edge to edge.
    wanted -= float(np.angle(np.exp(2j * np.pi * wanted).sum())) / (2 * np.pi) if turn else 0.5
    # Strictly growing cells are never falling cells less rank; lines lie too far apart to touch.
    apart = np.repeat(np.arange(len(starts)) * 4.0 * cells, counts)
    steady = isotonic_regression(np.clip(wanted, -cells, 2 * cells) - rank + apart).x - apart
    index = np.zeros(len(angles), np.intp)
    placed = np.round(steady) + rank
    left_over = cells - np.repeat(counts, counts)
    index[order] = placed % cells if turn else np.clip(placed, rank, left_over + rank)
    return index, own
