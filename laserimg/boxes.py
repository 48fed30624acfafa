"""Boxes in pixels of a scan's own grid, also across the seam of a full turn."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from laserimg.errors import LaserImgError

Boxes = NDArray[np.float64]


def as_boxes(boxes: ArrayLike) -> Boxes:
    """Return ``x, y, w, h`` rows as an (n, 4) array.

    Raises
    ------
    LaserImgError
        If the shape is wrong, a value is not finite or a box has no area.
    """
    array = (
        np.asarray(boxes, np.float64).reshape(-1, 4) if np.size(boxes) == 0 else np.asarray(boxes, np.float64)
    )
    if array.ndim != 2 or array.shape[1] != 4:
        raise LaserImgError(f"boxes must be (n, 4), got {array.shape}")
    if not np.isfinite(array).all() or (array[:, 2:] <= 0).any():
        raise LaserImgError("boxes must be finite, with width and height above 0")
    return array


def intersection(a: ArrayLike, b: ArrayLike, wrap_width: int | None = None) -> NDArray[np.float64]:
    """Return the common area in pixels of every box of `a` with every box of `b`.

    Parameters
    ----------
    a, b : (n, 4), (m, 4) arrays
        ``x, y, w, h``.
    wrap_width : int, optional
        Columns of a grid that closes a full turn: x is then taken modulo this width.

    Returns
    -------
    (n, m) array
    """
    return _intersection(as_boxes(a), as_boxes(b), wrap_width)


def _intersection(a: Boxes, b: Boxes, wrap_width: int | None) -> NDArray[np.float64]:
    shifts = np.array((0.0,) if wrap_width is None else (-float(wrap_width), 0.0, float(wrap_width)))
    first, second = a[:, None], b[None, :]
    starts = first[..., 0] + shifts[:, None, None]
    width = _overlap(starts, first[..., 2], second[..., 0], second[..., 2]).sum(axis=0)
    return width * _overlap(first[..., 1], first[..., 3], second[..., 1], second[..., 3])


def iou(a: ArrayLike, b: ArrayLike, wrap_width: int | None = None) -> NDArray[np.float64]:
    """Return intersection over union of every box of `a` with every box of `b`.

    Examples
    --------
    >>> iou([[350, 0, 20, 10]], [[-10, 0, 20, 10]], wrap_width=360).tolist()
    [[1.0]]
    """
    first, second = as_boxes(a), as_boxes(b)
    common = _intersection(first, second, wrap_width)
    areas = (first[:, 2] * first[:, 3])[:, None] + second[:, 2] * second[:, 3]
    return common / (areas - common)


def inside_grid(boxes: Boxes, shape: tuple[int, int], wraps: bool) -> Boxes:
    """Return boxes cut to a grid of (H, W); where it closes a full turn, x is brought into it.

    Examples
    --------
    >>> inside_grid(np.array([[-3.0, 1, 6, 9]]), (8, 10), wraps=True).tolist()
    [[7.0, 1.0, 6.0, 7.0]]
    """
    height, width = shape
    first, last = boxes[:, :2], boxes[:, :2] + boxes[:, 2:]
    limits = (np.inf, height) if wraps else (width, height)
    first, last = np.maximum(first, (-np.inf if wraps else 0, 0)), np.minimum(last, limits)
    size = last - first
    if wraps:
        size[:, 0] = np.minimum(size[:, 0], width)
        first[:, 0] %= width
        first[first[:, 0] == width, 0] = 0  # the remainder of a tiny negative number
    return np.concatenate([first, size], axis=1)


def split_at_seam(box: ArrayLike, width: int) -> list[tuple[float, float, float, float]]:
    """Return the one or two boxes inside a grid of `width` columns that make up `box`.

    Examples
    --------
    >>> split_at_seam([350, 2, 20, 10], 360)
    [(350.0, 2.0, 10.0, 10.0), (0.0, 2.0, 10.0, 10.0)]
    """
    x, y, w, h = (float(value) for value in np.asarray(box))
    x %= width
    if x + w <= width:
        return [(x, y, w, h)]
    return [(x, y, width - x, h), (0.0, y, min(x + w - width, x), h)]


def _overlap(start_a: NDArray, size_a: NDArray, start_b: NDArray, size_b: NDArray) -> NDArray:
    end = np.minimum(start_a + size_a, start_b + size_b)
    return np.maximum(end - np.maximum(start_a, start_b), 0.0)
