"""How well objects are classified that were not trained on: leave-one-out and repeated k-fold."""

import warnings

import numpy as np
from numpy.typing import NDArray

from laserimg.classify.svm import Array, C, binary_machine
from laserimg.errors import ConfigError

Labels = NDArray[np.str_]


def leave_one_out(vectors: NDArray, labels: Labels, cost: float = C) -> Array:
    """Return the decision values (n, k) of every object, from machines trained without it.

    Exact: an object that is no support vector has no part in the machine of all objects, which
    therefore is the machine without it; for the others the machine is trained anew. All are trained
    on the (n, n) products of the objects, computed once.

    Parameters
    ----------
    vectors : (n, d) array
    labels : (n,) array of str
    cost : float

    Returns
    -------
    (n, k) array
        Columns in the order of the sorted classes.

    Raises
    ------
    ConfigError
        If there are fewer than two classes, or a class has only one object.
    """
    classes, kernel = _prepared(vectors, labels, 2)
    decisions = np.empty((len(labels), len(classes)))
    for column, name in enumerate(classes):
        decisions[:, column] = _left_out(kernel, labels == name, cost)
    return decisions


def repeated_folds(
    vectors: NDArray,
    labels: Labels,
    folds: int = 5,
    repeats: int = 5,
    cost: float = C,
) -> list[Array]:
    """Return the decision values (n, k) of every object for each of several divisions into folds.

    Every fold has the classes in their shares; divisions are drawn with seeds 0, 1, ...

    Parameters
    ----------
    vectors : (n, d) array
    labels : (n,) array of str
    folds, repeats : int
    cost : float

    Raises
    ------
    ConfigError
        If a class has fewer objects than 2, or there are fewer than 2 folds.
    """
    from sklearn.model_selection import StratifiedKFold

    if folds < 2:
        raise ConfigError(f"needs at least 2 folds, got {folds}")
    classes, kernel = _prepared(vectors, labels, 2)
    folds = min(folds, int(np.unique(labels, return_counts=True)[1].max()))
    results = []
    for repeat in range(repeats):
        decisions = np.empty((len(labels), len(classes)))
        split = StratifiedKFold(folds, shuffle=True, random_state=repeat)
        with warnings.catch_warnings():
            # A class with fewer objects than folds is missing in some of the folds: fine.
            warnings.filterwarnings("ignore", "The least populated class", UserWarning)
            parts = list(split.split(labels, labels))
        for train, test in parts:
            for column, name in enumerate(classes):
                decisions[test, column] = _decided(kernel, train, test, labels == name, cost)
        results.append(decisions)
    return results


def predicted(decisions: Array, labels: Labels) -> Labels:
    """Return the class with the highest decision value."""
    return np.unique(labels)[decisions.argmax(axis=1)]


def _prepared(vectors: NDArray, labels: Labels, least: int) -> tuple[Labels, Array]:
    classes, counts = np.unique(labels, return_counts=True)
    if len(classes) < 2:
        raise ConfigError(f"needs objects of at least 2 classes, got {len(classes)}")
    if counts.min() < least:
        few = classes[int(counts.argmin())]
        raise ConfigError(f"class {few} has only {int(counts.min())} object; at least {least} are needed")
    values = np.asarray(vectors, np.float64)
    return classes, values @ values.T


def _left_out(kernel: Array, positive: NDArray[np.bool_], cost: float) -> Array:
    alpha, bias = binary_machine(kernel, positive, cost)
    decision = kernel @ alpha + bias
    everything = np.arange(len(kernel))
    for index in np.flatnonzero(alpha):
        rest = np.delete(everything, index)
        decision[index] = _decided(kernel, rest, everything[index : index + 1], positive, cost)[0]
    return decision


def _decided(kernel: Array, train: NDArray, test: NDArray, positive: NDArray[np.bool_], cost: float) -> Array:
    """Train on some objects and return the decision values of others."""
    if not positive[train].any():
        return np.full(len(test), -1.0)  # a fold may leave no object of a small class
    alpha, bias = binary_machine(kernel[np.ix_(train, train)], positive[train], cost)
    return kernel[np.ix_(test, train)] @ alpha + bias
