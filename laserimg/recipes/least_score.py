"""From which score on detections of a class count: few false ones are left on scans new to its detector."""

from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np

from laserimg.cascade.folder import one_thread
from laserimg.recipes.measuring import Found, Sent, accepted_by, matched, sent
from laserimg.recipes.observation import killed, observed
from laserimg.recipes.recipe import Recipe
from laserimg.recipes.scans import TrainingScan
from laserimg.rules.model import ClassRules
from laserimg.workers import in_order

# Two a scan in all, in equal parts of nine classes.
FALSE_PER_SCAN = 2 / 9
# Scores that are tried, in hundredths.
TRIED = range(5, 100, 5)


def least_score(
    recipe: Recipe,
    models: list[Path],
    rules: ClassRules,
    scans: list[TrainingScan],
    jobs: int,
    tell: Callable[[int], None] = lambda done: None,
) -> float:
    """Return the least of 0.05, 0.10 ... 0.95 above which at most `FALSE_PER_SCAN` are false.

    Parameters
    ----------
    recipe : Recipe
    models : list of Path
        Cascades and second stage, whose scores are chances.
    rules : ClassRules
        With the checks; their own score is not asked.
    scans : list of TrainingScan
        On which nothing was trained.
    jobs : int
    """
    parts = in_order(partial(_found, recipe, tuple(models), sent(rules)), scans, jobs, _died, tell)
    return chosen(np.concatenate([part.scores[~part.hits] for part in parts]), len(parts))


def chosen(false_scores: np.ndarray, scans: int) -> float:
    """Return the least score, given those of all that is false in so many scans.

    Examples
    --------
    >>> chosen(np.array([0.9, 0.4, 0.33, 0.2]), scans=9)
    0.35
    """
    few = (hundredths / 100 for hundredths in TRIED)
    return next(
        (one for one in few if (false_scores > one).sum() <= FALSE_PER_SCAN * scans), max(TRIED) / 100
    )


def _found(recipe: Recipe, models: tuple[Path, ...], rules: Sent, scan: TrainingScan) -> Found:
    asked, ignored = scan.objects(recipe)
    with one_thread():
        evidence = observed(scan.path)
        found = accepted_by(models, rules, evidence)
    width = evidence.scan.shape[1] if evidence.scan.wraps else None
    return matched(found, asked, ignored, width)


def _died(scan: TrainingScan) -> Found:
    raise killed(scan)
