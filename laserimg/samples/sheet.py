"""All samples in one picture."""

import math

import numpy as np
from numpy.typing import NDArray

# Grey between the samples.
_GAP, _GREY = 2, 128


def contact_sheet(samples: NDArray[np.uint8], columns: int = 0) -> NDArray[np.uint8]:
    """Return (n, height, width) samples side by side, row by row, in about a square.

    Examples
    --------
    >>> contact_sheet(np.zeros((5, 10, 20), np.uint8), columns=3).shape
    (26, 68)
    """
    count, height, width = samples.shape
    columns = columns or max(1, math.ceil(math.sqrt(count * height / width)))
    rows = math.ceil(count / columns)
    cells = np.full((rows * columns, height + _GAP, width + _GAP), _GREY, np.uint8)
    cells[:count, _GAP:, _GAP:] = samples
    cells = cells.reshape(rows, columns, height + _GAP, width + _GAP)
    sheet = cells.transpose(0, 2, 1, 3).reshape(rows * (height + _GAP), columns * (width + _GAP))
    return np.pad(sheet, ((0, _GAP), (0, _GAP)), constant_values=_GREY)
