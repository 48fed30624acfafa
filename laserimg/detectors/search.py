"""A window detector at work: levels searched, overlapping hits grouped, margins taken off."""

from dataclasses import dataclass
from typing import Literal

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from laserimg.boxes import iou
from laserimg.detectors.candidate import Candidate
from laserimg.detectors.levels import metric_levels, plain_levels, search
from laserimg.detectors.window import WindowModel
from laserimg.errors import ConfigError
from laserimg.evidence import Evidence, Image

Scale = Literal["metric", "plain"]

# Hits that overlap by this IoU are of one object.
SAME_IOU = 0.3


@dataclass(frozen=True, eq=False, slots=True)
class WindowDetector:
    """Proposes what a cascade or HOG model finds.

    Parameters
    ----------
    model : WindowModel
    scale : "metric" or "plain"
        Search only the sizes the object has at each range, or all sizes everywhere. A model
        whose card has no object size is searched plainly.
    min_neighbours : int
        Least number of hits that make a candidate.

    Raises
    ------
    ConfigError
        If `scale` is neither.
    """

    model: WindowModel
    scale: Scale = "metric"
    min_neighbours: int = 2

    def __post_init__(self) -> None:
        if self.scale not in ("metric", "plain"):
            raise ConfigError(f"scale must be metric or plain, not {self.scale!r}")

    @property
    def images(self) -> frozenset[str]:
        """Kinds of image it looks at."""
        return frozenset({self.model.card.image})

    def __call__(self, evidence: Evidence) -> list[Candidate]:
        """Return the candidates of one scan."""
        card = self.model.card
        metric = self.scale == "metric" and card.object_size_m is not None
        levels = metric_levels(evidence, self.model) if metric else plain_levels(evidence, self.model)
        wraps = evidence.scan.wraps
        boxes, scores = search(self.model, _gray(evidence.images[card.image]), levels, wraps)
        boxes, scores = grouped(boxes, scores, self.min_neighbours, evidence.scan.shape[1] if wraps else None)
        boxes = _inside(_without_margin(boxes, card.margin), evidence.scan.shape, wraps)
        source = "hog" if card.kind == "hog" else "cascade"
        return [
            Candidate(card.label, (x, y, w, h), float(score), source, self.model.name)
            for (x, y, w, h), score in zip(boxes.tolist(), scores, strict=True)
        ]


def grouped(
    boxes: NDArray[np.float64],
    scores: NDArray[np.float64],
    min_neighbours: int,
    wrap_width: int | None = None,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return one box for every group of overlapping ones: their mean, with the best score.

    Parameters
    ----------
    boxes : (n, 4) array
    scores : (n,) array
    min_neighbours : int
        Smaller groups are left out.
    wrap_width : int, optional
        Columns of a grid that closes a full turn.

    Examples
    --------
    >>> boxes = np.array([[0, 0, 10, 10], [2, 0, 10, 10], [50, 50, 9, 9]], float)
    >>> grouped(boxes, np.array([1.0, 3.0, 9.0]), 2)
    (array([[ 1.,  0., 10., 10.]]), array([3.]))
    """
    if len(boxes) == 0:
        return boxes, scores
    count, group = connected_components(iou(boxes, boxes, wrap_width) > SAME_IOU, directed=False)
    means, best = [], []
    for number in range(count):
        members = np.flatnonzero(group == number)
        if len(members) >= min_neighbours:
            means.append(_mean_box(boxes[members], wrap_width))
            best.append(scores[members].max())
    return np.array(means).reshape(-1, 4), np.array(best)


def _mean_box(boxes: NDArray[np.float64], wrap_width: int | None) -> NDArray[np.float64]:
    if wrap_width is not None:  # all beside the first, not a turn away from it
        boxes = boxes.copy()
        boxes[:, 0] -= np.rint((boxes[:, 0] - boxes[0, 0]) / wrap_width) * wrap_width
    return boxes.mean(axis=0)


def _without_margin(boxes: NDArray[np.float64], margin: float) -> NDArray[np.float64]:
    size = boxes[:, 2:] / (1 + 2 * margin)
    return np.concatenate([boxes[:, :2] + margin * size, size], axis=1)


def _inside(boxes: NDArray[np.float64], shape: tuple[int, int], wraps: bool) -> NDArray[np.float64]:
    """Cut boxes to the grid; where it closes a full turn only x is brought into it."""
    height, width = shape
    first, last = boxes[:, :2].copy(), boxes[:, :2] + boxes[:, 2:]
    first[:, 1], last[:, 1] = np.clip(first[:, 1], 0, height - 1), np.clip(last[:, 1], 1, height)
    if wraps:
        last[:, 0] = np.minimum(last[:, 0], first[:, 0] + width)
        turn = np.floor(first[:, 0] / width) * width
        first[:, 0], last[:, 0] = first[:, 0] - turn, last[:, 0] - turn
    else:
        first[:, 0], last[:, 0] = np.clip(first[:, 0], 0, width - 1), np.clip(last[:, 0], 1, width)
    return np.concatenate([first, last - first], axis=1)


def _gray(image: Image) -> Image:
    return image if image.ndim == 2 else cv2.cvtColor(image, cv2.COLOR_RGB2GRAY)
