"""The exact best threshold of a feature, on weighted samples."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from laserimg.cascade.histograms import best_between, by_mean


@dataclass(frozen=True, eq=False, slots=True)
class Split:
    """A question about one feature that divides samples into left and right.

    Attributes
    ----------
    feature : int
        Its number in the pool.
    gain : float
        See `laserimg.cascade.histograms.gains`.
    threshold : float
        Haar: values below it go left.
    subset : (8,) int32
        LBP: codes whose bit is set go left.
    left : (samples,) bool
        Which samples go left, all samples, also those of weight 0.
    """

    feature: int
    gain: float
    threshold: float
    subset: NDArray[np.int32]
    left: NDArray[np.bool_]


NO_SUBSET = np.zeros(8, np.int32)


def best_threshold(
    numbers: NDArray[np.integer],
    values: NDArray[np.float32],
    weights: NDArray[np.float64],
    targets: NDArray[np.float64],
) -> Split | None:
    """Return the best split of samples by one of the features, or none if no feature tells samples apart.

    Parameters
    ----------
    numbers : (features,)
        The features' numbers in the pool; the lowest row wins a tie.
    values : (features, samples) float32
        As the detector computes them.
    weights, targets : (samples,)
        Samples of weight 0 take no part.

    Examples
    --------
    >>> values = np.float32([[1, 2, 3, 4], [1, 1, 1, 1]])
    >>> split = best_threshold(np.array([7, 8]), values, np.full(4, 0.25), np.array([-1.0, -1, 1, 1]))
    >>> split.feature, split.threshold, split.left.tolist()
    (7, 2.5, [True, True, False, False])
    """
    active = np.flatnonzero(weights)
    some = values[:, active]
    order = np.argsort(some, axis=1)
    ordered = np.take_along_axis(some, order, axis=1)
    mass = np.cumsum(weights[active][order], axis=1)
    moment = np.cumsum((weights * targets)[active][order], axis=1)
    gain = best_between(mass, moment)[:, :-1]
    gain[ordered[:, :-1] == ordered[:, 1:]] = -1
    if gain.size == 0 or gain.max() < 0:
        return None
    row, place = np.unravel_index(np.argmax(gain), gain.shape)
    threshold = _between(ordered[row, place], ordered[row, place + 1])
    left = values[row] < threshold
    return Split(int(numbers[row]), float(gain[row, place]), float(threshold), NO_SUBSET, left)


def _between(low: np.float32, high: np.float32) -> np.float32:
    # Half-way, so that trainer and detector agree; between neighbouring floats only the upper one divides.
    middle = np.float32((np.float64(low) + np.float64(high)) / 2)
    return middle if middle > low else high


def best_subset(
    numbers: NDArray[np.integer],
    codes: NDArray[np.uint8],
    weights: NDArray[np.float64],
    targets: NDArray[np.float64],
) -> Split | None:
    """Return the best split of samples by a set of codes of one of the features.

    Parameters
    ----------
    numbers : (features,)
        The features' numbers in the pool; the lowest row wins a tie.
    codes : (features, samples) uint8
    weights, targets : (samples,)
        Samples of weight 0 take no part. Codes that none of the others has go right.

    Examples
    --------
    >>> codes, targets = np.uint8([[9, 0, 9, 33]]), np.array([-1.0, 1, -1, -1])
    >>> split = best_subset(np.array([7]), codes, np.full(4, 0.25), targets)
    >>> split.subset.tolist(), split.left.tolist()
    ([512, 2, 0, 0, 0, 0, 0, 0], [True, False, True, True])
    """
    flat = (codes + (np.arange(len(codes)) * 256)[:, None]).ravel()

    def histogram(values: NDArray[np.float64]) -> NDArray[np.float64]:
        counts = np.bincount(flat, np.tile(values, len(codes)), 256 * len(codes))
        return counts.astype(np.float64).reshape(-1, 256)

    mass, moment = histogram(weights), histogram(weights * targets)
    order = by_mean(mass, moment)
    ordered = np.take_along_axis(mass, order, 1)
    gain = best_between(np.cumsum(ordered, 1), np.cumsum(np.take_along_axis(moment, order, 1), 1))[:, :-1]
    # A split needs bins with samples on both sides of it.
    gain[ordered[:, 1:] == 0] = -1
    if gain.max() < 0:
        return None
    row, place = np.unravel_index(np.argmax(gain), gain.shape)
    chosen = np.zeros(256, bool)
    chosen[order[row, : place + 1]] = True
    subset = np.packbits(chosen, bitorder="little").view("<i4").astype(np.int32)
    return Split(int(numbers[row]), float(gain[row, place]), 0.0, subset, chosen[codes[row]])
