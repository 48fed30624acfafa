"""Parts of an image at any size, box by box the same place in the grid."""

from dataclasses import dataclass
from math import ceil, floor, log2
from typing import NamedTuple, Self

import cv2
import numpy as np
from numpy.typing import NDArray

from laserimg.evidence import Image

Pair = NDArray[np.float64]


@dataclass(frozen=True, eq=False, slots=True)
class View:
    """A part of an image, resized.

    Parameters
    ----------
    image : (h, w) array of uint8
    corner : (2,) array
        Column and row of the grid where it begins; the column may lie beyond the seam.
    pixel : (2,) array
        Columns and rows of the grid for one pixel across and down.
    """

    image: Image
    corner: Pair
    pixel: Pair


@dataclass(frozen=True, eq=False, slots=True)
class Pyramid:
    """An image, again and again at half its size: to shrink a part much, not all its pixels are needed.

    Parameters
    ----------
    images : tuple of (h, w) or (h, w, c) arrays of uint8
        The largest first.
    beyond : int
        Columns that the largest has before column 0 of the grid, and after its last.
    """

    images: tuple[Image, ...]
    beyond: int

    @property
    def width(self) -> int:
        """Columns of the grid."""
        return self.images[0].shape[1] - 2 * self.beyond

    @classmethod
    def of(cls, image: Image, wraps: bool) -> Self:
        """Make the pyramid of an (H, W[, c]) image; a full turn gets half a turn more at both ends."""
        beyond = image.shape[1] // 2 + 1 if wraps else 0
        padded = cv2.copyMakeBorder(image, 0, 0, beyond, beyond, cv2.BORDER_WRAP)
        images = [np.asarray(padded, np.uint8)]
        while min(images[-1].shape[:2]) > 1:
            height, width = images[-1].shape[:2]
            images.append(_resized(images[-1], (width + 1) // 2, (height + 1) // 2))
        return cls(tuple(images), beyond)

    def view(self, first: Pair, last: Pair, pixel: Pair) -> View:
        """Return a part of the image, about as many columns and rows of the grid a pixel as asked for.

        Parameters
        ----------
        first, last : (2,) arrays
            Column and row where it begins and ends; what lies beyond the image is left out.
        pixel : (2,) array
            Columns and rows of the grid a pixel.
        """
        halved = int(max(log2(min(pixel)), 0))
        image = self.images[min(halved, len(self.images) - 1)]
        across = _stretch(image.shape[1], self.images[0].shape[1], self.beyond, first[0], last[0], pixel[0])
        down = _stretch(image.shape[0], self.images[0].shape[0], 0, first[1], last[1], pixel[1])
        part = image[down.pixels, across.pixels]
        return View(
            _resized(part, across.size, down.size),
            np.array([across.corner, down.corner]),
            np.array([across.pixel, down.pixel]),
        )


class _Stretch(NamedTuple):
    """One side of a view: which pixels of the image, and how many it has, where it begins, how large each."""

    pixels: slice
    size: int
    corner: float
    pixel: float


def _stretch(side: int, whole: int, beyond: int, first: float, last: float, pixel: float) -> _Stretch:
    own = whole / side
    begin = max(floor((first + beyond) / own), 0)
    end = max(min(ceil((last + beyond) / own), side), begin)
    extent = (end - begin) * own
    size = max(round(extent / pixel), 1)
    return _Stretch(slice(begin, end), size, begin * own - beyond, extent / size)


def _resized(image: Image, width: int, height: int) -> Image:
    # cv2.INTER_AREA samples, without a mean, as soon as one side grows.
    smaller = min(width, image.shape[1]), min(height, image.shape[0])
    shrunk = cv2.resize(image, smaller, interpolation=cv2.INTER_AREA)
    if smaller == (width, height):
        return np.asarray(shrunk, np.uint8)
    return np.asarray(cv2.resize(shrunk, (width, height), interpolation=cv2.INTER_LINEAR), np.uint8)
