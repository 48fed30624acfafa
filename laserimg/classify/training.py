"""Training a classifier of objects from their descriptions. Imports scikit-learn."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from laserimg.classify.model import ObjectModel, softmax
from laserimg.classify.recipe import Recipe
from laserimg.classify.svm import Array, LinearClassifier
from laserimg.classify.validation import Labels, leave_one_out

# Objects left out that are all right would make confidences of 1.
_MAX_SHARPNESS = 20.0


@dataclass(frozen=True, eq=False, slots=True)
class Trained:
    """A model and the decision values (n, k) of every object from a machine trained without it."""

    model: ObjectModel
    left_out: Array


def train(vectors: NDArray, labels: Labels, recipe: Recipe, margin: float = 0.0) -> Trained:
    """Train a classifier on described objects.

    Parameters
    ----------
    vectors : (n, d) array
        Of `laserimg.classify.recipe`.
    labels : (n,) array of str
    recipe : Recipe
        How the objects were described.
    margin : float
        See `ObjectModel`.

    Raises
    ------
    ConfigError
        If there are fewer than two classes, or a class has only one object.
    """
    left_out = leave_one_out(vectors, labels)
    machine = LinearClassifier().fit(vectors, labels)
    names = tuple(str(name) for name in machine.classes_)
    weights, bias = (np.asarray(part, np.float32) for part in (machine.weights_, machine.bias_))
    model = ObjectModel(names, weights, bias, recipe, sharpness(left_out, labels), margin)
    return Trained(model, left_out)


def sharpness(decisions: Array, labels: Labels) -> float:
    """Return the factor that makes the softmax of decision values the most likely for the true classes."""
    truth = np.unique(labels, return_inverse=True)[1]
    rows = np.arange(len(labels))

    def unlikely(factor: float) -> float:
        return -float(np.log(np.maximum(softmax(decisions * factor)[rows, truth], 1e-12)).mean())

    found: Any = minimize_scalar(unlikely, bounds=(0.1, _MAX_SHARPNESS), method="bounded")
    return float(found.x)
