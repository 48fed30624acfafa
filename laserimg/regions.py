"""Regions: partitions of an image's pixels, and the reference partition of paper 2."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from laserimg.lattice import connected, step_links
from laserimg.scan import BoolArray, Float32Array, Scan

Labels = NDArray[np.int32]

CONTINUITY_STEP_M = 0.05
MIN_PIXELS = 16


@dataclass(frozen=True, eq=False, slots=True)
class Partition:
    """Which region every pixel belongs to.

    Parameters
    ----------
    labels : (H, W) array of int32
        Numbered from 1; 0 = no region.
    range : (H, W) array of float32
        Metres to measure with; a mixed pixel has the range of the edge it lies on.
    objects : (H, W) array of bool
        Returns that could be of a region: not floor, not a large plane.
    """

    labels: Labels
    range: Float32Array
    objects: BoolArray


@dataclass(frozen=True, eq=False, slots=True)
class Region:
    """A connected set of pixels that are one surface or object.

    Parameters
    ----------
    pixels : (n,) array of int
        Positions in the flattened grid, ascending.
    ranges : (n,) array of float32
        Metres to measure with.
    box : (float, float, float, float)
        Bounding rectangle ``x, y, w, h``; at the seam ``0 <= x < W`` and ``x + w > W``.
    """

    pixels: NDArray[np.intp]
    ranges: Float32Array
    box: tuple[float, float, float, float]


def regions_of(partition: Partition, wraps: bool) -> list[Region]:
    """Return the regions of a partition, in the order of their numbers.

    Examples
    --------
    >>> labels = np.array([[1, 0, 0, 1], [1, 0, 2, 1]], np.int32)
    >>> partition = Partition(labels, np.ones((2, 4), np.float32), labels > 0)
    >>> [region.box for region in regions_of(partition, wraps=True)]
    [(3.0, 0.0, 2.0, 2.0), (2.0, 1.0, 1.0, 1.0)]
    """
    pixels = np.flatnonzero(partition.labels)
    number = partition.labels.ravel()[pixels]
    if len(number) and int(number.max()) < 1 << 16:
        number = number.astype(np.uint16)  # sorted by radix: 5 times faster
    order = np.argsort(number, kind="stable")
    starts = np.flatnonzero(np.diff(number[order], prepend=number.dtype.type(0)))
    width, ranges = partition.labels.shape[1], partition.range.ravel()
    parts = np.split(pixels[order], starts[1:]) if len(starts) else []
    return [Region(part, ranges[part], bounding_box(part, width, wraps)) for part in parts]


def bounding_box(pixels: NDArray[np.intp], width: int, wraps: bool) -> tuple[float, float, float, float]:
    """Return the smallest ``x, y, w, h`` around some pixels of a grid of `width` columns."""
    rows, columns = np.divmod(pixels, width)
    left, across = _extent(np.unique(columns), width, wraps)
    top = int(rows.min())
    return float(left), float(top), float(across), float(rows.max() - top + 1)


def _extent(columns: NDArray[np.intp], width: int, wraps: bool) -> tuple[int, int]:
    """First column and number of columns of the shortest interval, modulo width if the grid wraps."""
    first, last = int(columns[0]), int(columns[-1])
    inner = np.diff(columns)
    if wraps and len(inner) and inner.max() > first + width - last:
        gap = int(np.argmax(inner))
        first, last = int(columns[gap + 1]), int(columns[gap]) + width
    return first, last - first + 1


def reference_regions(scan: Scan, continuity_step_m: float = CONTINUITY_STEP_M) -> Partition:
    """Return the regions of paper 2, section 4, for the whole image at once.

    Two 4-neighbours with returns are linked if their ranges differ by no more than
    `continuity_step_m`; connected sets of more than 15 pixels are regions, numbered from 1 in
    raster order of their first pixel. The result equals repeated `cv2.floodFill` with floating
    range; like there, nothing links across the seam of a full turn.

    Differs from the paper: pixels without a return belong to no region (the paper does not say);
    the flood does not start at pixel (0, 0) alone but everywhere, as the paper's loop does in effect.

    Parameters
    ----------
    scan : Scan
    continuity_step_m : float
        Compared in float32, as `cv2.floodFill` does.


    Examples
    --------
    >>> range_m = np.repeat([[2.0] * 5 + [3.0] * 5], 4, axis=0)
    >>> scan = Scan.from_range_image(range_m, np.radians(np.arange(10.0, 0, -1)), np.radians([2.0, 1, 0, -1]))
    >>> reference_regions(scan).labels[0].tolist()
    [1, 1, 1, 1, 1, 2, 2, 2, 2, 2]
    """
    valid = scan.valid
    limits = {(0, 1): continuity_step_m, (1, 0): continuity_step_m}
    links = step_links(scan.range, valid, limits, wraps=False)
    return Partition(connected(valid, links, MIN_PIXELS), scan.range, valid)
