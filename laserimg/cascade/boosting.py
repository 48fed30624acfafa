"""The four kinds of boosting: how samples are weighed, and what a leaf answers.

Each round fits a tree by weighted least squares to targets; the kinds differ in weights, targets and leaves
(Friedman, Hastie and Tibshirani, "Additive logistic regression", Annals of Statistics 28(2), 2000,
doi:10.1214/aos/1016218223).
"""

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from laserimg.cascade.model import Tree
from laserimg.cascade.search import Search
from laserimg.cascade.splits import Split

Kind = Literal["gentle", "real", "discrete", "logit"]
KINDS: tuple[Kind, ...] = ("gentle", "real", "discrete", "logit")
Floats = NDArray[np.float64]

# Logit targets grow without limit as a sample is learnt; OpenCV cuts them at 10, the paper at 2 to 4.
_LARGEST_TARGET = 4.0
_LEAST_SHARE = 1e-5


def working_sample(kind: Kind, labels: Floats, scores: Floats) -> tuple[Floats, Floats]:
    """Return the weights, which sum to 1, and the targets of the next round.

    Parameters
    ----------
    kind : str
    labels : (n,)
        -1 or 1.
    scores : (n,)
        The sum of the trees so far.
    """
    if kind == "logit":
        share = 1 / (1 + np.exp(-2 * scores))
        weights = np.maximum(share * (1 - share), 1e-12)
        targets = np.clip(((labels + 1) / 2 - share) / weights, -_LARGEST_TARGET, _LARGEST_TARGET)
    else:
        weights, targets = np.exp(-labels * scores), labels
    return weights / weights.sum(), targets


def trimmed(weights: Floats, rate: float) -> Floats:
    """Return the weights with the smallest ones set to 0 that together hold no more than 1 - rate of all."""
    if rate >= 1:
        return weights
    ascending = np.sort(weights)
    least = ascending[np.searchsorted(np.cumsum(ascending), (1 - rate) * weights.sum())]
    return np.where(weights >= least, weights, 0.0)


def grow_tree(
    kind: Kind, search: Search, weights: Floats, targets: Floats, depth: int
) -> tuple[Tree, NDArray[np.int64]] | None:
    """Return a tree fitted to the targets and the leaf of every sample, or none if no feature helps.

    Differs from OpenCV in the criterion for the splits of Real (Gini) and Discrete (misclassification):
    least squares, which for targets of -1 and 1 is the same as Gini.
    """
    splits: list[Split] = []
    children: list[list[int]] = []
    leaf_of = np.zeros(len(weights), np.int64)
    leaves = 0
    # Breadth first, as OpenCV numbers the nodes.
    waiting = [(np.ones(len(weights), bool), 0, -1, 0)]
    while waiting:
        here, level, parent, side = waiting.pop(0)
        split = search.best(weights * here, targets) if level < depth else None
        if split is None:
            if parent < 0:
                return None
            children[parent][side] = -leaves
            leaf_of[here] = leaves
            leaves += 1
            continue
        if parent >= 0:
            children[parent][side] = len(splits)
        waiting += [
            (here & split.left, level + 1, len(splits), 0),
            (here & ~split.left, level + 1, len(splits), 1),
        ]
        splits.append(split)
        children.append([0, 0])
    answers = leaf_answers(kind, weights, targets, leaf_of, leaves)
    return _tree(splits, children, answers), leaf_of


def leaf_answers(
    kind: Kind, weights: Floats, targets: Floats, leaf_of: NDArray[np.int64], leaves: int
) -> NDArray[np.float32]:
    """Return what each leaf adds to the score, float32 as the detector reads it."""
    mass = np.bincount(leaf_of, weights, leaves)
    mean = np.bincount(leaf_of, weights * targets, leaves) / np.maximum(mass, 1e-30)
    if kind == "real":
        share = np.clip((mean + 1) / 2, _LEAST_SHARE, 1 - _LEAST_SHARE)
        mean = np.log(share / (1 - share)) / 2
    elif kind == "discrete":
        side = np.where(mean >= 0, 1.0, -1.0)
        error = np.clip(
            weights[side[leaf_of] != targets].sum() / weights.sum(), _LEAST_SHARE, 1 - _LEAST_SHARE
        )
        mean = side * np.log((1 - error) / error) / 2
    elif kind == "logit":
        mean = mean / 2
    return mean.astype(np.float32)


def _tree(splits: list[Split], children: list[list[int]], answers: NDArray[np.float32]) -> Tree:
    return Tree(
        features=np.array([split.feature for split in splits], np.int64),
        thresholds=np.array([split.threshold for split in splits], np.float32),
        subsets=np.stack([split.subset for split in splits]),
        children=np.array(children, np.int64),
        leaves=answers,
    )
