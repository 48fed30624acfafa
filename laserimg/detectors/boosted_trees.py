"""Boosted trees of two questions over vectors of numbers."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from laserimg.scan import Float32Array

# Nodes of a tree: the first question, the one on its left, the one on its right.
NODES, LEAVES = 3, 4


@dataclass(frozen=True, eq=False, slots=True)
class BoostedTrees:
    """A sum of trees, each with two questions on the way to an answer.

    Parameters
    ----------
    features : (trees, 3) array of int32
        Which number each node asks for: the root, its left child, its right child.
    thresholds : (trees, 3) array of float32
        Numbers below go left.
    answers : (trees, 4) array of float32
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
        trees = len(self.features)
        shapes = self.features.shape, self.thresholds.shape, self.answers.shape
        if shapes != ((trees, NODES), (trees, NODES), (trees, LEAVES)):
            raise ValueError(f"trees have {NODES} questions and {LEAVES} answers each, not {shapes}")

    def __call__(self, vectors: Float32Array) -> NDArray[np.float64]:
        """Return the sum of the answers (n,) to vectors (n, d)."""
        right = vectors[:, self.features] >= self.thresholds
        leaf = np.where(right[..., 0], 2 + right[..., 2], right[..., 1].astype(np.intp))
        return self.answers[np.arange(len(self.features)), leaf].sum(axis=1, dtype=np.float64)
