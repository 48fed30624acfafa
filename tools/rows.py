"""The rows that `tools/benchmark.py` prints: our figure beside a peer's of the same run."""

import time
from collections.abc import Callable
from dataclasses import dataclass

import cv2

ROUNDS = 5


@dataclass(frozen=True, slots=True)
class Row:
    """One measurement: what, ours, the peer and its figure, their relation, what is wanted and kept."""

    what: str
    ours: str
    peer: str
    theirs: str
    relation: str
    wanted: str
    kept: bool | None

    def __str__(self) -> str:
        verdict = {True: "kept", False: "MISSED", None: ""}[self.kept]
        cells = (self.what, self.ours, self.peer, self.theirs, self.relation, self.wanted, verdict)
        return "".join(f"{cell:<{width}}" for cell, width in zip(cells, WIDTHS, strict=True)).rstrip()


WIDTHS = (46, 22, 32, 22, 16, 16, 6)
TITLES = Row("", "laserimg", "peer", "", "", "wanted", None)


_clock = [time.perf_counter]


def count_cpu_time() -> None:
    """From now on count the CPU time of this process, with one thread of OpenCV: other work does not show."""
    _clock[0] = time.process_time
    cv2.setNumThreads(1)


def best_times(*calls: Callable[[], object]) -> list[float]:
    """Return the best time of each call in seconds; they run in turn, so that all see the same machine."""
    times: list[list[float]] = [[] for _ in calls]
    for round_ in range(ROUNDS + 1):
        for call, seen in zip(calls, times, strict=True):
            start = _clock[0]()
            call()
            if round_:
                seen.append(_clock[0]() - start)
    return [min(seen) for seen in times]


def faster(
    what: str, ours: Callable, peer: str, theirs: Callable | None, at_least: float | None = None
) -> Row:
    """Time ours beside a peer's; `at_least` times faster is wanted."""
    if theirs is None:
        (mine,) = best_times(ours)
        return Row(what, f"{mine * 1e3:.1f} ms", peer, "not installed", "", "", None)
    mine, other = best_times(ours, theirs)
    ratio = other / mine
    wanted = "" if at_least is None else f">= {at_least:g} x"
    kept = None if at_least is None else ratio >= at_least
    return Row(
        what, f"{mine * 1e3:.1f} ms", peer, f"{other * 1e3:.1f} ms", f"{ratio:.1f} x faster", wanted, kept
    )


def within(what: str, ours: Callable, peer: str, theirs: Callable, at_most: float) -> Row:
    """Time ours beside a peer's; at most so many times its time is wanted."""
    mine, other = best_times(ours, theirs)
    ratio = mine / other
    texts = (
        f"{mine * 1e3:.1f} ms",
        peer,
        f"{other * 1e3:.1f} ms",
        f"{ratio:.2f} x its time",
        f"<= {at_most:g} x",
    )
    return Row(what, *texts, ratio <= at_most)


def error(what: str, ours_deg: float, peer: str, theirs_deg: float | None, at_most_deg: float) -> Row:
    """Set an error in degrees beside a peer's; at most so much is wanted."""
    theirs = "not installed" if theirs_deg is None else f"{theirs_deg:.2f} deg"
    return Row(
        what, f"{ours_deg:.2f} deg", peer, theirs, "", f"<= {at_most_deg:g} deg", ours_deg <= at_most_deg
    )


def under(what: str, ours: Callable[[], object], at_most_s: float | None) -> Row:
    """Time ours alone; at most so many seconds are wanted."""
    (mine,) = best_times(ours)
    wanted = "" if at_most_s is None else f"<= {at_most_s * 1e3:g} ms"
    kept = None if at_most_s is None else mine <= at_most_s
    return Row(what, f"{mine * 1e3:.1f} ms", "", "", "", wanted, kept)
