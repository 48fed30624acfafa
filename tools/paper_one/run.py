"""One seed of the experiment: scans, objects, and what each is taken for when it is left out."""

import time
from collections import Counter
from dataclasses import dataclass, field

import numpy as np
from threadpoolctl import threadpool_limits

from laserimg.classify import Recipe, describe_images
from laserimg.classify.validation import leave_one_out, predicted
from paper_one.controls import by_shape, by_size
from paper_one.objects import Found, collected
from paper_one.plan import FURTHER, Plan

PAPER = {"HONV": "honv", "HONV and HOG": "honv+hog", "3DHOG": "3dhog"}
SETS = {**PAPER, "3DHOG and HOG": "3dhog+hog"}
OF_RANGE, WITH_SIZE, USUAL = ", gradients of range", " + size", ", no hedges and low walls"
SIZE_ONLY, SHAPE = "size only (RBF)", "global shape (random forest)"
# Numbers of the size, at the end of a description.
_SIZES = 3


@dataclass(frozen=True, eq=False, slots=True)
class Run:
    """What came out for one seed.

    Parameters
    ----------
    plan : Plan
    found : list of Found
    refused : Counter
        Clusters that are no objects, by reason and class.
    scans : int
    taken_for : dict of str to (n,) array of str
        The class of every object by each way of classifying; "" for one that has no part in it.
    seconds : dict of str to float
        What each part took.
    """

    plan: Plan
    found: list[Found]
    refused: Counter[tuple[str, str]]
    scans: int
    taken_for: dict[str, np.ndarray] = field(default_factory=dict)
    seconds: dict[str, float] = field(default_factory=dict)

    @property
    def labels(self) -> np.ndarray:
        """(n,) true classes."""
        return np.array([one.truth.label for one in self.found])


def run_of(plan: Plan) -> Run:
    """Make the scans of a seed and classify their objects, with one thread."""
    with threadpool_limits(1):
        return _run(plan)


def _run(plan: Plan) -> Run:
    start = time.perf_counter()
    pool = collected(plan)
    run = Run(plan, pool.found, pool.refused, pool.scans)
    run.seconds["scans and segmentation"] = time.perf_counter() - start
    for name, features in SETS.items():
        _classify(run, name, Recipe(features, 1, True))
        if features in ("honv+hog", "3dhog"):
            _classify(run, name + OF_RANGE, Recipe(features, 1, True, "range"))
    clouds = [one.points for one in run.found]
    run.taken_for[SIZE_ONLY] = by_size(clouds, run.labels)
    run.taken_for[SHAPE] = by_shape(clouds, run.labels)
    return run


def _classify(run: Run, name: str, recipe: Recipe) -> None:
    """Leave each object out; where reflectance counts, also with its size, and without `FURTHER` kinds."""
    start = time.perf_counter()
    vectors = np.stack([describe_images(one.images, one.points, recipe) for one in run.found])
    described = time.perf_counter()
    plain = vectors[:, :-_SIZES]
    everything = np.ones(len(run.found), np.bool_)
    run.taken_for[name] = left_out(plain, run.labels, everything)
    run.seconds[f"{name}: descriptors"] = described - start
    run.seconds[f"{name}: leave-one-out"] = time.perf_counter() - described
    if recipe.appearance == "reflectance":
        usual = np.array([one.truth.kind not in FURTHER for one in run.found])
        run.taken_for[name + WITH_SIZE] = left_out(vectors, run.labels, everything)
        run.taken_for[name + USUAL] = left_out(plain, run.labels, usual)


def left_out(vectors: np.ndarray, labels: np.ndarray, among: np.ndarray) -> np.ndarray:
    """Return the class (n,) of every object of a mask by a machine of the others in it; "" for the rest."""
    found = np.full(len(labels), "", labels.dtype)
    found[among] = predicted(leave_one_out(vectors[among], labels[among]), labels[among])
    return found
