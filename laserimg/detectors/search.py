"""A window detector at work: levels searched, overlapping hits grouped, margins taken off."""

from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal

import cv2
import numpy as np
from numpy.typing import NDArray

from laserimg.boxes import Boxes, inside_grid
from laserimg.detectors.candidate import Candidate
from laserimg.detectors.grouping import grouped
from laserimg.detectors.levels import Level, plain_levels
from laserimg.detectors.metric import Sizes, metric_levels
from laserimg.detectors.pyramid import Pyramid
from laserimg.detectors.window import WindowModel
from laserimg.errors import ConfigError
from laserimg.evidence import Evidence, Image

Scale = Literal["metric", "plain"]


@dataclass(frozen=True, eq=False)
class Searched:
    """A scan to search: what several detectors need of it is made once.

    Parameters
    ----------
    evidence : Evidence
    """

    evidence: Evidence
    _pyramids: dict[str, Pyramid] = field(default_factory=dict, init=False)

    @cached_property
    def sizes(self) -> Sizes:
        """How large a metre is."""
        return Sizes.of(self.evidence)

    def pyramid(self, image: str) -> Pyramid:
        """Return the pyramid of one of the images, in gray."""
        if image not in self._pyramids:
            self._pyramids[image] = Pyramid.of(gray(self.evidence.images[image]), self.evidence.scan.wraps)
        return self._pyramids[image]


@dataclass(frozen=True, eq=False, slots=True)
class WindowDetector:
    """Proposes what a cascade or HOG model finds.

    Images of three planes are turned gray with the weights of `cv2.COLOR_RGB2GRAY`; a card that
    names one plane, such as ``normals_view.r``, gets that plane.

    Parameters
    ----------
    model : WindowModel
    scale : "metric" or "plain"
        Search only the sizes the object has at each range, or all sizes everywhere. A model
        whose card has no object size is searched plainly.

    Raises
    ------
    ConfigError
        If `scale` is neither.
    """

    model: WindowModel
    scale: Scale = "metric"

    def __post_init__(self) -> None:
        if self.scale not in ("metric", "plain"):
            raise ConfigError(f"scale must be metric or plain, not {self.scale!r}")

    @property
    def images(self) -> frozenset[str]:
        """Kinds of image it looks at."""
        return frozenset({self.model.card.image})

    def __call__(self, evidence: Evidence) -> list[Candidate]:
        """Return the candidates of one scan."""
        return self.found(Searched(evidence))

    def found(self, searched: Searched) -> list[Candidate]:
        """Return the candidates of one scan that other detectors search too."""
        evidence, card = searched.evidence, self.model.card
        wraps = evidence.scan.wraps
        metric = self.scale == "metric" and card.object_size_m is not None
        levels = metric_levels(evidence, card, searched.sizes) if metric else plain_levels(evidence, card)
        hits = search_pyramid(self.model, searched.pyramid(card.image), levels)
        boxes, scores = grouped(*hits, self.model.min_neighbours, evidence.scan.shape[1] if wraps else None)
        boxes = inside_grid(_without_margin(boxes, card.margin), evidence.scan.shape, wraps)
        source = "hog" if card.kind == "hog" else "cascade"
        return [
            Candidate(card.label, (x, y, w, h), float(score), source, self.model.name)
            for (x, y, w, h), score in zip(boxes.tolist(), scores, strict=True)
        ]


def search(
    model: WindowModel, image: Image, levels: Iterable[Level], wraps: bool
) -> tuple[Boxes, NDArray[np.float64]]:
    """Run a window detector over some levels.

    Parameters
    ----------
    model : WindowModel
    image : (H, W) array of uint8
    levels : iterable of Level
    wraps : bool
        The columns close a full turn.

    Returns
    -------
    boxes : (n, 4) array
        ``x, y, w, h`` of the windows in the grid; across the seam ``x`` is below 0 or ``x + w`` above W.
    margins : (n,) array
        As `Hits.margins`.
    """
    return search_pyramid(model, Pyramid.of(image, wraps), levels)


def search_pyramid(
    model: WindowModel, pyramid: Pyramid, levels: Iterable[Level]
) -> tuple[Boxes, NDArray[np.float64]]:
    """Run a window detector over some levels of an image of which there is a pyramid; else as `search`."""
    found = [(np.empty((0, 4)), np.empty(0)), *(_hits(model, pyramid, level) for level in levels)]
    boxes, margins = zip(*found, strict=True)
    return np.concatenate(boxes), np.concatenate(margins)


def _hits(model: WindowModel, pyramid: Pyramid, level: Level) -> tuple[Boxes, NDArray[np.float64]]:
    """Boxes in the grid and margins of one level's hits."""
    window = np.array(model.card.window)
    view = pyramid.view(*level.ends(), level.window / window)
    found = model.hits(view.image)
    if len(found.margins) == 0:
        return np.empty((0, 4)), found.margins
    corners = view.corner + found.corners * view.pixel
    boxes = np.concatenate([corners, np.broadcast_to(window * view.pixel, corners.shape)], axis=1)
    kept = level.holds(boxes)
    return boxes[kept], found.margins[kept]


def _without_margin(boxes: Boxes, margin: float) -> Boxes:
    size = boxes[:, 2:] / (1 + 2 * margin)
    return np.concatenate([boxes[:, :2] + margin * size, size], axis=1)


def gray(image: Image) -> Image:
    """Return an image of three planes as gray, with the weights of `cv2.COLOR_RGB2GRAY`."""
    return image if image.ndim == 2 else np.asarray(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY), np.uint8)
