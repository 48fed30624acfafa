"""A false-alarm rate counted on images, with a bound that knows that false alarms come in clusters."""

from dataclasses import dataclass
from math import sqrt

import numpy as np
from numpy.typing import ArrayLike


@dataclass(frozen=True)
class Rate:
    """Accepted windows per window, and 95 % bounds of it.

    Examples
    --------
    >>> rate = Rate.of([(3, 1000), (0, 1000), (1, 2000)])
    >>> rate.accepted, rate.windows, rate.value
    (4, 4000, 0.001)
    """

    accepted: int
    windows: int
    low: float
    high: float

    @property
    def value(self) -> float:
        """Accepted windows per window; 1 where none was looked at."""
        return self.accepted / self.windows if self.windows else 1.0

    @classmethod
    def of(cls, counts: ArrayLike, z: float = 1.96) -> "Rate":
        """Return the rate from (accepted, windows) counted in each image.

        A cascade accepts the same thing in many windows side by side, so windows are not independent and
        images are. The variance of the ratio between images over that of independent windows is the design
        effect (Kish, "Survey Sampling", 1965); Wilson's interval (JASA 22, 1927,
        doi:10.1080/01621459.1927.10502953) is taken for as many windows as are left after division by it.
        """
        hits, looked = np.asarray(counts, float).reshape(-1, 2).T
        total, images = looked.sum(), np.count_nonzero(looked)
        if total == 0:
            return cls(0, 0, 0.0, 1.0)
        share = hits.sum() / total
        effect = 1.0
        if images > 1 and 0 < share < 1:
            between = images / (images - 1) * ((hits - share * looked) ** 2).sum() / total**2
            effect = max(1.0, between * total / (share * (1 - share)))
        low, high = _wilson(float(share), float(total / effect), z)
        return cls(int(hits.sum()), int(total), low, high)


def _wilson(share: float, count: float, z: float) -> tuple[float, float]:
    middle = share + z * z / (2 * count)
    spread = z * sqrt(share * (1 - share) / count + z * z / (4 * count * count))
    scale = 1 + z * z / count
    return max(0.0, (middle - spread) / scale), min(1.0, (middle + spread) / scale)
