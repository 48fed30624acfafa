"""Cells of a few pixels each: means over them, and the rays in their middles."""

import cv2
import numpy as np
from numpy.typing import NDArray

from laserimg.scan import Float32Array


def cell_means(image: Float32Array, rows: int, columns: int) -> Float32Array:
    """Return the means over cells of `rows` x `columns` pixels.

    Parameters
    ----------
    image : (H, W) or (H, W, k) array of float32
        Cells at the lower and right border count the pixels that they lack as 0.

    Examples
    --------
    >>> cell_means(np.float32([[1, 3, 5, 4]]), 1, 2).tolist()
    [[2.0, 4.5]]
    """
    down, right = image.shape[0] // rows * rows, image.shape[1] // columns * columns
    # Only the rest at the border is copied, to fill it up: the whole of a fine scan would cost time.
    means = _shrink(image[:down, :right], rows, columns)
    if right < image.shape[1]:
        means = np.concatenate([means, _shrink(image[:down, right:], rows, columns)], axis=1)
    if down < image.shape[0]:
        means = np.concatenate([means, _shrink(image[down:], rows, columns)])
    return means


def _shrink(image: Float32Array, rows: int, columns: int) -> Float32Array:
    missing = -image.shape[0] % rows, -image.shape[1] % columns
    if any(missing):
        image = np.pad(image, ((0, missing[0]), (0, missing[1]), *[(0, 0)] * (image.ndim - 2)))
    height, width = image.shape[0] // rows, image.shape[1] // columns
    if not (height and width):
        return np.empty((height, width, *image.shape[2:]), np.float32)
    return np.asarray(cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA), np.float32)


def cell_middles(directions: Float32Array, rows: int, columns: int) -> Float32Array:
    """Return the direction of the middle pixel of every cell, (h, w, 3)."""
    return directions[_middles(directions.shape[0], rows)[:, None], _middles(directions.shape[1], columns)]


def enlarge_cells(
    cells: Float32Array, rows: int, columns: int, shape: tuple[int, int], wraps: bool
) -> Float32Array:
    """Interpolate linearly between the middles of cells, to an (H, W) grid of pixels."""
    padded = pad_cells(cells, wraps)
    large = cv2.resize(padded, None, fx=columns, fy=rows, interpolation=cv2.INTER_LINEAR)
    return np.asarray(large, np.float32)[rows : rows + shape[0], columns : columns + shape[1]]


def pad_cells(cells: NDArray, wraps: bool) -> NDArray:
    """Add one cell on every side: the border's own, or that beyond the seam of a full turn."""
    padded = cv2.copyMakeBorder(cells, 1, 1, 0, 0, cv2.BORDER_REPLICATE)
    return np.asarray(
        cv2.copyMakeBorder(padded, 0, 0, 1, 1, cv2.BORDER_WRAP if wraps else cv2.BORDER_REPLICATE)
    )


def _middles(pixels: int, size: int) -> NDArray[np.int64]:
    return np.minimum(np.arange(size // 2, pixels + size // 2, size), pixels - 1)
