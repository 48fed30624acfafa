"""HONV of windows of 8 bits: what a pixel votes for is looked up, not calculated."""

from functools import cache

import cv2
import numpy as np
from numpy.typing import NDArray

from laserimg.descriptors.cells import cell_histograms, normalised_blocks
from laserimg.descriptors.honv import normal_bins
from laserimg.descriptors.layout import Layout
from laserimg.scan import Float32Array


def honv_of_colours(colours: NDArray[np.uint8], layout: Layout) -> Float32Array:
    """Return the HONV of normals in the view frame, as `honv` gives it of their unit vectors.

    Parameters
    ----------
    colours : (n, h, w, 3) array of uint8
        Towards the scanner, right, up; 0, 0, 0 for none.
    layout : Layout

    Returns
    -------
    (n, layout.honv_length) array of float32
    """
    columns, squares, limits = _normal_tables(layout)
    towards = colours[..., 0]
    sideways = colours[..., 1].astype(np.int32) * 256 + colours[..., 2]
    bins, square = columns[sideways], squares[sideways]
    for limit in limits:
        bins += (square > limit[towards]) * np.int32(layout.n_phi)
    known = (towards > 0) | (sideways > 0)
    histograms = cell_histograms(bins, known, None, layout.n_theta * layout.n_phi, layout.cells)
    return normalised_blocks(histograms, layout)


@cache
def _normal_tables(layout: Layout) -> tuple[NDArray[np.int32], Float32Array, Float32Array]:
    """Bins of phi and squared lengths by right and up; limits of these between bins of theta, by towards.

    Values of 8 bits stand for odd numbers of 1/255: no three of them have theta at 30 or 60 degrees.
    """
    values = np.arange(256, dtype=np.float32) / np.float32(127.5) - 1
    right, up = (one.ravel() for one in np.meshgrid(values, values, indexing="ij"))
    normals = np.stack([right, -up, np.full_like(up, -1)], axis=-1)
    columns = normal_bins(normals, layout) % np.int32(layout.n_phi)
    steps = np.tan(np.pi / 2 * np.arange(1, layout.n_theta) / layout.n_theta)
    limits = (steps[:, None] * np.maximum(values, 1e-3)) ** 2
    squares = np.asarray(right**2 + up**2, np.float32)
    return np.asarray(columns, np.int32), squares, limits.astype(np.float32)


def cell_means(pixels: NDArray[np.uint8], cells: int) -> Float32Array:
    """Return the means of `cells` x `cells` cells of (n, s, s) or (n, s, s, c) windows, as (n, d), 0 to 1."""
    number, side = pixels.shape[:2]
    planes = int(np.prod(pixels.shape[3:]))
    if number == 0:
        return np.zeros((0, cells * cells * planes), np.float32)
    column = pixels.reshape(number * side, side, planes).astype(np.float32)
    means = cv2.resize(column, (cells, number * cells), interpolation=cv2.INTER_AREA)
    return np.asarray(means, np.float32).reshape(number, -1) / np.float32(255)
