"""Parts: rectangles of a mask, few and full enough to be searched quickly."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from math import sqrt

import cv2
import numpy as np

from laserimg.detectors.levels import SCALE_STEP
from laserimg.scan import BoolArray, Float32Array

Rectangle = tuple[slice, slice]

# The width of a window varies by no more than this within a part: it is wrong by one step of scale at most.
MAX_SPREAD = SCALE_STEP**2


@dataclass(frozen=True, slots=True)
class Part:
    """A rectangle of cells, as small as the marked cells in it allow.

    Parameters
    ----------
    rows, columns : slice
    narrowest, widest : float
        Width of a window in cells: the least and the largest at its marked cells.
    """

    rows: slice
    columns: slice
    narrowest: float
    widest: float

    @property
    def width(self) -> float:
        """The width that is wrong by the same factor for the narrowest and the widest."""
        return sqrt(self.narrowest * self.widest)

    @property
    def spread(self) -> float:
        """The factor from the narrowest to the widest."""
        return self.widest / self.narrowest

    def cost(self, height: float) -> float:
        """Return the pixels searched, in windows: those of the part and half a window more on every side."""
        rows, columns = self.rows.stop - self.rows.start, self.columns.stop - self.columns.start
        return (rows / height + 1) * (columns / self.width + 1)

    def halves(self) -> Iterator[tuple[Rectangle, ...]]:
        """Yield its upper and lower half, and its left and right half."""
        for axis, side in enumerate((self.rows, self.columns)):
            middle = (side.start + side.stop) // 2
            if side.start < middle:
                pair = slice(side.start, middle), slice(middle, side.stop)
                yield tuple((one, self.columns) if axis == 0 else (self.rows, one) for one in pair)


def parts_of(marked: BoolArray, widths: Float32Array, height: float) -> list[Part]:
    """Return disjoint rectangles that hold all marked cells.

    A part is halved while its windows differ too much in width, or when the halves are quicker to search.

    Parameters
    ----------
    marked : (h, w) array of bool
        Cells where a window may have its centre.
    widths : (h, w) array
        Width of a window there, in cells.
    height : float
        Height of a window, in cells.
    """
    found, waiting = [], _parts(marked, widths, [(slice(0, marked.shape[0]), slice(0, marked.shape[1]))])
    while waiting:
        part = waiting.pop()
        options = [_parts(marked, widths, halves) for halves in part.halves()]
        if options and part.spread > MAX_SPREAD:
            waiting += min(options, key=lambda halves: max(half.spread for half in halves))
            continue
        quickest = min(options, key=lambda halves: _cost(halves, height), default=[part])
        if _cost(quickest, height) < part.cost(height):
            waiting += quickest
        else:
            found.append(part)
    return found


def _cost(parts: list[Part], height: float) -> float:
    return sum(part.cost(height) for part in parts)


def _parts(marked: BoolArray, widths: Float32Array, rectangles: Iterable[Rectangle]) -> list[Part]:
    """The parts in some rectangles; none in one without a marked cell."""
    parts = []
    for rows, columns in rectangles:
        # These two calls of OpenCV take a tenth of the time of numpy's any, flatnonzero, min and max.
        inside = marked[rows, columns].view(np.uint8)
        x, y, width, height = cv2.boundingRect(inside)
        if width > 0:
            narrowest, widest, _, _ = cv2.minMaxLoc(widths[rows, columns], inside)
            top, left = rows.start + y, columns.start + x
            parts.append(Part(slice(top, top + height), slice(left, left + width), narrowest, widest))
    return parts
