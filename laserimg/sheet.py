"""How the grid of a scan lies in a picture: whole, or cut into strips, one below the other."""

from dataclasses import dataclass
from typing import Self

import cv2
import numpy as np
from numpy.typing import NDArray

from laserimg.boxes import split_at_seam
from laserimg.evidence import Box
from laserimg.geometry.pitch import angular_pitch
from laserimg.scan import Scan

Picture = NDArray[np.uint8]

MIN_WIDTH, MAX_WIDTH = 1400, 2800
# The grid is cut until the picture is about so many times as wide as high: 40 rows of 1800 columns in one
# piece are 50 pixels high, with captions all over them.
ASPECT, MOST_STRIPS = 2.0, 4
# Room above each of several strips, for captions.
GAP_PX = 100
_BETWEEN = 24


@dataclass(frozen=True, slots=True)
class Sheet:
    """A picture of a grid, with square pixels.

    Parameters
    ----------
    shape : (int, int)
        Rows and columns of the grid.
    wraps : bool
        The last column is next to the first.
    strips, columns : int
        How many strips, and how many columns of the grid each has; the last may have fewer.
    across, up : float
        Pixels of the picture that one of the grid takes.
    gap_px : int
        Empty rows of the picture above each strip.
    """

    shape: tuple[int, int]
    wraps: bool
    strips: int
    columns: int
    across: float
    up: float
    gap_px: int

    @classmethod
    def of(cls, scan: Scan) -> Self:
        """Return the sheet of a scan: shapes look right, and wide scans are cut."""
        across, up = (float(np.median(pitch)) for pitch in angular_pitch(scan))
        ratio = float(np.clip(up / max(across, 1e-6), 0.25, 4))
        rows, width = scan.shape
        strips = int(np.clip(round((width / (rows * ratio) / ASPECT) ** 0.5), 1, MOST_STRIPS))
        columns = -(-width // strips)
        wide = min(max(columns, MIN_WIDTH), MAX_WIDTH) / columns
        return cls(scan.shape, scan.wraps, strips, columns, wide, wide * ratio, GAP_PX if strips > 1 else 0)

    @property
    def strip_px(self) -> tuple[int, int]:
        """Height and width of a strip in the picture."""
        return max(1, round(self.shape[0] * self.up)), round(self.columns * self.across)

    def picture(self, image: Picture) -> Picture:
        """Return an image (H, W, 3) of the grid as a picture (h, w, 3)."""
        height, width = self.strip_px
        picture = np.full((self.strips * (self.gap_px + height), width, 3), _BETWEEN, np.uint8)
        for strip in range(self.strips):
            part = image[:, strip * self.columns : (strip + 1) * self.columns]
            size = round(part.shape[1] * self.across), height
            top = self._top(strip)
            picture[top : top + height, : size[0]] = cv2.resize(part, size, interpolation=cv2.INTER_NEAREST)
        return picture

    def places(self, box: Box) -> list[Box]:
        """Return where the pieces of a box lie in the picture: one for each strip and side of the seam."""
        pieces = split_at_seam(box, self.shape[1]) if self.wraps else [box]
        found = []
        for x, y, w, h in pieces:
            low, high = (min(max(edge, 0), self.shape[0]) for edge in (y, y + h))
            for strip in range(self.strips):
                first = strip * self.columns
                left, right = max(x, first), min(x + w, first + self.columns)
                if right > left:
                    corner = (left - first) * self.across, self._top(strip) + low * self.up
                    found.append((*corner, (right - left) * self.across, (high - low) * self.up))
        return found

    def _top(self, strip: int) -> int:
        """The row of the picture where a strip begins."""
        return strip * (self.gap_px + self.strip_px[0]) + self.gap_px
