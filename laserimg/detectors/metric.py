"""Metric search: every part of the grid with the window sizes that the object has there."""

from collections.abc import Iterator
from typing import cast

import cv2
import numpy as np
from numpy.typing import NDArray

from laserimg.detectors.levels import MAX_ENLARGE, SCALE_STEP, Level, Pair
from laserimg.detectors.parts import parts_of
from laserimg.evidence import Evidence
from laserimg.formats.card import Card
from laserimg.scan import Float32Array

# A window is searched if at least this share of its pixels has a range that fits its size. The range in the
# middle alone will not do: that of a chair often looks through the gap to what is behind.
MIN_FITTING = 0.15
# Where windows are searched is decided in cells, about so many to a side of a window.
_CELLS_PER_WINDOW = 4
# The pitch varies slowly, apart from noise: means over this part of the grid's sides are enough.
_PITCH_CELLS = 128
_NO_RETURN = -128


def metric_levels(evidence: Evidence, card: Card) -> Iterator[Level]:
    """Yield the sizes that the object has in the grid, each with where it has it.

    The size in pixels is the size in metres over range times pitch, across and up separately, so
    that the widening of a grid at steep angles is in it. Heights go in steps of `SCALE_STEP`; a
    pixel fits the height of its range and the next smaller and larger one, since objects vary.

    Parameters
    ----------
    evidence : Evidence
    card : Card
        With `object_size_m`.
    """
    width_m, height_m = (side * (1 + 2 * card.margin) for side in cast(Pair, card.object_size_m))
    steps = _steps(evidence, height_m)
    across, up = (_smooth(pitch) for pitch in evidence.pitch)
    ratios = width_m / height_m * up / across
    first = np.ceil(np.log(card.window[1] / MAX_ENLARGE) / np.log(SCALE_STEP))
    last = np.floor(np.log(steps.shape[0]) / np.log(SCALE_STEP))
    for step in np.arange(first, last + 1):
        yield from _levels_of_height(steps, float(step), ratios, card, evidence.scan.wraps)


def _steps(evidence: Evidence, height_m: float) -> NDArray[np.int8]:
    """(H, W) steps of `SCALE_STEP` of the object's height in pixels."""
    pixels = np.float32(height_m) / np.maximum(evidence.scan.range * evidence.pitch[1], np.float32(1e-6))
    steps = np.rint(np.log(pixels) / np.float32(np.log(SCALE_STEP)))
    return np.where(evidence.scan.valid, np.clip(steps, -99, 99), np.float32(_NO_RETURN)).astype(np.int8)


def _smooth(pitch: Float32Array) -> Float32Array:
    """The pitch without the noise of a head that turns in uneven steps, in a smaller grid."""
    size = [min(side, _PITCH_CELLS) for side in pitch.shape[::-1]]
    means = cv2.blur(cv2.resize(pitch, size, interpolation=cv2.INTER_AREA), (5, 5))
    return np.maximum(means, np.float32(1e-6))


def _levels_of_height(
    steps: NDArray[np.int8], step: float, ratios: Float32Array, card: Card, wraps: bool
) -> Iterator[Level]:
    """Yield the parts of the grid where the object has this height."""
    height, extent = float(SCALE_STEP**step), np.array(steps.shape)
    sides = np.array([height, height * float(np.median(ratios))])
    shape = np.clip(np.rint(_CELLS_PER_WINDOW * extent / sides), 1, extent).astype(int)
    cell = extent / shape
    around = _sampled(ratios, shape)
    fitting = np.asarray(cv2.inRange(_sampled(steps, shape), step - 1, step + 1), np.uint8)
    marked = _means(fitting, sides / cell, wraps) >= 255 * MIN_FITTING
    marked &= (around * height >= card.window[0] / MAX_ENLARGE) & (around * height <= extent[1])
    for part in parts_of(marked, around * (cell[0] / cell[1]), height / cell[0]):
        window = part.ratio * height * cell[1] / cell[0], height
        centres = marked[part.rows, part.columns]
        yield Level(window, (cell[1], cell[0]), (part.columns.start, part.rows.start), centres)


def _sampled(grid: NDArray, shape: NDArray[np.intp]) -> NDArray:
    """The values in the middles of cells."""
    rows, columns = (
        ((np.arange(cells) + 0.5) * extent / cells).astype(int)
        for cells, extent in zip(shape, grid.shape, strict=True)
    )
    return grid[rows[:, None], columns]


def _means(fitting: NDArray[np.uint8], window: NDArray[np.float64], wraps: bool) -> NDArray[np.uint8]:
    """Means over a window around each cell; what lies outside the grid counts as 0."""
    height, width = (2 * np.rint((window - 1) / 2) + 1).astype(int).tolist()
    beyond = min(width, fitting.shape[1]) if wraps else 0
    padded = cv2.copyMakeBorder(fitting, 0, 0, beyond, beyond, cv2.BORDER_WRAP)
    means = np.asarray(cv2.blur(padded, (width, height), borderType=cv2.BORDER_CONSTANT), np.uint8)
    return means[:, beyond : beyond + fitting.shape[1]]
