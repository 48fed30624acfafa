"""Counting what is proposed in simulated test scans: shared by the tools that compare ways of proposing."""

from typing import NamedTuple

import numpy as np

from laserimg.boxes import Boxes, iou
from laserimg.recipes.scans import TrainingScan

HIT = 0.5


class Counts(NamedTuple):
    """Objects hit by a box, boxes that hit none, and objects asked for."""

    hits: int
    false_positives: int
    objects: int


def counted(boxes: Boxes, asked: Boxes, ignored: Boxes, width: int | None) -> Counts:
    """Count an object as hit by one box with IoU 0.5; boxes of objects to be ignored are not false."""
    hit = iou(boxes, asked, width) >= HIT
    neutral = (iou(boxes, ignored, width) >= HIT).any(axis=1)
    false_positives = ~hit.any(axis=1) & ~neutral
    return Counts(int(hit.any(axis=0).sum()), int(np.count_nonzero(false_positives)), len(asked))


def some_of(scans: list[TrainingScan], about: int) -> list[TrainingScan]:
    """Return about so many scans, spread evenly; all of them for 0."""
    return scans[:: max(1, len(scans) // about) if about else 1]
