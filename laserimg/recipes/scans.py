"""The simulated scans of a recipe with their truth, made once for all recipes that name them."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from laserimg.boxes import Boxes, as_boxes
from laserimg.formats.coco import Annotation
from laserimg.formats.coco_file import read_coco
from laserimg.recipes.recipe import Recipe
from laserimg.simulate.sets import Extra, SetPlan, known, make_scans

Part = Literal["train", "tune", "test"]
# Seeds of the parts: no scene of one is a scene of another.
_PARTS: dict[Part, int] = {"train": 0, "tune": 1_000_000, "test": 2_000_000}


@dataclass(frozen=True, slots=True)
class TrainingScan:
    """A simulated scan.

    Parameters
    ----------
    path, truth : Path
    """

    path: Path
    truth: Path

    def objects(self, recipe: Recipe) -> tuple[Boxes, Boxes]:
        """Return the boxes to learn and find, and those of the class, or neutral, that nobody asks for."""
        coco = read_coco(self.truth)
        labels = [coco.labels[one.category_id] for one in coco.annotations]
        named = [
            (label == recipe.label and asked_for(one, recipe), one.bbox)
            for one, label in zip(coco.annotations, labels, strict=True)
            if label == recipe.label or label in recipe.neutral
        ]
        asked = np.array([is_asked for is_asked, _ in named], np.bool_)
        boxes = as_boxes([box for _, box in named] or np.empty((0, 4)))
        return boxes[asked], boxes[~asked]


def asked_for(one: Annotation, recipe: Recipe) -> bool:
    """Return whether enough is seen of an object of the recipe's class to be learnt and asked for."""
    clear = one.visibility is None or one.visibility >= recipe.min_visibility
    return clear and (one.area or 0) >= recipe.min_points


def scans_of(
    recipe: Recipe,
    part: Part,
    work: Path,
    jobs: int,
    extras: tuple[Extra, ...] = (),
    tell: Callable[[int], None] = lambda made: None,
) -> list[TrainingScan]:
    """Return the scans of a part, simulating those that are not there yet.

    Parameters
    ----------
    recipe : Recipe
    part : "train", "tune" or "test"
    work : Path
        Where simulated scans are kept.
    jobs : int
    extras : tuple of Extra
    tell : function
        Called with the number of scans there are so far.
    """
    made: list[TrainingScan] = []
    for plan, count in _plans(recipe, part, work, extras):
        for done, _ in enumerate(make_scans(plan, count, jobs), len(made) + 1):
            tell(done)
        made += [TrainingScan(plan.out / plan.name(i), plan.truth(i)) for i in range(count)]
    return made


def count_of(recipe: Recipe, part: Part) -> int:
    """Return how many scans a part has."""
    return sum(_count(recipe, part, one.count) for one in recipe.scans)


def _plans(
    recipe: Recipe, part: Part, work: Path, extras: tuple[Extra, ...]
) -> Iterator[tuple[SetPlan, int]]:
    for one in recipe.scans:
        seed = recipe.seed + _PARTS[part]
        folder = work / f"{one.scene}-{one.scanner}-{seed}"
        things = (*extras, *(known(kind) for kind in one.more))
        yield SetPlan(one.scene, one.scanner, seed, folder, things), _count(recipe, part, one.count)


def _count(recipe: Recipe, part: Part, count: int) -> int:
    return count if part == "train" else max(1, round(count * recipe.held_out))
