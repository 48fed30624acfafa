"""Objects with their foot in the shadow of the scanner's carrier, made from scans without it."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from laserimg.boxes import Boxes
from laserimg.detectors.description import IMAGES
from laserimg.evidence import Evidence, Window
from laserimg.scan import BoolArray

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
    dark = np.zeros(evidence.scan.shape, np.bool_)
    dark[:, columns] = np.arange(evidence.scan.shape[0])[:, None] >= border
    return without_returns(evidence, dark), np.array([[x, y, w, cut - y]])


def without_returns(evidence: Evidence, lost: BoolArray) -> Evidence:
    """Return a scan in which some pixels (H, W) have no return, with the images of the second stage alone."""
    images = {
        kind: evidence.images[kind] * (~lost if evidence.images[kind].ndim == 2 else ~lost[..., None])
        for kind in IMAGES
    }
    scan = replace(evidence.scan, range=evidence.scan.range * ~lost)
    return replace(evidence, scan=scan, images=images)
