"""Metric search: every part of the grid with the window sizes that the object has there."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Self, cast

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
_NO_RETURN = -1e4
# Heights within one and a half steps of scale fit, as logarithms.
_FIT = 1.5 * float(np.log(SCALE_STEP))
# Where the object is wider than here, not all of its width is asked whether it fits.
_NARROW = 0.1


@dataclass(frozen=True, eq=False, slots=True)
class Sizes:
    """How large a metre is in a scan: what the metric searches of all detectors share.

    Parameters
    ----------
    heights : (H, W) array of float32
        Logarithm of a metre's height in pixels, by range and pitch; far below any where nothing returned.
    ratios : (h, w) array of float32
        Width by height in pixels of what is as wide as high, in a smaller grid.
    """

    heights: Float32Array
    ratios: Float32Array

    @classmethod
    def of(cls, evidence: Evidence) -> Self:
        """Measure a scan."""
        metre = np.maximum(evidence.scan.range * evidence.pitch[1], np.float32(1e-6))
        heights = -np.asarray(cv2.log(metre), np.float32)
        heights[~evidence.scan.valid] = _NO_RETURN
        across, up = (_smooth(pitch) for pitch in evidence.pitch)
        return cls(heights, up / across)


def metric_levels(evidence: Evidence, card: Card, sizes: Sizes | None = None) -> Iterator[Level]:
    """Yield the sizes that the object has in the grid, each with where it has it.

    The size in pixels is the size in metres over range times pitch, across and up separately, so
    that the widening of a grid at steep angles is in it. Heights go in steps of `SCALE_STEP`; a
    pixel fits the height of its range and others that differ by a factor of up to 1.31, since objects vary.

    Parameters
    ----------
    evidence : Evidence
    card : Card
        With `object_size_m`.
    sizes : Sizes, optional
        Of the same scan, if known already.
    """
    width_m, height_m = cast(Pair, card.object_size_m)
    sizes = sizes or Sizes.of(evidence)
    ratios = width_m / height_m * sizes.ratios
    narrow = float(np.quantile(ratios, _NARROW))
    smallest = card.window[1] / MAX_ENLARGE / (1 + 2 * card.margin)
    largest = evidence.scan.shape[0] / (1 + 2 * card.margin)
    first, last = np.log([smallest, largest]) / np.log(SCALE_STEP)
    for step in np.arange(np.ceil(first), np.floor(last) + 1).tolist():
        metre = step * np.log(SCALE_STEP) - np.log(height_m)
        fits = float(metre - _FIT), float(metre + _FIT)
        yield from _levels_of_height(
            sizes.heights, SCALE_STEP**step, fits, ratios, narrow, card, evidence.scan.wraps
        )


def _smooth(pitch: Float32Array) -> Float32Array:
    """The pitch without the noise of a head that turns in uneven steps, in a smaller grid."""
    size = [min(side, _PITCH_CELLS) for side in pitch.shape[::-1]]
    means = cv2.blur(cv2.resize(pitch, size, interpolation=cv2.INTER_AREA), (5, 5))
    return np.maximum(means, np.float32(1e-6))


def _levels_of_height(
    heights: Float32Array,
    height: float,
    fits: Pair,
    ratios: Float32Array,
    narrow: float,
    card: Card,
    wraps: bool,
) -> Iterator[Level]:
    """Yield the parts of the grid where the object has one height."""
    extent = np.array(heights.shape[::-1])
    side = height * np.array([narrow, 1])
    cells = np.clip(np.rint(_CELLS * extent / side), 1, extent).astype(int)
    cell = extent / cells
    sampled = cv2.resize(heights, cells.tolist(), interpolation=cv2.INTER_NEAREST_EXACT)
    fitting = np.asarray(cv2.inRange(sampled, *fits), np.uint8)
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
