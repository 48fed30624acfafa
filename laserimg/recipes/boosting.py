"""Training boosted trees over numbers."""

import numpy as np
from numpy.typing import NDArray

from laserimg.detectors.boosted_trees import BoostedTrees
from laserimg.scan import Float32Array

# On wastebaskets, office chairs and doors 600 trees of half the step, or of 31 leaves, were no better.
ROUNDS, DEPTH, STEP = 300, 4, 0.1
# Pulls the answers to 0.
_RIDGE = 1.0


def fit_trees(vectors: Float32Array, positive: NDArray[np.bool_], rounds: int = ROUNDS) -> BoostedTrees:
    """Return trees whose sum is larger for positive samples.

    Gradient boosting of the logistic loss on histograms (J. Friedman, "Greedy function approximation", Annals
    of Statistics 29(5), 2001, doi:10.1214/aos/1013203451) by scikit-learn; what runs, and is kept, are the
    arrays of `BoostedTrees`. Differs in that the sum has no constant: what it means is learnt later.

    Parameters
    ----------
    vectors : (n, d) array of float32
    positive : (n,) array of bool
    rounds : int
        Trees.
    """
    from sklearn.ensemble import HistGradientBoostingClassifier  # seconds that runs do not need

    machine = HistGradientBoostingClassifier(
        learning_rate=STEP,
        max_iter=rounds,
        max_depth=DEPTH,
        max_leaf_nodes=2**DEPTH,
        l2_regularization=_RIDGE,
        early_stopping=False,  # type: ignore[arg-type]
        random_state=0,
    ).fit(vectors, positive)
    # There is no public way to the trees; a test compares their sum with the machine's own.
    trees = [_complete(tree.nodes) for (tree,) in machine._predictors]
    features, thresholds, answers = (np.stack(parts) for parts in zip(*trees, strict=True))
    return BoostedTrees(features, thresholds, answers)


def _complete(nodes: NDArray) -> tuple[NDArray[np.int32], Float32Array, Float32Array]:
    """A tree of scikit-learn as a complete one: below a leaf no number is too large to go left."""
    features = np.zeros(2**DEPTH - 1, np.int32)
    thresholds = np.full(2**DEPTH - 1, np.inf, np.float32)
    answers = np.zeros(2**DEPTH, np.float32)
    waiting = [(0, 0)]
    while waiting:
        place, number = waiting.pop()
        node = nodes[number]
        if node["is_leaf"]:
            while place < len(features):
                place = 2 * place + 1
            answers[place - len(features)] = node["value"]
        else:
            features[place], thresholds[place] = node["feature_idx"], _above(node["num_threshold"])
            waiting += [(2 * place + 1, node["left"]), (2 * place + 2, node["right"])]
    return features, thresholds, answers


def _above(limit: float) -> np.float32:
    """The least number of 32 bits above a limit: what is not above it goes left."""
    nearest = np.float32(limit)
    return nearest if float(nearest) > limit else np.nextafter(nearest, np.float32(np.inf))
