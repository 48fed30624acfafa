"""The region of a candidate: found among those of the scan, or grown in its surroundings."""

from collections.abc import Iterator

import numpy as np

from laserimg.clusters import LINK, linked
from laserimg.evidence import Box, Evidence, Window
from laserimg.regions import Region, bounding_box
from laserimg.scan import BoolArray

# Shares of the range within which returns are linked when a region is grown anew: first looser
# than the default, which keeps an object whole, then tighter, which frees it from what it touches.
LINKS = (LINK * 1.5, LINK * 1.25, LINK / 1.25, LINK / 1.5)

# The surroundings of a candidate are its box, this many times as wide and as high.
SURROUNDINGS = 2.0


def matching_region(evidence: Evidence, box: Box, region_inside: float, region_fills: float) -> Region | None:
    """Return the region that a candidate is a picture of.

    Paper 2 asks whether there exists an area that lies in the candidate. The regions of the scan
    are tried first; if none satisfies the two shares, regions are grown from the returns in the
    candidate's surroundings with other links. If none does either, the one that agrees best with
    the candidate (one that lies in it before one that does not) is returned, so that a reason can be given.

    Parameters
    ----------
    evidence : Evidence
    box : tuple
        ``x, y, w, h`` in pixels of the grid.
    region_inside, region_fills : float
        As for `shares`.

    Returns
    -------
    Region or None
        None if no region has a pixel in the candidate.
    """
    scan = evidence.scan
    window = Window.of(box, scan.shape, scan.wraps)
    returns = window.cut(scan.valid)
    best, best_agreement = None, (False, 0.0)
    for regions in _partitions(evidence, box, window):
        for region in regions:
            inside, fills = shares(region, window, scan.shape, returns)
            if inside > region_inside and fills > region_fills:
                return region
            agreement = (inside > region_inside, inside * fills)
            if agreement > best_agreement:
                best, best_agreement = region, agreement
    return best


def shares(region: Region, window: Window, shape: tuple[int, int], returns: BoolArray) -> tuple[float, float]:
    """Return the shares of the continuity check.

    Parameters
    ----------
    region : Region
    window : Window
        The candidate's pixels.
    shape : (int, int)
        Of the grid.
    returns : array of bool
        Which of the candidate's pixels have a return.

    Returns
    -------
    region_inside, region_fills : float
        The share of the region in the candidate (paper 2, section 4: more than 0.9), and the share
        of the candidate's returns that are the region's, largest first.
    """
    common = int(window.holds(region.pixels, shape).sum())
    return common / len(region.pixels), common / max(int(returns.sum()), 1)


def _partitions(evidence: Evidence, box: Box, window: Window) -> Iterator[list[Region]]:
    """Yield lists of regions, largest overlap with the candidate first: the scan's, then grown ones."""
    labels = evidence.partition.labels
    yield [evidence.regions[number - 1] for number in _numbers(window.cut(labels))]
    scan = evidence.scan
    around = Window.of(_enlarged(box), scan.shape, scan.wraps)
    range_m, directions = around.cut(scan.range), around.cut(scan.directions)
    objects, pixels = around.cut(evidence.partition.objects), around.pixels(scan.shape[1])
    if min(objects.shape) < 2:
        return
    in_box = window.holds(pixels.ravel(), scan.shape).reshape(pixels.shape)
    for link in LINKS:
        grown, ranges = linked(range_m, directions, objects, False, link)
        yield [
            _region(pixels[grown == number], ranges[grown == number], scan.shape[1], scan.wraps)
            for number in _numbers(grown[in_box])
        ]


def _numbers(labels: np.ndarray) -> list[int]:
    """Numbers of the regions among some labels, the most frequent first."""
    number, count = np.unique(labels[labels > 0], return_counts=True)
    return number[np.argsort(-count, kind="stable")].tolist()


def _enlarged(box: Box) -> Box:
    x, y, w, h = box
    grow = (SURROUNDINGS - 1) / 2
    return x - grow * w, y - grow * h, SURROUNDINGS * w, SURROUNDINGS * h


def _region(pixels: np.ndarray, ranges: np.ndarray, width: int, wraps: bool) -> Region:
    order = np.argsort(pixels)
    return Region(pixels[order], ranges[order], bounding_box(pixels, width, wraps))
