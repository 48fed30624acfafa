"""An image file with the boxes of the objects in it."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray


def no_boxes() -> NDArray[np.float64]:
    """Return no ``x, y, w, h``."""
    return np.empty((0, 4))


@dataclass(frozen=True, eq=False, slots=True)
class LabelledImage:
    """An image file and what is marked in it.

    Attributes
    ----------
    path : Path
    objects : (n, 4) array
        ``x, y, w, h`` of the objects to learn, pixels.
    ignored : (m, 4) array
        Boxes that are neither positive nor negative: other marked things, and objects marked as unclear.
    source : str
        Where this is written: file and line, for messages.
    """

    path: Path
    objects: NDArray[np.float64] = field(default_factory=no_boxes)
    ignored: NDArray[np.float64] = field(default_factory=no_boxes)
    source: str = ""

    @property
    def boxes(self) -> NDArray[np.float64]:
        """All boxes; negatives keep outside them."""
        return np.concatenate([self.objects, self.ignored])
