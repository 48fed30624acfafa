"""What a person sees of a training run: a line a stage, and below it what is going on, with the time left."""

import sys
from collections.abc import Sequence
from types import TracebackType

from laserimg.cascade.checkpoint import StageRecord, StageState
from laserimg.cascade.estimate import forecast
from laserimg.cascade.folder import Run, ending
from laserimg.cascade.model import Cascade
from laserimg.cascade.rates import Rate
from laserimg.cascade.stage import Progress
from laserimg.cascade.training import Trained, Watcher

HEAD = "stage  trees  hit rate  false alarm  positives left  windows searched  false alarms/window  seconds"


class Display(Watcher):
    """Prints stages to standard output and a live line to standard error, where that is a terminal."""

    def __init__(self, run: Run, quiet: bool) -> None:
        self._run, self._quiet = run, quiet
        self._records: list[StageRecord] = []
        self._live = None
        if not quiet and sys.stderr.isatty():
            from rich.console import Console
            from rich.status import Status

            self._live = Status("", console=Console(stderr=True))

    def __enter__(self) -> "Display":
        if self._live:
            self._live.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._live:
            self._live.stop()

    def left_out(self, lines: Sequence[str]) -> None:
        """Name what was left out, the first twenty."""
        for line in lines[:20]:
            print(f"left out: {line}", file=sys.stderr)
        if len(lines) > 20:
            print(f"left out: {len(lines) - 20} more", file=sys.stderr)

    def mining(self, stage: int, found: int, wanted: int, rate: Rate) -> None:
        """Show how many negatives are found."""
        self._show(f"stage {stage}: {found} of {wanted} negatives, {rate.value:.2g} per window")

    def tree(self, stage: int, progress: Progress) -> None:
        """Show what the stage reaches."""
        self._show(f"stage {stage}: {progress.trees} trees, {progress.false_alarm:.3f} false alarms")

    def stage(self, cascade: Cascade, state: StageState) -> None:
        """Print the stage's line."""
        if self._quiet:
            return
        if not self._records:
            print(HEAD)
        self._records.append(state.record)
        print(_line(state.record), flush=True)

    def end(self, trained: Trained) -> None:
        """Say why training ended."""
        print(ending(self._run, trained))
        if len(trained.cascade):
            print(self._run.cascade)

    def _show(self, text: str) -> None:
        if self._live:
            left = forecast(self._run.plan, 1 << 60, self._records, self._run.jobs).seconds
            self._live.update(f"{text}; about {_duration(left)} left")


def _line(record: StageRecord) -> str:
    return (
        f"{record.number:5d}  {record.trees:5d}  {record.hit_rate:8.4f}  {record.false_alarm:11.4f}"
        f"  {record.positives_left:14d}  {record.before.windows:16,d}  {record.rate:19.3g}"
        f"  {record.mining_s + record.training_s:7.1f}"
    )


def _duration(seconds: float) -> str:
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"
