"""The images that negatives come from, kept in memory as far as allowed."""

from collections.abc import Sequence
from concurrent.futures import Executor
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
    turned : bool
        Each image counts eight times: as it is, mirrored, and both turned by 90, 180 and 270 degrees.
    """

    def __init__(self, files: Sequence[LabelledImage], memory: int = 256 << 20, turned: bool = False) -> None:
        self.files = tuple(files)
        self._copies = 8 if turned else 1
        self._free = memory
        self._kept: dict[int, NDArray[np.uint8]] = {}
        self._lock = Lock()

    def __len__(self) -> int:
        return len(self.files) * self._copies

    def image(self, number: int) -> NDArray[np.uint8] | None:
        """Return the grey pixels, or none if the file cannot be read as an image."""
        file, copy = divmod(number, self._copies)
        image = self._read(file)
        return None if image is None else turned_image(image, copy)

    def boxes(self, number: int) -> NDArray[np.float64]:
        """Return the boxes of objects and of what is ignored in an image."""
        file, copy = divmod(number, self._copies)
        boxes = self.files[file].boxes
        if copy == 0 or len(boxes) == 0:
            return boxes
        image = self._read(file)
        return boxes if image is None else turned_boxes(boxes, image.shape, copy)

    def unusable(self, window: tuple[int, int], jobs: Executor | None = None) -> list[str]:
        """Return a line for each file that cannot be read as an image or is smaller than the window."""

        def judge(number: int) -> str:
            image, file = self._read(number), self.files[number]
            if image is None:
                return f"{file.source or file.path}: {file.path.name} cannot be read as an image"
            rows, columns = image.shape
            if columns < window[0] or rows < window[1]:
                return f"{file.source or file.path}: {columns}x{rows} is smaller than the window"
            return ""

        numbers = range(len(self.files))
        return [line for line in (jobs.map(judge, numbers) if jobs else map(judge, numbers)) if line]

    def _read(self, number: int) -> NDArray[np.uint8] | None:
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


def turned_image(image: NDArray[np.uint8], copy: int) -> NDArray[np.uint8]:
    """Return copy 0 to 7: turned left by 90 degrees ``copy % 4`` times, from 4 on mirrored after it."""
    if copy == 0:
        return image
    turned = np.rot90(image, copy % 4)
    return np.ascontiguousarray(turned[:, ::-1] if copy >= 4 else turned)


def turned_boxes(boxes: NDArray[np.float64], shape: tuple[int, ...], copy: int) -> NDArray[np.float64]:
    """Return where boxes of an image of this shape are in its copy (see `turned_image`).

    Examples
    --------
    >>> turned_boxes(np.array([[1.0, 2, 3, 4]]), (10, 20), 1).tolist()
    [[2.0, 16.0, 4.0, 3.0]]
    """
    rows, columns = shape[:2]
    x, y, w, h = boxes.T
    for _ in range(copy % 4):
        x, y, w, h = y, columns - x - w, h, w
        rows, columns = columns, rows
    return np.stack([columns - x - w if copy >= 4 else x, y, w, h], axis=1)
