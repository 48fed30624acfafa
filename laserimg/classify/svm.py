"""A linear support vector machine, one class against the rest, trained on the kernel of the objects.

Importing this imports scikit-learn; using a trained model (`laserimg.classify.model`) does not.
"""

from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.base import BaseEstimator, ClassifierMixin
from sklearn.svm import SVC
from sklearn.utils.multiclass import check_classification_targets
from sklearn.utils.validation import check_is_fitted, validate_data

Array = NDArray[np.float64]

# The kernel of vectors of length 1 has diagonal 1; much smaller values lose up to 16 points.
C = 10.0
# Finer than scikit-learn's, so that leaving out an object that is no support vector changes nothing.
_TOLERANCE = 1e-4


class LinearClassifier(ClassifierMixin, BaseEstimator):
    """Linear SVM for few objects with many numbers each, as a scikit-learn estimator.

    The objects, rotated into the space that they span, are at most as many numbers as there are
    objects: their (n, n) products say all that a linear SVM needs, so 15876 numbers cost no more than 490.

    Parameters
    ----------
    C : float
        Cost of an error; rows of X should have a length of about 1.

    Attributes
    ----------
    classes_ : (k,) array
    weights_ : (k, d) array
        Of each class against the rest.
    bias_ : (k,) array

    Examples
    --------
    >>> X = [[0, 1], [0.1, 1], [1, 0], [1, 0.1]]
    >>> LinearClassifier().fit(X, ["tree", "tree", "car", "car"]).predict([[0.9, 0.2]]).tolist()
    ['car']
    """

    def __init__(self, C: float = C) -> None:
        self.C = C

    def fit(self, X: ArrayLike, y: ArrayLike) -> Self:
        """Train on objects X (n, d) of classes y (n,)."""
        checked: Any = validate_data(self, X, y, dtype=np.float64)  # type: ignore[arg-type]
        X, y = checked
        check_classification_targets(y)
        self.classes_, place = np.unique(y, return_inverse=True)
        if len(self.classes_) < 2:
            raise ValueError(f"needs objects of at least 2 classes, got 1 class: {self.classes_[0]!r}")
        objects = np.asarray(X, np.float64)
        kernel = objects @ objects.T
        machines = [binary_machine(kernel, place == index, self.C) for index in range(len(self.classes_))]
        self.weights_ = np.stack([alpha @ objects for alpha, _ in machines])
        self.bias_ = np.array([bias for _, bias in machines])
        return self

    def decision_function(self, X: ArrayLike) -> Array:
        """Return how far objects are on the side of each class, (n, k); (n,) for two classes."""
        check_is_fitted(self)
        objects: Any = validate_data(self, X, dtype=np.float64, reset=False)  # type: ignore[arg-type]
        decision = objects @ self.weights_.T + self.bias_
        return decision[:, 1] if len(self.classes_) == 2 else decision

    def predict(self, X: ArrayLike) -> NDArray:
        """Return the class (n,) of every object."""
        decision = self.decision_function(X)
        best = (decision > 0).astype(int) if decision.ndim == 1 else decision.argmax(axis=1)
        return self.classes_[best]


def binary_machine(kernel: Array, positive: NDArray[np.bool_], cost: float = C) -> tuple[Array, float]:
    """Train one class against the rest.

    Parameters
    ----------
    kernel : (n, n) array
        Products of the objects.
    positive : (n,) array of bool
        Objects of the class.
    cost : float

    Returns
    -------
    alpha : (n,) array
        Signed weights of the objects; not 0 for the support vectors.
    bias : float
    """
    machine = SVC(kernel="precomputed", C=cost, tol=_TOLERANCE).fit(kernel, positive)
    alpha = np.zeros(len(kernel))
    alpha[machine.support_] = machine.dual_coef_[0]
    return alpha, float(machine.intercept_[0])
