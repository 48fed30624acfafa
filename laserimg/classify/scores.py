"""The paper's table: what was detected as what, with intervals."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from laserimg.errors import ConfigError

UNKNOWN = "unknown"


@dataclass(frozen=True, eq=False, slots=True)
class ClassTable:
    """Which class was taken for which.

    Parameters
    ----------
    labels : tuple of str
        The classes.
    counts : (k, k + 1) array of float64
        Rows are true classes, columns what they were taken for, the last "unknown". Means over
        repeats need not be whole.
    """

    labels: tuple[str, ...]
    counts: NDArray[np.float64]

    @property
    def images(self) -> NDArray[np.float64]:
        """(k,) objects of each class."""
        return self.counts.sum(axis=1)

    @property
    def detected(self) -> NDArray[np.float64]:
        """(k,) objects taken for each class."""
        return self.counts[:, :-1].sum(axis=0)

    @property
    def correct(self) -> NDArray[np.float64]:
        """(k,) objects of each class taken for it."""
        return np.diagonal(self.counts).copy()

    @property
    def precision(self) -> NDArray[np.float64]:
        """(k,) share of the detected that are correct; NaN where nothing was detected."""
        return _ratio(self.correct, self.detected)

    @property
    def recall(self) -> NDArray[np.float64]:
        """(k,) share of the images that are correct; NaN for a class without images."""
        return _ratio(self.correct, self.images)

    @property
    def accuracy(self) -> float:
        """Share of all objects that are correct."""
        return float(self.correct.sum() / self.images.sum())

    @property
    def balanced_accuracy(self) -> float:
        """Mean recall of the classes that have objects."""
        return float(np.nanmean(self.recall))

    def interval(self) -> tuple[float, float]:
        """Return the 95 % interval (Wilson) of the accuracy."""
        return wilson(float(self.correct.sum()), float(self.images.sum()))

    def as_dict(self) -> dict[str, Any]:
        """Return plain values: ``classes``, ``total`` and ``confusion``."""
        names = ("images", "detected", "correct", "precision", "recall")
        rows = zip(*(_plain(getattr(self, name)) for name in names), strict=True)
        total = {
            "images": _number(self.images.sum()),
            "detected": _number(self.detected.sum()),
            "correct": _number(self.correct.sum()),
            "precision": _number(self.correct.sum() / max(self.detected.sum(), 1e-12)),
            "recall": self.accuracy,
            "accuracy": self.accuracy,
            "accuracy_interval": list(self.interval()),
            "balanced_accuracy": self.balanced_accuracy,
        }
        classes = [dict(zip(names, row, strict=True)) for row in rows]
        return {
            "classes": dict(zip(self.labels, classes, strict=True)),
            "total": total,
            "confusion": {"labels": [*self.labels, UNKNOWN], "counts": [_plain(row) for row in self.counts]},
        }


def class_table(truth: NDArray, found: NDArray | list[NDArray], labels: tuple[str, ...] = ()) -> ClassTable:
    """Count what objects were taken for.

    Parameters
    ----------
    truth : (n,) array of str
    found : (n,) array of str, or a list of such, one a repeat
        Their counts are averaged.
    labels : tuple of str
        Classes to show even if no object has them.

    Raises
    ------
    ConfigError
        If there are no objects, or one is of a class called "unknown".

    Examples
    --------
    >>> table = class_table(np.array(["car", "car", "tree"]), np.array(["car", "tree", "tree"]))
    >>> table.precision.tolist(), table.recall.tolist(), round(table.accuracy, 3)
    ([1.0, 0.5], [0.5, 1.0], 0.667)
    """
    runs = found if isinstance(found, list) else [found]
    if not len(truth):
        raise ConfigError("no objects to count")
    refuse_unknown(truth)
    seen = {name for part in (truth, *runs) for name in part.tolist()}
    names = tuple(sorted({*labels, *seen} - {UNKNOWN}))
    place = {name: index for index, name in enumerate((*names, UNKNOWN))}
    counts = np.zeros((len(names), len(names) + 1))
    for run in runs:
        rows, columns = ([place[name] for name in part.tolist()] for part in (truth, run))
        np.add.at(counts, (rows, columns), 1 / len(runs))
    return ClassTable(names, counts)


def refuse_unknown(labels: NDArray) -> None:
    """Refuse objects of a class that is called as what belongs to none.

    Raises
    ------
    ConfigError
    """
    if UNKNOWN in labels:
        raise ConfigError(f"a class cannot be called {UNKNOWN}: that is what no class is clear of")


def wilson(hits: float, total: float) -> tuple[float, float]:
    """Return the 95 % interval of a share of independent trials (Wilson, 1927).

    Examples
    --------
    >>> tuple(round(bound, 3) for bound in wilson(481, 490))
    (0.965, 0.99)
    """
    z = 1.959964
    share, weight = hits / total, z * z / total
    middle = share + weight / 2
    spread = z * np.sqrt(max(share * (1 - share), 0) / total + weight / (4 * total))
    low, high = (middle - spread) / (1 + weight), (middle + spread) / (1 + weight)
    return float(max(low, 0)), float(min(high, 1))


def _ratio(part: NDArray[np.float64], whole: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.divide(part, whole, out=np.full(len(part), np.nan), where=whole > 0)


def _plain(values: NDArray[np.float64]) -> list[float | int | None]:
    return [None if np.isnan(value) else _number(value) for value in values]


def _number(value: float) -> float | int:
    near = round(float(value))
    return near if abs(float(value) - near) < 1e-9 else round(float(value), 4)
