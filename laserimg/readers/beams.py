"""The steady spacing of beams, from angles measured with gaps."""

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

# Gaps of more steps than this say less about the step than they cost in certainty.
_MAX_GAP = 5
# Angles that lie on a lattice differ from it by less than this part of a step (rms).
_SHARP = 0.15


def usual_step(steps: FloatArray) -> float:
    """Return the step of a lattice from differences that are mostly one step, some of them several."""
    forward = np.abs(steps[steps != 0])
    step = float(np.median(forward))
    multiples = np.round(forward / step)
    near = (multiples >= 1) & (multiples <= _MAX_GAP) & (np.abs(forward - multiples * step) < _SHARP * step)
    return float(forward[near].sum() / multiples[near].sum()) if near.any() else step


def lattice_index(angles: FloatArray, step: float) -> tuple[NDArray[np.intp], bool]:
    """Return the number of every angle on the lattice that fits best, and whether it fits.

    Parameters
    ----------
    angles : (N,) array
    step : float
        A first estimate, in the unit of `angles`.
    """
    phase = float(np.angle(np.exp(2j * np.pi * angles / step).sum())) * step / (2 * np.pi)
    index = np.round((angles - phase) / step)
    for _ in range(3):
        centre = index.mean()
        spread = float(((index - centre) ** 2).sum())
        step = float(((index - centre) * angles).sum()) / spread if spread else step
        phase = float(angles.mean() - step * centre)
        index = np.round((angles - phase) / step)
    sharp = float(np.sqrt(((angles - phase - index * step) ** 2).mean())) < _SHARP * step
    return (index - index.min()).astype(np.intp), sharp
