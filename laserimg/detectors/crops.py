"""Windows of images resampled to one size, all at once."""

import cv2
import numpy as np
from numpy.typing import NDArray

from laserimg.boxes import Boxes
from laserimg.detectors.pyramid import Pyramid

# cv2.remap takes images of less than 2^15 rows; so many windows are resampled in one call.
_AT_ONCE = 512


def resampled(pyramid: Pyramid, boxes: Boxes, side: int) -> NDArray[np.uint8]:
    """Return the pixels of boxes, each resampled to `side` x `side`.

    Boxes much larger than that are taken from the image at half, a quarter, ... of its size, so that no
    pixel of it is left out. What lies outside the grid is 0.

    Parameters
    ----------
    pyramid : Pyramid
        Of an image of c planes, or of one.
    boxes : (n, 4) array
        ``x, y, w, h``; across the seam of a full turn too.
    side : int

    Returns
    -------
    (n, side, side) or (n, side, side, c) array of uint8
    """
    whole = pyramid.images[0]
    out = np.zeros((len(boxes), side, side, *whole.shape[2:]), np.uint8)
    halvings = np.minimum(_halvings(boxes, side), len(pyramid.images) - 1)
    for level in np.unique(halvings):
        image = pyramid.images[level]
        scale = image.shape[1] / whole.shape[1], image.shape[0] / whole.shape[0]
        chosen = np.flatnonzero(halvings == level)
        for part in np.array_split(chosen, -(-len(chosen) // _AT_ONCE)):
            out[part] = _sampled(image, _shifted(boxes[part], pyramid), scale, side)
    return out


def _halvings(boxes: Boxes, side: int) -> NDArray[np.intp]:
    """How often the image may be halved and still have `side` pixels across and down a box."""
    pixels = np.maximum(boxes[:, 2:].min(axis=1), 1e-3) / side
    return np.floor(np.log2(np.maximum(pixels, 1))).astype(np.intp)


def _shifted(boxes: Boxes, pyramid: Pyramid) -> Boxes:
    """Boxes in the padded image, as near to its middle as a full turn allows."""
    if pyramid.beyond == 0:
        return boxes
    moved = boxes.copy()
    middle = moved[:, 0] + moved[:, 2] / 2
    moved[:, 0] += pyramid.beyond - np.floor(middle / pyramid.width) * pyramid.width
    return moved


def _sampled(
    image: NDArray[np.uint8], boxes: Boxes, scale: tuple[float, float], side: int
) -> NDArray[np.uint8]:
    places = (np.arange(side) + 0.5) / side
    x, y = ((boxes[:, i, None] + places * boxes[:, i + 2, None]) * scale[i] - 0.5 for i in (0, 1))
    across = np.repeat(x, side, axis=0).astype(np.float32)
    down = np.broadcast_to(y.reshape(-1, 1), across.shape).astype(np.float32)
    found = cv2.remap(image, across, down, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT)
    return np.asarray(found, np.uint8).reshape(len(boxes), side, side, *image.shape[2:])
