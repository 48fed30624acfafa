"""Negatives for a stage: windows of the backgrounds that the cascade so far accepts."""

import math
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from itertools import islice
from threading import local
from typing import Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from laserimg.cascade.integral import passes_gate
from laserimg.cascade.pyramid import Tile, tiles
from laserimg.cascade.rates import Rate
from laserimg.errors import ModelError

# Each pass looks at all images with the grid of windows and the scales shifted against the other passes.
PASSES = 4
# An image gives at most this many times its equal share. Measured over three seeds on faces: 20 in place of 4
# halves the search and costs 1.5 % of the hits at 1.7e-5 false alarms per window.
_CAP_FACTOR = 8
# The false-alarm rate is looked at after every so many images.
_LOOK_EVERY = 64


@dataclass(frozen=True, eq=False, slots=True)
class Mined:
    """Negatives found, and how much was looked at for them.

    Attributes
    ----------
    windows : (n, height, width) uint8
    rate : Rate
        Windows that the cascade accepts, of all looked at.
    exhausted : bool
        Whether all passes over all images ended with fewer windows than wanted.
    """

    windows: NDArray[np.uint8]
    rate: Rate
    exhausted: bool


class Images(Protocol):
    """Images that negatives come from, by number."""

    def __len__(self) -> int: ...

    def image(self, number: int, /) -> NDArray[np.uint8] | None:
        """Return the grey pixels, or none if there are none to be had."""
        ...

    def boxes(self, number: int, /) -> NDArray[np.float64]:
        """Return the (n, 4) boxes in an image that no negative may overlap."""
        ...


@dataclass(frozen=True, eq=False)
class Miner:
    """Where negatives come from and how they are looked for.

    Attributes
    ----------
    backgrounds : Images
    window : (int, int)
        Width and height.
    seed : int
    scale_step : float
        Ratio of neighbouring pyramid levels, as the detector's scale factor.
    lbp : bool
        LBP detectors have no contrast gate.
    jobs : ThreadPoolExecutor, optional
        Threads to look at images in; the result is the same for any number.
    """

    backgrounds: Images
    window: tuple[int, int]
    seed: int
    scale_step: float = 1.2
    lbp: bool = False
    jobs: ThreadPoolExecutor | None = None
    _own: local = field(default_factory=local, repr=False)

    def mine(
        self,
        xml: str | None,
        stage: int,
        wanted: int,
        expected: float,
        known: NDArray[np.uint8] | None = None,
        target: float = 0.0,
        tell: Callable[[int, Rate], None] = lambda found, rate: None,
    ) -> Mined:
        """Return windows that the cascade accepts, each once, from images in random order.

        Parameters
        ----------
        xml : str, optional
            The cascade; without one every window with contrast is accepted.
        stage : int
            Together with the seed it sets the order of the images.
        wanted : int
        expected : float
            A guess of the share of windows accepted: while it is high, parts of each image are enough.
        known : (n, height, width) uint8, optional
            Windows not to be found again.
        target : float
            Stop, with too few windows, as soon as the rate is surely no more than this.
        tell : function
            Called with the number found and the rate so far.
        """
        cap = max(4, math.ceil(_CAP_FACTOR * wanted / len(self.backgrounds)))
        found: list[NDArray[np.uint8]] = []
        counts: list[tuple[int, int]] = []
        seen = {window.tobytes() for window in known} if known is not None else set()
        have = 0
        for windows, accepted, looked in self._visits(xml, stage, cap, expected):
            counts.append((accepted, looked))
            new = [window for window in windows if _add(seen, window)][: wanted - have]
            found += new
            have += len(new)
            if have >= wanted:
                break
            if len(counts) % _LOOK_EVERY == 0:
                rate = Rate.of(counts)
                tell(have, rate)
                if rate.high <= target:
                    break
        pixels = np.array(found, np.uint8).reshape(-1, self.window[1], self.window[0])
        return Mined(pixels, Rate.of(counts), have < wanted)

    def _visits(
        self, xml: str | None, stage: int, cap: int, expected: float
    ) -> Iterator[tuple[NDArray, int, int]]:
        def visit(task: tuple[int, int]) -> tuple[NDArray, int, int]:
            number, turn = task
            rng = np.random.default_rng([self.seed, stage, turn, number])
            # Later passes come because the first was not enough: they look at everything.
            want = 4 * cap / expected if turn == 0 else math.inf
            return self._look(xml, number, turn, want, cap, rng)

        order = np.random.default_rng([self.seed, stage]).permutation(len(self.backgrounds))
        tasks = ((int(number), turn) for turn in range(PASSES) for number in order)
        if self.jobs is None:
            yield from map(visit, tasks)
            return
        # A few tasks ahead of the one consumed: enough for the threads, little lost at the end.
        ahead = [self.jobs.submit(visit, task) for task in islice(tasks, 8)]
        while ahead:
            result = ahead.pop(0).result()
            ahead += [self.jobs.submit(visit, task) for task in islice(tasks, 1)]
            try:
                yield result
            except GeneratorExit:
                for task in ahead:
                    task.cancel()
                raise

    def _look(
        self, xml: str | None, number: int, turn: int, want: float, cap: int, rng: np.random.Generator
    ) -> tuple[NDArray, int, int]:
        width, height = self.window
        image = self.backgrounds.image(number)
        if image is None or image.shape[0] < height or image.shape[1] < width:
            return np.empty((0, height, width), np.uint8), 0, 0
        boxes = self.backgrounds.boxes(number)
        parts = list(tiles(image, self.window, self.scale_step, turn, want, cap, rng))
        corners = [tile.outside(self._accepted(xml, tile), boxes, self.window) for tile in parts]
        tile_of = np.repeat(np.arange(len(parts)), [len(each) for each in corners])
        chosen = np.sort(rng.permutation(len(tile_of))[:cap])
        corner = np.concatenate([np.empty((0, 2), np.int64), *corners])[chosen]
        crops = [parts[t].crop(corner[tile_of[chosen] == t], self.window) for t in np.unique(tile_of[chosen])]
        pixels = np.concatenate([np.empty((0, height, width), np.uint8), *crops])
        return pixels, len(tile_of), sum(tile.windows for tile in parts)

    def _accepted(self, xml: str | None, tile: Tile) -> NDArray[np.int64]:
        if xml is not None:
            found = self._detector(xml).detectMultiScale(tile.pixels, 2.0, 0, 0, self.window, self.window)
            return np.asarray(found, np.int64).reshape(-1, 4)[:, :2]
        grid = tile.grid(self.window)
        return grid if self.lbp else grid[passes_gate(tile.crop(grid, self.window))]

    def _detector(self, xml: str) -> "cv2.CascadeClassifier":
        # One a thread: a classifier keeps the image it is looking at.
        if getattr(self._own, "xml", None) is not xml:
            self._own.detector = detector_of(xml)
            self._own.xml = xml
        return self._own.detector


def _add(seen: set[bytes], window: NDArray[np.uint8]) -> bool:
    key = window.tobytes()
    return key not in seen and not seen.add(key)


def detector_of(xml: str) -> "cv2.CascadeClassifier":
    """Return OpenCV's detector for a cascade that laserimg wrote.

    Raises
    ------
    ModelError
        If OpenCV does not take it.
    """
    detector = cv2.CascadeClassifier()
    storage = cv2.FileStorage(xml, cv2.FILE_STORAGE_READ | cv2.FILE_STORAGE_MEMORY)
    if not detector.read(storage.getFirstTopLevelNode()):
        raise ModelError("OpenCV does not read the cascade")
    return detector
