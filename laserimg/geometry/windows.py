"""Sums over windows of any size, different at each place, from one integral image."""

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

Indices = NDArray[np.int64]


class WindowSums:
    """Sums of several channels over upright windows of a grid.

    Parameters
    ----------
    channels : k arrays (h, w)
    wraps : bool
        Windows continue across the seam of a full turn; otherwise they end at the border.
    reach : int
        The largest number of columns on one side of a window's middle; at most the width.

    Examples
    --------
    >>> sums = WindowSums([np.ones((3, 4))], wraps=True, reach=1)
    >>> one = np.ones(2, int)
    >>> sums.around(np.array([0, 1]), np.array([0, 2]), one, one).tolist()
    [[6.0], [9.0]]
    """

    def __init__(self, channels: Sequence[NDArray], wraps: bool, reach: int) -> None:
        self._height, self._width = channels[0].shape
        self._pad = pad = reach if wraps else 0
        padded = np.empty((self._height, self._width + 2 * pad, len(channels)))
        for k, channel in enumerate(channels):
            padded[:, pad : pad + self._width, k] = channel
        padded[:, :pad] = padded[:, self._width : self._width + pad]
        padded[:, pad + self._width :] = padded[:, pad : 2 * pad]
        integral = cv2.integral(padded, sdepth=cv2.CV_64F)
        self._stride = integral.shape[1]
        self._table = integral.reshape(-1, len(channels))

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
