"""Where a second stage says yes: chosen on scans that it was not trained on."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from laserimg.cascade.folder import one_cv2_thread
from laserimg.detectors.description import describe
from laserimg.detectors.second_stage import SecondStage, distinct
from laserimg.evaluate.matching import match
from laserimg.recipes.observation import killed, observed
from laserimg.recipes.recipe import Recipe
from laserimg.recipes.scans import TrainingScan
from laserimg.recipes.scoring import proposed_boxes
from laserimg.workers import unordered

MIN_IOU = 0.5


def with_threshold(
    stage: SecondStage,
    recipe: Recipe,
    cascades: list[Path],
    scans: list[TrainingScan],
    jobs: int,
    tell: Callable[[int], None] = lambda done: None,
) -> SecondStage:
    """Return the second stage with score 0.5 where F1 is best, and scores that are chances of being right."""
    work = partial(_judged, stage, recipe, tuple(cascades))
    parts, objects = [], 0
    for margins, hits, count in unordered(work, scans, jobs, _died):
        parts.append((margins, hits))
        objects += count
        tell(len(parts))
    margins, hits = (np.concatenate([part[i] for part in parts]) for i in (0, 1))
    if not hits.any():
        return stage
    bias = stage.bias - best_threshold(margins, hits, objects)
    return replace(stage, bias=bias, slope=_slope(margins + bias - stage.bias, hits))


def best_threshold(margins: NDArray[np.float64], hits: NDArray[np.bool_], objects: int) -> float:
    """Return the margin above which F1 is best.

    Examples
    --------
    >>> best_threshold(np.array([3.0, 1.0, 2.0]), np.array([True, False, True]), 2)
    1.5
    """
    order = np.argsort(-margins, kind="stable")
    true = np.cumsum(hits[order])
    best = int(np.argmax(2 * true / (objects + np.arange(1, len(true) + 1))))
    lower = margins[order[best + 1]] if best + 1 < len(order) else margins[order[best]] - 1
    return float(margins[order[best]] + lower) / 2


def _slope(margins: NDArray[np.float64], hits: NDArray[np.bool_]) -> float:
    """The slope of the logistic curve through 0.5 at 0 that explains hits and misses best."""
    signed = np.where(hits, margins, -margins)
    found = minimize_scalar(
        lambda log: float(np.logaddexp(0, -np.exp(log) * signed).sum()), bounds=(-3, 4), method="bounded"
    )
    return float(np.exp(found.x))  # type: ignore[attr-defined]


def _judged(
    stage: SecondStage, recipe: Recipe, cascades: tuple[Path, ...], scan: TrainingScan
) -> tuple[NDArray[np.float64], NDArray[np.bool_], int]:
    asked, ignored = scan.objects(recipe)
    with one_cv2_thread():
        evidence = observed(scan.path)
        boxes = proposed_boxes(evidence, cascades, recipe.regions)
        vectors = describe(evidence, boxes)
    margins = (vectors @ stage.weights).astype(np.float64) + stage.bias
    width = evidence.scan.shape[1] if evidence.scan.wraps else None
    moved = stage.corrected(boxes, vectors)
    kept = distinct(moved, margins, width)
    truth = np.concatenate([asked, ignored])
    found = match(moved[kept], margins[kept], truth, np.arange(len(truth)) >= len(asked), MIN_IOU, width)
    counted = ~found.ignored
    return margins[kept][counted], (found.truth >= 0)[counted], len(asked)


def _died(scan: TrainingScan) -> tuple[NDArray[np.float64], NDArray[np.bool_], int]:
    raise killed(scan)
