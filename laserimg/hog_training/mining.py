"""Negatives for a HOG detector: windows at random, then those that it takes for the object."""

import math
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from hashlib import blake2b
from itertools import islice

import cv2
import numpy as np
from numpy.typing import NDArray

from laserimg.cascade.pyramid import STEP, Tile, tiles
from laserimg.cascade.rates import Rate
from laserimg.hog_training.frames import FRAME
from laserimg.samples.backgrounds import Backgrounds

# Negatives of this margin and more are searched for: 0 is the detector's own limit, and what lies above -1
# moves the plane.
LEAST_MARGIN = 0.0
# Rounds look at images with the grid of windows and the scales shifted in as many ways.
TURNS = 4
# An image gives at most this many times its equal share.
_CAP_FACTOR = 8
# Images that threads are ahead of the one consumed.
_AHEAD = 8

Visit = tuple[NDArray[np.uint8], int, int]


@dataclass(frozen=True, eq=False, slots=True)
class Found:
    """Negatives of a round.

    Attributes
    ----------
    frames : (n, height + 2, width + 2) uint8
        Windows with the frame of pixels that they have in their images.
    rate : Rate
        Windows taken for the object, of all looked at.
    """

    frames: NDArray[np.uint8]
    rate: Rate


@dataclass(frozen=True, eq=False)
class HogMiner:
    """Where negatives come from and how they are looked for.

    Attributes
    ----------
    backgrounds : Backgrounds
        Windows that touch a box of an image are not taken.
    window, step : (int, int)
        Width and height; columns and rows from window to window.
    seed : int
    scale_step : float
        Ratio of neighbouring pyramid levels.
    jobs : ThreadPoolExecutor, optional
        Threads to look at images in; the result is the same for any number.
    """

    backgrounds: Backgrounds
    window: tuple[int, int]
    step: tuple[int, int]
    seed: int
    scale_step: float = 1.2
    jobs: ThreadPoolExecutor | None = None

    def mine(
        self,
        descriptor: cv2.HOGDescriptor | None,
        turn: int,
        wanted: int,
        expected: float,
        seen: set[bytes],
        tell: Callable[[int, int], None] = lambda images, found: None,
    ) -> Found:
        """Return windows that the detector takes for the object; images come once, in random order.

        Parameters
        ----------
        descriptor : cv2.HOGDescriptor, optional
            With its SVM set; without one, windows are taken at random.
        turn : int
            The round; together with the seed it sets the order of the images.
        wanted : int
        expected : float
            A guess of the share of windows found: while it is high, parts of each image are enough.
        seen : set of bytes
            Digests of windows not to be found again; those found are added.
        tell : function
            Called with the number of images looked at and of windows found.
        """
        cap = max(4, math.ceil(_CAP_FACTOR * wanted / len(self.backgrounds)))
        found: list[NDArray[np.uint8]] = []
        counts: list[tuple[int, int]] = []
        for frames, accepted, looked in self._visits(descriptor, turn, cap, cap / expected):
            counts.append((accepted, looked))
            found += [frame for frame in frames if _new(frame, seen)][: wanted - len(found)]
            tell(len(counts), len(found))
            if len(found) >= wanted:
                break
        width, height = self._frame
        return Found(np.array(found, np.uint8).reshape(-1, height, width), Rate.of(counts))

    def rate(self, descriptor: cv2.HOGDescriptor) -> Rate:
        """Return how many windows the detector takes for the object, over all images."""
        visits = self._visits(descriptor, 0, cap=0, want=math.inf)
        return Rate.of([(accepted, looked) for _, accepted, looked in visits])

    @property
    def _frame(self) -> tuple[int, int]:
        return self.window[0] + 2 * FRAME, self.window[1] + 2 * FRAME

    def _visits(
        self, descriptor: cv2.HOGDescriptor | None, turn: int, cap: int, want: float
    ) -> Iterator[Visit]:
        def visit(number: int) -> Visit:
            rng = np.random.default_rng([self.seed, turn, number])
            parts = self._tiles(number, turn, cap, want, rng)
            return self._look(descriptor, parts, self.backgrounds.boxes(number), cap, rng)

        order = np.random.default_rng([self.seed, turn]).permutation(len(self.backgrounds)).tolist()
        if self.jobs is None:
            yield from map(visit, order)
            return
        numbers = iter(order)
        ahead = [self.jobs.submit(visit, number) for number in islice(numbers, _AHEAD)]
        try:
            while ahead:
                result = ahead.pop(0).result()
                ahead += [self.jobs.submit(visit, number) for number in islice(numbers, 1)]
                yield result
        finally:
            for task in ahead:
                task.cancel()

    def _tiles(
        self, number: int, turn: int, cap: int, want: float, rng: np.random.Generator
    ) -> Iterator[Tile]:
        image = self.backgrounds.image(number)
        if image is None:
            return
        # Tiles count windows of a finer grid.
        want *= math.prod(self.step) / STEP**2
        yield from tiles(image, self._frame, self.scale_step, turn % TURNS, want, cap, rng)

    def _look(
        self,
        descriptor: cv2.HOGDescriptor | None,
        parts: Iterator[Tile],
        boxes: NDArray[np.float64],
        cap: int,
        rng: np.random.Generator,
    ) -> Visit:
        frames = [np.empty((0, *self._frame[::-1]), np.uint8)]
        accepted, looked = 0, 0
        for tile in parts:
            grid = self._grid(tile)
            corners = grid if descriptor is None else self._hits(descriptor, tile)
            corners = tile.outside(corners, boxes, self.window)
            frames.append(tile.crop(corners - FRAME, self._frame))
            accepted, looked = accepted + len(corners), looked + len(grid)
        pixels = np.concatenate(frames)
        return pixels[np.sort(rng.permutation(len(pixels))[:cap])], accepted, looked

    def _grid(self, tile: Tile) -> NDArray[np.int64]:
        """Corners of the windows whose frame lies within the tile."""
        rows, columns = tile.pixels.shape
        x = np.arange(FRAME, columns - self.window[0], self.step[0])
        y = np.arange(FRAME, rows - self.window[1], self.step[1])
        return np.stack(np.meshgrid(x, y), axis=2).reshape(-1, 2)

    def _hits(self, descriptor: cv2.HOGDescriptor, tile: Tile) -> NDArray[np.int64]:
        # OpenCV's grid begins at the corner: more pixels there, so that it meets ours.
        across, down = self.step[0] - FRAME, self.step[1] - FRAME
        padded = cv2.copyMakeBorder(tile.pixels, down, 0, across, 0, cv2.BORDER_REPLICATE)
        corners, _ = descriptor.detect(padded, hitThreshold=LEAST_MARGIN, winStride=self.step, padding=(0, 0))
        found = np.asarray(corners, np.int64).reshape(-1, 2) - (across, down)
        last = np.array(tile.pixels.shape[::-1]) - self.window - FRAME
        return found[((found >= FRAME) & (found <= last)).all(axis=1)]


def _new(frame: NDArray[np.uint8], seen: set[bytes]) -> bool:
    key = blake2b(frame[FRAME:-FRAME, FRAME:-FRAME].tobytes(), digest_size=16).digest()
    return key not in seen and not seen.add(key)
