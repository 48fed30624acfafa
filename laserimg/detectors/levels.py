"""Levels: which window sizes are searched, and where in the grid; plain search has every size everywhere."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from laserimg.boxes import Boxes
from laserimg.evidence import Evidence
from laserimg.formats.card import Card
from laserimg.geometry.pitch import sample_pitch
from laserimg.images import SquareGrid
from laserimg.scan import BoolArray

Pair = tuple[float, float]

# From level to level windows grow by this factor.
SCALE_STEP = 1.2
# Images are enlarged up to this much to find objects smaller than the window.
MAX_ENLARGE = 2.0
# Plain search enlarges images so coarse that a window of the detector's own size covers more than this.
ENLARGE_ABOVE_DEG = 5.0


@dataclass(frozen=True, eq=False, slots=True)
class Level:
    """Windows of one size, with their centres in some cells of the grid.

    Parameters
    ----------
    window : (float, float)
        Width and height in pixels of the grid.
    cell : (float, float)
        Width and height of a cell in pixels of the grid.
    first : (int, int)
        Column and row of the first cell of `centres`, counted in cells.
    centres : (h, w) array of bool
        The cells that the centre of a window may be in.
    """

    window: Pair
    cell: Pair
    first: tuple[int, int]
    centres: BoolArray

    def ends(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return column and row where the first windows begin, and those where the last ones end.

        They may lie outside the grid: beyond the seam or the border.
        """
        half, first = np.array(self.window) / 2, np.array(self.first)
        return first * self.cell - half, (first + self.centres.shape[::-1]) * self.cell + half

    def holds(self, boxes: Boxes) -> BoolArray:
        """Return which windows have their centre in the cells: of all levels of one size, one holds it."""
        centres = (boxes[:, :2] + boxes[:, 2:] / 2) / self.cell
        column, row = (np.floor(centres).astype(np.int64) - self.first).T
        rows, columns = self.centres.shape
        inside = (column >= 0) & (column < columns) & (row >= 0) & (row < rows)
        inside[inside] = self.centres[row[inside], column[inside]]
        return inside


def plain_levels(evidence: Evidence, card: Card) -> Iterator[Level]:
    """Yield every window size up to the image's, everywhere.

    Pixels count as `SquareGrid` makes them square.
    """
    height, width = evidence.scan.shape
    up, across = SquareGrid.of(evidence.scan).scale
    _, _, pitch_up = sample_pitch(evidence.scan, np.ones(evidence.scan.shape, np.bool_))
    own_deg = np.degrees(max(card.window) * np.median(pitch_up) / up)
    enlarge = float(np.clip(own_deg / ENLARGE_ABOVE_DEG, 1, MAX_ENLARGE))
    window = card.window[0] / across / enlarge, card.window[1] / up / enlarge
    everywhere = np.ones((1, 1), np.bool_)
    while window[0] <= width and window[1] <= height:
        yield Level(window, (width, height), (0, 0), everywhere)
        window = window[0] * SCALE_STEP, window[1] * SCALE_STEP
