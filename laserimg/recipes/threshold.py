"""What scores of a second stage mean: chances, learnt on scans that it was not trained on."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from laserimg.cascade.folder import one_thread
from laserimg.detectors.second_stage import SecondStage
from laserimg.evaluate.matching import match
from laserimg.pipeline import Finding
from laserimg.recipes.measuring import MIN_IOU, Sent, boxes_of, pipeline_of, sent
from laserimg.recipes.observation import killed, observed
from laserimg.recipes.recipe import Recipe
from laserimg.recipes.scans import TrainingScan
from laserimg.rules.checks import FAR_CHECKS
from laserimg.rules.model import ClassRules
from laserimg.workers import in_order

# What passing them is worth is not asked of these.
_NO_CHECKS = ("score", "suppression", *FAR_CHECKS)


@dataclass(frozen=True, eq=False, slots=True)
class Judged:
    """Candidates of some scans.

    Parameters
    ----------
    margins : (n,) array
    passed : (n,) array of bool
        All checks.
    hits : (n,) array of bool
        Which are of objects.
    """

    margins: NDArray[np.float64]
    passed: NDArray[np.bool_]
    hits: NDArray[np.bool_]


def with_chances(
    stage: SecondStage,
    models: list[Path],
    recipe: Recipe,
    rules: ClassRules,
    scans: list[TrainingScan],
    jobs: int,
    tell: Callable[[int], None] = lambda done: None,
) -> SecondStage:
    """Return the second stage with chances as scores, and with what passing the checks is worth.

    Parameters
    ----------
    stage : SecondStage
        As its file among the models holds it, with nothing for passed checks.
    models : list of Path
        Cascades and second stage.
    recipe : Recipe
    rules : ClassRules
        With the checks.
    scans : list of TrainingScan
    jobs : int
    """
    parts = in_order(partial(_judged, recipe, tuple(models), sent(rules)), scans, jobs, _died, tell)
    margins, passed, hits = (
        np.concatenate([getattr(part, name) for part in parts]) for name in ("margins", "passed", "hits")
    )
    if not hits.any() or hits.all():
        return stage
    slope, shift, odds = chances(margins, passed, hits)
    slopes = slope * stage.slope, slope * stage.lean
    return replace(stage, slope=slopes[0], lean=slopes[1], shift=slope * stage.shift + shift, passed=odds)


def chances(
    margins: NDArray[np.float64], passed: NDArray[np.bool_], hits: NDArray[np.bool_]
) -> tuple[float, float, float]:
    """Return slope, shift and odds: the log odds of a hit are ``slope * margin + shift + odds * passed``.

    The most likely ones (J. Platt 1999, by `fitted_odds`), with a slope and odds that are not negative.

    Examples
    --------
    >>> margins = np.array([-2, -1, 0, 1, 2, 3.0])
    >>> hits = np.array([False, False, True, False, True, True])
    >>> slope, shift, odds = chances(margins, np.zeros(6, bool), hits)
    >>> slope > 0, odds
    (True, 0.0)
    """
    numbers = np.stack([margins, passed.astype(np.float64)], axis=1)
    (slope, odds), shift = fitted_odds(numbers, hits, most=(50, 10))
    return slope, shift, odds


def fitted_odds(
    numbers: NDArray[np.float64], hits: NDArray[np.bool_], most: tuple[float, ...]
) -> tuple[tuple[float, ...], float]:
    """Return weights, none negative, and shift of the log odds of a hit: ``numbers @ weights + shift``.

    Logistic regression. A weak pull of the first weight to 1 keeps it finite when hits and others do not
    overlap.

    Parameters
    ----------
    numbers : (n, k) array
    hits : (n,) array of bool
    most : tuple of k floats
        The largest weights; the first is at least 0.05.
    """
    signs = np.where(hits, 1.0, -1.0)

    def loss(values: NDArray[np.float64]) -> float:
        log_odds = numbers @ values[:-1] + values[-1]
        return float(np.logaddexp(0, -signs * log_odds).sum() + 0.1 * (values[0] - 1) ** 2)

    first, *others = most
    bounds = [(0.05, first), *((0, one) for one in others), (-50, 50)]
    start = [1.0, *(0.0 for _ in others), 0.0]
    *weights, shift = minimize(loss, start, bounds=bounds, method="L-BFGS-B").x.tolist()
    return tuple(weights), shift


def _judged(recipe: Recipe, models: tuple[Path, ...], rules: Sent, scan: TrainingScan) -> Judged:
    asked, ignored = scan.objects(recipe)
    with one_thread():
        evidence = observed(scan.path)
        findings = pipeline_of(models, rules, False).judge(evidence)
    width = evidence.scan.shape[1] if evidence.scan.wraps else None
    scores = np.array([one.candidate.score for one in findings], np.float64)
    truth = np.concatenate([asked, ignored])
    ignore = np.arange(len(truth)) >= len(asked)
    found = match(boxes_of([one.box for one in findings]), scores, truth, ignore, MIN_IOU, width)
    counted = ~found.ignored
    passed = np.array([_passed(one) for one in findings], np.bool_)
    safe = np.clip(scores, 1e-9, 1 - 1e-9)
    return Judged(np.log(safe / (1 - safe))[counted], passed[counted], (found.truth >= 0)[counted])


def _passed(finding: Finding) -> bool:
    return all(check.passed for check in finding.checks if check.name not in _NO_CHECKS)


def _died(scan: TrainingScan) -> Judged:
    raise killed(scan)
