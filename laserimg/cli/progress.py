"""A progress bar with time left, on the terminal only."""

import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import TypeVar

T = TypeVar("T")


def track(items: Iterable[T], total: int, what: str, quiet: bool = False) -> Iterator[T]:
    """Yield the items, showing how many of `total` are done and the time left, on standard error."""
    if quiet or total < 2 or not sys.stderr.isatty():
        yield from items
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True)) as progress:
        task = progress.add_task(what, total=total)
        for item in items:
            yield item
            progress.advance(task)


def stepping(quiet: bool = False) -> Callable[[str, int], AbstractContextManager[Callable[[int], None]]]:
    """Return what shows the steps of a long work one after the other, on the terminal only.

    Called with the name of a step and its number of items, it gives a context whose value is told how
    many are done.
    """

    @contextmanager
    def step(what: str, total: int) -> Iterator[Callable[[int], None]]:
        if quiet or total < 2 or not sys.stderr.isatty():
            yield lambda done: None
            return
        from rich.console import Console
        from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

        columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
        with Progress(*columns, console=Console(stderr=True)) as progress:
            task = progress.add_task(what, total=total)
            yield lambda done: progress.update(task, completed=done)

    return step
