"""What the second stage looks at: normals, relative depth and size of windows, as vectors of numbers."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from laserimg.boxes import Boxes
from laserimg.descriptors.hog import hog
from laserimg.descriptors.layout import Layout
from laserimg.detectors.box_samples import foot_m, grown, near_range, sizes_m
from laserimg.detectors.crops import resampled
from laserimg.detectors.lookup import cell_means, honv_of_colours
from laserimg.detectors.pyramid import Pyramid
from laserimg.evidence import Evidence
from laserimg.scan import Float32Array

IMAGES = frozenset({"normals_view", "depth_relative"})
# A window reaches over its box on every side by this share of it: the floor before a foot, the wall behind.
SURROUNDINGS = 0.2
SIDE = 32
LAYOUT = Layout(cells=8, n_alpha=9, n_theta=3, n_phi=8)
CELLS = 8
# So many windows stay in the processor's cache.
_AT_ONCE = 64
# Places of the soft bins: logarithms of width, height and range in metres; height of the foot over the floor.
_BINS = (
    np.linspace(np.log(0.08), np.log(8.0), 12),
    np.linspace(np.log(0.08), np.log(8.0), 12),
    np.linspace(np.log(0.5), np.log(40.0), 8),
    np.linspace(-1.0, 3.0, 17),
)
VECTOR_LENGTH = LAYOUT.honv_length + LAYOUT.hog_length + 5 * CELLS**2 + sum(map(len, _BINS))
# Of vectors of about length 1, so that no part outweighs the others in a linear SVM: tried on wastebaskets.
_WEIGHTS = {"honv": 0.1, "hog": 0.1, "depth": 0.5, "known": 0.3, "normals": 0.4, "size": 0.7}


@dataclass(frozen=True, eq=False, slots=True)
class Describer:
    """Makes the vectors of boxes in one scan.

    Parameters
    ----------
    evidence : Evidence
        With the images of `IMAGES`.
    pyramid : Pyramid
        Of the normals in the view frame and the relative depth, as four planes.
    ranges : (H * W,) array of float32
        Metres; infinite where nothing returned.
    """

    evidence: Evidence
    pyramid: Pyramid
    ranges: Float32Array

    @classmethod
    def of(cls, evidence: Evidence) -> Self:
        """Make the describer of a scan: what all boxes share is made once."""
        planes = np.dstack([evidence.images["normals_view"], evidence.images["depth_relative"]])
        ranges = np.where(evidence.scan.valid, evidence.scan.range, np.float32(np.inf)).ravel()
        return cls(evidence, Pyramid.of(planes, evidence.scan.wraps), ranges)

    def __call__(self, boxes: Boxes) -> Float32Array:
        """Return a vector for each box.

        1. HONV of the normals in the view frame (paper 1, section 3.4; here 3 x 8 directions).
        2. HOG of the relative depth (section 3.3).
        3. Means of depth, normals and returns in 8 x 8 cells.
        4. Width, height, range and height over the floor in metres, as soft histograms: a linear SVM can
           learn any limit on them.

        Parameters
        ----------
        boxes : (n, 4) array
            ``x, y, w, h`` in pixels of the grid.

        Returns
        -------
        (n, d) array of float32
            d is `VECTOR_LENGTH`.
        """
        pixels = resampled(self.pyramid, grown(boxes, SURROUNDINGS), SIDE)
        parts = [_seen(pixels[first : first + _AT_ONCE]) for first in range(0, max(len(boxes), 1), _AT_ONCE)]
        sizes = _sizes(self.evidence, self.ranges, boxes) * np.float32(_WEIGHTS["size"])
        return np.concatenate([np.concatenate(parts), sizes], axis=1)


def plain_part(vectors: NDArray[np.floating]) -> NDArray[np.floating]:
    """Return the part (n, e) of vectors (n, d) that needs no histogram of directions: parts 3 and 4."""
    return vectors[:, LAYOUT.honv_length + LAYOUT.hog_length :]


def _seen(pixels: NDArray[np.uint8]) -> Float32Array:
    """(n, d) all but the sizes, of windows of normals and depth."""
    colours, depth = pixels[..., :3], pixels[..., 3]
    known = (depth > 0).astype(np.uint8) * np.uint8(255)
    parts = {
        "honv": honv_of_colours(colours, LAYOUT),
        "hog": hog(depth.astype(np.float32) / np.float32(255), None, LAYOUT),
        "depth": cell_means(depth, CELLS) - 0.5,
        "known": cell_means(known, CELLS) - 0.5,
        "normals": cell_means(colours, CELLS) - 0.5,
    }
    return np.concatenate([part * np.float32(_WEIGHTS[name]) for name, part in parts.items()], axis=1)


def _sizes(evidence: Evidence, ranges: Float32Array, boxes: Boxes) -> Float32Array:
    """Soft histograms of width, height, range and foot; those of a foot are 0 without a floor."""
    range_m = near_range(evidence, ranges, boxes)
    width, height = (np.log(np.maximum(size, 1e-3)) for size in sizes_m(evidence, boxes, range_m))
    found = [_soft(width, _BINS[0]), _soft(height, _BINS[1]), _soft(np.log(range_m), _BINS[2])]
    floor = evidence.floor
    if floor is None:
        return np.concatenate([*found, np.zeros((len(boxes), len(_BINS[3])), np.float32)], axis=1)
    return np.concatenate([*found, _soft(foot_m(floor, evidence, boxes, range_m), _BINS[3])], axis=1)


def _soft(values: NDArray, places: NDArray[np.float64]) -> Float32Array:
    """Shares of the two nearest places, (n, places)."""
    inside = np.clip(values, places[0], places[-1])
    share = 1 - np.abs(inside[:, None] - places) / (places[1] - places[0])
    return np.maximum(share, 0).astype(np.float32)
