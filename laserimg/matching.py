"""The region of a candidate: found among those of the scan, or grown in its surroundings."""

from collections.abc import Callable, Iterator
from functools import partial
from typing import NamedTuple

import numpy as np

from laserimg.clusters import LINK, linked
from laserimg.evidence import Box, Evidence, Window
from laserimg.regions import Region, bounding_box
from laserimg.scan import BoolArray

# A region grown anew is linked more tightly than those of the scan, which frees it from what it
# touches. Looser links were tried too and found nothing more: parts at one depth are taken together.
TIGHT_LINK = LINK / 1.5

# The surroundings of a candidate are its box, this many times as wide and as high.
SURROUNDINGS = 2.0

# Of the returns in a box so many must be of objects for the floor and large planes to be left out.
LEAST_OBJECTS = 0.1
# The range of a box is this quantile of its returns': a chair's middle looks through to the wall.
NEAR = 0.3


def matching_region(evidence: Evidence, box: Box, region_inside: float, region_fills: float) -> Region | None:
    """Return the region that a candidate is a picture of.

    Paper 2 asks whether there exists an area that lies in the candidate. The regions of the scan
    are tried first; if none satisfies the two shares, regions are grown from the returns in the
    candidate's surroundings with tighter links. Then, in the same order, the parts that lie in the
    candidate at one depth are taken together: the near and far wall of an open wastebasket do
    not touch, nor do the legs and the seat of a chair. If all fails, the region that agrees best
    with the candidate is returned (one that lies in it before one that does not), so that a
    reason can be given.

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
    return _matched(evidence, box, region_inside, region_fills)[0]


def _matched(
    evidence: Evidence, box: Box, region_inside: float, region_fills: float
) -> tuple[Region | None, bool]:
    """The region of `matching_region`, and whether it satisfies both shares."""
    scan = evidence.scan
    window = Window.of(box, scan.shape, scan.wraps)
    returns = scan.counts(window.cut(scan.range))
    count = max(int(returns.sum()), 1)
    partitions, best = [], _Best(region_inside, region_fills)
    for parts in _partitions(evidence, box, window):
        partitions.append(parts)
        for part in parts:
            if best.take(part.region, part.inside, part.common / count):
                return part.region(), True
    for parts in partitions:
        whole = _at_one_depth(evidence, [p.region() for p in parts if p.inside > region_inside], window)
        if whole is not None and best.take(_made(whole), *shares(whole, window, scan.shape, returns)):
            return whole, True
    return best.region(), False


def region_of_box(evidence: Evidence, box: Box, region_inside: float, region_fills: float) -> Region | None:
    """Return the region of a candidate of a class that asks for no continuity.

    A region that satisfies the shares, as `matching_region` finds it; if there is none, as in front
    of a door or of stairs that are one with the wall or floor, the returns in the box at its own depth: no
    farther behind its near ones than it is large. Floor and large planes are left out unless they are
    most of it.

    Returns
    -------
    Region or None
        None if nothing returned in the box.
    """
    region, satisfies = _matched(evidence, box, region_inside, region_fills)
    if satisfies:
        return region
    scan = evidence.scan
    window = Window.of(box, scan.shape, scan.wraps)
    return _near_returns(evidence, window, scan.counts(window.cut(scan.range)))


def _near_returns(evidence: Evidence, window: Window, returns: BoolArray) -> Region | None:
    scan = evidence.scan
    objects = window.cut(evidence.partition.objects) & returns
    taken = objects if objects.sum() >= LEAST_OBJECTS * returns.sum() else returns
    if not taken.any():
        return None
    pixels = window.pixels(scan.shape[1])[taken]
    ranges = window.cut(scan.range)[taken]
    near = float(np.quantile(ranges, NEAR))
    middle = pixels[len(pixels) // 2]
    across, up = (float(pitch.ravel()[middle]) for pitch in evidence.pitch)
    reach = near * max(across * len(window.columns), up * (window.rows.stop - window.rows.start))
    kept = ranges <= near + reach
    return _region(pixels[kept], ranges[kept], scan.shape[1], scan.wraps)


class _Part(NamedTuple):
    """A region that has pixels in the candidate: how many, of how many, and how to make it."""

    common: int
    pixels: int
    region: Callable[[], Region]

    @property
    def inside(self) -> float:
        """The share of the region in the candidate."""
        return self.common / self.pixels


class _Best:
    """The region that agrees best so far."""

    def __init__(self, region_inside: float, region_fills: float) -> None:
        self._limits = region_inside, region_fills
        self._agreement = (False, 0.0)
        self.region: Callable[[], Region | None] = lambda: None

    def take(self, region: Callable[[], Region], inside: float, fills: float) -> bool:
        """Remember the region if it is the best so far; tell whether it satisfies both limits."""
        agreement = (inside > self._limits[0], inside * fills)
        if agreement > self._agreement:
            self.region, self._agreement = region, agreement
        return inside > self._limits[0] and fills > self._limits[1]


def _at_one_depth(evidence: Evidence, inside: list[Region], window: Window) -> Region | None:
    """Take together regions that lie in the candidate, no deeper apart than the candidate is large."""
    shape = evidence.scan.shape
    if len(inside) < 2:
        return None
    main = max(inside, key=lambda r: len(r.pixels))
    middle = main.pixels[len(main.pixels) // 2]
    across, up = (float(pitch.ravel()[middle]) for pitch in evidence.pitch)
    depth = float(np.median(main.ranges))
    reach = depth * max(across * len(window.columns), up * (window.rows.stop - window.rows.start))
    parts = [r for r in inside if abs(float(np.median(r.ranges)) - depth) <= reach]
    pixels, ranges = (
        np.concatenate(arrays) for arrays in zip(*((r.pixels, r.ranges) for r in parts), strict=True)
    )
    return _region(pixels, ranges, shape[1], evidence.scan.wraps)


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
    first, last = np.searchsorted(region.pixels, [window.rows.start * shape[1], window.rows.stop * shape[1]])
    common = int(window.holds(region.pixels[first:last], shape).sum())
    return common / len(region.pixels), common / max(int(returns.sum()), 1)


def _partitions(evidence: Evidence, box: Box, window: Window) -> Iterator[list[_Part]]:
    """Yield the scan's regions in a candidate, then grown ones, those with most pixels in it first."""
    labels = evidence.partition.labels[window.rows][:, np.unique(window.columns)]
    of_scan = [(evidence.regions[number - 1], common) for number, common in _numbers(labels)]
    yield [_Part(common, len(region.pixels), _made(region)) for region, common in of_scan]
    scan = evidence.scan
    around = Window.of(_enlarged(box), scan.shape, scan.wraps)
    range_m, directions = around.cut(scan.range), around.cut(scan.directions)
    objects, pixels = around.cut(evidence.partition.objects), around.pixels(scan.shape[1])
    if min(objects.shape) < 2:
        return
    in_box = window.holds(pixels.ravel(), scan.shape).reshape(pixels.shape)
    grown, ranges = linked(range_m, directions, objects, False, TIGHT_LINK)
    whole = np.bincount(grown.ravel())

    def region(number: int) -> Region:
        of = grown == number
        return _region(pixels[of], ranges[of], scan.shape[1], scan.wraps)

    yield [
        _Part(common, int(whole[number]), partial(region, number))
        for number, common in _numbers(grown[in_box])
    ]


def _made(region: Region) -> Callable[[], Region]:
    return lambda: region


def _numbers(labels: np.ndarray) -> list[tuple[int, int]]:
    """Numbers of the regions among some labels with their pixels there, the most frequent first."""
    count = np.bincount(labels.ravel())
    count[:1] = 0
    number = np.flatnonzero(count)
    number = number[np.argsort(-count[number], kind="stable")]
    return list(zip(number.tolist(), count[number].tolist(), strict=True))


def _enlarged(box: Box) -> Box:
    x, y, w, h = box
    grow = (SURROUNDINGS - 1) / 2
    return x - grow * w, y - grow * h, SURROUNDINGS * w, SURROUNDINGS * h


def _region(pixels: np.ndarray, ranges: np.ndarray, width: int, wraps: bool) -> Region:
    order = np.argsort(pixels)
    return Region(pixels[order], ranges[order], bounding_box(pixels, width, wraps))
