"""Masks as COCO writes them: run lengths of the columns, not compressed."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from laserimg.errors import LabelError
from laserimg.scan import BoolArray


def run_lengths(mask: BoolArray) -> dict[str, Any]:
    """Return a mask as COCO run lengths: column after column, zeros first.

    Parameters
    ----------
    mask : (H, W) array of bool

    Examples
    --------
    >>> run_lengths(np.array([[False, True], [True, True]]))
    {'size': [2, 2], 'counts': [1, 3]}
    """
    flat = mask.ravel(order="F")
    changes = np.flatnonzero(flat[1:] != flat[:-1]) + 1
    edges = np.r_[0, changes, len(flat)] if not flat[0] else np.r_[0, 0, changes, len(flat)]
    return {"size": list(mask.shape), "counts": np.diff(edges).tolist()}


def mask_of(segmentation: Mapping[str, Any]) -> BoolArray:
    """Return the mask of COCO run lengths.

    Raises
    ------
    LabelError
        If they are not lists of whole numbers, or do not fill the image.

    Examples
    --------
    >>> mask_of({"size": [2, 2], "counts": [1, 3]})
    array([[False,  True],
           [ True,  True]])
    """
    try:
        height, width = (int(side) for side in segmentation["size"])
        counts = np.array(segmentation["counts"], np.int64)
    except (KeyError, TypeError, ValueError):
        raise LabelError("a segmentation must be run lengths: a size and a list of counts") from None
    if counts.ndim != 1 or (counts < 0).any() or counts.sum() != height * width:
        raise LabelError(f"run lengths must fill {height} rows and {width} columns")
    inside = np.arange(len(counts)) % 2 == 1
    return np.repeat(inside, counts).reshape(width, height).T
