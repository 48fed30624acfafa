"""Grouping: overlapping hits are one candidate."""

import numpy as np
from numpy.typing import NDArray

from laserimg.boxes import Boxes, iou

# Hits that overlap the best one by more than this IoU are of the same object.
SAME_IOU = 0.3
# Centres of such boxes are at most this many sides of one of them apart.
_REACH = 1.001 * (1 - SAME_IOU) / (2 * SAME_IOU)


def grouped(
    boxes: Boxes, margins: NDArray[np.float64], min_neighbours: int, wrap_width: int | None = None
) -> tuple[Boxes, NDArray[np.float64]]:
    """Return one box for every group of overlapping hits: their mean, and how strongly they speak for it.

    The best hit takes all that overlap it, then the best of the rest, and so on. The score of a
    group is the sum of 1 + margin over its hits. Measured with four face cascades on pasted faces, average
    precision was 0.74 to 0.94 with this score, 0.51 to 0.93 with the number of hits and 0.49 to
    0.83 with the best margin; `cv2.groupRectangles`, which joins whatever is connected by a chain of
    overlaps, did worse where there are many false alarms.

    Parameters
    ----------
    boxes : (n, 4) array
    margins : (n,) array
        As `Hits.margins`.
    min_neighbours : int
        Smaller groups are left out.
    wrap_width : int, optional
        Columns of a grid that closes a full turn.

    Returns
    -------
    boxes : (m, 4) array
    scores : (m,) array

    Examples
    --------
    >>> boxes = np.array([[0, 0, 10, 10], [2, 0, 10, 10], [50, 50, 9, 9]], float)
    >>> grouped(boxes, np.array([1.0, 3.0, 9.0]), 2)
    (array([[ 1.,  0., 10., 10.]]), array([6.]))
    """
    found = [
        (_mean_box(boxes[members], wrap_width), float((1 + margins[members]).sum()))
        for members in _groups(boxes, margins, wrap_width)
        if len(members) >= min_neighbours
    ]
    means = np.array([box for box, _ in found]).reshape(-1, 4)
    return means, np.array([score for _, score in found])


def _groups(boxes: Boxes, margins: NDArray[np.float64], wrap_width: int | None) -> list[NDArray[np.intp]]:
    """Numbers of the hits in each group. Time and memory grow with their number, not with its square."""
    from scipy.spatial import KDTree  # 60 ms that runs without window detectors do not need

    tree = KDTree(_centres(boxes, wrap_width), boxsize=(wrap_width or 0, 0))
    free = np.ones(len(boxes), np.bool_)
    groups = []
    for best in np.argsort(-margins, kind="stable"):
        if free[best]:
            near = np.array(tree.query_ball_point(tree.data[best], _REACH * boxes[best, 2:].max(), p=np.inf))
            near = near[free[near]]
            members = near[iou(boxes[[best]], boxes[near], wrap_width)[0] > SAME_IOU]
            free[members] = False
            groups.append(members)
    return groups


def _centres(boxes: Boxes, wrap_width: int | None) -> NDArray[np.float64]:
    centres = boxes[:, :2] + boxes[:, 2:] / 2
    if wrap_width is not None:
        centres[:, 0] %= wrap_width
        centres[centres[:, 0] == wrap_width, 0] = 0  # the remainder of a tiny negative number
    return centres


def _mean_box(boxes: Boxes, wrap_width: int | None) -> NDArray[np.float64]:
    if wrap_width is not None:  # all beside the first, not a turn away from it
        boxes = boxes.copy()
        boxes[:, 0] -= np.rint((boxes[:, 0] - boxes[0, 0]) / wrap_width) * wrap_width
    return boxes.mean(axis=0)
