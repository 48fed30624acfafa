"""Histograms over the cells of images, and their normalisation in overlapping blocks."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from laserimg.descriptors.layout import Layout
from laserimg.scan import BoolArray, Float32Array

# Objects worked on at a time: their images stay in the processor's cache.
CHUNK = 32
# Blocks much weaker than the strongest of their object fade out instead of showing their noise.
EPSILON = 0.02


@lru_cache(maxsize=64)
def cell_of_pixels(shape: tuple[int, int], cells: int) -> NDArray[np.int32]:
    """Return the cell (h, w) of every pixel, in raster order of `cells` x `cells` equal parts.

    Examples
    --------
    >>> cell_of_pixels((2, 4), 2).tolist()
    [[0, 0, 1, 1], [2, 2, 3, 3]]
    """
    row, column = ((np.arange(size) * cells // size).astype(np.int32) for size in shape)
    place = row[:, None] * cells + column
    place.setflags(write=False)
    return place


def cell_histograms(
    bins: NDArray[np.int32],
    counted: BoolArray | None,
    weights: Float32Array | None,
    count: int,
    cells: int,
) -> Float32Array:
    """Return the histogram of every cell.

    Parameters
    ----------
    bins : (n, h, w) array of int32
        Bin of every pixel, below `count`.
    counted : (n, h, w) array of bool or None
        Pixels that vote; None for all.
    weights : (n, h, w) array of float32 or None
        What a vote weighs; None for 1.
    count : int
        Bins of a histogram.
    cells : int
        Cells along each side.

    Returns
    -------
    (n, cells * cells, count) array of float32
    """
    number, height, width = bins.shape
    total = cells * cells
    place = bins + cell_of_pixels((height, width), cells) * np.int32(count)
    place += (np.arange(number, dtype=np.int32) * np.int32(total * count))[:, None, None]
    if counted is not None:
        place = place[counted]
        weights = None if weights is None else weights[counted]
    flat = None if weights is None else weights.ravel()
    histogram = np.bincount(place.ravel(), flat, number * total * count)
    return histogram.reshape(number, total, count).astype(np.float32)


def normalised_blocks(histograms: Float32Array, layout: Layout) -> Float32Array:
    """Return the descriptors of n objects: the histograms of every block, scaled to length 1.

    A block's histograms v become v / sqrt(|v|^2 + e^2) with e a fixed small part of the largest |v|
    of the object, so that a descriptor does not depend on the scale of the values; blocks without
    a vote stay 0.

    Parameters
    ----------
    histograms : (n, cells * cells, b) array of float32
    layout : Layout

    Returns
    -------
    (n, places * b) array of float32
        Blocks in raster order, within each its cells in raster order.
    """
    number, _, bins = histograms.shape
    k, q = layout.cells, layout.block
    places = k - q + 1
    grid = histograms.reshape(number, k, k, bins)
    energy = np.einsum("nijb,nijb->nij", grid, grid)
    windows = [(slice(i, i + places), slice(j, j + places)) for i in range(q) for j in range(q)]
    squared = np.zeros((number, places, places), np.float32)
    for window in windows:
        squared += energy[:, *window]
    squared += np.float32(EPSILON**2) * squared.max(axis=(1, 2), keepdims=True, initial=0)
    scale = np.where(squared > 0, 1 / np.sqrt(np.maximum(squared, np.finfo(np.float32).tiny)), 0)
    blocks = np.empty((number, places, places, q * q, bins), np.float32)
    for place, window in enumerate(windows):
        np.multiply(grid[:, *window], scale[..., None], out=blocks[:, :, :, place])
    return blocks.reshape(number, places * places * q * q * bins)
