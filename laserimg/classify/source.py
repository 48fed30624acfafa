"""One object to be described: what folders, files and data sets come down to."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from laserimg.classify.recipe import Recipe, describe_images
from laserimg.classify.views import crop_of_scan
from laserimg.scan import BoolArray, Float32Array, Scan


class Source(NamedTuple):
    """One object.

    Parameters
    ----------
    name : str
        Where it is, in words.
    label : str
        Its class; "" if not known.
    describe : function of Recipe
        Returns the feature vector.
    fold : int
        The part of its data set that it belongs to when parts are left out in turn; -1 for none.
    """

    name: str
    label: str
    describe: Callable[[Recipe], Float32Array]
    fold: int = -1


def source_of_pixels(name: str, label: str, scan: Scan, mask: BoolArray) -> Source:
    """Return the object that some pixels (H, W) of a scan show; the scan itself is not kept."""
    points = scan.points()[mask].astype(np.float64) @ scan.world_from_scan[:3, :3].T
    images = crop_of_scan(scan, mask)
    return Source(name, label, lambda recipe: describe_images(images, points, recipe))
