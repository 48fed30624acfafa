"""Training the second stage of a recipe on what its cascades and regions propose."""

from collections.abc import Callable
from itertools import count
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from laserimg.cascade.folder import one_thread
from laserimg.detectors.boosted_trees import BoostedTrees
from laserimg.detectors.look import Look
from laserimg.detectors.second_stage import SecondStage
from laserimg.errors import LabelError
from laserimg.formats.card import Card
from laserimg.hog_training.svm import Plane, fit_svm
from laserimg.recipes.boosting import fit_trees
from laserimg.recipes.look_samples import (
    CORRECTED,
    OF_NONE,
    OF_OBJECT,
    Samples,
    proposed_in,
    samples_of_look,
)
from laserimg.recipes.recipe import Recipe
from laserimg.recipes.scans import TrainingScan

# How often boxes are looked at. Of wastebaskets in simulated scans average precision was 0.81 with two looks,
# 0.82 with three, and 0.73 with three by the same machine.
LOOKS = 3
# A box that the last correction brings this far only is of no object to the judge.
OF_NO_OBJECT = 0.4
LEAST_BOXES = 40
# Negatives of a look's SVM; of the rest those on the wrong side are added, twice.
AT_FIRST, MOST = 12_000, 24_000
ROUNDS = 2
# Shrinks the correction of boxes: an object is a few hundred numbers, a vector thousands.
RIDGE = 1.0


def scans_looked_at(scans: int) -> int:
    """Return how many scans `train_second_stage` looks at, the same ones again and again."""
    return scans * (1 + LOOKS)


def train_second_stage(
    recipe: Recipe,
    card: Card,
    cascades: list[Path],
    scans: list[TrainingScan],
    jobs: int,
    tell: Callable[[int], None] = lambda done: None,
) -> SecondStage:
    """Train the looks and the judge; what its sums mean is still open.

    Parameters
    ----------
    recipe : Recipe
    card : Card
        Of the second stage.
    cascades : list of Path
    scans : list of TrainingScan
    jobs : int
    tell : function
        Called with the number of scans looked at, of `scans_looked_at`.

    Raises
    ------
    LabelError
        If the scans show too few objects.
    """
    done = count(1)
    proposed = proposed_in(recipe, cascades, scans, jobs, lambda: tell(next(done)))

    looks: tuple[Look, ...] = ()
    while True:
        last = len(looks) == LOOKS - 1
        samples, proposed = samples_of_look(recipe, looks, proposed, jobs, lambda: tell(next(done)), last)
        looks = (*looks, trained_look(samples, recipe))
        if len(looks) == LOOKS:
            break
    judge = trained_judge(samples, looks[-1], jobs)
    return SecondStage(recipe.label, card, looks, judge, regions=recipe.regions)


def trained_look(samples: Samples, recipe: Recipe) -> Look:
    """Return the SVM and the correction that samples teach.

    Raises
    ------
    LabelError
        If too few of them are of objects.
    """
    overlap, vectors = samples.overlap, samples.vectors
    of_object = overlap >= OF_OBJECT
    if of_object.sum() < LEAST_BOXES:
        raise LabelError(
            f"{recipe.label}: {int(of_object.sum())} boxes of objects are too few to learn: more scans"
        )
    plane = _plane(vectors[of_object], vectors[overlap < OF_NONE], recipe)
    near = overlap >= CORRECTED
    moves, still = _correction(vectors[near], samples.moves[near])
    # As the file keeps them: what follows is trained on what will run.
    weights, moves = (values.astype(np.float16).astype(np.float32) for values in (plane.weights, moves))
    return Look(weights, float(np.float32(plane.bias)), moves, still)


def trained_judge(samples: Samples, look: Look, jobs: int = 1) -> BoostedTrees:
    """Return the trees that tell boxes of objects from others, by what the last look makes of its samples."""
    overlap = np.where(samples.overlap < OF_NONE, 0, overlap_after(look, samples))
    of_object = overlap >= OF_OBJECT
    sure = of_object | (overlap < OF_NO_OBJECT)
    # As many threads as jobs, whatever the machine has: those of two commands would wait for each other.
    with threadpool_limits(jobs):
        return fit_trees(samples.numbers[sure], of_object[sure])


def overlap_after(look: Look, samples: Samples) -> NDArray[np.float64]:
    """Return the IoU (n,) of each of the samples, corrected by a look, with its object."""
    # In units of the box itself.
    unit = np.broadcast_to(np.array([0.0, 0, 1, 1]), (len(samples.overlap), 4))
    with one_thread():
        parts = [
            look.corrected(unit[: len(part)], part.astype(np.float32)) for part in _parts(samples.vectors)
        ]
    boxes = np.concatenate(parts)
    size = np.exp(samples.moves[:, 2:].astype(np.float64))
    first = 0.5 + samples.moves[:, :2] - size / 2
    ends = np.minimum(boxes[:, :2] + boxes[:, 2:], first + size)
    common = np.maximum(ends - np.maximum(boxes[:, :2], first), 0).prod(axis=1)
    return common / (boxes[:, 2:].prod(axis=1) + size.prod(axis=1) - common)


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
    with one_thread():
        kernel = centred @ centred.T
        kernel[np.diag_indices_from(kernel)] += RIDGE * np.trace(kernel) / len(kernel)
        weights = np.linalg.solve(kernel, wanted - still).T @ centred
    return weights, (still - weights @ mean).astype(np.float32)
