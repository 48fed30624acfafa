"""Training boosted trees over numbers, with the boosting of the cascades."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from laserimg.cascade.boosting import grow_tree, trimmed, working_sample
from laserimg.cascade.histograms import HAAR, Binned
from laserimg.cascade.model import Tree
from laserimg.cascade.splits import Split, best_threshold
from laserimg.detectors.boosted_trees import LEAVES, NODES, BoostedTrees
from laserimg.scan import Float32Array

ROUNDS, DEPTH = 200, 2
# Each tree counts for less than it says, so that those after it can disagree.
SHRINKAGE = 0.2
# Samples that together hold so little of the weight are left out of a round.
_TRIM = 0.99
# Numbers whose splits are found exactly, after the histograms.
_FINALISTS = 4
# Places of bins are quantiles of every seventh sample.
_EVERY = 7


@dataclass(frozen=True, eq=False, slots=True)
class NumberSearch:
    """Finds the number that best divides weighted samples (`laserimg.cascade.search.Search`).

    Parameters
    ----------
    numbers : (d, n) array of float32
    table : Binned
        The same, in bins.
    """

    numbers: Float32Array
    table: Binned

    @classmethod
    def of(cls, vectors: Float32Array, positive: NDArray[np.bool_]) -> "NumberSearch":
        """Sort vectors (n, d) into bins."""
        numbers = np.ascontiguousarray(vectors.T)
        shares = np.linspace(0, 1, HAAR.bins + 1)[1:-1]
        codes = np.empty(numbers.shape, np.uint8)
        for row, code in zip(numbers, codes, strict=True):
            edges = np.unique(np.quantile(row[::_EVERY], shares))
            code[:] = np.searchsorted(edges, row, side="right")
        codes += np.uint8(HAAR.bins) * positive
        return cls(numbers, Binned.of(codes, HAAR))

    def best(self, weights: NDArray[np.float64], targets: NDArray[np.float64]) -> Split | None:
        """Return the best split; exact among the finalists of the histograms."""
        gains = self.table.gains(weights, targets)
        finalists = np.sort(np.argsort(-gains, kind="stable")[:_FINALISTS])
        return best_threshold(finalists, self.numbers[finalists], weights, targets)


def fit_trees(vectors: Float32Array, positive: NDArray[np.bool_], rounds: int = ROUNDS) -> BoostedTrees:
    """Return trees by Gentle AdaBoost whose sum is above 0 for positive samples.

    J. Friedman, T. Hastie and R. Tibshirani, "Additive logistic regression", Annals of Statistics 28(2),
    2000, doi:10.1214/aos/1016218223; with shrinkage (J. Friedman, "Greedy function approximation", Annals of
    Statistics 29(5), 2001, doi:10.1214/aos/1013203451, section 5).

    Parameters
    ----------
    vectors : (n, d) array of float32
    positive : (n,) array of bool
    rounds : int
        Trees; fewer if no number tells the samples apart any more.
    """
    search = NumberSearch.of(vectors, positive)
    labels = np.where(positive, 1.0, -1.0)
    scores = np.zeros(len(labels))
    trees: list[Tree] = []
    for _ in range(rounds):
        weights, targets = working_sample("gentle", labels, scores)
        grown = grow_tree("gentle", search, trimmed(weights, _TRIM), targets, DEPTH)
        if grown is None:
            break
        tree, leaf_of = grown
        scores += SHRINKAGE * tree.leaves[leaf_of]
        trees.append(tree)
    return _complete(trees)


def _complete(trees: list[Tree]) -> BoostedTrees:
    """The trees with three questions each; where there is none, all go left."""
    features = np.zeros((len(trees), NODES), np.int32)
    thresholds = np.full((len(trees), NODES), np.inf, np.float32)
    answers = np.zeros((len(trees), LEAVES), np.float32)
    for tree, feature, threshold, answer in zip(trees, features, thresholds, answers, strict=True):
        feature[0], threshold[0] = tree.features[0], tree.thresholds[0]
        for side, child in enumerate(tree.children[0]):
            if child > 0:
                feature[1 + side], threshold[1 + side] = tree.features[child], tree.thresholds[child]
                answer[2 * side : 2 * side + 2] = tree.leaves[-tree.children[child]]
            else:
                answer[2 * side] = tree.leaves[-child]
    return BoostedTrees(features, thresholds, answers * np.float32(SHRINKAGE))
