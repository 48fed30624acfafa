"""The grid of a scan whose file keeps only its returns, in the order they were measured."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from laserimg.readers.beams import lattice_index, usual_step
from laserimg.readers.grid import ranges_of
from laserimg.readers.lines import Lines, split_lines

FloatArray = NDArray[np.float64]

# The head stood still: lines nearer than this are one, if lines are usually further apart.
_SAME_LINE_RAD = np.radians(0.1)
_SAME_LINE_PART = 0.25


@dataclass(frozen=True, eq=False, slots=True)
class HiddenGrid:
    """The place of every point on the grid.

    Parameters
    ----------
    row, column : (N,) arrays of int
    kept : (N,) array of bool
        False for points without place: no measurement, or its pixel was taken.
    shape : tuple of int
    """

    row: NDArray[np.intp]
    column: NDArray[np.intp]
    kept: NDArray[np.bool_]
    shape: tuple[int, int]

    def place(self, values: NDArray) -> NDArray:
        """Return (H, W, ...) values on the grid, 0 where there is no point."""
        grid = np.zeros((*self.shape, *values.shape[1:]), values.dtype)
        grid[self.row[self.kept], self.column[self.kept]] = values[self.kept]
        return grid


def recover(points: FloatArray) -> HiddenGrid | None:
    """Recover the grid of points in scan order, with missing beams left out.

    Parameters
    ----------
    points : (N, 3) array
        Metres, in the scanner's frame.

    Returns
    -------
    HiddenGrid, or None if the points stand in no scan order.
    """
    length, known = ranges_of(points)
    directions = points[known] / length[known, None]
    lines = split_lines(directions) if len(directions) > 1 else None
    if lines is None or lines.pole == "ring":
        return None
    beam, line = _fan(directions, lines)
    row, column = (beam, line) if lines.pole == "z" else (line, beam)
    return _first_written(row, column, known)


def _fan(directions: FloatArray, lines: Lines) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Number of the beam and of the distinct line of every point of a fan that pans or tilts."""
    along, first, second = _about(directions, lines.pole)
    line = lines.line_of_point
    heading = np.arctan2(np.add.reduceat(second, lines.starts), np.add.reduceat(first, lines.starts))
    # Measured from the line's own heading, so that a fan of more than half a turn stays one line.
    ahead = first * np.cos(heading)[line] + second * np.sin(heading)[line]
    angle = np.arctan2(along, ahead)
    steps = np.diff(angle)[np.diff(line) == 0]
    beam, _ = lattice_index(angle, usual_step(steps))
    return beam, _distinct(heading)[line]


def _about(directions: FloatArray, pole: str) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The coordinate along the pole, and the two across it."""
    x, y, z = directions.T
    return (z, x, y) if pole == "z" else (y, z, x)


def _distinct(heading: FloatArray) -> NDArray[np.intp]:
    """Number lines by heading, those nearer than a standing head's jitter as one."""
    order = np.argsort(heading, kind="stable")
    steps = np.diff(heading[order])
    limit = min(_SAME_LINE_RAD, _SAME_LINE_PART * float(np.percentile(steps, 75)))
    number = np.empty(len(heading), np.intp)
    number[order] = np.r_[0, np.cumsum(steps >= limit)]
    return number


def _first_written(row: NDArray[np.intp], column: NDArray[np.intp], known: NDArray[np.bool_]) -> HiddenGrid:
    shape = int(row.max()) + 1, int(column.max()) + 1
    _, first = np.unique(row * shape[1] + column, return_index=True)
    places = np.flatnonzero(known)
    full_row, full_column = np.zeros(len(known), np.intp), np.zeros(len(known), np.intp)
    full_row[places], full_column[places] = row, column
    kept = np.zeros(len(known), bool)
    kept[places[first]] = True
    return HiddenGrid(full_row, full_column, kept, shape)
