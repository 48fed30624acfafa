"""The decision values of one machine for objects that it was not trained on, one left out at a time."""

import numpy as np
from numpy.typing import NDArray

from laserimg.classify.svm import Array, binary_machine

# How far a margin may be off, as that of the solver.
_TOLERANCE = 1e-3
_ZERO = 1e-9


def left_out_decisions(kernel: Array, positive: NDArray[np.bool_], cost: float) -> Array:
    """Return the decision value (n,) of every object by the machine of all others.

    An object that is no support vector has no part in the machine of all: that is the machine without
    it. For one whose weight is between 0 and `cost`, the linear equations of the other such
    weights are solved without it, all at once from one inverse; the solution is the machine without
    it if it keeps every condition of the optimum, which is checked. Else the machine is trained anew.

    Parameters
    ----------
    kernel : (n, n) array
        Products of the objects.
    positive : (n,) array of bool
    cost : float

    Notes
    -----
    One step of G. Cauwenberghs and T. Poggio, "Incremental and decremental support vector machine
    learning", 2000; where it takes several, training anew is as fast.
    """
    alpha, bias = binary_machine(kernel, positive, cost)
    decision = kernel @ alpha + bias
    free = np.flatnonzero((np.abs(alpha) > _ZERO) & (np.abs(alpha) < cost - _ZERO))
    held, values = _without_each(kernel, np.where(positive, 1.0, -1.0), alpha, free, cost)
    decision[free[held]] = values[held]
    everything = np.arange(len(kernel))
    for index in np.setdiff1d(np.flatnonzero(alpha), free[held]):
        rest = np.delete(everything, index)
        decision[index] = decided(kernel, rest, everything[index : index + 1], positive, cost)[0]
    return decision


def decided(kernel: Array, train: NDArray, test: NDArray, positive: NDArray[np.bool_], cost: float) -> Array:
    """Train on some objects and return the decision values of others."""
    if positive[train].all() or not positive[train].any():
        # A fold may leave no object of a small class, or of any other.
        return np.full(len(test), 1.0 if positive[train].any() else -1.0)
    alpha, bias = binary_machine(kernel[np.ix_(train, train)], positive[train], cost)
    return kernel[np.ix_(test, train)] @ alpha + bias


def _without_each(
    kernel: Array, sign: Array, alpha: Array, free: NDArray[np.intp], cost: float
) -> tuple[NDArray[np.bool_], Array]:
    """Solve without each free object in turn.

    Returns
    -------
    held : (f,) array of bool
        Whether the solution keeps the conditions of the optimum.
    values : (f,) array
        The decision value of the object left out.
    """
    bound = np.flatnonzero(np.abs(alpha) >= cost - _ZERO)
    fixed = kernel[:, bound] @ alpha[bound]
    try:
        solution = _solutions(kernel[np.ix_(free, free)], sign[free] - fixed[free], -alpha[bound].sum())
    except np.linalg.LinAlgError:  # two equal objects
        return np.zeros(len(free), np.bool_), np.zeros(len(free))
    weight = solution[:-1] * sign[free][:, None]
    kept = (weight >= -_ZERO) & (weight <= cost)
    np.fill_diagonal(kept, True)
    decision = kernel[:, free] @ solution[:-1] + fixed[:, None] + solution[-1]
    margin = decision * sign[:, None]
    zero = np.setdiff1d(np.arange(len(kernel)), np.concatenate([free, bound]))
    held = kept.all(axis=0) & (margin[zero] >= 1 - _TOLERANCE).all(axis=0)
    held &= (margin[bound] <= 1 + _TOLERANCE).all(axis=0)
    return held, decision[free, np.arange(len(free))]


def _solutions(kernel: Array, wanted: Array, sum_wanted: float) -> Array:
    """Return weights and bias (f + 1, f) of the free objects, column i those without object i."""
    system = np.ones((len(kernel) + 1, len(kernel) + 1))
    system[:-1, :-1], system[-1, -1] = kernel, 0.0
    inverse = np.linalg.inv(system)
    whole = inverse @ np.append(wanted, sum_wanted)
    return whole[:, None] - inverse[:, :-1] * (whole[:-1] / np.diagonal(inverse)[:-1])
