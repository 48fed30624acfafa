"""Objects with their foot in the shadow of the scanner's carrier, made from scans without it."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from laserimg.boxes import Boxes
from laserimg.detectors.description import IMAGES
from laserimg.evidence import Evidence, Window

# Of an object this much at least, and at most, is left above the shadow; its border goes up and down by this
# share of the object's height.
LEAST_LEFT, MOST_LEFT, WAVE = 0.5, 0.95, 0.12


def in_shadow(evidence: Evidence, box: NDArray, rng: np.random.Generator) -> tuple[Evidence, Boxes]:
    """Return a scan in which the pixels below a wavy line through an object have no return, and what is left.

    Carriers shade the lowest rows of a scan; objects near the scanner lose their foot to them.

    Parameters
    ----------
    evidence : Evidence
    box : (4,) array
        ``x, y, w, h`` of the object.
    rng : numpy.random.Generator

    Returns
    -------
    evidence : Evidence
        With the images of the second stage alone.
    boxes : (1, 4) array
        Of the part of the object above the shadow.
    """
    x, y, w, h = box
    cut = y + h * rng.uniform(LEAST_LEFT, MOST_LEFT)
    around = Window.of((x - w, y, 3 * w, evidence.scan.shape[0]), evidence.scan.shape, evidence.scan.wraps)
    columns = np.unique(around.columns)
    phase, period = rng.uniform(0, 2 * np.pi), rng.uniform(0.5, 2) * max(w, 2)
    border = (
        cut + WAVE * h * np.sin(phase + 2 * np.pi * columns / period) + rng.uniform(-0.5, 0.5, len(columns))
    )
    dark = np.arange(evidence.scan.shape[0])[:, None] >= border
    images = {}
    for kind in IMAGES:
        images[kind] = evidence.images[kind].copy()
        images[kind][:, columns] *= ~dark if images[kind].ndim == 2 else ~dark[..., None]
    range_m = evidence.scan.range.copy()
    range_m[:, columns] *= ~dark
    scan = replace(evidence.scan, range=range_m)
    return replace(evidence, scan=scan, images=images), np.array([[x, y, w, cut - y]])
