"""What cascades and HOG detectors have in common: a window, an image, and a class it finds."""

from dataclasses import dataclass
from typing import Protocol, Self

import numpy as np
from numpy.typing import NDArray

from laserimg.evidence import Image
from laserimg.formats.card import Card


@dataclass(frozen=True, eq=False, slots=True)
class Hits:
    """Windows that a detector fired on.

    Parameters
    ----------
    corners : (n, 2) array of float64
        Column and row of the upper left corner.
    margins : (n,) array of float64
        By how much the classifier's sum exceeds what it takes to be a hit: 0 and more.
    """

    corners: NDArray[np.float64]
    margins: NDArray[np.float64]

    @classmethod
    def none(cls) -> Self:
        """Return no hits."""
        return cls(np.empty((0, 2)), np.empty(0))


class WindowModel(Protocol):
    """A classifier of windows, run over an image at one scale."""

    @property
    def name(self) -> str:
        """Name of its file, without suffix."""
        ...

    @property
    def card(self) -> Card:
        """What it was trained on and for."""
        ...

    @property
    def min_neighbours(self) -> int:
        """Least number of overlapping hits that make a candidate."""
        ...

    def hits(self, image: Image) -> Hits:
        """Return the windows of a gray image, not resized, that may be the object."""
        ...
