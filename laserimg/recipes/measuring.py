"""How good a detector is on simulated scans it was not trained on, step by step."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import lru_cache, partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from laserimg.boxes import Boxes, as_boxes
from laserimg.cascade.folder import one_thread
from laserimg.detectors.shipped import load_model
from laserimg.evaluate.curves import Curve
from laserimg.evaluate.matching import match
from laserimg.evidence import Box, Evidence
from laserimg.files import changed_ns
from laserimg.pipeline import Finding, Pipeline
from laserimg.recipes.observation import killed, observed
from laserimg.recipes.proposals import proposals
from laserimg.recipes.recipe import Recipe
from laserimg.recipes.scans import TrainingScan
from laserimg.rules.model import QUANTITIES, ClassRules, Interval, OnFail, Rules, Source
from laserimg.sources import detectors_for
from laserimg.workers import in_order

# What workers are sent of rules: all but the score, by which detections are chosen after them.
Sent = tuple[str, tuple[Source, ...], tuple[tuple[str, Interval], ...], float, float, int, OnFail]
Scored = list[tuple[Box, float]]

MIN_IOU = 0.5
STEPS = ("cascades alone", "second stage", "continuity gate", "size gate", "as shipped")
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
    work = partial(_found, recipe, tuple(models), sent(rules))
    results = in_order(work, scans, jobs, _died, tell)
    all_found, objects = [found for found, _ in results], sum(count for _, count in results)
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


def pipeline_of(models: tuple[Path, ...], rules: Sent, gates: bool) -> Pipeline:
    """Return the pipeline of one class; as long as the files stay the same, the same one.

    Parameters
    ----------
    models : tuple of Path
    rules : Sent
    gates : bool
        Checks reject, as in the paper, whatever the rules say.
    """
    return _pipeline(models, tuple(map(changed_ns, models)), rules, gates)


@lru_cache(maxsize=4)
def _pipeline(models: tuple[Path, ...], _changed_ns: tuple[int, ...], rules: Sent, gates: bool) -> Pipeline:
    label, sources, limits, inside, fills, agree, on_fail = rules
    asked = ClassRules(
        label, sources, dict(limits), inside, fills, 0.0, agree, on_fail="reject" if gates else on_fail
    )
    all_rules = Rules((asked,))
    return Pipeline(all_rules, detectors_for(all_rules, [load_model(path) for path in models]))


def sent(rules: ClassRules) -> Sent:
    """Return what workers are sent of rules."""
    limits = tuple(rules.limits.items())
    shares = rules.region_inside, rules.region_fills
    return rules.label, rules.sources, limits, *shares, rules.agree, rules.on_fail


def _found(
    recipe: Recipe, models: tuple[Path, ...], rules: Sent, scan: TrainingScan
) -> tuple[dict[str, Found], int]:
    asked, ignored = scan.objects(recipe)
    with one_thread():
        evidence = observed(scan.path)
        steps: dict[str, Scored] = dict(_gates(pipeline_of(models, rules, True).judge(evidence)))
        steps[STEPS[4]] = accepted_by(models, rules, evidence)
        cascades = tuple(path for path in models if path.suffix == ".xml")
        if cascades:
            steps[STEPS[0]] = [(one.box, one.score) for one in proposals(evidence, cascades)]
    width = evidence.scan.shape[1] if evidence.scan.wraps else None
    found = {step: matched(candidates, asked, ignored, width) for step, candidates in steps.items()}
    return found, len(asked)


def accepted_by(models: tuple[Path, ...], rules: Sent, evidence: Evidence) -> Scored:
    """Return boxes and scores of what a detector reports in a scan, as shipped, whatever the score."""
    return [(f.box, f.score) for f in pipeline_of(models, rules, False).judge(evidence) if f.accepted]


def _gates(findings: Iterable[Finding]) -> Iterator[tuple[str, Scored]]:
    """The candidates left when each check rejects, as in the paper, with the scores of the second stage."""
    left = list(findings)
    for step, names in (
        (STEPS[1], frozenset[str]()),
        (STEPS[2], _CONTINUITY),
        (STEPS[3], frozenset(QUANTITIES)),
    ):
        left = [f for f in left if all(check.passed for check in f.checks if check.name in names)]
        yield step, [(f.box, f.candidate.score) for f in left]


def matched(candidates: Scored, asked: Boxes, ignored: Boxes, width: int | None) -> Found:
    """Return what scored candidates of a scan are, given the boxes asked for and those to be ignored."""
    truth = np.concatenate([asked, ignored])
    ignore = np.arange(len(truth)) >= len(asked)
    boxes = boxes_of([box for box, _ in candidates])
    scores = np.array([score for _, score in candidates], np.float64)
    found = match(boxes, scores, truth, ignore, MIN_IOU, width)
    return Found(scores[~found.ignored], (found.truth >= 0)[~found.ignored])


def boxes_of(boxes: list[Box]) -> Boxes:
    """Return boxes as an (n, 4) array, also none."""
    return as_boxes(boxes or np.empty((0, 4)))


def _died(scan: TrainingScan) -> tuple[dict[str, Found], int]:
    raise killed(scan)
