"""A trained classifier of objects: read, written and used without scikit-learn."""

import io
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from laserimg.classify.recipe import Recipe
from laserimg.classify.scores import UNKNOWN
from laserimg.errors import ConfigError, LaserImgError, ModelError
from laserimg.files import atomic_write, read_bytes
from laserimg.readers.npz import load_arrays

FORMAT = 1
MAX_BYTES = 256 << 20
MAX_CLASSES = 1000


class Verdict(NamedTuple):
    """What an object is taken for, and how sure that is (0 to 1)."""

    label: str
    confidence: float


@dataclass(frozen=True, eq=False, slots=True)
class ObjectModel:
    """A linear classifier of objects with what it looks at.

    Parameters
    ----------
    labels : tuple of str
        Its k classes.
    weights : (k, d) array of float32
    bias : (k,) array of float32
    recipe : Recipe
    sharpness : float
        Confidences are the softmax of so many times the decision values; fitted to objects left out.
    margin : float
        An object whose best decision value is less than this above the second is "unknown".

    Raises
    ------
    ModelError
        If the numbers do not fit each other or are not finite.
    """

    labels: tuple[str, ...]
    weights: NDArray[np.float32]
    bias: NDArray[np.float32]
    recipe: Recipe
    sharpness: float = 1.0
    margin: float = 0.0

    def __post_init__(self) -> None:
        for name in ("weights", "bias"):
            array = np.ascontiguousarray(getattr(self, name), np.float32)
            array = array.view()
            array.setflags(write=False)
            object.__setattr__(self, name, array)
        count = len(self.labels)
        if not 2 <= count <= MAX_CLASSES or len(set(self.labels)) != count:
            raise ModelError(f"needs from 2 to {MAX_CLASSES} different classes, got {count}")
        if self.weights.shape != (count, self.recipe.length) or self.bias.shape != (count,):
            raise ModelError(
                f"weights must be ({count}, {self.recipe.length}) and bias ({count},), "
                f"got {self.weights.shape} and {self.bias.shape}"
            )
        numbers = (self.weights, self.bias, self.sharpness, self.margin)
        if not all(np.isfinite(part).all() for part in numbers):
            raise ModelError("the weights are not finite")
        if self.sharpness <= 0 or self.margin < 0:
            raise ModelError("sharpness must be above 0 and margin not below")

    def decide(self, vectors: NDArray) -> NDArray[np.float64]:
        """Return the decision values (n, k) of objects described by `recipe`, (n, d)."""
        return np.asarray(vectors, np.float64) @ self.weights.T.astype(np.float64) + self.bias

    def classify(self, vectors: NDArray, margin: float | None = None) -> list[Verdict]:
        """Return what objects are taken for; see `verdicts`."""
        decisions = self.decide(vectors)
        return verdicts(decisions, self.labels, self.sharpness, self.margin if margin is None else margin)


def verdicts(
    decisions: NDArray, labels: tuple[str, ...], sharpness: float = 1.0, margin: float = 0.0
) -> list[Verdict]:
    """Return class and confidence for decision values (n, k).

    Examples
    --------
    >>> verdicts(np.array([[1.0, -1.0], [0.1, 0.0]]), ("car", "tree"), margin=0.2)[1].label
    'unknown'
    """
    order = np.sort(decisions, axis=1)
    clear = order[:, -1] - order[:, -2] >= margin
    share = softmax(decisions * sharpness).max(axis=1)
    best = decisions.argmax(axis=1)
    return [
        Verdict(labels[index] if sure else UNKNOWN, float(confidence))
        for index, sure, confidence in zip(best, clear, share, strict=True)
    ]


def softmax(values: NDArray) -> NDArray[np.float64]:
    """Return exp(values) with rows scaled to sum 1."""
    powers = np.exp(values - values.max(axis=1, keepdims=True))
    return powers / powers.sum(axis=1, keepdims=True)


def save_model(path: Path, model: ObjectModel) -> None:
    """Write a model (.npz), whole or not at all."""
    head: dict[str, Any] = {
        "format": FORMAT,
        "labels": list(model.labels),
        "recipe": model.recipe.as_dict(),
        "sharpness": model.sharpness,
        "margin": model.margin,
    }
    buffer = io.BytesIO()
    text = np.frombuffer(json.dumps(head).encode(), np.uint8)
    np.savez_compressed(buffer, head=text, weights=model.weights, bias=model.bias)
    with atomic_write(path) as temporary:
        temporary.write_bytes(buffer.getvalue())


def load_model(path: Path) -> ObjectModel:
    """Read a model.

    Raises
    ------
    ModelError
        Naming the file, if it cannot be read, is no model, or holds values that are not finite.
    """
    try:
        arrays = load_arrays(read_bytes(path, MAX_BYTES))
        if not {"head", "weights", "bias"} <= arrays.keys():
            raise ModelError("not a model of laserimg classify: needs head, weights and bias")
        return _model(arrays)
    except (ModelError, ConfigError, LaserImgError) as error:
        raise ModelError(f"{path}: {error}") from error


def _model(arrays: dict[str, NDArray]) -> ObjectModel:
    try:
        head = json.loads(arrays["head"].astype(np.uint8).tobytes())
        if head["format"] != FORMAT:
            raise ModelError(f"has format {head['format']}, this version reads {FORMAT}")
        labels = tuple(str(label) for label in head["labels"])
        recipe = Recipe.from_dict(head["recipe"])
        numbers = float(head["sharpness"]), float(head["margin"])
    except (ValueError, KeyError, TypeError, OverflowError, RecursionError) as error:
        raise ModelError(f"its head is malformed: {error}") from error
    return ObjectModel(labels, arrays["weights"], arrays["bias"], recipe, *numbers)
