"""Mixed pixels: beams that hit the edge of an object and what is behind it at once."""

import numpy as np

from laserimg.regions import Labels
from laserimg.scan import BoolArray, Float32Array

# Share of a mixed beam that must have hit the object in front.
MIN_SHARE = 1 / 3


def with_mixed_pixels(
    labels: Labels, range_m: Float32Array, loose: BoolArray, wraps: bool
) -> tuple[Labels, Float32Array]:
    """Return labels and ranges in which mixed pixels belong to the object in front.

    A loose pixel between a labelled pixel and a farther one on the opposite side (left and right,
    or above and below), with a range between theirs, was hit by a beam that saw both. If at least
    a third of it saw the near one, the edge of the object runs through the pixel: it joins the
    object, at the range of its neighbour, since its own is nobody's.

    On the office scan the wastebasket is 10 columns of clean returns and 2 of mixed ones: 0.20 m
    wide without them, 0.24 m with them.

    Parameters
    ----------
    labels : (H, W) array of int32
    range_m : (H, W) array of float32
    loose : (H, W) array of bool
        Returns that may be mixed: of no region, not floor, not a large plane.
    wraps : bool
        The columns close a full turn.
    """
    # The two-dimensional nonzero takes ten times as long.
    row, column = np.divmod(np.flatnonzero(loose), loose.shape[1])
    own = range_m[row, column]
    owner, nearest = np.zeros(len(own), np.int32), np.full(len(own), np.inf, np.float32)
    for rows, columns in ((0, 1), (0, -1), (1, 0), (-1, 0)):
        label, near = _at(labels, range_m, row + rows, column + columns, wraps)
        _, far = _at(labels, range_m, row - rows, column - columns, wraps)
        mixed = (label > 0) & (near < own) & (own < far) & (far - own >= MIN_SHARE * (far - near))
        mixed &= near < nearest
        owner[mixed], nearest[mixed] = label[mixed], near[mixed]
    owned = owner > 0
    if not owned.any():
        return labels, range_m
    new_labels, new_range = labels.copy(), range_m.copy()
    new_labels[row[owned], column[owned]] = owner[owned]
    new_range[row[owned], column[owned]] = nearest[owned]
    return new_labels, new_range


def _at(
    labels: Labels, range_m: Float32Array, row: np.ndarray, column: np.ndarray, wraps: bool
) -> tuple[Labels, Float32Array]:
    """Label and range at some places; 0 and 0 outside the grid."""
    height, width = labels.shape
    inside = (row >= 0) & (row < height)
    if not wraps:
        inside &= (column >= 0) & (column < width)
    row, column = np.where(inside, row, 0), np.where(inside, column % width, 0)
    return np.where(inside, labels[row, column], 0), np.where(inside, range_m[row, column], np.float32(0))
