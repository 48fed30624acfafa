"""What a cascade is trained on: objects as its windows see them, and the parts of scans it will search."""

from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from laserimg.boxes import Boxes, iou
from laserimg.detectors.metric import metric_levels
from laserimg.detectors.pyramid import Pyramid
from laserimg.detectors.search import gray
from laserimg.evidence import Evidence
from laserimg.formats.card import Card

Pixels = NDArray[np.uint8]

# A window has one shape, objects have many: those that no window of that shape fits are not learnt.
MIN_FIT = 0.55
# Each object is learnt in so many places and sizes, as the search meets it: levels are 1.2 apart, and steps
# two pixels.
COPIES = 4
MAX_SHIFT, MAX_GROWTH = 0.06, 0.1


@dataclass(frozen=True, eq=False, slots=True)
class Samples:
    """Samples of one scan.

    Parameters
    ----------
    positives : (n, h, w) array of uint8
    views : tuple of (image, boxes)
        Parts of the scan as the metric search sees them, and where the objects are in each.
    """

    positives: Pixels
    views: tuple[tuple[Pixels, Boxes], ...]


@dataclass(frozen=True, eq=False)
class Views:
    """Images of a `Miner` that are views in memory."""

    views: list[tuple[Pixels, Boxes]]

    def __len__(self) -> int:
        return len(self.views)

    def image(self, number: int) -> Pixels:
        """Return the pixels of a view."""
        return self.views[number][0]

    def boxes(self, number: int) -> Boxes:
        """Return the boxes of the objects in a view."""
        return self.views[number][1]


def samples_of(
    evidence: Evidence,
    card: Card,
    learnt: Boxes,
    kept_out: Boxes,
    rng: np.random.Generator,
    views: bool = True,
) -> Samples:
    """Return the samples of a scan.

    Parameters
    ----------
    evidence : Evidence
    card : Card
        Window, image, size and margin.
    learnt : (n, 4) array
        Boxes of the objects.
    kept_out : (m, 4) array
        Boxes that are neither learnt nor background.
    rng : numpy.random.Generator
    views : bool
        Whether views are wanted too.
    """
    pyramid = Pyramid.of(gray(evidence.images[card.image]), evidence.scan.wraps)
    windows = [window for box in learnt for window in _windows(evidence, box, card, rng)]
    width, height = card.window
    pixels = [_crop(pyramid, window, card.window) for window in windows]
    positives = np.array(pixels, np.uint8).reshape(-1, height, width)
    if not views:
        return Samples(positives, ())
    return Samples(positives, tuple(_views(evidence, pyramid, card, np.concatenate([learnt, kept_out]))))


def no_samples(card: Card) -> Samples:
    """Return the samples of a scan that is not looked at."""
    width, height = card.window
    return Samples(np.empty((0, height, width), np.uint8), ())


def _windows(evidence: Evidence, box: NDArray, card: Card, rng: np.random.Generator) -> Iterator[NDArray]:
    """Windows of the card's shape around a box, with its margin; none if the shape does not fit."""
    middle, area = box[:2] + box[2:] / 2, box[2] * box[3]
    ratio = _ratio(evidence, middle, card)
    size = np.sqrt(area) * np.array([np.sqrt(ratio), 1 / np.sqrt(ratio)])
    if iou([[*(middle - size / 2), *size]], [box])[0, 0] < MIN_FIT:
        return
    for copy in range(COPIES):
        growth = np.exp(rng.uniform(-MAX_GROWTH, MAX_GROWTH)) if copy else 1.0
        shift = rng.uniform(-MAX_SHIFT, MAX_SHIFT, 2) * size if copy else np.zeros(2)
        window = size * growth * (1 + 2 * card.margin)
        yield np.concatenate([middle + shift - window / 2, window])


def _ratio(evidence: Evidence, middle: NDArray, card: Card) -> float:
    """Width by height in pixels of the card's object at a place."""
    assert card.object_size_m is not None
    rows, columns = evidence.scan.shape
    row, column = min(max(int(middle[1]), 0), rows - 1), int(middle[0]) % columns
    around = (slice(max(row - 2, 0), row + 3), slice(max(column - 2, 0), column + 3))
    across, up = (float(pitch[around].mean()) for pitch in evidence.pitch)
    return card.object_size_m[0] / card.object_size_m[1] * up / max(across, 1e-6)


def _crop(pyramid: Pyramid, window: NDArray, size: tuple[int, int]) -> Pixels:
    """Pixels of a window, resized as the detector's pyramid does: means where it shrinks."""
    pixel = window[2:] / np.array(size)
    view = pyramid.view(window[:2], window[:2] + window[2:], pixel)
    places = [
        (window[i] + (np.arange(size[i]) + 0.5) * pixel[i] - view.corner[i]) / view.pixel[i] - 0.5
        for i in (0, 1)
    ]
    across, down = np.meshgrid(*(place.astype(np.float32) for place in places))
    found = cv2.remap(view.image, across, down, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(found, np.uint8)


def _views(evidence: Evidence, pyramid: Pyramid, card: Card, boxes: Boxes) -> Iterator[tuple[Pixels, Boxes]]:
    """Parts of the image at the scale of the window, as the metric search looks at them."""
    window = np.array(card.window)
    columns = evidence.scan.shape[1]
    turns = (-columns, 0, columns) if evidence.scan.wraps else (0,)
    everywhere = (
        np.concatenate([boxes + np.array([turn, 0, 0, 0]) for turn in turns]) if len(boxes) else boxes
    )
    for level in metric_levels(evidence, card):
        view = pyramid.view(*level.ends(), level.window / window)
        if view.image.shape[0] >= window[1] and view.image.shape[1] >= window[0]:
            corners = (everywhere[:, :2] - view.corner) / view.pixel
            yield view.image, np.concatenate([corners, everywhere[:, 2:] / view.pixel], axis=1)
