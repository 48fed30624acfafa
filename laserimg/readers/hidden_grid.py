"""The grid of a scan whose file keeps only its returns, in the order they were measured."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from laserimg.projection import MIN_RANGE_M, ranges_of
from laserimg.readers.fan import fan_places, laser_centre
from laserimg.readers.lines import split_lines
from laserimg.readers.rings import ring_places, rings_of_elevation

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.intp]

_MIN_POINTS = 32
# A grid with fewer returns than one in so many rays is none.
_MAX_CELLS_PER_POINT = 10


@dataclass(frozen=True, eq=False, slots=True)
class HiddenGrid:
    """The place of every point on the grid, in any orientation.

    Parameters
    ----------
    row, column : (N,) arrays of int
    kept : (N,) array of bool
        False for points without a place: no measurement, or another point has its pixel.
    origin : (3,) array
        The centre of the laser, in the frame of the points.
    wraps : bool
        The columns are those of full turns.
    """

    row: IntArray
    column: IntArray
    kept: BoolArray
    origin: FloatArray
    wraps: bool

    def place(self, values: NDArray) -> NDArray:
        """Return (H, W, ...) values on the grid, 0 where there is no point."""
        shape = int(self.row[self.kept].max()) + 1, int(self.column[self.kept].max()) + 1
        grid = np.zeros((*shape, *values.shape[1:]), values.dtype)
        grid[self.row[self.kept], self.column[self.kept]] = values[self.kept]
        return grid


def recover(points: FloatArray, ring: NDArray[np.integer] | None = None) -> HiddenGrid | None:
    """Recover the grid of points in scan order, with missing beams left out.

    Parameters
    ----------
    points : (N, 3) array
        Metres.
    ring : (N,) array of int, optional
        The number of the beam of a spinning scanner, where the file keeps it.

    Returns
    -------
    HiddenGrid, or None if the points stand in no scan order.
    """
    length, known = ranges_of(points)
    if known.sum() < _MIN_POINTS:
        return None
    seen = points[known]
    directions = seen / length[known, None]
    if ring is not None:
        return _spinning(directions, ring[known], None, known)
    lines = split_lines(directions)
    if lines is None:
        return None
    if lines.begin is not None:
        return _spinning(directions, lines.of_point, lines.begin, known)
    origin = laser_centre(seen, lines)
    fan = fan_places(_unit(seen - origin), lines)
    if fan is None:
        ring = lines.of_point if lines.along_azimuth else rings_of_elevation(directions)
        return None if ring is None else _spinning(directions, ring, None, known)
    row, column = (fan.beam, fan.line) if fan.lines_are_columns else (fan.line, fan.beam)
    return _on_grid(row, column, fan.own, known, origin, wraps=False)


def _unit(vectors: FloatArray) -> FloatArray:
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return vectors / np.maximum(length, MIN_RANGE_M)


def _spinning(
    directions: FloatArray, ring: NDArray[np.integer], begin: float | None, known: BoolArray
) -> HiddenGrid | None:
    """Without a known beginning, a turn begins where the file does."""
    start = float(np.arctan2(directions[0, 1], directions[0, 0])) if begin is None else begin
    places = ring_places(directions, ring, start)
    if places is None:
        return None
    row, column, own, turns = places
    return _on_grid(row, column, own, known, np.zeros(3), turns)


def _on_grid(
    row: IntArray, column: IntArray, own: BoolArray, known: BoolArray, origin: FloatArray, wraps: bool
) -> HiddenGrid | None:
    """Keep the first written point of every pixel; None if the grid is too small or too empty."""
    shape = int(row.max()) + 1, int(column.max()) + 1
    if min(shape) < 2 or shape[0] * shape[1] > _MAX_CELLS_PER_POINT * len(row):
        return None
    candidates = np.flatnonzero(own)
    _, first = np.unique(row[own] * shape[1] + column[own], return_index=True)
    rows, columns = np.zeros((2, len(known)), np.intp)
    rows[known], columns[known] = row, column
    kept = np.zeros(len(known), bool)
    kept[np.flatnonzero(known)[candidates[first]]] = True
    return HiddenGrid(rows, columns, kept, origin, wraps)
