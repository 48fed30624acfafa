"""What cascades and HOG detectors have in common: a window, an image, and a class it finds."""

from dataclasses import dataclass
from typing import Protocol

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
    scores : (n,) array of float64
    """

    corners: NDArray[np.float64]
    scores: NDArray[np.float64]


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

    def hits(self, image: Image) -> Hits:
        """Return the windows of a gray image, not resized, that may be the object."""
        ...
