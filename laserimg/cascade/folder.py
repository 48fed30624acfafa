"""A training run in a folder: cascade.xml, its card, log.jsonl, report.html, and the state to go on from."""

import json
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from hashlib import sha256
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from laserimg.cascade.checkpoint import Checkpoints, StageRecord, StageState
from laserimg.cascade.mining import PASSES, Miner
from laserimg.cascade.model import Cascade
from laserimg.cascade.rates import Rate
from laserimg.cascade.report import ReportData, training_page
from laserimg.cascade.stage import Progress
from laserimg.cascade.training import Plan, Trained, Watcher, train_cascade
from laserimg.cascade.writer import write_cascade
from laserimg.errors import LabelError
from laserimg.files import remove_unfinished, write_text
from laserimg.samples.backgrounds import Backgrounds
from laserimg.samples.labelled import LabelledImage

# Of the memory allowed, what images kept in memory and the tables of the search may take; the rest is
# the interpreter, the samples and what is passed on.
_IMAGES_SHARE, _TABLES_SHARE = 1 / 8, 1 / 4


@dataclass(frozen=True, eq=False)
class Run:
    """Everything that a run needs.

    Attributes
    ----------
    plan : Plan
    positives : (n, height, width) uint8
    backgrounds : tuple of LabelledImage
    folder : Path
    jobs : int
        Threads.
    memory : int
        Bytes.
    scale_step : float
        Of the pyramid that negatives are looked for in.
    validation : (m, height, width) uint8, optional
        Positives to judge the cascade by; nothing is trained on them.
    turned : bool
        Look for negatives also in mirrored and turned copies of the backgrounds.
    """

    plan: Plan
    positives: NDArray[np.uint8]
    backgrounds: tuple[LabelledImage, ...]
    folder: Path
    jobs: int
    memory: int = 2 << 30
    scale_step: float = 1.2
    validation: NDArray[np.uint8] | None = None
    turned: bool = False

    @property
    def cascade(self) -> Path:
        """The XML file."""
        return self.folder / "cascade.xml"


def tables_share(memory: int) -> int:
    """Return the bytes that the tables of the search may take."""
    return int(memory * _TABLES_SHARE)


def run_in_folder(run: Run, watcher: Watcher, restart: bool = False) -> Trained:
    """Train into a folder, going on from its state; after each stage its files are whole and valid.

    Raises
    ------
    ConfigError
        If the folder holds the state of another run and `restart` is not set.
    LabelError
        If no image can be used for negatives.
    """
    checkpoints = Checkpoints(run.folder / "state", _identity(run))
    for folder in (run.folder, run.folder / "state"):
        remove_unfinished(folder)
    done = [] if restart else checkpoints.load()[: run.plan.stages]
    if not done:
        checkpoints.begin()
    keeper = _Keeper(run, checkpoints, [state.record for state in done], watcher)
    with one_thread(), ThreadPoolExecutor(run.jobs) as threads:
        jobs = threads if run.jobs > 1 else None
        images = Backgrounds(run.backgrounds, int(run.memory * _IMAGES_SHARE), run.turned)
        miner = _miner(run, images, jobs)
        _check(run, images.unusable(miner.window, jobs), watcher)
        trained = train_cascade(run.plan, run.positives, miner, jobs, done, keeper)
    keeper.finish(trained)
    return trained


@contextmanager
def one_thread() -> Iterator[None]:
    """Let OpenCV and NumPy use one thread a call: the calls run in threads and processes of ours.

    With more, products of matrices have other last bits, and what is trained on them differs.
    """
    before = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        with threadpool_limits(1):
            yield
    finally:
        cv2.setNumThreads(before)


def _check(run: Run, unusable: Sequence[str], watcher: Watcher) -> None:
    if len(unusable) == len(run.backgrounds):
        raise LabelError(f"no image to take negatives from; {unusable[0] if unusable else 'none is given'}")
    watcher.left_out(unusable)


def _miner(run: Run, images: Backgrounds, jobs: ThreadPoolExecutor | None) -> Miner:
    pool = run.plan.pool
    return Miner(images, (pool.width, pool.height), run.plan.seed, run.scale_step, pool.mode == "lbp", jobs)


def _identity(run: Run) -> dict:
    plan = asdict(run.plan)
    # More stages, or a lower target, go on with what is there.
    del plan["stages"], plan["target"]
    names = "\n".join(f"{image.path.resolve()} {image.boxes.tolist()}" for image in run.backgrounds)
    return {
        "format": 1,
        **plan,
        "scale_step": run.scale_step,
        "turned": run.turned,
        "positives": sha256(run.positives.tobytes()).hexdigest(),
        "backgrounds": sha256(names.encode()).hexdigest(),
    }


def ending(run: Run, trained: Trained) -> str:
    """Return in a sentence why training ended, and the rate it reached."""
    if trained.rate is None:
        rate = f"about {trained.records[-1].rate:.2g} false alarms per window" if trained.records else ""
        return f"All {len(trained.cascade)} stages are trained: {rate}."
    counted = (
        f"{trained.rate.value:.3g} false alarms per window (95 %: {trained.rate.low:.3g} to"
        f" {trained.rate.high:.3g}; {trained.rate.accepted} in {trained.rate.windows:,d} windows)"
    )
    stages = f"after {len(trained.cascade)} stages"
    images = f"{len(run.backgrounds)} images" + (" in eight copies" if run.turned else "")
    if trained.end == "target":
        return f"The target is reached {stages}: {counted}."
    if trained.end == "positives":
        return f"Too few positives are left {stages}: {counted}."
    return (
        f"The negatives have run out {stages}: {PASSES} passes over {images} gave fewer "
        f"than the {run.plan.negatives} negatives asked for; {counted}. More images let training go on."
    )


def _report(run: Run, trained: Trained) -> ReportData:
    return ReportData(
        trained.cascade,
        trained.records,
        run.positives,
        run.validation,
        trained.negatives,
        run.folder.resolve().name,
        ending(run, trained),
    )


class _Keeper(Watcher):
    """Writes the files of the folder after each stage, and passes on what it is told."""

    def __init__(
        self, run: Run, checkpoints: Checkpoints, records: Sequence[StageRecord], watcher: Watcher
    ) -> None:
        self._run, self._checkpoints, self._watcher = run, checkpoints, watcher
        self._records = list(records)

    def mining(self, stage: int, found: int, wanted: int, rate: Rate) -> None:
        self._watcher.mining(stage, found, wanted, rate)

    def tree(self, stage: int, progress: Progress) -> None:
        self._watcher.tree(stage, progress)

    def stage(self, cascade: Cascade, state: StageState) -> None:
        self._checkpoints.save(state)
        self._records.append(state.record)
        write_cascade(self._run.cascade, cascade, self._run.plan.goal)
        self._log()
        self._watcher.stage(cascade, state)

    def finish(self, trained: Trained) -> None:
        if len(trained.cascade):
            # Also when nothing was left to train: the folder may have lost a file.
            write_cascade(self._run.cascade, trained.cascade, self._run.plan.goal)
            write_text(self._run.folder / "report.html", training_page(_report(self._run, trained)))
        end = {"event": "end", "reason": trained.end, "rate": asdict(trained.rate) if trained.rate else None}
        self._log(end)

    def _log(self, *ends: dict) -> None:
        lines = [{"event": "stage", **asdict(record), "rate": record.rate} for record in self._records]
        write_text(
            self._run.folder / "log.jsonl", "".join(f"{json.dumps(line)}\n" for line in [*lines, *ends])
        )
