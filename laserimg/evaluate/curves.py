"""Counts of hits, false positives and misses, and the curves over all score limits."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Counts:
    """Hits, false positives and misses; adding pools them, which is not a mean of means.

    Examples
    --------
    >>> total = Counts(8, 2, 1) + Counts(0, 0, 1)
    >>> total.precision, total.recall
    (0.8, 0.8)
    """

    hits: int = 0
    false_positives: int = 0
    misses: int = 0

    def __add__(self, other: "Counts") -> "Counts":
        return Counts(
            self.hits + other.hits,
            self.false_positives + other.false_positives,
            self.misses + other.misses,
        )

    @property
    def precision(self) -> float:
        """Share of the detections that are hits; NaN without detections."""
        return _share(self.hits, self.hits + self.false_positives)

    @property
    def recall(self) -> float:
        """Share of the objects that are found; NaN without objects."""
        return _share(self.hits, self.hits + self.misses)

    @property
    def f1(self) -> float:
        """Harmonic mean of precision and recall."""
        return _share(2 * self.hits, 2 * self.hits + self.false_positives + self.misses)


@dataclass(frozen=True, eq=False, slots=True)
class Curve:
    """Precision, recall and false positives per image for every limit of the score.

    Parameters
    ----------
    scores : (n,) array of float64
        The limits, falling; one for each distinct score.
    hits, false_positives : (n,) arrays of int
        Detections with at least that score.
    objects : int
    images : int
    """

    scores: NDArray[np.float64]
    hits: NDArray[np.intp]
    false_positives: NDArray[np.intp]
    objects: int
    images: int

    @classmethod
    def of(cls, scores: NDArray[np.float64], hit: NDArray[np.bool_], objects: int, images: int) -> "Curve":
        """Return the curve of detections with these scores, of which some are hits.

        Examples
        --------
        >>> curve = Curve.of(np.array([0.9, 0.8, 0.7]), np.array([True, False, True]), objects=2, images=1)
        >>> curve.recall.tolist(), round(curve.average_precision, 3)
        ([0.5, 0.5, 1.0], 0.833)
        """
        order = np.argsort(-scores, kind="stable")
        falling, hits = scores[order], np.cumsum(hit[order], dtype=np.intp)
        last = (
            np.flatnonzero(np.append(np.diff(falling) != 0, True)) if len(falling) else np.array([], np.intp)
        )
        return cls(falling[last], hits[last], last + 1 - hits[last], objects, images)

    @property
    def recall(self) -> NDArray[np.float64]:
        """(n,) share of the objects found."""
        return self.hits / max(self.objects, 1)

    @property
    def precision(self) -> NDArray[np.float64]:
        """(n,) share of the detections that are hits."""
        return self.hits / np.maximum(self.hits + self.false_positives, 1)

    @property
    def false_positives_per_image(self) -> NDArray[np.float64]:
        """(n,) false positives over images."""
        return self.false_positives / max(self.images, 1)

    @property
    def average_precision(self) -> float:
        """Area under the precision-recall curve, precision made falling; NaN without objects.

        As PASCAL VOC 2010 has it; COCO samples the same curve at 101 recalls.
        """
        if self.objects == 0:
            return float("nan")
        envelope = np.maximum.accumulate(self.precision[::-1])[::-1]
        return float(np.sum(np.diff(self.recall, prepend=0.0) * envelope))

    @property
    def counts(self) -> Counts:
        """Counts over all detections."""
        hits = int(self.hits[-1]) if len(self.hits) else 0
        false_positives = int(self.false_positives[-1]) if len(self.hits) else 0
        return Counts(hits, false_positives, self.objects - hits)

    def recall_at(self, false_positives_per_image: float) -> float:
        """Return the best recall with at most so many false positives per image."""
        allowed = self.recall[self.false_positives_per_image <= false_positives_per_image]
        return float(allowed.max()) if len(allowed) else 0.0


def _share(part: int, whole: int) -> float:
    return part / whole if whole else float("nan")
