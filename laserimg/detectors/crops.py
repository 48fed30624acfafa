"""Windows of images resampled to one size, all at once."""

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from laserimg.boxes import Boxes

# cv2.remap takes images of less than 2^15 rows; so many windows are resampled in one call.
_AT_ONCE = 512


def resampled(image: NDArray[np.uint8], boxes: Boxes, side: int, wraps: bool) -> NDArray[np.uint8]:
    """Return the pixels of boxes, each resampled to `side` x `side`.

    Boxes much larger than that are taken from the image at half, a quarter, ... of its size, so that no
    pixel of it is left out. What lies outside the grid is 0.

    Parameters
    ----------
    image : (H, W) or (H, W, c) array of uint8
    boxes : (n, 4) array
        ``x, y, w, h``; across the seam of a full turn too.
    side : int
    wraps : bool
        The columns close a full turn.

    Returns
    -------
    (n, side, side) or (n, side, side, c) array of uint8
    """
    out = np.zeros((len(boxes), side, side, *image.shape[2:]), np.uint8)
    if len(boxes) == 0:
        return out
    beyond = image.shape[1] // 2 if wraps else 0
    halvings = _halvings(boxes, side)
    for level, (small, scale) in enumerate(_halves(image, beyond, int(halvings.max()))):
        chosen = np.flatnonzero(halvings == level)
        for part in np.array_split(chosen, -(-len(chosen) // _AT_ONCE)) if len(chosen) else ():
            out[part] = _sampled(small, _shifted(boxes[part], image.shape[1], beyond), scale, side)
    return out


def _halvings(boxes: Boxes, side: int) -> NDArray[np.intp]:
    """How often the image may be halved and still have `side` pixels across and down a box."""
    pixels = np.maximum(boxes[:, 2:].min(axis=1), 1e-3) / side
    return np.floor(np.log2(np.maximum(pixels, 1))).astype(np.intp)


def _halves(
    image: NDArray[np.uint8], beyond: int, most: int
) -> Sequence[tuple[NDArray[np.uint8], tuple[float, float]]]:
    """The padded image and its halves, each with its pixels per pixel of the image, across and down."""
    whole = cv2.copyMakeBorder(image, 0, 0, beyond, beyond, cv2.BORDER_WRAP) if beyond else image
    levels, small = [(np.asarray(whole, np.uint8), (1.0, 1.0))], whole
    for _ in range(most):
        size = [max(1, extent // 2) for extent in small.shape[1::-1]]
        small = cv2.resize(small, size, interpolation=cv2.INTER_AREA)
        scale = small.shape[1] / whole.shape[1], small.shape[0] / whole.shape[0]
        levels.append((np.asarray(small, np.uint8), scale))
    return levels


def _shifted(boxes: Boxes, width: int, beyond: int) -> Boxes:
    """Boxes in the padded image, as near to its middle as a full turn allows."""
    if beyond == 0:
        return boxes
    moved = boxes.copy()
    middle = moved[:, 0] + moved[:, 2] / 2
    moved[:, 0] += beyond - np.floor(middle / width) * width
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
