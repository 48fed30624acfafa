"""A HOG training run into a folder: hog.npz, its card, and log.jsonl."""

import json
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Self

import numpy as np
from numpy.typing import NDArray

from laserimg.cascade.folder import one_thread
from laserimg.detectors.hog import load_hog, save_hog
from laserimg.files import atomic_write, sha256_of, write_text
from laserimg.formats.card import Card, card_path, write_card
from laserimg.hog_training.frames import describe, framed
from laserimg.hog_training.mining import HogMiner
from laserimg.hog_training.training import HogPlan, HogWatcher, TrainedHog, train_hog
from laserimg.hog_training.window import Size
from laserimg.samples.backgrounds import Backgrounds
from laserimg.samples.labelled import LabelledImage
from laserimg.samples.negatives import Negatives, read_negatives
from laserimg.samples.positives import read_positives


@dataclass(frozen=True, eq=False)
class HogSamples:
    """Positives, and images whose windows outside all boxes are negatives.

    Attributes
    ----------
    positives : (n, height, width) uint8
    backgrounds : tuple of LabelledImage
    skipped : tuple of str
        What was left out with the reason, one line each.
    """

    positives: NDArray[np.uint8]
    backgrounds: tuple[LabelledImage, ...] = ()
    skipped: tuple[str, ...] = ()

    @classmethod
    def read(
        cls,
        positives: Path,
        negatives: Path | None,
        window: Size,
        margin: float = 0.0,
        label: str | None = None,
        pictures: tuple[Path, str] | None = None,
    ) -> Self:
        """Read files with the arguments of `read_positives`; without `negatives` there are no backgrounds.

        Raises
        ------
        LabelError
            If there is no positive, or no image in `negatives`.
        """
        objects = read_positives(positives, window, margin, label, pictures)
        images = read_negatives(negatives, pictures) if negatives else Negatives(())
        return cls(objects.windows, images.images, (*objects.skipped, *images.skipped))


@dataclass(frozen=True, eq=False)
class HogRun:
    """Everything that a run needs.

    Attributes
    ----------
    plan : HogPlan
    samples : HogSamples
    folder : Path
    card : Card
        What the detector is for; kind, window, seed, scores and checksum are filled in.
    jobs : int
        Threads; the result does not depend on them.
    scale_step : float
        Ratio of the sizes that negatives are looked for at.
    aside : HogSamples, optional
        Kept aside to judge by.
    """

    plan: HogPlan
    samples: HogSamples
    folder: Path
    card: Card
    jobs: int = 1
    scale_step: float = 1.2
    aside: HogSamples | None = None

    @property
    def detector(self) -> Path:
        """The file of the detector."""
        return self.folder / "hog.npz"


def train_into_folder(run: HogRun, watcher: HogWatcher | None = None) -> tuple[TrainedHog, Card]:
    """Train, judge by the samples kept aside, and write the files; until the end nothing is written."""
    watcher = watcher or HogWatcher()
    with one_thread(), ThreadPoolExecutor(run.jobs) as threads:
        jobs = threads if run.jobs > 1 else None
        miner = _miner(run, run.samples, jobs)
        watcher.left_out(miner.backgrounds.unusable(miner.window, jobs))
        trained = train_hog(run.plan, run.samples.positives, miner, watcher)
        scores = _scores(run, run.aside, trained, jobs) if run.aside else {}
    card = _write(run, trained, scores)
    _write_log(run.folder / "log.jsonl", trained, scores)
    return trained, card


def _miner(run: HogRun, samples: HogSamples, jobs: ThreadPoolExecutor | None) -> HogMiner:
    parts, images = run.plan.window, Backgrounds(samples.backgrounds)
    # By steps of whole strides windows share their blocks, and OpenCV computes each once.
    return HogMiner(images, parts.window, parts.stride, run.plan.seed, run.scale_step, jobs)


def _scores(
    run: HogRun, aside: HogSamples, trained: TrainedHog, jobs: ThreadPoolExecutor | None
) -> dict[str, float]:
    values = describe(trained.window.descriptor(), framed(aside.positives), jobs)
    scores = {"hit_rate": float((trained.plane.margins(values) >= 0).mean())}
    if aside.backgrounds:
        rate = _miner(run, aside, jobs).rate(trained.descriptor())
        scores |= {"false_alarms_per_window": rate.value, "false_alarms_per_window_high": rate.high}
    return scores


def _write(run: HogRun, trained: TrainedHog, scores: dict[str, float]) -> Card:
    # An old card goes first: a run killed between the two files leaves none rather than a wrong one.
    card_path(run.detector).unlink(missing_ok=True)
    with atomic_write(run.detector) as temporary:
        temporary.write_bytes(save_hog(trained.window.arguments, trained.plane.weights, trained.plane.bias))
        load_hog(temporary)
    card = replace(
        run.card,
        kind="hog",
        window=trained.window.window,
        seed=run.plan.seed,
        scores={**run.card.scores, **scores},
        sha256=sha256_of(run.detector),
    )
    write_card(card_path(run.detector), card)
    return card


def _write_log(path: Path, trained: TrainedHog, scores: dict[str, float]) -> None:
    lines = [{"event": "round", **asdict(record)} for record in trained.rounds]
    rate = asdict(trained.rate) if trained.rate else None
    lines.append({"event": "end", "rate": rate, "scores": scores})
    write_text(path, "".join(f"{json.dumps(line)}\n" for line in lines))
