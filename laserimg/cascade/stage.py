"""Training one stage: add trees until enough negatives fail while enough positives pass."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from laserimg.cascade.boosting import KINDS, Kind, grow_tree, trimmed, working_sample
from laserimg.cascade.model import Stage, Tree
from laserimg.cascade.search import Search
from laserimg.errors import ConfigError


@dataclass(frozen=True)
class StageGoal:
    """What a stage must reach and how it is boosted.

    Attributes
    ----------
    min_hit_rate, max_false_alarm : float
        Shares of the stage's own positives and negatives.
    boost : "gentle" | "real" | "discrete" | "logit"
    depth : int
        Questions in a row a tree may ask; 1 makes stumps.
    trim : float
        Share of the weight that a round looks at; the samples of least weight are left out of it.
    max_trees : int
        A stage ends with these many trees even if it has not reached its goal.
    """

    min_hit_rate: float = 0.995
    max_false_alarm: float = 0.5
    boost: Kind = "gentle"
    depth: int = 1
    trim: float = 1.0
    max_trees: int = 100

    def __post_init__(self) -> None:
        for name in ("min_hit_rate", "max_false_alarm", "trim"):
            if not 0 < getattr(self, name) <= 1:
                raise ConfigError(f"{name} must be above 0 and at most 1, got {getattr(self, name)}")
        if self.boost not in KINDS:
            raise ConfigError(f"boost must be one of {', '.join(KINDS)}, got {self.boost}")
        if self.depth < 1 or self.max_trees < 1:
            raise ConfigError("depth and max_trees must be 1 or more")


@dataclass(frozen=True)
class Progress:
    """After a tree: how many there are, and what of the stage's samples passes at its threshold."""

    trees: int
    hit_rate: float
    false_alarm: float


def train_stage(
    search: Search,
    positive: NDArray[np.bool_],
    goal: StageGoal,
    tell: Callable[[Progress], None] = lambda progress: None,
) -> tuple[Stage, Progress]:
    """Return a stage that reaches the goal on the samples the search looks at.

    Parameters
    ----------
    search : Search
    positive : (samples,) bool
    goal : StageGoal
    tell : function
        Called after every tree.

    Raises
    ------
    ConfigError
        If no feature tells the positives from the negatives.
    """
    labels = np.where(positive, 1.0, -1.0)
    scores = np.zeros(len(labels))
    trees: list[Tree] = []
    while True:
        weights, targets = working_sample(goal.boost, labels, scores)
        grown = grow_tree(goal.boost, search, trimmed(weights, goal.trim), targets, goal.depth)
        if grown is None and not trees:
            raise ConfigError("no feature tells the positives from the negatives: are they the same images?")
        if grown is not None:
            tree, leaf_of = grown
            trees.append(tree)
            scores += tree.leaves[leaf_of]
        stage = Stage(tuple(trees), _threshold(scores[positive], goal.min_hit_rate))
        passed = stage.passed(scores)
        progress = Progress(len(trees), float(passed[positive].mean()), float(passed[~positive].mean()))
        tell(progress)
        if grown is None or progress.false_alarm <= goal.max_false_alarm or len(trees) == goal.max_trees:
            return stage, progress


def _threshold(sums: NDArray[np.float64], min_hit_rate: float) -> np.float32:
    # As opencv_traincascade the highest that enough positives reach, but with one standard deviation of the
    # count in reserve: the rate is meant for objects not seen yet, and is less for them than for these.
    expected = (1 - min_hit_rate) * len(sums)
    missed = max(0, int(expected - np.sqrt(expected * min_hit_rate)))
    lowest = np.partition(sums, missed)[missed]
    threshold = np.float32(lowest)
    return threshold if threshold <= lowest else np.nextafter(threshold, np.float32(-np.inf))
