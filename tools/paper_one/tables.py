"""The tables of the experiment in Markdown, in the paper's words."""

from collections import Counter
from collections.abc import Iterable, Iterator

import numpy as np
from scipy.stats import binomtest

from laserimg.classify import ClassTable, class_table
from paper_one.plan import IMAGES
from paper_one.run import Run


def pooled(runs: list[Run], name: str) -> ClassTable:
    """Return the table of one way of classifying over all seeds."""
    truth = np.concatenate([run.labels for run in runs])
    taken = np.concatenate([run.taken_for[name] for run in runs])
    return class_table(truth[taken != ""], taken[taken != ""], tuple(IMAGES))


def paper_table(table: ClassTable) -> Iterator[str]:
    """Yield the lines of one of the paper's tables."""
    place = [table.labels.index(label) for label in IMAGES]
    yield from head("", *IMAGES, "Total")
    for word, values in (("Images", table.images), ("Detected", table.detected), ("Correct", table.correct)):
        total = "" if word == "Detected" else f"{values.sum():.0f}"
        yield line(word, *(f"{values[i]:.0f}" for i in place), total)
    yield line("Precision", *(f"{table.precision[i]:.1%}" for i in place), "")
    yield line("Recall", *(f"{table.recall[i]:.1%}" for i in place), f"{table.accuracy:.1%}")


def comparison(runs: list[Run]) -> Iterator[str]:
    """Yield a line for every way of classifying: total, its interval, its spread over seeds."""
    yield from head("classified by", "Total", "95 % interval", "of the seeds", "balanced", "wrong")
    for name in runs[0].taken_for:
        table = pooled(runs, name)
        low, high = table.interval()
        each = " ".join(f"{100 * pooled([run], name).accuracy:.1f}" for run in runs)
        wrong = f"{table.images.sum() - table.correct.sum():.0f} of {table.images.sum():.0f}"
        shown = f"{table.accuracy:.1%}", f"{low:.1%} to {high:.1%}", each, f"{table.balanced_accuracy:.1%}"
        yield line(name, *shown, wrong)


def orders(runs: list[Run], pairs: Iterable[tuple[str, str]]) -> Iterator[str]:
    """Yield a line for every pair: objects that only one of them has right, and how likely by chance."""
    yield from head("first", "second", "only the first is right", "only the second is right", "p")
    for first, second in pairs:
        one, other = (
            np.concatenate([run.taken_for[name] == run.labels for run in runs]) for name in (first, second)
        )
        gains = int((one & ~other).sum()), int((other & ~one).sum())
        chance = binomtest(gains[1], max(sum(gains), 1)).pvalue if sum(gains) else 1.0
        yield line(first, second, *map(str, gains), f"{chance:.2g}")


def kinds(runs: list[Run], names: Iterable[str]) -> Iterator[str]:
    """Yield a line for every kind of thing: how many, and the recall of each way of classifying."""
    names = list(names)
    yield from head("class", "kind", "images", *names)
    truths = [(one.truth.label, one.truth.kind) for run in runs for one in run.found]
    right = [np.concatenate([run.taken_for[name] == run.labels for run in runs]) for name in names]
    order = list(IMAGES)
    for label, kind in sorted(set(truths), key=lambda truth: (order.index(truth[0]), truth[1])):
        mask = np.array([truth == (label, kind) for truth in truths])
        yield line(label, kind, str(mask.sum()), *(f"{each[mask].mean():.1%}" for each in right))


def refusals(runs: list[Run]) -> Iterator[str]:
    """Yield a line for every reason why clusters are no objects."""
    total = sum((run.refused for run in runs), Counter())
    yield from head("clusters left out", "how many", "of")
    for reason in sorted({reason for reason, _ in total}):
        of = {what: count for (why, what), count in sorted(total.items()) if why == reason}
        parts = ", ".join(f"{what or 'none of them'} {count}" for what, count in of.items())
        yield line(reason, str(sum(of.values())), parts)


def head(*cells: str) -> Iterator[str]:
    """Yield the first two lines of a table."""
    yield line(*cells)
    yield "|---" * len(cells) + "|"


def line(*cells: str) -> str:
    """Return one line of a table."""
    return f"| {' | '.join(cells)} |"
