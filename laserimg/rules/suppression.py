"""Suppression: several candidates of one object are one detection."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from laserimg.boxes import as_boxes, iou
from laserimg.regions import Region

MAX_IOU = 0.5


@dataclass(frozen=True, eq=False, slots=True)
class Claim:
    """What suppression needs to know of a candidate.

    Parameters
    ----------
    label : str
    score : float
    from_detector : bool
        False for candidates made from regions, which yield to detectors of other classes.
    region : Region
    """

    label: str
    score: float
    from_detector: bool
    region: Region


def suppressed_by(claims: Sequence[Claim], width: int, wraps: bool) -> list[tuple[int, float]]:
    """Return, for every claim, which claim it yields to and their overlap; (-1, 0.0) for winners.

    Claims are settled best first: detectors before regions, then by score. A later claim yields
    to a winner if both are of the same object: of one class with boxes of the regions that
    overlap by an IoU over 0.5, or of any class with regions whose pixels do.

    Parameters
    ----------
    claims : sequence of Claim
    width : int
        Columns of the grid.
    wraps : bool
    """
    verdicts = [(-1, 0.0)] * len(claims)
    winners: list[int] = []
    boxes = as_boxes([claim.region.box for claim in claims])
    for index in sorted(range(len(claims)), key=lambda i: (not claims[i].from_detector, -claims[i].score)):
        of_boxes = iou(boxes[[index]], boxes[winners], width if wraps else None)[0]
        for place in np.flatnonzero(of_boxes):
            winner = winners[place]
            overlap = _overlap(claims[index], claims[winner], float(of_boxes[place]))
            if overlap > MAX_IOU:
                verdicts[index] = (winner, overlap)
                break
        else:
            winners.append(index)
    return verdicts


def _overlap(a: Claim, b: Claim, of_boxes: float) -> float:
    """Of claims whose boxes overlap: that of the boxes in one class, that of the pixels across classes."""
    if a.label == b.label:
        return of_boxes
    common = len(np.intersect1d(a.region.pixels, b.region.pixels, assume_unique=True))
    return common / (len(a.region.pixels) + len(b.region.pixels) - common)
