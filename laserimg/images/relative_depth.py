"""Depth that does not depend on where an object stands: range less its mean in the surroundings."""

import numpy as np

from laserimg.geometry.cells import cell_means, cell_middles, enlarge_cells
from laserimg.geometry.pitch import pitch_of, sample_pitch
from laserimg.geometry.windows import WindowSums
from laserimg.scan import BoolArray, Float32Array, Scan

SURROUNDINGS_M = 0.45
# The mean is smooth; it is taken once per cell, of which so many reach from the middle of a typical window to
# its side.
CELLS_PER_SIDE = 8
MAX_CELL_PIXELS = 8


def relative_depth(scan: Scan, valid: BoolArray) -> Float32Array:
    """Return the range less its mean over +-0.45 m, in metres.

    The mean is over the valid returns in the upright window of pixels that spans 0.45 m to each
    side at the range of its middle. It is taken at every pixel of a coarse scan; at the middles of
    small cells of a fine one, and interpolated.

    Returns
    -------
    (H, W) array of float32
        0 where not valid.
    """
    size = _cell_size(scan, valid)
    share = cell_means(valid.astype(np.float32), size, size)
    range_m = scan.range if valid.all() else scan.range * valid
    difference = _means_around(scan, cell_means(range_m, size, size), share, size)
    np.subtract(scan.range, difference, out=difference)
    if range_m is not scan.range:
        difference *= valid
    return difference


def _means_around(scan: Scan, total: Float32Array, share: Float32Array, size: int) -> Float32Array:
    """(H, W) mean range of the returns around each pixel, interpolated between cells with returns."""
    across, up = pitch_of(cell_middles(scan.directions, size, size), scan.wraps)
    step = np.maximum(total / np.maximum(share, 1e-9), 1e-3)
    half_height, half_width = (
        np.clip(np.rint(SURROUNDINGS_M / np.maximum(step * pitch, 1e-6)), 0, max(share.shape)).astype(
            np.int64
        )
        for pitch in (up, across)
    )
    if scan.wraps:
        np.minimum(half_width, (share.shape[1] - 1) // 2, out=half_width)
    sums = WindowSums([total, share], scan.wraps, int(half_width.max()))
    rows, columns = np.nonzero(share > 0)
    around = sums.around(rows, columns, half_height[rows, columns], half_width[rows, columns])
    mean = np.zeros(share.shape, np.float32)
    mean[rows, columns] = around[:, 0] / around[:, 1]
    known = (share > 0).astype(np.float32)
    mean = enlarge_cells(mean, size, size, scan.shape, scan.wraps)
    if known.all():
        return mean
    mean /= np.maximum(enlarge_cells(known, size, size, scan.shape, scan.wraps), np.float32(1e-9))
    return mean


def _cell_size(scan: Scan, valid: BoolArray) -> int:
    """Pixels on a side of a cell."""
    range_m, across, up = sample_pitch(scan, valid)
    if range_m.size == 0:
        return 1
    side = SURROUNDINGS_M / np.median(range_m * np.maximum(np.maximum(across, up), 1e-6))
    return int(np.clip(side / CELLS_PER_SIDE, 1, min(MAX_CELL_PIXELS, max(1, min(scan.shape) // 4))))
