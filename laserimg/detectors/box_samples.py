"""Samples of boxes in a scan: pixels at shares of their sides, and the range of what is near in them."""

import numpy as np
from numpy.typing import NDArray

from laserimg.boxes import Boxes, as_boxes
from laserimg.evidence import Box, Evidence
from laserimg.geometry.floor import Floor
from laserimg.scan import Float32Array

# The range of a window is this quantile of the returns in it: a chair's middle looks through to the wall.
_NEAR_SHARE = 0.3
_RANGE_PLACES = (np.arange(12) + 0.5) / 12
_MIDDLE, _END = np.array([0.5]), np.array([1.0])
# In the first and in the last column of a box.
_SIDES = np.array([1e-3, 1.0])


def near_range(evidence: Evidence, ranges: Float32Array, boxes: Boxes) -> NDArray[np.float64]:
    """Return the range (n,) in metres of what is near in each of boxes (n, 4); 1 where nothing returned.

    Parameters
    ----------
    evidence : Evidence
    ranges : (H * W,) array of float32
        Metres; infinite where nothing returned.
    boxes : (n, 4) array
    """
    found = ranges[pixels_of(evidence, boxes, _RANGE_PLACES, _RANGE_PLACES)].astype(np.float64)
    near = quantiles(found, np.isfinite(found), (_NEAR_SHARE,))[0]
    return np.where(np.isfinite(near), np.clip(near, 0.1, 1e4), 1.0)


def box_size_m(evidence: Evidence, box: Box) -> tuple[float, float] | None:
    """Return width and height in metres of a box, at the range of what is near in it.

    None if nothing returned there.
    """
    boxes = as_boxes([box])
    found = evidence.scan.range.ravel()[pixels_of(evidence, boxes, _RANGE_PLACES, _RANGE_PLACES)]
    (near,) = quantiles(found, evidence.scan.counts(found), (_NEAR_SHARE,))
    if not np.isfinite(near[0]):
        return None
    (width,), (height,) = sizes_m(evidence, boxes, near.astype(np.float64))
    return float(width), float(height)


def side_ratio(evidence: Evidence, box: Box) -> float:
    """Return how high one upright side of a box is, in angle, as a share of the other; the higher one is 1.

    1 on a grid of elevations and azimuths. At the ends of a tilting fan all rows meet in its axis: there a
    box is a wedge.
    """
    ends = pixels_of(evidence, as_boxes([box]), _SIDES, _MIDDLE)[0]
    left, right = (float(pitch) for pitch in evidence.pitch[1].ravel()[ends])
    return min(left, right) / max(left, right, 1e-9)


def pixels_of(evidence: Evidence, boxes: Boxes, across: NDArray, down: NDArray) -> NDArray[np.intp]:
    """Return flattened positions (n, places) of places in boxes (n, 4), as shares of their sides.

    Parameters
    ----------
    evidence : Evidence
    boxes : (n, 4) array
    across, down : (k,), (m,) arrays
        places = m * k, row by row.
    """
    height, width = evidence.scan.shape
    columns = np.floor(boxes[:, 0, None] + boxes[:, 2, None] * across - 1e-6).astype(np.intp)
    rows = np.floor(boxes[:, 1, None] + boxes[:, 3, None] * down - 1e-6).astype(np.intp)
    columns = columns % width if evidence.scan.wraps else np.clip(columns, 0, width - 1)
    pixels = np.clip(rows, 0, height - 1)[:, :, None] * width + columns[:, None, :]
    return pixels.reshape(len(boxes), len(across) * len(down))


def grown(boxes: Boxes, share: float) -> Boxes:
    """Return boxes (n, 4) that reach over these on every side by a share of it."""
    return np.concatenate([boxes[:, :2] - share * boxes[:, 2:], boxes[:, 2:] * (1 + 2 * share)], axis=1)


def middles(evidence: Evidence, boxes: Boxes) -> NDArray[np.intp]:
    """Return the flattened position (n,) of the middle of each of boxes (n, 4)."""
    return pixels_of(evidence, boxes, _MIDDLE, _MIDDLE)[:, 0]


def sizes_m(
    evidence: Evidence, boxes: Boxes, range_m: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return width and height (n,) in metres of boxes (n, 4) at a range (n,) each."""
    middle = middles(evidence, boxes)
    across, up = (pitch.ravel()[middle] for pitch in evidence.pitch)
    return boxes[:, 2] * across * range_m, boxes[:, 3] * up * range_m


def foot_m(floor: Floor, evidence: Evidence, boxes: Boxes, range_m: NDArray[np.float64]) -> NDArray:
    """Return the height (n,) over the floor of the lower side of boxes (n, 4), in its middle, at a range."""
    bottom = pixels_of(evidence, boxes, _MIDDLE, _END)[:, 0]
    return floor.height_of(evidence.scan.directions.reshape(-1, 3)[bottom] * range_m[:, None])


def quantiles(
    values: NDArray, counted: NDArray[np.bool_], shares: tuple[float, ...]
) -> list[NDArray[np.float64]]:
    """Return the values (n,) at some shares of those counted in each row; NaN where none is.

    The values are not interpolated.

    Parameters
    ----------
    values : (n, k) array
    counted : (n, k) array of bool
    shares : tuple of float

    Examples
    --------
    >>> values = np.array([[3.0, 1, 2, 9]])
    >>> low, high = quantiles(values, np.array([[True, True, True, False]]), (0, 1))
    >>> float(low[0]), float(high[0])
    (1.0, 3.0)
    """
    ordered = np.sort(np.where(counted, values, np.inf), axis=1)
    last = counted.sum(axis=1) - 1
    ordered[last < 0] = np.nan
    row = np.arange(len(ordered))
    return [ordered[row, (share * np.maximum(last, 0)).astype(np.intp)] for share in shares]
