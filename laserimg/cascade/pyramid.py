"""The scaled copies of an image that a cascade looks at, whole or in parts, with the detector's own grid."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

Window = tuple[int, int]

# OpenCV's step is 1 on levels at half the image's size or less, else 2. On a level of ours its factor is 1.
STEP = 2
# Shift of the grid in x and y, and of the scales in steps, by pass: all windows of all passes differ.
_SHIFTS = ((0, 0, 0.0), (1, 1, 0.5), (1, 0, 0.25), (0, 1, 0.75))
# Levels a visit looks at when it needs few windows: resizing costs more than detecting then.
_FEW_LEVELS = 2


@dataclass(frozen=True, eq=False, slots=True)
class Tile:
    """A part of a scaled image.

    Attributes
    ----------
    pixels : (rows, columns) uint8
    x, y : int
        Where the part begins in the scaled image.
    scale : float
        Pixels of the image per pixel of the tile.
    windows : int
        Places of the grid in the tile.
    """

    pixels: NDArray[np.uint8]
    x: int
    y: int
    scale: float
    windows: int

    def grid(self, window: Window) -> NDArray[np.int64]:
        """Return the ``x, y`` corners of all windows in the tile."""
        rows, columns = self.pixels.shape
        x, y = np.meshgrid(
            np.arange(0, columns - window[0] + 1, STEP), np.arange(0, rows - window[1] + 1, STEP)
        )
        return np.stack([x.ravel(), y.ravel()], axis=1)

    def crop(self, corners: NDArray[np.integer], window: Window) -> NDArray[np.uint8]:
        """Return the (n, height, width) pixels of windows: those that the detector saw, bit for bit."""
        across, down = np.arange(window[0]), np.arange(window[1])
        rows = corners[:, 1, None, None] + down[:, None]
        return self.pixels[rows, corners[:, 0, None, None] + across]

    def outside(
        self, corners: NDArray[np.int64], boxes: NDArray[np.float64], window: Window
    ) -> NDArray[np.int64]:
        """Return the corners of those windows that touch no box of the image."""
        if len(boxes) == 0:
            return corners
        start = (corners + np.array([self.x, self.y]))[:, None] * self.scale
        end = start + np.array(window) * self.scale
        touches = ((start < boxes[:, :2] + boxes[:, 2:]) & (end > boxes[:, :2])).all(axis=2)
        return corners[~np.any(touches, axis=1)]


def tiles(
    image: NDArray[np.uint8],
    window: Window,
    scale_step: float,
    turn: int,
    want: float,
    pieces: int,
    rng: np.random.Generator,
) -> Iterator[Tile]:
    """Yield parts of the pyramid of an image that hold about `want` windows, at most all.

    Parameters
    ----------
    image : (rows, columns) uint8
    window : (int, int)
        Width and height.
    scale_step : float
        Ratio of neighbouring levels.
    turn : int
        Which pass: shifts grid and scales, so that no two passes look at the same window.
    want : float
        When fewer windows than the pyramid holds are asked for, some places of some levels are chosen by
        chance, larger levels more often: each window of the pyramid is about equally likely.
    pieces : int
        How many places then.
    rng : numpy.random.Generator
    """
    shift_x, shift_y, shift_scale = _SHIFTS[turn]
    shape = image.shape[::-1]
    scales = _scales(shape, window, scale_step, shift_scale)
    counts = np.array(
        [_count(_size(shape, scale), window, shift_x, shift_y) for scale in scales.tolist()], float
    )
    scales, counts = scales[counts > 0], counts[counts > 0]
    if len(counts) == 0:
        return
    chosen = _chosen_levels(counts, want, rng)
    share = want / counts[chosen].sum()
    for level in chosen:
        scale = float(scales[level])
        size = _size(shape, scale)
        scaled = image if size == shape else cv2.resize(image, size, interpolation=cv2.INTER_LINEAR_EXACT)
        shifted = np.asarray(scaled, np.uint8)[shift_y:, shift_x:]
        whole = _tile(shifted, shift_x, shift_y, scale, window)
        if share > 0.5:
            yield whole
        else:
            each = math.ceil(pieces / len(chosen))
            yield from _pieces(whole, window, share * counts[level] / each, each, rng)


def windows_of(shape: tuple[int, int], window: Window, scale_step: float) -> int:
    """Return the windows of one pass over an image of this width and height.

    Examples
    --------
    >>> windows_of((22, 20), (20, 20), 1.2), windows_of((19, 40), (20, 20), 1.2)
    (2, 0)
    """
    return sum(
        _count(_size(shape, scale), window, 0, 0)
        for scale in _scales(shape, window, scale_step, 0.0).tolist()
    )


def _scales(shape: tuple[int, int], window: Window, step: float, shift: float) -> NDArray[np.float64]:
    largest = min(shape[0] / window[0], shape[1] / window[1])
    if largest < 1:
        return np.empty(0)
    return np.power(step, np.arange(int(math.log(largest, step)) + 2.0) + shift, dtype=np.float64)


def _size(shape: tuple[int, int], scale: float) -> tuple[int, int]:
    return round(shape[0] / scale), round(shape[1] / scale)


def _count(size: tuple[int, int], window: Window, shift_x: int, shift_y: int) -> int:
    across, down = size[0] - shift_x - window[0], size[1] - shift_y - window[1]
    return 0 if min(across, down) < 0 else (across // STEP + 1) * (down // STEP + 1)


def _chosen_levels(counts: NDArray[np.float64], want: float, rng: np.random.Generator) -> NDArray[np.intp]:
    if want >= counts.sum():
        return np.arange(len(counts))
    order = rng.choice(len(counts), len(counts), replace=False, p=counts / counts.sum())
    enough = int(np.searchsorted(np.cumsum(counts[order]), want)) + 1
    return order[: max(enough, _FEW_LEVELS)]


def _tile(pixels: NDArray[np.uint8], x: int, y: int, scale: float, window: Window) -> Tile:
    return Tile(pixels, x, y, scale, _count(pixels.shape[::-1], window, 0, 0))


def _pieces(
    whole: Tile, window: Window, windows: float, count: int, rng: np.random.Generator
) -> Iterator[Tile]:
    # Squares of about as many windows as asked for, each anywhere in the level.
    rows, columns = whole.pixels.shape
    side = math.ceil(math.sqrt(windows))
    width = min(columns, window[0] + STEP * (side - 1))
    height = min(rows, window[1] + STEP * (side - 1))
    for _ in range(count):
        x, y = int(rng.integers(columns - width + 1)), int(rng.integers(rows - height + 1))
        part = whole.pixels[y : y + height, x : x + width]
        yield _tile(part, whole.x + x, whole.y + y, whole.scale, window)
