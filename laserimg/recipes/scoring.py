"""Training the second stage of a recipe on what its cascades and regions propose."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache, partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from laserimg.boxes import Boxes, as_boxes, iou
from laserimg.cascade.folder import one_cv2_thread
from laserimg.detectors.description import Describer
from laserimg.detectors.ranked import proposer
from laserimg.detectors.search import WindowDetector
from laserimg.detectors.second_stage import SecondStage
from laserimg.detectors.shipped import load_model
from laserimg.errors import LabelError
from laserimg.evidence import Evidence
from laserimg.hog_training.svm import Plane, fit_svm
from laserimg.recipes.cards import card_of
from laserimg.recipes.observation import killed, observed
from laserimg.recipes.recipe import Recipe
from laserimg.recipes.scans import TrainingScan
from laserimg.recipes.shadows import in_shadow
from laserimg.workers import unordered

# A box is of an object from here on, of none below; between the two it teaches nothing.
OF_OBJECT, OF_NONE = 0.55, 0.35
# Every object is also learnt in so many places and sizes beside its own; the correction from all of them and
# from what is proposed, the SVM from those that are of the object.
COPIES = 6
MAX_SHIFT, MAX_GROWTH = 0.25, 0.35
CORRECTED = 0.35
# Negatives kept of a scan; of the rest those on the wrong side are added, twice.
LEAST_BOXES = 40
OF_SCAN, AT_FIRST, MOST = 60, 12_000, 24_000
ROUNDS = 2
# Shrinks the correction of boxes: an object is a few hundred numbers, a vector thousands.
RIDGE = 1.0


@dataclass(frozen=True, eq=False, slots=True)
class Proposals:
    """What is proposed in some scans, as vectors, and what is true of it.

    Parameters
    ----------
    vectors : (n, d) array of float16
    overlap : (n,) array
        Of each box with the object it overlaps most.
    moves : (n, 4) array
        How that object's middle and size differ (see `SecondStage.moves`).
    """

    vectors: NDArray[np.float16]
    overlap: NDArray[np.float32]
    moves: NDArray[np.float32]


def train_second_stage(
    recipe: Recipe,
    cascades: list[Path],
    scans: list[TrainingScan],
    jobs: int,
    tell: Callable[[int], None] = lambda done: None,
) -> SecondStage:
    """Train the SVM and the correction of boxes; the threshold is still that of the SVM.

    Raises
    ------
    LabelError
        If the scans show too few objects.
    """
    parts: dict[int, Proposals] = {}
    work = partial(_proposals, recipe, tuple(cascades))
    for number, part in unordered(work, list(enumerate(scans)), jobs, _died):
        parts[number] = part
        tell(len(parts))
    joined = _joined([parts[number] for number in range(len(scans))])
    overlap, moves, vectors = joined.overlap, joined.moves, joined.vectors
    of_object = overlap >= OF_OBJECT
    if of_object.sum() < LEAST_BOXES:
        count = int(of_object.sum())
        raise LabelError(f"{recipe.label}: {count} boxes of objects in {len(scans)} scans: too few to learn")
    plane = _plane(vectors[of_object], vectors[overlap < OF_NONE], recipe)
    near = overlap >= CORRECTED
    correction = _correction(vectors[near], moves[near])
    return SecondStage(
        recipe.label,
        card_of(recipe, None, len(scans)),
        plane.weights.astype(np.float16).astype(np.float32),
        plane.bias,
        1.0,
        correction[0].astype(np.float16).astype(np.float32),
        correction[1],
        regions=recipe.regions,
    )


def proposed_boxes(evidence: Evidence, cascades: tuple[Path, ...], regions: bool) -> Boxes:
    """Return what the cascades of a class, and the regions, propose in a scan."""
    boxes = [one.box for detector in _detectors(cascades) for one in detector(evidence)]
    if regions:
        boxes += [region.box for region in evidence.regions]
    return as_boxes(boxes or np.empty((0, 4)))


@lru_cache(maxsize=4)
def _detectors(cascades: tuple[Path, ...]) -> tuple[WindowDetector, ...]:
    return tuple(proposer(load_model(path)) for path in cascades)  # type: ignore[arg-type]


def _proposals(
    recipe: Recipe, cascades: tuple[Path, ...], item: tuple[int, TrainingScan]
) -> tuple[int, Proposals]:
    number, scan = item
    learnt, kept_out = scan.objects(recipe)
    rng = np.random.default_rng([recipe.seed, number, 1])
    with one_cv2_thread():
        evidence = observed(scan.path)
        width = evidence.scan.shape[1] if evidence.scan.wraps else None
        boxes = np.concatenate([proposed_boxes(evidence, cascades, recipe.regions), _copies(learnt, rng)])
        overlap, nearest = _overlap(boxes, learnt, width)
        clear = (_overlap(boxes, kept_out, width)[0] < 0.3) | (overlap >= OF_OBJECT)
        none = np.flatnonzero((overlap < OF_NONE) & clear)
        chosen = np.sort(
            np.concatenate([rng.permutation(none)[:OF_SCAN], np.flatnonzero(overlap >= CORRECTED)])
        )
        vectors = Describer.of(evidence)(boxes[chosen]).astype(np.float16)
        moves = _moves(boxes[chosen], learnt[nearest[chosen]] if len(learnt) else boxes[chosen], width)
        found = Proposals(vectors, overlap[chosen].astype(np.float32), moves.astype(np.float32))
        shaded = [_shaded(evidence, box, rng) for box in learnt if rng.uniform() < recipe.shadows]
    return number, _joined([found, *shaded])


def _died(item: tuple[int, TrainingScan]) -> tuple[int, Proposals]:
    raise killed(item[1])


def _shaded(evidence: Evidence, box: NDArray, rng: np.random.Generator) -> Proposals:
    """What is proposed of one object with its foot in a shadow."""
    shaded, left = in_shadow(evidence, box, rng)
    width = evidence.scan.shape[1] if evidence.scan.wraps else None
    boxes = _copies(left, rng)
    overlap, _ = _overlap(boxes, left, width)
    moves = _moves(boxes, np.repeat(left, len(boxes), axis=0), width)
    vectors = Describer.of(shaded)(boxes).astype(np.float16)
    return Proposals(vectors, overlap.astype(np.float32), moves.astype(np.float32))


def _joined(parts: list[Proposals]) -> Proposals:
    return Proposals(
        np.concatenate([one.vectors for one in parts]),
        np.concatenate([one.overlap for one in parts]),
        np.concatenate([one.moves for one in parts]),
    )


def _copies(boxes: Boxes, rng: np.random.Generator) -> Boxes:
    """The boxes and, of each, some moved and resized."""
    copies = np.repeat(boxes, COPIES, axis=0)
    middle = copies[:, :2] + copies[:, 2:] * (0.5 + rng.uniform(-MAX_SHIFT, MAX_SHIFT, (len(copies), 2)))
    size = copies[:, 2:] * np.exp(rng.uniform(-MAX_GROWTH, MAX_GROWTH, (len(copies), 2)))
    return np.concatenate([boxes, np.concatenate([middle - size / 2, size], axis=1)])


def _overlap(boxes: Boxes, objects: Boxes, width: int | None) -> tuple[NDArray, NDArray]:
    if len(objects) == 0 or len(boxes) == 0:
        return np.zeros(len(boxes)), np.zeros(len(boxes), np.intp)
    overlap = iou(boxes, objects, width)
    return overlap.max(axis=1), overlap.argmax(axis=1)


def _moves(boxes: Boxes, objects: Boxes, width: int | None) -> NDArray[np.float64]:
    across = objects[:, :2] + objects[:, 2:] / 2 - boxes[:, :2] - boxes[:, 2:] / 2
    if width is not None:
        across[:, 0] -= np.rint(across[:, 0] / width) * width
    return np.concatenate([across / boxes[:, 2:], np.log(objects[:, 2:] / boxes[:, 2:])], axis=1)


def _plane(objects: NDArray[np.float16], others: NDArray[np.float16], recipe: Recipe) -> Plane:
    """The SVM; of the negatives those that the planes before it got wrong."""
    order = np.random.default_rng([recipe.seed, 2]).permutation(len(others))
    chosen, plane = order[:AT_FIRST], None
    for _ in range(ROUNDS + 1):
        values = np.concatenate([objects, others[chosen]]).astype(np.float32)
        positive = np.arange(len(values)) < len(objects)
        plane = fit_svm(values, positive, recipe.cost, plane)
        margins = np.concatenate([plane.margins(part.astype(np.float32)) for part in _parts(others)])
        hardest = np.argsort(-margins, kind="stable")[:MOST]
        if len(chosen) == len(others):
            break
        chosen = np.union1d(chosen[margins[chosen] > -1.2], hardest[margins[hardest] > -1.2])
        chosen = np.union1d(chosen, order[: AT_FIRST // 3])
    assert plane is not None
    return plane


def _parts(vectors: NDArray[np.float16]) -> list[NDArray[np.float16]]:
    return [vectors[first : first + 4096] for first in range(0, max(len(vectors), 1), 4096)]


def _correction(vectors: NDArray[np.float16], moves: NDArray[np.float32]) -> tuple[NDArray, NDArray]:
    """Ridge regression, in the space that at most 4000 objects span."""
    some = np.linspace(0, len(vectors) - 1, min(len(vectors), 4000)).astype(np.intp)
    values, wanted = vectors[some].astype(np.float64), moves[some].astype(np.float64)
    mean, still = values.mean(axis=0), wanted.mean(axis=0)
    centred = values - mean
    kernel = centred @ centred.T
    kernel[np.diag_indices_from(kernel)] += RIDGE * np.trace(kernel) / len(kernel)
    weights = np.linalg.solve(kernel, wanted - still).T @ centred
    return weights, (still - weights @ mean).astype(np.float32)
