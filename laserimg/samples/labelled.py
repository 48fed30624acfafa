"""An image file with the boxes of the objects in it."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from laserimg.files import stem


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


def of_scans(images: Sequence[LabelledImage], folder: Path, kind: str) -> list[LabelledImage]:
    """Return labelled scans as their images of one kind, written by ``laserimg images`` into a folder.

    Examples
    --------
    >>> [image] = of_scans([LabelledImage(Path("scans/room.pcd"))], Path("pictures"), "normals_view")
    >>> image.path.as_posix()
    'pictures/room.normals_view.png'
    """
    return [replace(image, path=folder / f"{stem(image.path)}.{kind}.png") for image in images]
