"""Training a cascade: mine negatives, train a stage, keep the positives that pass, and again."""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from time import perf_counter
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from laserimg.cascade.checkpoint import StageRecord, StageState
from laserimg.cascade.features import Pool
from laserimg.cascade.measures import measures
from laserimg.cascade.mining import Mined, Miner
from laserimg.cascade.model import Cascade, Stage
from laserimg.cascade.rates import Rate
from laserimg.cascade.search import ExhaustiveSearch, ScreenedSearch, Search
from laserimg.cascade.stage import Progress, StageGoal, train_stage
from laserimg.cascade.windows import Windows
from laserimg.cascade.writer import cascade_xml
from laserimg.errors import ConfigError

End = Literal["stages", "target", "negatives", "positives"]
Pixels = NDArray[np.uint8]
# Fewer positives than this teach a stage nothing but themselves.
LEAST_POSITIVES = 10


@dataclass(frozen=True)
class Plan:
    """What to train.

    Attributes
    ----------
    pool : Pool
        Window and features.
    goal : StageGoal
        What each stage must reach.
    stages : int
        Stages at most.
    positives, negatives : int
        Samples of a stage; with positives 0 all that are left.
    target : float
        Stop when the false alarms per window are surely no more than this.
    search : "screened" or "exhaustive"
    seed : int
    memory : int
        Bytes for the tables of the search.
    """

    pool: Pool
    goal: StageGoal = field(default_factory=StageGoal)
    stages: int = 20
    positives: int = 0
    negatives: int = 2000
    target: float = 0.0
    search: Literal["screened", "exhaustive"] = "screened"
    seed: int = 0
    memory: int = 1 << 30

    def __post_init__(self) -> None:
        if self.stages < 1 or self.negatives < 1 or self.positives < 0:
            raise ConfigError("stages and negatives must be 1 or more")
        if not 0 <= self.target < 1:
            raise ConfigError(
                f"target must be at least 0 and below 1 false alarms per window, is {self.target}"
            )
        if self.search not in ("screened", "exhaustive"):
            raise ConfigError(f"search must be screened or exhaustive, got {self.search}")


class Watcher:
    """Is told how a training run goes; this one does not listen."""

    def left_out(self, lines: Sequence[str]) -> None:
        """Some files cannot be used; a line for each."""

    def mining(self, stage: int, found: int, wanted: int, rate: Rate) -> None:
        """Some more images were searched for negatives."""

    def tree(self, stage: int, progress: Progress) -> None:
        """A stage has one tree more."""

    def stage(self, cascade: Cascade, state: StageState) -> None:
        """A stage is trained."""


@dataclass(frozen=True, eq=False, slots=True)
class Trained:
    """The end of a training run.

    Attributes
    ----------
    cascade : Cascade
    records : tuple of StageRecord
    end : str
        Why it ended: all "stages", the "target", or no more "negatives" or "positives".
    rate : Rate or None
        False alarms per window of the whole cascade, where they were counted.
    negatives : (n, height, width) uint8
        Those trained on that pass the whole cascade.
    """

    cascade: Cascade
    records: tuple[StageRecord, ...]
    end: End
    rate: Rate | None
    negatives: Pixels


def train_cascade(
    plan: Plan,
    positives: Pixels,
    miner: Miner,
    jobs: ThreadPoolExecutor | None = None,
    done: Sequence[StageState] = (),
    watcher: Watcher | None = None,
) -> Trained:
    """Train a cascade.

    P. Viola and M. Jones, "Rapid object detection using a boosted cascade of simple features", CVPR 2001,
    doi:10.1109/CVPR.2001.990517. Differs from it and from opencv_traincascade: negatives that pass a stage
    stay for the next one, which then needs half as many new ones; windows that the detector would never look
    at are not trained on; images are searched in random order.

    Parameters
    ----------
    plan : Plan
    positives : (n, height, width) uint8
    miner : Miner
        Finds negatives.
    jobs : ThreadPoolExecutor, optional
        Threads of the search.
    done : sequence of StageState
        Stages of an earlier run of the same plan; the result is that of a run that was not interrupted.
    watcher : Watcher, optional

    Returns
    -------
    Trained
    """
    watcher = watcher or Watcher()
    cascade = Cascade(plan.pool, tuple(state.stage for state in done))
    records = [state.record for state in done]
    kept = done[-1].negatives if done else np.empty((0, *positives.shape[1:]), np.uint8)
    left = positives[np.random.default_rng(plan.seed).permutation(len(positives))]
    left = left[cascade.passes(left)]
    for number in range(len(done), plan.stages):
        start = perf_counter()
        mined = _mine(plan, cascade, records, kept, miner, watcher)
        end = _end(plan, mined, left)
        if end:
            return Trained(cascade, tuple(records), end, mined.rate, kept)
        middle = perf_counter()
        negatives = np.concatenate([kept, mined.windows])
        chosen = left[: plan.positives or None]
        stage, progress = _train(plan, number, chosen, negatives, jobs, watcher)
        cascade = cascade.with_stage(stage)
        left, kept = _passing(stage, left, plan.pool), _passing(stage, negatives, plan.pool)
        record = StageRecord(
            number,
            progress.trees,
            progress.hit_rate,
            progress.false_alarm,
            len(chosen),
            len(negatives),
            len(left),
            mined.rate,
            middle - start,
            perf_counter() - middle,
        )
        records.append(record)
        watcher.stage(cascade, StageState(stage, record, kept))
    return Trained(cascade, tuple(records), "stages", None, kept)


def _mine(
    plan: Plan, cascade: Cascade, records: list[StageRecord], kept: Pixels, miner: Miner, watcher: Watcher
) -> Mined:
    number = len(cascade)
    xml = cascade_xml(cascade, plan.goal) if number else None
    expected = records[-1].rate if records else 1.0
    return miner.mine(
        xml,
        number,
        plan.negatives - len(kept),
        max(expected, 1e-12),
        kept,
        plan.target,
        lambda found, rate: watcher.mining(number, found, plan.negatives - len(kept), rate),
    )


def _end(plan: Plan, mined: Mined, positives: Pixels) -> End | None:
    if mined.rate.windows and mined.rate.high <= plan.target:
        return "target"
    if mined.exhausted:
        return "negatives"
    return "positives" if len(positives) < LEAST_POSITIVES else None


def _train(
    plan: Plan,
    number: int,
    positives: Pixels,
    negatives: Pixels,
    jobs: ThreadPoolExecutor | None,
    watcher: Watcher,
) -> tuple[Stage, Progress]:
    positive = np.arange(len(positives) + len(negatives)) < len(positives)
    windows = Windows.of(np.concatenate([positives, negatives]), plan.pool.mode)
    samples = measures(plan.pool, windows, positive)
    search: Search
    if plan.search == "exhaustive":
        search = ExhaustiveSearch(samples, jobs, plan.memory)
    else:
        search = ScreenedSearch(samples, np.random.default_rng([plan.seed, number]), jobs, plan.memory)
    return train_stage(search, positive, plan.goal, lambda progress: watcher.tree(number, progress))


def _passing(stage: Stage, pixels: Pixels, pool: Pool) -> Pixels:
    windows = Windows.of(pixels, pool.mode)
    return pixels[stage.passed(stage.sums(pool, windows))]
