"""Pieces that hang in the air belong to something: roofs and bonnets of cars, which few beams reach."""

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from laserimg.polar_cells import starts_of

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

# A piece hangs if it begins this high over the ground, and is lower and wider than what is seen of a person
# whose legs something hides.
ABOVE_M = 0.5
MAX_TALL_M = 0.7
MIN_WIDTH_M = 1.0
# It belongs to the nearest cluster within so many radii with which it is no longer and taller than a car.
REACH = 2.0
CAR_LENGTH_M = 6.0
CAR_TOP_M = 2.5


def with_hanging(labels: Indices, points: Array, level: Array, height: Array, radius: Array) -> Indices:
    """Return labels in which clusters that hang in the air are part of the nearest one.

    Parameters
    ----------
    labels : (n,) array of int
        0 for none.
    points : (n, 3) array
        In which distances count.
    level : (n, 3) array
        The points without their height.
    height : (n,) array
        Over the ground, metres.
    radius : (n,) array
        Of the links of each point, metres.
    """
    held = np.flatnonzero(labels)
    if len(held) == 0:
        return labels
    order = held[np.argsort(labels[held], kind="stable")]
    start = starts_of(labels[order])
    low, high = np.minimum.reduceat(height[order], start), np.maximum.reduceat(height[order], start)
    lone = (low > ABOVE_M) & (high <= CAR_TOP_M) & (high - low < MAX_TALL_M)
    lone &= widths(level[order], start) > MIN_WIDTH_M
    if not lone.any():
        return labels
    members = np.split(order, start[1:])
    low_enough = np.repeat(high <= CAR_TOP_M, np.diff(start, append=len(order)))
    others = order[low_enough]
    place = np.repeat(np.arange(len(start)), np.diff(start, append=len(order)))[low_enough]
    pairs = [
        (number, _nearest(number, members, others, place, points, level, radius))
        for number in np.flatnonzero(lone).tolist()
    ]
    one, other = np.array([pair for pair in pairs if pair[1] >= 0], np.intp).reshape(-1, 2).T
    graph = coo_array((np.ones(len(one), np.bool_), (one, other)), (len(start), len(start)))
    joined = connected_components(graph, directed=False)[1]
    found = labels.copy()
    found[order] = np.repeat(joined + 1, np.diff(start, append=len(order)))
    return found


def widths(level: Array, start: Indices) -> Array:
    """Return twice the largest level distance from its mean, of every run of points."""
    count = np.diff(start, append=len(level))
    mean = np.add.reduceat(level, start) / count[:, None]
    away = level - np.repeat(mean, count, axis=0)
    return 2 * np.sqrt(np.maximum.reduceat(np.einsum("ij,ij->i", away, away), start))


def _nearest(
    number: int,
    members: list[Indices],
    others: Indices,
    place: Indices,
    points: Array,
    level: Array,
    radius: Array,
) -> int:
    """Return the number of the nearest cluster that a hanging one can be a part of, -1 for none."""
    own = members[number]
    reach = REACH * radius[own]
    low, high = points[own].min(axis=0) - reach.max(), points[own].max(axis=0) + reach.max()
    around = ((points[others] >= low) & (points[others] <= high)).all(axis=1) & (place != number)
    others, place = others[around], place[around]
    distance, nearest = KDTree(points[own]).query(points[others])
    near = np.flatnonzero(distance <= reach[nearest])
    by_distance = place[near][np.argsort(distance[near], kind="stable")]
    for candidate in dict.fromkeys(by_distance.tolist()):
        both = np.concatenate([own, members[candidate]])
        if widths(level[both], np.zeros(1, np.intp))[0] <= CAR_LENGTH_M:
            return int(candidate)
    return -1
