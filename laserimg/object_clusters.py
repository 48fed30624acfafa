"""Clusters of points, one an object: gaps in height are bridged, and what only touches is cut apart."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import KDTree

from laserimg.clusters import LINK
from laserimg.errors import ScanError
from laserimg.hanging import widths, with_hanging
from laserimg.polar_cells import starts_of
from laserimg.rbnn import numbered, rbnn
from laserimg.regions import MIN_PIXELS, Labels

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

# What other values give is in docs/clusters_of_points.md.
# Heights are divided by so much where points are linked: the lower beams of spinning scanners are 5 degrees
# apart, a windscreen gives no return, and objects stand beside each other more often than above.
BRIDGE = 5.0
# The same where clusters are cut, and the radii of the cuts as shares of the radius of the links.
CUT_BRIDGE = 2.0
CUTS = (1.0, 0.63, 0.4, 0.25)
# A piece that can be an object: as tall as a wheel of a bicycle is not, no taller than people and cars are.
MIN_TALL_M = 0.7
MAX_TOP_M = 2.5
MIN_PIECE = 30
# One column of returns is none: where a round thing turns away, columns are far apart.
MIN_WIDE_M = 0.1
# Columns of a surface seen straight on are held together by radii of so many pitches.
PITCHES = 1.2
# Doors, mirrors and pillars of cars are this far from the rest of them. Where no piece is as wide as a car,
# there are people: they are cut apart at smaller gaps, too.
SMALL_GAP_M = 0.08
CAR_WIDTH_M = 1.9
# Longer than a car or a group of people: one piece is enough to be cut off, and crumbs farther from it than
# half the radius of the links are left behind.
LONG_M = 10.0
CRUMB_REACH = 0.5

# Farther than any two points of one scan: keeps clusters apart in one tree.
_APART_M = 1e6


@dataclass(frozen=True, eq=False, slots=True)
class _Cloud:
    """Points with half their height and without any (n, 3), heights over the ground, radii of links (n,)."""

    flat: Array
    level: Array
    height: Array
    radius: Array


def object_clusters(
    points: ArrayLike,
    height_m: ArrayLike,
    up: ArrayLike = (0.0, 0.0, 1.0),
    ratio: float = LINK,
    min_points: int = MIN_PIXELS,
    pitch: float = 0.0,
) -> Labels:
    """Return the clusters of points without their ground, of which most are one object each.

    1. RBNN of the points with a fifth of their height.
    2. For smaller and smaller radii, down to a quarter: RBNN of the points with half their height. Where
       two pieces or more of a cluster have 30 points, 0.7 m from top to bottom and 0.1 m across, those that
       reach no higher than 2.5 m over the ground become clusters. What is taller stays together; the
       other pieces go to the nearest. Where a piece is wider than 1.9 m, gaps of less than 8 cm are not
       cut. In clusters longer than 10 m one such piece is enough, and what is far from it stays behind.
    3. What hangs in the air (`hanging.with_hanging`) goes to the nearest.

    Parameters
    ----------
    points : (n, 3) array
        Metres from the scanner, without ground.
    height_m : (n,) array
        Of every point over the ground, as `ground_of_points` gives it.
    up : (3,) array
        Unit vector.
    ratio : float
        Radius in metres at a range of 1 m; from 0.0004 to 0.5.
    min_points : int
    pitch : float
        Angle in radians between columns of returns, where they are so coarse that a radius of a cut could be
        smaller: such cuts are left out, as each column would be an object.

    Returns
    -------
    (n,) array of int32
        Numbered from 1 in the order of their first points; 0 = no cluster.

    Raises
    ------
    ScanError
        If the points are not (n, 3), or the heights not (n,).
    ConfigError
        If `ratio` is out of bounds.

    Notes
    -----
    Differs from paper 1, section 4.1, which takes the clusters of RBNN as they are (`rbnn`): two
    people who touch are one there, and a car that several beams miss is many.

    Examples
    --------
    >>> z, y = np.tile(np.arange(0.3, 1.7, 0.05), 6), np.repeat([-0.12, -0.06, 0, 0.3, 0.36, 0.42], 28)
    >>> hands = (np.abs(z - 1) < 0.03) & (np.abs(y - 0.15) < 0.2)
    >>> y = np.where(hands, y + np.sign(0.15 - y) * 0.12, y)
    >>> people = np.column_stack([np.full(len(y), 10.0), y, z - 1.5])
    >>> int(rbnn(people).max()), int(object_clusters(people, people[:, 2] + 1.5).max())
    (1, 2)
    """
    array, height = np.asarray(points, np.float64), np.asarray(height_m, np.float64)
    if array.ndim != 2 or array.shape[1] != 3 or height.shape != array.shape[:1]:
        raise ScanError(f"points must be (n, 3) and heights (n,), got {array.shape} and {height.shape}")
    vertical = np.asarray(up, np.float64)
    bridged = _flattened(array, vertical, BRIDGE)
    labels = rbnn(bridged, ratio, min_points).astype(np.intp)
    cloud = _Cloud(
        _flattened(array, vertical, CUT_BRIDGE),
        array - np.outer(array @ vertical, vertical),
        height,
        ratio * np.linalg.norm(array, axis=1),
    )
    for share in (share for share in CUTS if ratio * share > PITCHES * pitch):
        labels = _cut(labels, rbnn(cloud.flat, ratio * share, 1), cloud, share)
    labels = with_hanging(labels, bridged, cloud.level, height, cloud.radius)
    found = np.zeros(len(array), np.int32)
    found[labels > 0] = numbered(labels[labels > 0], min_points) if labels.any() else 0
    return found


def _flattened(points: Array, up: Array, divisor: float) -> Array:
    """Return the points with a part of their height over the scanner."""
    return points - np.outer(points @ up, up * (1 - 1 / divisor))


def _cut(labels: Indices, pieces: Labels, cloud: _Cloud, share: float) -> Indices:
    """Give the pieces of clusters that can be objects of their own a label of their own."""
    held = np.flatnonzero(labels)
    if len(held) == 0:
        return labels
    order = held[np.lexsort((pieces[held], labels[held]))]
    start = starts_of(pieces[order], labels[order])
    count = np.diff(start, append=len(order))
    parent = labels[order[start]]
    high = np.maximum.reduceat(cloud.height[order], start)
    width = widths(cloud.level[order], start)
    whole = (count >= MIN_PIECE) & (high - np.minimum.reduceat(cloud.height[order], start) >= MIN_TALL_M)
    whole &= width >= MIN_WIDE_M
    long = _long(order, parent, start, cloud)
    several = np.bincount(parent[whole], minlength=len(long)) > 1
    free = whole & (several | long)[parent] & (high <= MAX_TOP_M)
    wide = np.zeros(len(long), np.bool_)
    wide[parent[free & (width > CAR_WIDTH_M)]] = True
    free &= ~wide[parent] | (share * np.add.reduceat(cloud.radius[order], start) / count >= SMALL_GAP_M)
    label = np.where(free, int(parent.max()) + np.cumsum(free), parent)
    opened = np.isin(parent, parent[free])
    crumbs = np.repeat(opened & ~whole, count)
    targets = np.repeat(opened & whole, count)
    of_points = np.repeat(label, count)
    if crumbs.any():
        distance, at = _nearest(cloud.flat[order], np.repeat(parent, count), targets, crumbs)
        reach = np.where(long[parent], CRUMB_REACH, np.inf)
        piece = np.repeat(np.arange(len(start)), count)[crumbs]
        distance /= np.maximum(cloud.radius[order][crumbs], 1e-9)
        own = of_points[crumbs]
        of_points[crumbs] = _of_whole_pieces(piece, (distance, at), of_points, own, reach)
    found = labels.copy()
    found[order] = of_points
    return found


def _long(order: Indices, parent: Indices, start: Indices, cloud: _Cloud) -> NDArray[np.bool_]:
    """Tell of every label whether its cluster is longer than `LONG_M`."""
    first = starts_of(parent)
    found = np.zeros(int(parent.max()) + 1, np.bool_)
    found[parent[first]] = widths(cloud.level[order], start[first]) > LONG_M
    return found


def _nearest(points: Array, parent: Indices, targets: NDArray, crumbs: NDArray) -> tuple[Array, Indices]:
    """Return the distance and the place of the nearest target of the same cluster, for every crumb."""
    places = np.column_stack([points, parent * _APART_M])
    distance, at = KDTree(places[targets]).query(places[crumbs])
    return distance, np.flatnonzero(targets)[at]


def _of_whole_pieces(
    piece: Indices, nearest: tuple[Array, Indices], of_points: Indices, own: Indices, reach: Array
) -> Indices:
    """Return the label that each point of a piece gets: that of the target nearest to any point of it.

    A piece whose nearest target is farther than its reach keeps its own.
    """
    distance, at = nearest
    order = np.lexsort((distance, piece))
    start = starts_of(piece[order])
    first = order[start]
    best = np.where(distance[first] <= reach[piece[first]], of_points[at[first]], own[first])
    found = np.empty(len(piece), np.intp)
    found[order] = np.repeat(best, np.diff(start, append=len(order)))
    return found
