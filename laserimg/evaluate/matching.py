"""Which detection is of which object."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from laserimg.boxes import intersection, iou

Boxes = NDArray[np.float64]


@dataclass(frozen=True, eq=False, slots=True)
class Matches:
    """What became of the detections of one image and class.

    Parameters
    ----------
    truth : (n,) array of int
        Index of the object that a detection is of; -1 for none.
    ignored : (n,) array of bool
        Detections of something to be ignored: neither hits nor false positives.
    """

    truth: NDArray[np.intp]
    ignored: NDArray[np.bool_]


def match(
    detected: Boxes,
    scores: NDArray[np.float64],
    truth: Boxes,
    ignore: NDArray[np.bool_],
    min_iou: float,
    wrap_width: int | None = None,
) -> Matches:
    """Match detections with objects, best score first, each with the free object it overlaps most.

    The rule of PASCAL VOC (Everingham et al. 2010, doi:10.1007/s11263-009-0275-4) and COCO (Lin et
    al. 2014, doi:10.1007/978-3-319-10602-1_48): an object is found once, further detections of it
    are false positives. Objects to be ignored are matched last and by any number of detections,
    by the share of the detection that they cover.

    Parameters
    ----------
    detected, truth : (n, 4), (m, 4) arrays
        ``x, y, w, h``.
    scores : (n,) array
    ignore : (m,) array of bool
    min_iou : float
    wrap_width : int, optional
        Columns of a grid that closes a full turn.

    Examples
    --------
    >>> boxes = np.array([[0.0, 0, 10, 10], [1, 0, 10, 10]])
    >>> match(boxes, np.array([0.5, 0.9]), boxes[:1], np.array([False]), 0.5).truth.tolist()
    [-1, 0]
    """
    owner = np.full(len(detected), -1, np.intp)
    ignored = np.zeros(len(detected), np.bool_)
    if len(truth) == 0 or len(detected) == 0:
        return Matches(owner, ignored)
    overlap = iou(detected, truth, wrap_width)
    covered = intersection(detected, truth, wrap_width) / np.prod(detected[:, 2:], axis=1)[:, None]
    free = ~ignore
    for index in np.argsort(-scores, kind="stable"):
        best = int(np.argmax(np.where(free, overlap[index], -1)))
        if free[best] and overlap[index, best] >= min_iou:
            owner[index], free[best] = best, False
        else:
            ignored[index] = bool((covered[index, ignore] >= min_iou).any())
    return Matches(owner, ignored)
