"""Sums over windows of any size, different at each place, from one integral image."""

import cv2
import numpy as np
from numpy.typing import NDArray

Indices = NDArray[np.int64]


class WindowSums:
    """Sums of several channels over upright windows of a grid.

    Parameters
    ----------
    channels : (h, w, k) array of float64
    wraps : bool
        Windows continue across the seam of a full turn; otherwise they end at the border.
    reach : int
        The largest number of columns on one side of a window's middle; at most the width.

    Examples
    --------
    >>> sums = WindowSums(np.ones((3, 4, 1)), wraps=True, reach=1)
    >>> one = np.ones(2, int)
    >>> sums.around(np.array([0, 1]), np.array([0, 2]), one, one).tolist()
    [[6.0], [9.0]]
    """

    def __init__(self, channels: NDArray[np.float64], wraps: bool, reach: int) -> None:
        self._height, self._width, self._count = channels.shape
        self._pad = reach if wraps else 0
        if wraps:
            channels = np.concatenate(
                [channels[:, self._width - reach :], channels, channels[:, :reach]], axis=1
            )
        integral = cv2.integral(channels, sdepth=cv2.CV_64F)
        self._stride = integral.shape[1]
        self._table = integral.reshape(-1, self._count)

    def around(self, rows: Indices, columns: Indices, half_height: Indices, half_width: Indices) -> NDArray:
        """Return the (n, k) sums of windows from middle - half to middle + half, both included."""
        top, bottom = np.maximum(rows - half_height, 0), np.minimum(rows + half_height + 1, self._height)
        left, right = columns - half_width + self._pad, columns + half_width + 1 + self._pad
        if not self._pad:
            left, right = np.maximum(left, 0), np.minimum(right, self._width)
        top *= self._stride
        bottom *= self._stride
        sums = self._table.take(bottom + right, axis=0)
        sums -= self._table.take(top + right, axis=0)
        sums -= self._table.take(bottom + left, axis=0)
        sums += self._table.take(top + left, axis=0)
        return sums
