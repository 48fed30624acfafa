"""What the search asks of a stage's samples: bin numbers of many features, and the exact split of a few."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from laserimg.cascade.features import Pool
from laserimg.cascade.histograms import HAAR, LBP, Scale
from laserimg.cascade.splits import Split, best_subset, best_threshold
from laserimg.cascade.windows import Windows, corner_matrix

Floats = NDArray[np.float64]


class Measures(Protocol):
    """The samples of one stage, seen through the features of a pool."""

    @property
    def pool(self) -> Pool:
        """Where the features are numbered."""
        ...

    @property
    def scale(self) -> Scale:
        """How values fall into bins."""
        ...

    def __len__(self) -> int:
        """Return the number of samples."""
        ...

    def codes(self, numbers: NDArray[np.integer]) -> NDArray[np.unsignedinteger]:
        """Return the (features, samples) bin numbers, with the number of bins added for positive samples."""
        ...

    def split(self, numbers: NDArray[np.integer], weights: Floats, targets: Floats) -> Split | None:
        """Return the exact best split by one of the features, or none if no feature tells samples apart."""
        ...


def measures(pool: Pool, windows: Windows, positive: NDArray[np.bool_]) -> Measures:
    """Return what the search needs for the features of `pool`."""
    if pool.mode == "lbp":
        return LbpMeasures(pool, windows, positive)
    return HaarMeasures(pool, windows, positive, windows.corners * windows.inverse_norm)


@dataclass(frozen=True, eq=False)
class HaarMeasures:
    """Haar values; for the histograms to six digits, from corners normalised once."""

    pool: Pool
    windows: Windows
    positive: NDArray[np.bool_]
    normalised: NDArray[np.float32]
    scale: Scale = HAAR

    def __len__(self) -> int:
        return len(self.windows)

    def codes(self, numbers: NDArray[np.integer]) -> NDArray[np.uint8]:
        """Return bin numbers: equal bins from the least to the largest value of each feature."""
        values = self._approximate(numbers)
        values -= values.min(axis=1, keepdims=True)
        span = np.maximum(values.max(axis=1, keepdims=True), np.float32(1e-20))
        values *= np.float32(self.scale.bins - 0.01) / span
        values += np.where(self.positive, np.float32(self.scale.bins), np.float32(0))
        return values.astype(np.uint8)

    def split(self, numbers: NDArray[np.integer], weights: Floats, targets: Floats) -> Split | None:
        """Return the best threshold half-way between two values, exact as the detector computes them."""
        return best_threshold(numbers, self.windows.measure(self.pool[numbers]), weights, targets)

    def _approximate(self, numbers: NDArray[np.integer]) -> NDArray[np.float32]:
        size = (self.windows.width, self.windows.height, len(self.normalised))
        return corner_matrix(self.pool[numbers], *size).astype(np.float32) @ self.normalised


@dataclass(frozen=True, eq=False)
class LbpMeasures:
    """LBP codes: each of the 256 is a bin."""

    pool: Pool
    windows: Windows
    positive: NDArray[np.bool_]
    scale: Scale = LBP

    def __len__(self) -> int:
        return len(self.windows)

    def codes(self, numbers: NDArray[np.integer]) -> NDArray[np.uint16]:
        """Return the LBP codes, with 256 added for positive samples."""
        shift = np.where(self.positive, np.uint16(self.scale.bins), np.uint16(0))
        return self.windows.measure(self.pool[numbers]) + shift

    def split(self, numbers: NDArray[np.integer], weights: Floats, targets: Floats) -> Split | None:
        """Return the best set of codes."""
        return best_subset(numbers, self.windows.measure(self.pool[numbers]), weights, targets)
