"""Which class is taken for which."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from laserimg.evaluate.matching import match
from laserimg.evaluate.scores import Accept, accepted
from laserimg.formats.coco import CocoFile

NOTHING = "nothing"


@dataclass(frozen=True, eq=False, slots=True)
class Confusion:
    """How many objects of each class were detected as which class.

    Parameters
    ----------
    labels : tuple of str
        Classes, and `NOTHING` at the end.
    counts : (n, n) array of int
        Rows are true classes, columns detected ones.
    """

    labels: tuple[str, ...]
    counts: NDArray[np.intp]


def confusion(
    detections: CocoFile,
    truth: CocoFile,
    min_iou: float = 0.5,
    accept: Accept = accepted,
    asked: Accept = lambda annotation: True,
) -> Confusion:
    """Return the confusion of classes among detections and objects that overlap by `min_iou`.

    Every detection is matched whatever its class; one of nothing counts in the last row, an object
    that was not found in the last column. `asked` as `evaluate` has it.
    """
    labels = (*dict.fromkeys((*truth.labels.values(), *detections.labels.values())), NOTHING)
    place = {label: index for index, label in enumerate(labels)}
    counts = np.zeros((len(labels), len(labels)), np.intp)
    only = len(truth.images) == len(detections.images) == 1
    for image in truth.images:
        found_image = detections.image_of(image.file_name, image.scan, only)
        if found_image is None:
            continue
        wanted = [entry for entry in truth.annotations if entry.image_id == image.id and accepted(entry)]
        ignore = np.array([bool(entry.iscrowd) or not asked(entry) for entry in wanted], np.bool_)
        found = [e for e in detections.annotations if e.image_id == found_image.id and accept(e)]
        matches = match(
            np.array([entry.bbox for entry in found], np.float64).reshape(-1, 4),
            np.array([1.0 if entry.score is None else entry.score for entry in found]),
            np.array([entry.bbox for entry in wanted], np.float64).reshape(-1, 4),
            ignore,
            min_iou,
            image.width,
        )
        for entry, owner, ignored in zip(found, matches.truth, matches.ignored, strict=True):
            if not ignored:
                row = NOTHING if owner < 0 else truth.labels[wanted[owner].category_id]
                counts[place[row], place[detections.labels[entry.category_id]]] += 1
        matched = set(matches.truth.tolist())
        for index, entry in enumerate(wanted):
            if not ignore[index] and index not in matched:
                counts[place[truth.labels[entry.category_id]], place[NOTHING]] += 1
    return Confusion(labels, counts)
