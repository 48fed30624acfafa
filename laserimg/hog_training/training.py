"""Training a HOG detector: windows at random, an SVM, then rounds of the negatives that it gets wrong."""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from time import perf_counter
from typing import Self

import cv2
import numpy as np
from numpy.typing import NDArray

from laserimg.cascade.rates import Rate
from laserimg.errors import ConfigError
from laserimg.hog_training.frames import describe, framed
from laserimg.hog_training.mining import HogMiner
from laserimg.hog_training.svm import Plane, fit_svm
from laserimg.hog_training.window import HogWindow

# What share of windows the first SVM is guessed to get wrong, and each of the next of the one before.
_FIRST_RATE, _NEXT_RATE = 1e-3, 0.02


@dataclass(frozen=True)
class HogPlan:
    """What to train.

    Attributes
    ----------
    window : HogWindow
    rounds : int
        Times that negatives which the detector takes for the object are added.
    negatives : int
        Taken at random at first, and added in a round at most.
    c : float
        What a sample on the wrong side costs.
    seed : int
    """

    window: HogWindow = field(default_factory=HogWindow)
    rounds: int = 3
    negatives: int = 2000
    c: float = 0.1
    seed: int = 0

    def __post_init__(self) -> None:
        if self.rounds < 0 or self.negatives < 1:
            raise ConfigError("rounds must be 0 or more, negatives 1 or more")
        if not self.c > 0:
            raise ConfigError(f"c must be above 0, got {self.c:g}")


@dataclass(frozen=True)
class Round:
    """What is known after a round.

    Attributes
    ----------
    number : int
        From 0, the round with negatives taken at random.
    positives, negatives : int
        Samples of its SVM.
    added : int
        Negatives that are new.
    before : Rate
        False alarms per window before it, counted while its negatives were looked for.
    hit_rate : float
        Share of its positives on the object's side.
    mining_s, training_s : float
        Seconds.
    """

    number: int
    positives: int
    negatives: int
    added: int
    before: Rate
    hit_rate: float
    mining_s: float
    training_s: float


@dataclass(frozen=True, eq=False, slots=True)
class TrainedHog:
    """A HOG detector and how it came about.

    Attributes
    ----------
    window : HogWindow
    plane : Plane
    rounds : tuple of Round
    rate : Rate or None
        False alarms per window, where the last search found none that is new; else they were not counted.
    """

    window: HogWindow
    plane: Plane
    rounds: tuple[Round, ...]
    rate: Rate | None = None

    def descriptor(self) -> cv2.HOGDescriptor:
        """Return OpenCV's descriptor with the SVM set."""
        descriptor = self.window.descriptor()
        descriptor.setSVMDetector(np.append(self.plane.weights, self.plane.bias).astype(np.float32))
        return descriptor


class HogWatcher:
    """Is told how a training run goes; this one does not listen."""

    def left_out(self, lines: Sequence[str]) -> None:
        """Some images cannot be used, for the reason in their line."""

    def mining(self, number: int, images: int, found: int) -> None:
        """One more image was searched for negatives."""

    def round(self, record: Round) -> None:
        """A round is done."""


def train_hog(
    plan: HogPlan, positives: NDArray[np.uint8], miner: HogMiner, watcher: HogWatcher | None = None
) -> TrainedHog:
    """Train a HOG detector.

    N. Dalal and B. Triggs, "Histograms of oriented gradients for human detection", CVPR 2005,
    doi:10.1109/CVPR.2005.177, sections 4 and 5. Differs from it: several rounds in place of one, with a limit
    for each image, errors squared, and windows as the detector sees them within their images.

    Parameters
    ----------
    plan : HogPlan
    positives : (n, height, width) uint8
    miner : HogMiner
        Finds negatives.
    watcher : HogWatcher, optional

    Raises
    ------
    ConfigError
        If no negative is found.
    """
    watcher = watcher or HogWatcher()
    samples = _Samples.of(plan, positives, miner.jobs)
    trained, seen, rate = None, set(), 1.0
    for number in range(plan.rounds + 1):
        start = perf_counter()
        detector = trained.descriptor() if trained else None
        found = miner.mine(detector, number, plan.negatives, rate, seen, _teller(watcher, number))
        if len(found.frames) == 0:
            return _ended(trained, found.rate)
        middle = perf_counter()
        samples.add(found.frames)
        plane = fit_svm(samples.values, samples.positive, plan.c, trained.plane if trained else None)
        record = Round(
            number,
            len(positives),
            len(samples.values) - len(positives),
            len(found.frames),
            found.rate,
            float((plane.margins(samples.values[: len(positives)]) >= 0).mean()),
            middle - start,
            perf_counter() - middle,
        )
        trained = TrainedHog(plan.window, plane, (*(trained.rounds if trained else ()), record))
        rate = _FIRST_RATE if number == 0 else max(found.rate.value, 1e-9) * _NEXT_RATE
        watcher.round(record)
    return _ended(trained, None)


def _ended(trained: TrainedHog | None, rate: Rate | None) -> TrainedHog:
    if trained is None:
        raise ConfigError("no negatives: every image is smaller than the window or covered by boxes")
    return replace(trained, rate=rate)


class _Samples:
    """Descriptors of all samples, positives first, in one array with room for all rounds."""

    def __init__(self, plan: HogPlan, count: int, jobs: ThreadPoolExecutor | None) -> None:
        self._descriptor, self._jobs = plan.window.descriptor(), jobs
        room = count + plan.negatives * (plan.rounds + 1)
        self._values = np.empty((room, self._descriptor.getDescriptorSize()), np.float32)
        self._positives, self._count = count, 0

    @classmethod
    def of(cls, plan: HogPlan, positives: NDArray[np.uint8], jobs: ThreadPoolExecutor | None) -> Self:
        samples = cls(plan, len(positives), jobs)
        samples.add(framed(positives))
        return samples

    @property
    def values(self) -> NDArray[np.float32]:
        return self._values[: self._count]

    @property
    def positive(self) -> NDArray[np.bool_]:
        return np.arange(self._count) < self._positives

    def add(self, frames: NDArray[np.uint8]) -> None:
        end = self._count + len(frames)
        self._values[self._count : end] = describe(self._descriptor, frames, self._jobs)
        self._count = end


def _teller(watcher: HogWatcher, number: int) -> Callable[[int, int], None]:
    return lambda images, found: watcher.mining(number, images, found)
