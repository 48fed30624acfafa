"""Integral images of many equally large windows at once, as OpenCV computes them."""

import cv2
import numpy as np
from numpy.typing import NDArray

# OpenCV's detector rejects a window whose pixels deviate by no more than this, before any feature.
MIN_STD = 10.0


def upright_integrals(pixels: NDArray[np.uint8]) -> NDArray[np.int32]:
    """Return the (n, height + 1, width + 1) sums of all pixels above and to the left."""
    n, height, width = pixels.shape
    sums = np.zeros((n, height + 1, width + 1), np.int32)
    inner = sums[:, 1:, 1:]
    np.cumsum(pixels, axis=1, out=inner, dtype=np.int32)
    np.cumsum(inner, axis=2, out=inner)
    return sums


def tilted_integrals(pixels: NDArray[np.uint8]) -> NDArray[np.int32]:
    """Return the (n, height + 1, width + 1) sums of all pixels in the cone of 45 degrees above.

    Lienhart and Maydt, "An extended set of Haar-like features for rapid object detection", ICIP 2002,
    doi:10.1109/ICIP.2002.1038171.
    """
    n, height, width = pixels.shape
    sums = np.empty((n, height + 1, width + 1), np.int32)
    for window, out in zip(pixels, sums, strict=True):
        out[:] = cv2.integral3(window)[2]
    return sums


def inverse_norms(pixels: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Return what OpenCV multiplies Haar values by: 1 / (area * standard deviation), 1 where all is one grey.

    Counted over the (n, height, width) windows without their outermost pixels.
    """
    n, height, width = pixels.shape
    inner = pixels[:, 1:-1, 1:-1].reshape(n, (height - 2) * (width - 2))
    sums = inner.sum(axis=1, dtype=np.int64)
    squares = np.einsum("ij,ij->i", inner, inner, dtype=np.int64)
    spread = (inner.shape[1] * squares - sums**2).astype(np.float64)
    factors = np.ones(len(pixels), np.float32)
    np.divide(1.0, np.sqrt(spread), out=factors, where=spread > 0, casting="unsafe")
    return factors


def passes_gate(pixels: NDArray[np.uint8]) -> NDArray[np.bool_]:
    """Return which windows have contrast enough for OpenCV's Haar detector to look at them.

    Examples
    --------
    >>> clear, faint = (np.tile(np.uint8([100, 100 + step]), (20, 10)) for step in (30, 10))
    >>> passes_gate(np.stack([clear, faint])).tolist()
    [True, False]
    """
    area = (pixels.shape[1] - 2) * (pixels.shape[2] - 2)
    return area * inverse_norms(pixels).astype(np.float64) < 1 / MIN_STD
