"""The images that negatives come from, kept in memory as far as allowed."""

from collections.abc import Sequence
from threading import Lock

import numpy as np
from numpy.typing import NDArray

from laserimg.samples.images import read_grey
from laserimg.samples.labelled import LabelledImage


class Backgrounds:
    """Grey images by number, read when asked for; those read first stay in memory.

    Parameters
    ----------
    files : sequence of LabelledImage
        Negatives are windows outside their boxes.
    memory : int
        Bytes of pixels to keep.
    """

    def __init__(self, files: Sequence[LabelledImage], memory: int = 256 << 20) -> None:
        self.files = tuple(files)
        self._free = memory
        self._kept: dict[int, NDArray[np.uint8]] = {}
        self._lock = Lock()

    def __len__(self) -> int:
        return len(self.files)

    def image(self, number: int) -> NDArray[np.uint8] | None:
        """Return the grey pixels, or none if the file cannot be read as an image."""
        kept = self._kept.get(number)
        if kept is not None:
            return kept
        image = read_grey(self.files[number].path)
        if image is not None:
            self._keep(number, image)
        return image

    def _keep(self, number: int, image: NDArray[np.uint8]) -> None:
        with self._lock:
            if number not in self._kept and image.nbytes <= self._free:
                self._kept[number] = image
                self._free -= image.nbytes
