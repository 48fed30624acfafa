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

# A place is searched if at least this share of the object's box there has a range that fits its size. The
# range in the middle alone will not do: that of a chair often looks through the gap to what is behind.
MIN_FITTING = 0.2
# Where to search is decided in cells: the object's box has so many across and down. An odd number, so that a
# box has one in the middle.
_CELLS = 5
# The pitch varies slowly, apart from noise: means over this part of the grid's sides are enough.
_PITCH_CELLS = 64
_NO_RETURN = -128
# Where the object is wider than here, not all of its width is asked whether it fits.
_NARROW = 0.1


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
    width_m, height_m = cast(Pair, card.object_size_m)
    steps = _steps(evidence, height_m)
    across, up = (_smooth(pitch) for pitch in evidence.pitch)
    ratios = width_m / height_m * up / across
    narrow = float(np.quantile(ratios, _NARROW))
    smallest = card.window[1] / MAX_ENLARGE / (1 + 2 * card.margin)
    largest = steps.shape[0] / (1 + 2 * card.margin)
    first, last = np.log([smallest, largest]) / np.log(SCALE_STEP)
    for step in np.arange(np.ceil(first), np.floor(last) + 1):
        yield from _levels_of_height(steps, float(step), ratios, narrow, card, evidence.scan.wraps)


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
    steps: NDArray[np.int8], step: float, ratios: Float32Array, narrow: float, card: Card, wraps: bool
) -> Iterator[Level]:
    """Yield the parts of the grid where the object has one height."""
    height, extent = SCALE_STEP**step, np.array(steps.shape[::-1])
    side = height * np.array([narrow, 1])
    cells = np.clip(np.rint(_CELLS * extent / side), 1, extent).astype(int)
    cell = extent / cells
    sampled = cv2.resize(steps, cells.tolist(), interpolation=cv2.INTER_NEAREST_EXACT)
    fitting = np.asarray(cv2.inRange(sampled, step - 1, step + 1), np.uint8)
    if not fitting.any():
        return
    marked = _means(fitting, side / cell, wraps) >= 255 * MIN_FITTING
    height *= 1 + 2 * card.margin
    widths = height * np.asarray(cv2.resize(ratios, cells.tolist(), interpolation=cv2.INTER_NEAREST_EXACT))
    marked &= (widths >= card.window[0] / MAX_ENLARGE) & (widths <= extent[0])
    for part in parts_of(marked, widths / np.float32(cell[0]), height / cell[1]):
        window = part.width * cell[0], height
        centres = marked[part.rows, part.columns]
        yield Level(window, (cell[0], cell[1]), (part.columns.start, part.rows.start), centres)


def _means(fitting: NDArray[np.uint8], box: NDArray[np.float64], wraps: bool) -> NDArray[np.uint8]:
    """Means over a box of cells around each cell; what lies outside the grid counts as 0."""
    width, height = (2 * np.rint((box - 1) / 2) + 1).astype(int).tolist()
    beyond = min(width, fitting.shape[1]) if wraps else 0
    padded = cv2.copyMakeBorder(fitting, 0, 0, beyond, beyond, cv2.BORDER_WRAP)
    means = np.asarray(cv2.blur(padded, (width, height), borderType=cv2.BORDER_CONSTANT), np.uint8)
    return means[:, beyond : beyond + fitting.shape[1]]
