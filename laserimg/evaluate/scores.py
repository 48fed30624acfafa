"""Detections against truth, per class, IoU and range band."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from laserimg.evaluate.curves import Curve
from laserimg.evaluate.matching import match
from laserimg.formats.coco import Annotation, CocoFile, CocoImage

IOUS = (0.3, 0.5, 0.75)
BANDS_M = ((0.0, 5.0), (5.0, 10.0), (10.0, 20.0))

Band = tuple[float, float]
Accept = Callable[[Annotation], bool]


@dataclass(frozen=True, eq=False, slots=True)
class Evaluation:
    """Curves of every class at every IoU, over all ranges and per range band.

    Parameters
    ----------
    curves : mapping of (label, IoU, band or None) to Curve
        Band None is all ranges.
    missing : tuple of str
        Scans of the truth that the detections do not have; they are left out.
    """

    curves: dict[tuple[str, float, Band | None], Curve]
    missing: tuple[str, ...] = ()

    @property
    def labels(self) -> tuple[str, ...]:
        """Classes, in the order of the truth."""
        return tuple(dict.fromkeys(label for label, _, _ in self.curves))

    def mean_average_precision(self, iou: float) -> float:
        """Return the mean over the classes that have objects."""
        values = [
            curve.average_precision
            for (_, at, band), curve in self.curves.items()
            if (at, band) == (iou, None)
        ]
        known = [value for value in values if not np.isnan(value)]
        return float(np.mean(known)) if known else float("nan")


def accepted(annotation: Annotation) -> bool:
    """Whether a detection was accepted, or nobody has judged it."""
    return annotation.accepted is not False


def evaluate(
    detections: CocoFile,
    truth: CocoFile,
    ious: Iterable[float] = IOUS,
    bands_m: Iterable[Band] = BANDS_M,
    accept: Accept = accepted,
    asked: Accept = lambda annotation: True,
) -> Evaluation:
    """Compare detections with truth.

    Parameters
    ----------
    detections : CocoFile
    truth : CocoFile
        Its images are what counts; boxes with ``iscrowd`` are neither hits nor misses, what was rejected is
        no object.
    ious : iterable of float
        Least overlap of a hit.
    bands_m : iterable of (float, float)
        Ranges in metres; used for objects of the truth whose position is written.
    accept : function of Annotation
        Which candidates of the detections count as detections.
    asked : function of Annotation
        Which objects of the truth must be found; others, such as those nearly hidden, are neither hits nor
        misses.

    Returns
    -------
    Evaluation
    """
    pairs = list(_image_pairs(detections, truth))
    both = [(image, found) for image, found in pairs if found is not None]
    missing = tuple(image.file_name for image, found in pairs if found is None)
    curves, widths = {}, [image.width for image, _ in both]
    for label in truth.labels.values():
        found = [_of_class(detections, entry, label, accept) for _, entry in both]
        wanted = [_of_class(truth, image, label, accepted) for image, _ in both]
        for iou in ious:
            for band in (None, *bands_m):
                curves[label, iou, band] = _curve(found, wanted, widths, iou, band, asked)
    return Evaluation(curves, missing)


def _image_pairs(detections: CocoFile, truth: CocoFile) -> Iterator[tuple[CocoImage, CocoImage | None]]:
    only = len(truth.images) == len(detections.images) == 1
    for image in truth.images:
        yield image, detections.image_of(image.file_name, image.scan, only)


def _of_class(coco: CocoFile, image: CocoImage, label: str, accept: Accept) -> list[Annotation]:
    return [
        entry
        for entry in coco.annotations
        if entry.image_id == image.id and coco.labels[entry.category_id] == label and accept(entry)
    ]


def _curve(
    found: list[list[Annotation]],
    wanted: list[list[Annotation]],
    widths: list[int],
    iou: float,
    band: Band | None,
    asked: Accept,
) -> Curve:
    """One curve over all images; in a band, objects and detections beyond it are ignored."""
    scores, hits, objects = [np.empty(0)], [np.empty(0, np.bool_)], 0
    for ours, theirs, width in zip(found, wanted, widths, strict=True):
        score = np.array([1.0 if entry.score is None else entry.score for entry in ours])
        counted = [not entry.iscrowd and asked(entry) and _inside(entry, band) for entry in theirs]
        ignore = ~np.array(counted, np.bool_)
        matches = match(_boxes(ours), score, _boxes(theirs), ignore, iou, width)
        counts = ~matches.ignored & (
            (matches.truth >= 0) | np.array([_inside(e, band) for e in ours], np.bool_)
        )
        scores.append(score[counts])
        hits.append(matches.truth[counts] >= 0)
        objects += int((~ignore).sum())
    return Curve.of(np.concatenate(scores), np.concatenate(hits), objects, len(found))


def _inside(entry: Annotation, band: Band | None) -> bool:
    if band is None:
        return True
    return entry.position is not None and band[0] <= entry.position.range < band[1]


def _boxes(entries: list[Annotation]) -> np.ndarray:
    return np.array([entry.bbox for entry in entries], np.float64).reshape(-1, 4)
