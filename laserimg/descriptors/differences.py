"""Differences between neighbouring pixels of images that are known in part."""

import numpy as np
from numpy.typing import NDArray

from laserimg.scan import BoolArray, Float32Array


def central_differences(images: Float32Array) -> tuple[Float32Array, Float32Array]:
    """Return f(x + 1) - f(x - 1) along rows and columns of (n, h, w) images; borders are repeated.

    Examples
    --------
    >>> across, down = central_differences(np.array([[[1, 2, 4]]], np.float32))
    >>> across.tolist(), down.tolist()
    ([[[1.0, 3.0, 2.0]]], [[[0.0, 0.0, 0.0]]])
    """
    return _along(images, 2), _along(images, 1)


def _along(images: Float32Array, axis: int) -> Float32Array:
    moved = np.moveaxis(images, axis, 0)
    out = np.zeros_like(images)
    result = np.moveaxis(out, axis, 0)
    if len(moved) > 1:
        np.subtract(moved[2:], moved[:-2], out=result[1:-1])
        np.subtract(moved[1], moved[0], out=result[0])
        np.subtract(moved[-1], moved[-2], out=result[-1])
    return out


def slopes(values: NDArray, known: BoolArray, axis: int) -> tuple[NDArray, BoolArray]:
    """Return the change per pixel along an axis, and where there is one.

    Central where both neighbours are known, else to the one that is.

    Parameters
    ----------
    values : (n, h, w) or (n, h, w, c) array
    known : (n, h, w) array of bool
    axis : int
        1 down, 2 across.

    Returns
    -------
    slope : array like `values`
        0 where there is none.
    found : (n, h, w) array of bool
    """
    v, k = np.moveaxis(values, axis, 0), np.moveaxis(known, axis, 0)
    slope, steps = np.zeros_like(v), np.zeros(k.shape, np.int8)
    for here, there, sign in ((slice(None, -1), slice(1, None), 1), (slice(1, None), slice(None, -1), -1)):
        both = k[here] & k[there]
        change = (v[there] - v[here]) * sign
        slope[here] += change * _like(both, change)
        steps[here] += both
    slope /= _like(np.maximum(steps, 1), slope)
    return np.moveaxis(slope, 0, axis), np.moveaxis(steps > 0, 0, axis)


def _like(mask: NDArray, values: NDArray) -> NDArray:
    return mask if mask.ndim == values.ndim else mask[..., None]
