"""Windows in metres: how deep and how high over the floor their cells lie, and how large what is near is."""

import numpy as np
from numpy.typing import NDArray

from laserimg.boxes import Boxes
from laserimg.detectors.box_samples import foot_m, grown, middles, near_range, pixels_of, quantiles, sizes_m
from laserimg.evidence import Evidence
from laserimg.scan import Float32Array

# Windows reach over their box on every side by these shares of it: what stands there, and what stands around.
SURROUNDINGS = (0.2, 1.0)
CELLS = 8
# Samples of a window across and down.
_SAMPLES = 16
# Where a cell lies is of interest within these limits, in metres from the box's range and over the floor.
_DEPTHS, _HEIGHTS = (-0.6, 1.2), (-0.5, 3.0)
# Of a cell without a return, or of a height without a floor.
UNKNOWN = -1.0
# Returns this near to the box's range, in metres, are taken for the object's: a flat one, a deep one.
_NEAR = (0.15, 0.4)
_SHARES = (0.05, 0.5, 0.95)
# Numbers of a box.
METRIC_NUMBERS = len(SURROUNDINGS) * 3 * CELLS**2 + 8 + len(_NEAR) * 10


def metric_cells(evidence: Evidence, ranges: Float32Array, boxes: Boxes) -> Float32Array:
    """Return numbers in metres for each box: a seat or a rim is as high whatever the range.

    1. For two windows, one a little larger than the box and one three times as large, of 8 x 8 cells each:
       the mean range beyond that of the box (`near_range`), the mean height over the floor, the share of
       returns.
    2. Range, sine of the elevation, width, height, height of the foot, width over height, returns, their
       share.
    3. Of the returns near `near_range`: their share; height over the floor at 5, 50 and 95 %, and how
       far they reach; how far they reach sideways; the same in depth as in height.

    Parameters
    ----------
    evidence : Evidence
    ranges : (H * W,) array of float32
        Metres; infinite where nothing returned.
    boxes : (n, 4) array
        ``x, y, w, h`` in pixels of the grid.

    Returns
    -------
    (n, d) array of float32
    """
    near = near_range(evidence, ranges, boxes)
    parts = []
    for share in SURROUNDINGS:
        depth, height, known, _ = _sampled(evidence, ranges, grown(boxes, share), near)
        parts += [
            _cell_means(np.clip(depth, *_DEPTHS), known),
            _cell_means(np.clip(height, *_HEIGHTS), known & np.isfinite(height)),
            _shares(known),
        ]
    parts.append(_sizes(evidence, ranges, boxes, near))
    return np.concatenate(parts, axis=1, dtype=np.float32)


def _sampled(
    evidence: Evidence, ranges: Float32Array, boxes: Boxes, near: NDArray[np.float64]
) -> tuple[NDArray, NDArray, NDArray[np.bool_], NDArray]:
    """Depth and height (n, samples) in metres, which of them returned, and points (n, samples, 3)."""
    places = (np.arange(_SAMPLES) + 0.5) / _SAMPLES
    pixels = pixels_of(evidence, boxes, places, places)
    found = ranges[pixels]
    known = np.isfinite(found)
    found = np.where(known, found, 0)
    points = evidence.scan.directions.reshape(-1, 3)[pixels] * found[..., None]
    if evidence.floor is None:
        height = np.full(found.shape, np.nan)
    else:
        height = evidence.floor.height_of(points.reshape(-1, 3)).reshape(found.shape)
    return found - near[:, None], height, known, points


def _cell_means(values: NDArray, known: NDArray[np.bool_]) -> NDArray:
    """(n, cells) means of what is known."""
    count = _by_cell(known).sum(axis=(2, 4))
    total = _by_cell(np.where(known, values, 0)).sum(axis=(2, 4))
    return np.where(count > 0, total / np.maximum(count, 1), UNKNOWN).reshape(len(values), CELLS**2)


def _shares(known: NDArray[np.bool_]) -> NDArray:
    return _by_cell(known).mean(axis=(2, 4)).reshape(len(known), CELLS**2)


def _by_cell(values: NDArray) -> NDArray:
    side = _SAMPLES // CELLS
    return values.reshape(len(values), CELLS, side, CELLS, side)


def _sizes(evidence: Evidence, ranges: Float32Array, boxes: Boxes, near: NDArray[np.float64]) -> NDArray:
    """(n, d) sizes of the boxes and of the returns near their range."""
    width, high = sizes_m(evidence, boxes, near)
    direction = evidence.scan.directions.reshape(-1, 3)[middles(evidence, boxes)].astype(np.float64)
    depth, height, known, points = _sampled(evidence, ranges, boxes, near)
    share = known.mean(axis=1)
    floor = evidence.floor
    foot = np.full(len(boxes), np.nan) if floor is None else foot_m(floor, evidence, boxes, near)
    area = boxes[:, 2] * boxes[:, 3]
    up = evidence.scan.up
    found = [near, direction @ up, width, high, foot, width / np.maximum(high, 1e-3), share * area, share]
    sideways = (points * _sideways(direction, up)[:, None, :]).sum(axis=2)
    for limit in _NEAR:
        close = known & (np.abs(depth) < limit)
        found.append(close.mean(axis=1))
        low, middle_of, top = quantiles(height, close & np.isfinite(height), _SHARES)
        left, _, right = quantiles(sideways, close, _SHARES)
        front, between, back = quantiles(depth, close, _SHARES)
        found += [low, middle_of, top, top - low, right - left, front, between, back, back - front]
    return np.where(np.isfinite(found), found, UNKNOWN).T


def _sideways(directions: NDArray[np.float64], up: NDArray[np.float64]) -> NDArray[np.float64]:
    """(n, 3) level unit vectors across the view."""
    across = np.cross(up, directions)
    return across / np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-6)
