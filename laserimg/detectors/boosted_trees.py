"""Boosted trees of a few questions each, over vectors of numbers."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from laserimg.scan import Float32Array

# No tree asks more questions on the way to an answer.
MAX_DEPTH = 8


@dataclass(frozen=True, eq=False, slots=True)
class BoostedTrees:
    """A sum of complete trees: each asks as many questions on the way to every answer.

    Parameters
    ----------
    features : (trees, 2**depth - 1) array of int32
        Which number each node asks for, level by level: the children of node i are 2 i + 1 and 2 i + 2.
    thresholds : (trees, 2**depth - 1) array of float32
        Numbers below go left.
    answers : (trees, 2**depth) array of float32
        Of the leaves, from left to right.

    Raises
    ------
    ValueError
        If the arrays do not fit each other.

    Examples
    --------
    >>> trees = BoostedTrees(
    ...     np.int32([[0, 1, 1]]), np.float32([[0, 5, 7]]), np.float32([[1, 2, 3, 4]])
    ... )
    >>> trees(np.float32([[-1, 4], [-1, 5], [0, 6], [0, 7]])).tolist()
    [1.0, 2.0, 3.0, 4.0]
    """

    features: NDArray[np.int32]
    thresholds: Float32Array
    answers: Float32Array

    def __post_init__(self) -> None:
        trees, leaves = self.answers.shape
        nodes = trees, leaves - 1
        if self.features.shape != nodes or self.thresholds.shape != nodes or leaves != 2**self.depth:
            shapes = self.features.shape, self.thresholds.shape, self.answers.shape
            raise ValueError(f"trees have 2**depth - 1 questions and 2**depth answers each, not {shapes}")

    @property
    def depth(self) -> int:
        """Questions on the way to an answer, at most `MAX_DEPTH`."""
        return min(self.answers.shape[1].bit_length() - 1, MAX_DEPTH)

    def __call__(self, vectors: Float32Array) -> NDArray[np.float64]:
        """Return the sum of the answers (n,) to vectors (n, d)."""
        tree, row = np.arange(len(self.features)), np.arange(len(vectors))[:, None]
        node = np.zeros((len(vectors), len(self.features)), np.intp)
        for _ in range(self.depth):
            right = vectors[row, self.features[tree, node]] >= self.thresholds[tree, node]
            node = 2 * node + 1 + right
        leaf = node - self.features.shape[1]
        return self.answers[tree, leaf].sum(axis=1, dtype=np.float64)
