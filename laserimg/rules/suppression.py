"""Suppression: several candidates of one object are one detection."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from laserimg.boxes import iou
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
    for index in sorted(range(len(claims)), key=lambda i: (not claims[i].from_detector, -claims[i].score)):
        for winner in winners:
            overlap = _overlap(claims[index], claims[winner], width if wraps else None)
            if overlap > MAX_IOU:
                verdicts[index] = (winner, overlap)
                break
        else:
            winners.append(index)
    return verdicts


def _overlap(a: Claim, b: Claim, wrap_width: int | None) -> float:
    boxes = float(iou([a.region.box], [b.region.box], wrap_width)[0, 0])
    if boxes == 0 or a.label == b.label:
        return boxes
    common = len(np.intersect1d(a.region.pixels, b.region.pixels, assume_unique=True))
    return common / (len(a.region.pixels) + len(b.region.pixels) - common)
