"""Samples of boxes in a scan: pixels at shares of their sides, and the range of what is near in them."""

import numpy as np
from numpy.typing import NDArray

from laserimg.boxes import Boxes, as_boxes
from laserimg.evidence import Box, Evidence
from laserimg.geometry.floor import Floor
from laserimg.scan import Float32Array
from laserimg.seen_box import SeenBox

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


def seen_box(evidence: Evidence, box: Box) -> SeenBox:
    """Return what a box shows by itself."""
    boxes = as_boxes([box])
    found = evidence.scan.range.ravel()[pixels_of(evidence, boxes, _RANGE_PLACES, _RANGE_PLACES)]
    (near,) = quantiles(found, evidence.scan.counts(found), (_NEAR_SHARE,))
    width, height = (float(size[0]) for size in sizes_m(evidence, boxes, near.astype(np.float64)))
    ends = pixels_of(evidence, boxes, _SIDES, _MIDDLE)[0]
    left, right = (float(pitch) for pitch in evidence.pitch[1].ravel()[ends])
    is_seen = bool(np.isfinite(near[0]))
    return SeenBox(
        width if is_seen else None,
        height if is_seen else None,
        min(left, right) / max(left, right, 1e-9),
        _cut(box, evidence.scan.shape, evidence.scan.wraps),
    )


def _cut(box: Box, shape: tuple[int, int], wraps: bool) -> frozenset[str]:
    """Which sides of a box end in the first or in the last pixel of the grid."""
    x, y, w, h = box
    rows, columns = shape
    across = not wraps and (x < 1 or x + w > columns - 1)
    upright = y < 1 or y + h > rows - 1
    return frozenset(name for name, is_cut in (("width", across), ("height", upright)) if is_cut)


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
