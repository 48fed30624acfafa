"""What the looks of a second stage are trained on: boxes in simulated scans, as each look gets them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import NoReturn

import numpy as np
from numpy.typing import NDArray

from laserimg.boxes import Boxes, iou
from laserimg.cascade.folder import one_thread
from laserimg.detectors.description import Describer
from laserimg.detectors.look import Look
from laserimg.detectors.second_stage import MOST, seen
from laserimg.recipes.gloss import without_glancing
from laserimg.recipes.observation import killed, observed
from laserimg.recipes.proposals import proposed_boxes
from laserimg.recipes.recipe import Recipe
from laserimg.recipes.scans import TrainingScan
from laserimg.recipes.shadows import in_shadow
from laserimg.workers import in_order

# A box is of an object from here on, of none below; between the two it teaches nothing.
OF_OBJECT, OF_NONE = 0.55, 0.35
# The correction of boxes is learnt from those that overlap an object by as much.
CORRECTED = 0.35
# Every object is also learnt in so many places and sizes beside its own.
COPIES = 6
MAX_SHIFT, MAX_GROWTH = 0.25, 0.35
# Boxes of no object that the first look learns of a scan; the looks after it learn all that it passes on.
OF_SCAN = 60
# A box that overlaps an object nobody asks for by as much is neither learnt nor background.
_UNCLEAR = 0.3


@dataclass(frozen=True, eq=False, slots=True)
class Samples:
    """Boxes in some scans as a look gets them, as vectors, and what is true of them.

    Parameters
    ----------
    vectors : (n, d) array of float16
    numbers : (n, e) array of float32
        What the judge sees of them (`seen`); no columns for a look that is not the last.
    overlap : (n,) array of float32
        Of each box with the object it overlaps most.
    moves : (n, 4) array of float32
        How that object's middle and size differ (see `Look`).
    """

    vectors: NDArray[np.float16]
    numbers: NDArray[np.float32]
    overlap: NDArray[np.float32]
    moves: NDArray[np.float32]


@dataclass(frozen=True, eq=False, slots=True)
class Proposed:
    """A simulated scan, what is proposed in it, and what there is.

    Parameters
    ----------
    number : int
    scan : TrainingScan
    boxes : (n, 4) array
    learnt, kept_out : (m, 4) arrays
        The boxes of `TrainingScan.objects`.
    """

    number: int
    scan: TrainingScan
    boxes: Boxes
    learnt: Boxes
    kept_out: Boxes


def proposed_in(
    recipe: Recipe,
    cascades: list[Path],
    scans: list[TrainingScan],
    jobs: int,
    tell: Callable[[], None] = lambda: None,
) -> list[Proposed]:
    """Return what the cascades of a recipe, and the regions, propose in some scans."""
    work = partial(_proposed, recipe, tuple(cascades))
    return in_order(work, enumerate(scans), jobs, _died, lambda _: tell())


def samples_of_look(
    recipe: Recipe,
    looks: tuple[Look, ...],
    proposed: list[Proposed],
    jobs: int,
    tell: Callable[[], None] = lambda: None,
    judged: bool = False,
) -> tuple[Samples, list[Proposed]]:
    """Return what the look after some looks is trained on, and the proposals that got as far.

    Parameters
    ----------
    recipe : Recipe
    looks : tuple of Look
        Those before; none for the first one.
    proposed : list of Proposed
    jobs : int
    tell : function
        Called after each scan.
    judged : bool
        This look is the last: what the judge sees is asked for too.
    """
    work = partial(_samples, recipe, looks, judged)
    found = in_order(work, proposed, jobs, lambda one: _died((one.number, one.scan)), lambda _: tell())
    samples, left = zip(*found, strict=True)
    return joined(samples), list(left)


def joined(parts: Sequence[Samples]) -> Samples:
    """Return all samples together."""
    return Samples(
        np.concatenate([one.vectors for one in parts]),
        np.concatenate([one.numbers for one in parts]),
        np.concatenate([one.overlap for one in parts]),
        np.concatenate([one.moves for one in parts]),
    )


def _proposed(recipe: Recipe, cascades: tuple[Path, ...], item: tuple[int, TrainingScan]) -> Proposed:
    number, scan = item
    with one_thread():
        boxes = proposed_boxes(observed(scan.path), cascades, recipe.regions)
    return Proposed(number, scan, boxes, *scan.objects(recipe))


def _samples(
    recipe: Recipe, looks: tuple[Look, ...], judged: bool, one: Proposed
) -> tuple[Samples, Proposed]:
    learnt = one.learnt
    rng = np.random.default_rng([recipe.seed, one.number, 1 + len(looks)])
    with one_thread():
        evidence = observed(one.scan.path)
        describe = Describer.of(evidence)
        left = _most_promising(looks[0], one.boxes, describe) if looks else one.boxes
        boxes = np.concatenate([left, _copies(learnt, rng)])
        parts = [_taught(describe, boxes, learnt, one.kept_out, looks, judged, rng)]
        others = np.concatenate([learnt, one.kept_out])
        for box in learnt:
            if rng.uniform() < recipe.shadows:
                shaded, rest = in_shadow(evidence, box, rng)
                copies = _copies(rest, rng)
                parts.append(_taught(Describer.of(shaded), copies, rest, others, looks, judged, rng))
            if recipe.gloss > 0 and rng.uniform() < recipe.gloss:
                glossy, copies = without_glancing(evidence, box, rng), _copies(box[None], rng)
                parts.append(_taught(Describer.of(glossy), copies, box[None], others, looks, judged, rng))
    return joined(parts), replace(one, boxes=left)


def _most_promising(look: Look, boxes: Boxes, describe: Describer) -> Boxes:
    """As many of the boxes as a second stage looks at again, in their order."""
    if len(boxes) <= MOST:
        return boxes
    return boxes[np.sort(np.argsort(-look.margins(describe(boxes)), kind="stable")[:MOST])]


def _died(item: tuple[int, TrainingScan]) -> NoReturn:
    raise killed(item[1])


def _taught(
    describe: Describer,
    boxes: Boxes,
    learnt: Boxes,
    kept_out: Boxes,
    looks: tuple[Look, ...],
    judged: bool,
    rng: np.random.Generator,
) -> Samples:
    """What is learnt of one scan from boxes as the looks before put them.

    A box that overlaps what is kept out teaches nothing, unless it is of an object that is learnt.
    """
    for look in looks:
        boxes = look.corrected(boxes, describe(boxes))
    scan = describe.evidence.scan
    width = scan.shape[1] if scan.wraps else None
    overlap, nearest = _overlap(boxes, learnt, width)
    clear = (overlap_with(kept_out, boxes, width) < _UNCLEAR) | (overlap >= OF_OBJECT)
    none = np.flatnonzero((overlap < OF_NONE) & clear)
    if not looks:
        none = rng.permutation(none)[:OF_SCAN]
    chosen = np.sort(np.concatenate([none, np.flatnonzero(overlap >= CORRECTED)]))
    overlap, boxes, nearest = overlap[chosen], boxes[chosen], nearest[chosen]
    vectors = describe(boxes)
    return Samples(
        vectors.astype(np.float16),
        seen(describe, boxes, vectors) if judged else np.empty((len(boxes), 0), np.float32),
        overlap.astype(np.float32),
        _moves(boxes, learnt[nearest] if len(learnt) else boxes, width).astype(np.float32),
    )


def _copies(boxes: Boxes, rng: np.random.Generator) -> Boxes:
    """The boxes and, of each, some moved and resized."""
    copies = np.repeat(boxes, COPIES, axis=0)
    middle = copies[:, :2] + copies[:, 2:] * (0.5 + rng.uniform(-MAX_SHIFT, MAX_SHIFT, (len(copies), 2)))
    size = copies[:, 2:] * np.exp(rng.uniform(-MAX_GROWTH, MAX_GROWTH, (len(copies), 2)))
    return np.concatenate([boxes, np.concatenate([middle - size / 2, size], axis=1)])


def overlap_with(objects: Boxes, boxes: Boxes, width: int | None) -> NDArray[np.float64]:
    """Return the overlap (n,) of each of boxes (n, 4) with the object it overlaps most; 0 without any."""
    return _overlap(boxes, objects, width)[0]


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
