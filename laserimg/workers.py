"""Worker processes that begin with everything imported."""

import multiprocessing
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from functools import partial
from multiprocessing.context import BaseContext
from typing import TypeVar

T = TypeVar("T")
R = TypeVar("R")

# A process that has imported this is forked for every worker. With loky each worker imported anew:
# 100 scans of 181 x 316 pixels took 4.2 s with two jobs; so they take 3.2 s (5.0 s with one job).
_PRELOADED = ["laserimg.batch"]
# Items handed out to each worker, so that none waits for its next.
_AHEAD = 2


def _context() -> BaseContext:
    if "forkserver" not in multiprocessing.get_all_start_methods():
        return multiprocessing.get_context("spawn")
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(_PRELOADED)
    return context


def start_early() -> None:
    """Begin to import what workers need while this process imports the same."""
    if _context().get_start_method() == "forkserver":
        from multiprocessing import forkserver

        forkserver.ensure_running()


def in_order(
    work: Callable[[T], R],
    items: Iterable[T],
    jobs: int,
    died: Callable[[T], R],
    tell: Callable[[int], None] = lambda done: None,
) -> list[R]:
    """Return ``work(item)`` of every item, in their order whichever is finished first.

    Parameters
    ----------
    work, items, jobs, died
        As `unordered`.
    tell : callable
        Called with the number of items finished, after each.
    """
    found: dict[int, R] = {}
    numbered = partial(_numbered, work)
    results = unordered(numbered, enumerate(items), jobs, lambda item: (item[0], died(item[1])))
    for number, result in results:
        found[number] = result
        tell(len(found))
    return [found[number] for number in range(len(found))]


def _numbered(work: Callable[[T], R], item: tuple[int, T]) -> tuple[int, R]:
    return item[0], work(item[1])


def unordered(work: Callable[[T], R], items: Iterable[T], jobs: int, died: Callable[[T], R]) -> Iterator[R]:
    """Yield ``work(item)`` of every item as each is finished, in this process if `jobs` is 1.

    Parameters
    ----------
    work : callable
        At the top of a module, so that workers find it.
    items : iterable
    jobs : int
        Worker processes.
    died : callable
        What an item gives whose worker was killed, as when memory runs out or a library crashes; the
        other items are done all the same.
    """
    if jobs == 1:
        yield from map(work, items)
        return
    rest = deque(items)
    while rest:
        # Which of the items in work killed its worker is not known: each gets a worker of its own.
        for suspect in (yield from _pooled(work, rest, jobs)):
            alone = deque([suspect])
            yield from map(died, (yield from _pooled(work, alone, 1)))


def _pooled(work: Callable[[T], R], items: deque[T], jobs: int) -> Generator[R, None, list[T]]:
    """Take items and yield what they give; return those in work when a worker was killed."""
    waiting: dict[Future[R], T] = {}
    with ProcessPoolExecutor(min(jobs, len(items)), mp_context=_context()) as pool:
        try:
            while items or waiting:
                while items and len(waiting) < _AHEAD * jobs:
                    item = items.popleft()
                    waiting[pool.submit(work, item)] = item
                for future in wait(waiting, return_when=FIRST_COMPLETED).done:
                    result = future.result()
                    del waiting[future]
                    yield result
        except BrokenProcessPool:
            return list(waiting.values())
        finally:
            pool.shutdown(cancel_futures=True)
    return []
