"""How good a detector is on simulated scans it was not trained on, step by step."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import lru_cache, partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from laserimg.boxes import Boxes, as_boxes
from laserimg.cascade.folder import one_cv2_thread
from laserimg.detectors.search import WindowDetector
from laserimg.detectors.shipped import load_model
from laserimg.evaluate.curves import Curve
from laserimg.evaluate.matching import match
from laserimg.pipeline import Finding, Pipeline
from laserimg.recipes.observation import killed, observed
from laserimg.recipes.recipe import Recipe
from laserimg.recipes.scans import TrainingScan
from laserimg.rules.model import QUANTITIES, ClassRules, Interval, Rules, Source
from laserimg.sources import detectors_for
from laserimg.workers import unordered

# Of rules as workers can be sent them.
Limits = tuple[tuple[str, Interval], ...]

MIN_IOU = 0.5
STEPS = ("cascades alone", "second stage", "and continuity", "and size rules", "and suppression")
_CONTINUITY = frozenset({"region", "region_inside", "region_fills"})


@dataclass(frozen=True, eq=False, slots=True)
class Found:
    """What was found in one scan up to one step: scores, and which are of objects.

    Parameters
    ----------
    scores : (n,) array
    hits : (n,) array of bool
    """

    scores: NDArray[np.float64]
    hits: NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class StepScore:
    """How good the candidates are that are left after a step.

    Parameters
    ----------
    step : str
    average_precision : float
        At IoU 0.5, over all scores.
    recall, false_per_scan : float
        Of those that score above the threshold; of cascades alone all.
    objects, scans : int
    """

    step: str
    average_precision: float
    recall: float
    false_per_scan: float
    objects: int
    scans: int


def measured(
    recipe: Recipe,
    models: Iterable[Path],
    rules: ClassRules,
    scans: list[TrainingScan],
    jobs: int,
    tell: Callable[[int], None] = lambda done: None,
) -> list[StepScore]:
    """Return the scores after each step of the pipeline.

    Parameters
    ----------
    recipe : Recipe
    models : iterable of Path
        The cascades and the second stage.
    rules : ClassRules
    scans : list of TrainingScan
    jobs : int
    """
    work = partial(_found, recipe, tuple(models), rules.sources, tuple(rules.limits.items()))
    all_found, objects = [], 0
    for found, count in unordered(work, scans, jobs, _died):
        all_found.append(found)
        objects += count
        tell(len(all_found))
    return [_score(step, all_found, objects, rules.score) for step in STEPS if step in all_found[0]]


def _score(step: str, all_found: list[dict[str, Found]], objects: int, threshold: float) -> StepScore:
    scores = np.concatenate([found[step].scores for found in all_found])
    hits = np.concatenate([found[step].hits for found in all_found])
    sure = scores > (0 if step == STEPS[0] else threshold)
    return StepScore(
        step,
        Curve.of(scores, hits, objects, len(all_found)).average_precision,
        float((hits & sure).sum() / max(objects, 1)),
        float((~hits & sure).sum() / len(all_found)),
        objects,
        len(all_found),
    )


@lru_cache(maxsize=2)
def _pipeline(label: str, models: tuple[Path, ...], sources: tuple[Source, ...], limits: Limits) -> Pipeline:
    all_rules = Rules((ClassRules(label, sources, dict(limits)),))
    return Pipeline(all_rules, detectors_for(all_rules, [load_model(path) for path in models]))


def _found(
    recipe: Recipe, models: tuple[Path, ...], sources: tuple[Source, ...], limits: Limits, scan: TrainingScan
) -> tuple[dict[str, Found], int]:
    asked, ignored = scan.objects(recipe)
    with one_cv2_thread():
        evidence = observed(scan.path)
        findings = _pipeline(recipe.label, models, sources, limits).judge(evidence)
        alone = [
            candidate
            for path in models
            if path.suffix == ".xml"
            for candidate in WindowDetector(load_model(path))(evidence)  # type: ignore[arg-type]
        ]
    width = evidence.scan.shape[1] if evidence.scan.wraps else None
    steps = {"cascades alone": [(one.box, one.score) for one in alone]} if alone else {}
    steps |= {step: [(f.box, f.score) for f in left] for step, left in _steps(findings)}
    return {
        step: _matched([box for box, _ in found], [score for _, score in found], asked, ignored, width)
        for step, found in steps.items()
    }, len(asked)


def _steps(findings: Iterable[Finding]) -> Iterator[tuple[str, list[Finding]]]:
    """The candidates left after each step."""
    left = list(findings)
    for step, names in (
        (STEPS[1], frozenset[str]()),
        (STEPS[2], _CONTINUITY),
        (STEPS[3], frozenset(QUANTITIES)),
        (STEPS[4], frozenset({"suppression"})),
    ):
        left = [f for f in left if all(check.passed for check in f.checks if check.name in names)]
        yield step, left


def _matched(boxes: list, scores: list[float], asked: Boxes, ignored: Boxes, width: int | None) -> Found:
    truth = np.concatenate([asked, ignored])
    ignore = np.arange(len(truth)) >= len(asked)
    values = np.array(scores, np.float64)
    found = match(as_boxes(boxes or np.empty((0, 4))), values, truth, ignore, MIN_IOU, width)
    return Found(values[~found.ignored], (found.truth >= 0)[~found.ignored])


def _died(scan: TrainingScan) -> tuple[dict[str, Found], int]:
    raise killed(scan)
