"""How much the trees of a second stage count, and how much its looks: learnt on scans new to both."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from laserimg.cascade.folder import one_thread
from laserimg.detectors.description import Describer
from laserimg.detectors.second_stage import SecondStage
from laserimg.recipes.look_samples import overlap_with
from laserimg.recipes.measuring import MIN_IOU
from laserimg.recipes.observation import killed, observed
from laserimg.recipes.proposals import proposed_boxes
from laserimg.recipes.recipe import Recipe
from laserimg.recipes.scans import TrainingScan
from laserimg.recipes.threshold import fitted_odds
from laserimg.workers import in_order

# Weights of the trees and of the mean margin are at most this.
_MOST = 50.0


@dataclass(frozen=True, eq=False, slots=True)
class Voted:
    """Boxes of some scans after all looks.

    Parameters
    ----------
    numbers : (n, 2) array
        Sum of the judge, mean of the margins.
    hits : (n,) array of bool
        Which are of objects.
    """

    numbers: NDArray[np.float64]
    hits: NDArray[np.bool_]


def fused(
    stage: SecondStage,
    recipe: Recipe,
    cascades: list[Path],
    scans: list[TrainingScan],
    jobs: int,
    tell: Callable[[int], None] = lambda done: None,
) -> SecondStage:
    """Return the second stage with the most likely weights of judge and looks.

    Parameters
    ----------
    stage : SecondStage
    recipe : Recipe
    cascades : list of Path
    scans : list of TrainingScan
        On which nothing of it was trained.
    jobs : int
    tell : function
        Called with the number of scans looked at.
    """
    parts = in_order(partial(_voted, recipe, stage, tuple(cascades)), scans, jobs, _died, tell)
    numbers, hits = (np.concatenate([getattr(part, name) for part in parts]) for name in ("numbers", "hits"))
    if not hits.any() or hits.all():
        return stage
    (slope, lean), shift = fitted_odds(numbers, hits, most=(_MOST, _MOST))
    return replace(stage, slope=slope, lean=lean, shift=shift)


def _voted(recipe: Recipe, stage: SecondStage, cascades: tuple[Path, ...], scan: TrainingScan) -> Voted:
    asked, ignored = scan.objects(recipe)
    with one_thread():
        evidence = observed(scan.path)
        describe = Describer.of(evidence)
        boxes = proposed_boxes(evidence, cascades, recipe.regions)
        _, boxes, sums, means = stage.looked_at(describe, boxes, describe(boxes))
    width = evidence.scan.shape[1] if evidence.scan.wraps else None
    hits = overlap_with(asked, boxes, width) >= MIN_IOU
    counted = hits | (overlap_with(ignored, boxes, width) < MIN_IOU)
    return Voted(np.stack([sums, means], axis=1)[counted], hits[counted])


def _died(scan: TrainingScan) -> Voted:
    raise killed(scan)
