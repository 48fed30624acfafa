"""Gray values from measured values."""

import cv2
import numpy as np
from numpy.typing import NDArray

from laserimg.scan import BoolArray, Float32Array

Image = NDArray[np.uint8]

LOW, HIGH = 1.0, 99.0
# Gray of an image in which all values are equal.
MIDDLE = 128
# Percentiles come from whole rows, about this many pixels: a turned scan keeps its gray values.
SAMPLES = 30_000


def stretch(values: Float32Array, valid: BoolArray, limits: tuple[float, float] | None = None) -> Image:
    """Return gray values 1 to 255 between two limits, 0 where not valid.

    Parameters
    ----------
    values : (H, W) array
    valid : (H, W) array of bool
    limits : (low, high), optional
        Values for gray 1 and 255; by default the 1st and 99th percentile of the valid ones.

    Examples
    --------
    >>> stretch(np.float32([[1, 2, 3, 9]]), np.array([[True, True, True, False]]), limits=(1, 3)).tolist()
    [[1, 128, 255, 0]]
    """
    low, high = percentiles(values, valid) if limits is None else limits
    if not high > low:
        return np.where(valid, np.uint8(MIDDLE), np.uint8(0))
    # Less than low is gray 1 too: 0 means not valid.
    above = values - np.float32(low)
    np.maximum(above, np.float32(0), out=above)
    gray = cv2.convertScaleAbs(above, alpha=254 / (high - low), beta=1)
    return blacken(np.asarray(gray, np.uint8), valid)


def percentiles(values: Float32Array, valid: BoolArray) -> tuple[float, float]:
    """Return the 1st and 99th percentile of the valid values; (0, 0) if there are none."""
    step = max(1, values.size // SAMPLES)
    chosen = values[::step][valid[::step]]
    if chosen.size == 0:
        chosen = values[valid]
    if chosen.size == 0:
        return 0.0, 0.0
    low, high = np.percentile(chosen, [LOW, HIGH])
    return float(low), float(high)


def blacken(image: Image, valid: BoolArray) -> Image:
    """Return the image with 0 in every plane where not valid."""
    if valid.all():
        return image
    return np.asarray(cv2.bitwise_and(image, image, mask=valid.view(np.uint8)), np.uint8)
