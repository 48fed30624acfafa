"""How well objects are classified that were not trained on: leave-one-out and repeated k-fold."""

import warnings

import numpy as np
from numpy.typing import NDArray

from laserimg.classify.left_out import decided, left_out_decisions
from laserimg.classify.scores import refuse_unknown
from laserimg.classify.svm import Array, C
from laserimg.errors import ConfigError

Labels = NDArray[np.str_]


def leave_one_out(vectors: NDArray, labels: Labels, cost: float = C) -> Array:
    """Return the decision values (n, k) of every object, from machines trained without it.

    Exact (see `laserimg.classify.left_out`). All machines are trained on the (n, n) products of the
    objects, computed once: the objects rotated into the space that they span.

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
        decisions[:, column] = left_out_decisions(kernel, labels == name, cost)
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
                decisions[test, column] = decided(kernel, train, test, labels == name, cost)
        results.append(decisions)
    return results


def given_folds(vectors: NDArray, labels: Labels, folds: NDArray[np.intp], cost: float = C) -> Array:
    """Return the decision values (n, k) of every object, from machines trained on the other folds.

    Parameters
    ----------
    vectors : (n, d) array
    labels : (n,) array of str
    folds : (n,) array of int
        The fold of every object.
    cost : float

    Raises
    ------
    ConfigError
        If there are fewer than two folds or classes, or a class has only one object.
    """
    numbers = np.unique(folds)
    if len(numbers) < 2:
        raise ConfigError(f"needs at least 2 folds, got {len(numbers)}")
    classes, kernel = _prepared(vectors, labels, 2)
    decisions = np.empty((len(labels), len(classes)))
    for number in numbers:
        train, test = np.flatnonzero(folds != number), np.flatnonzero(folds == number)
        for column, name in enumerate(classes):
            decisions[test, column] = decided(kernel, train, test, labels == name, cost)
    return decisions


def predicted(decisions: Array, labels: Labels) -> Labels:
    """Return the class with the highest decision value."""
    return np.unique(labels)[decisions.argmax(axis=1)]


def _prepared(vectors: NDArray, labels: Labels, least: int) -> tuple[Labels, Array]:
    classes, counts = np.unique(labels, return_counts=True)
    refuse_unknown(classes)
    if len(classes) < 2:
        raise ConfigError(f"needs objects of at least 2 classes, got {len(classes)}")
    if counts.min() < least:
        few = classes[int(counts.argmin())]
        raise ConfigError(
            f"class {few} has only {int(counts.min())} object; at least {least} are needed, "
            "or name the other classes with --classes"
        )
    values = np.asarray(vectors, np.float64)
    return classes, values @ values.T
