"""How far a sensor's returns scatter, estimated from one scan."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from laserimg.scan import Scan

Array = NDArray[np.float64]

# Pixels looked at: more would not change the estimates.
SAMPLES = 15_000
FEWEST_SAMPLES = 32
# Believed standard deviations of the range in metres, and of the angle in parts of the pitch.
RANGE_LIMITS = (0.002, 0.05)
ANGLE_LIMIT = 0.2
# Tangents of the incidence at which an error of the angle shows.
SLOPES = (2.0, 6.0)
# Median and lower quartile of |x| for a normal distribution of deviation 1.
MEDIAN, QUARTILE = 0.6745, 0.3186


@dataclass(frozen=True, slots=True)
class Noise:
    """Standard deviations of one return: `range` in metres, `angle` in radians."""

    range: float
    angle: float

    @classmethod
    def of(cls, scan: Scan) -> Self:
        """Estimate the noise from neighbouring returns.

        On a plane the mixed second difference of the inverse range over 2 x 2 pixels is nearly 0
        however steep the plane, and an error common to a row drops out: its median tells the
        noise of the range. The second difference along a column is nearly 0 too. Where the plane
        is steep, what it shows beyond the noise of the range tells the error of the angle from row
        to row, which tilting heads make; its lower quartile is taken, as clutter is steep as well.
        """
        step = max(1, scan.range.size // SAMPLES)
        left, right = _inverse(scan.range[:, :-1:step]), _inverse(scan.range[:, 1::step])
        range_noise = _range_noise(left, right)
        return cls(range_noise, _angle_noise(left, scan.directions[:, :-1:step], range_noise))

    def variance(self, inverse_range: NDArray, squared_plane: NDArray) -> NDArray:
        """Return the variance of 1/r, in 1/m^2, for returns from planes a = n / d of given |a|^2."""
        square = inverse_range * inverse_range
        variance = square * square * inverse_range.dtype.type(self.range**2)
        if self.angle:
            tilt = np.maximum(squared_plane - square, 0)
            variance += tilt * inverse_range.dtype.type(self.angle**2)
        return variance


def _inverse(range_m: NDArray[np.float32]) -> Array:
    return 1 / np.where(range_m > 0, range_m, np.nan).astype(np.float64)


def _range_noise(left: Array, right: Array) -> float:
    mixed = left[:-1] - left[1:] - right[:-1] + right[1:]
    deviations = np.abs(mixed / left[:-1] ** 2) / 2
    deviations = deviations[np.isfinite(deviations)]
    if len(deviations) < FEWEST_SAMPLES:
        return RANGE_LIMITS[1]
    return float(np.clip(np.median(deviations) / MEDIAN, *RANGE_LIMITS))


def _angle_noise(inverse_range: Array, directions: NDArray, range_noise: float) -> float:
    above, middle, below = inverse_range[:-2], inverse_range[1:-1], inverse_range[2:]
    if not len(middle):
        return 0.0
    pitch = np.linalg.norm(directions[2:] - directions[:-2], axis=-1) / 2
    slope = np.abs(below - above) / 2
    with np.errstate(divide="ignore", invalid="ignore"):
        steep = slope / (middle * pitch)
        chosen = (steep > SLOPES[0]) & (steep < SLOPES[1])
    if chosen.sum() < FEWEST_SAMPLES:
        return 0.0
    bend = np.abs(above - 2 * middle + below)[chosen] / np.sqrt(6)
    seen = np.quantile(bend / slope[chosen], 0.25) / QUARTILE
    from_range = np.median(range_noise * middle[chosen] ** 2 / slope[chosen])
    steps = np.sqrt(max(seen**2 - from_range**2, 0.0))
    return float(min(steps, ANGLE_LIMIT) * np.median(pitch))
