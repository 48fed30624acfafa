"""Components of points linked by a radius in proportion to range: exact, and without a test of most pairs."""

from dataclasses import dataclass
from itertools import pairwise, product

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from laserimg.polar_cells import (
    Array,
    Indices,
    Keys,
    Pairs,
    PolarCells,
    a_step_apart,
    hash_table,
    neighbouring_groups,
    polar_cells,
    products,
    starts_of,
    strides_of,
)

BoolArray = NDArray[np.bool_]

# Rounding must neither join what the definition leaves apart nor hide what it joins.
_SURE, _SAFE = 1 - 1e-6, 1 + 1e-6
# Sine of the elevation, 45 degrees, beyond which an azimuth says little.
_STEEP = float(np.sqrt(0.5))
# Pairs of points compared at a time; pairs of points of two cells from which on a tree is quicker.
_PAIRS = 1 << 21
_LARGE = 1 << 16
# Half of the 26 neighbours of a cell: those with a common face, and the others.
_FACES = [(0, 0, 1), (0, 1, 0), (1, 0, 0)]
_CORNERS = [step for step in product((-1, 0, 1), repeat=3) if step > (0, 0, 0) and step not in _FACES]


@dataclass(frozen=True, eq=False, slots=True)
class _Boxes:
    """Bounding boxes (m, 3) of sets of points, and their largest ranges (m,)."""

    low: Array
    high: Array
    farthest: Array


def linked_components(points: Array, length: Array, ratio: float) -> Indices:
    """Return the component of every point; two are linked within `ratio` times the range of the farther one.

    Parameters
    ----------
    points : (n, 3) array
        As seen from the scanner; n > 0.
    length : (n,) array
        Their ranges, above 0.
    ratio : float
        From 0.0001 to 0.5.

    Returns
    -------
    (n,) array
        Numbers from 0.

    Notes
    -----
    1. Cells of elevation, azimuth and log range, so small that any two points of one are linked.
    2. Neighbouring cells whose first points are linked are joined.
    3. Blocks of cells as wide as the radius: linked points lie in one block or in neighbouring
       ones. The cells of a block that are joined already are one group. Groups of different components are
       compared by their bounding boxes, what is left cell by cell, and what is left of this point by point.

    Two linked points that are both steeper than 45 degrees, or on two sides of azimuth 180 degrees, may
    be missed. All such points are looked at again alone, in a frame in which they lie ahead.
    """
    component = _in_one_frame(points, length, ratio)
    x, y, z = points.T
    seam = (x < 0) & (np.abs(y) <= ratio / _STEEP * _SAFE * length)
    turned = np.flatnonzero(seam | (np.abs(z) * _SAFE >= _STEEP * length))
    if len(turned) == 0:
        return component
    ahead = np.stack([-x[turned], z[turned], y[turned]], axis=-1)
    again = _in_one_frame(ahead, length[turned], ratio) + component.max() + 1
    return _joined(component[turned], again, int(again.max()) + 1)[component]


def _in_one_frame(points: Array, length: Array, ratio: float) -> Indices:
    """Return the components, but for some links of steep points and across the seam."""
    order, cells = polar_cells(points, length, ratio * _SURE / np.sqrt(3))
    component = _by_first_points(cells, ratio)
    pairs = _near_cells(cells, component, ratio)
    component = _by_all_points(cells, component, pairs, ratio)
    of_points = np.empty(len(points), np.intp)
    of_points[order] = np.repeat(component, cells.count)
    return of_points


def _by_first_points(cells: PolarCells, ratio: float) -> Indices:
    """Join neighbouring cells whose first points are linked; return the component of each cell."""
    points, length = cells.points[cells.start], cells.length[cells.start]
    component = np.arange(len(points))
    key, strides = strides_of(cells.place) @ cells.place, strides_of(cells.place)
    table = hash_table(key)
    # Most are joined through their faces; the others then need no distance.
    for steps in (_FACES, _CORNERS):
        found = []
        for step in steps:
            one, other = a_step_apart(key, table, int(strides @ step))
            one, other = _of_two_components(component, one, other)
            linked = _near(points, length, one, other, ratio)
            found.append((one[linked], other[linked]))
        component = _joined_by(component, *map(np.concatenate, zip(*found, strict=True)))
    return component


def _near_cells(cells: PolarCells, component: Indices, ratio: float) -> Pairs:
    """Return the pairs of cells of different components that may hold linked points."""
    place = cells.place // _block(ratio)[:, None]
    strides = strides_of(place)
    block = strides @ place
    order = np.lexsort((component, block))
    start = starts_of(block[order], component[order])
    one, other = neighbouring_groups(block[order[start]], strides)
    one, other = _of_two_components(component[order[start]], one, other)
    count = np.diff(start, append=len(order))
    # Most groups have nothing but their own component around them: their boxes are not asked for.
    asked = np.zeros(len(start), np.bool_)
    asked[one] = asked[other] = True
    boxes = _boxes_of_cells(cells, order[np.repeat(asked, count)])
    groups = _boxes_of_groups(boxes, order, start)
    one, other = _within_reach(groups, one, other, ratio)
    pair, first, second = products(count[one], count[other])
    one, other = order[start[one[pair]] + first], order[start[other[pair]] + second]
    return _within_reach(boxes, one, other, ratio)


def _block(ratio: float) -> Keys:
    """Return the rows, columns and shells of cells in a block: no less than linked points are apart.

    The nearer of two linked points has at least 1 - `ratio` of the range of the other. The angle between
    them is at most arcsin(`ratio`), hence the difference in azimuth arcsin(`ratio` / cos(elevation)).
    """
    widest = np.array([np.arcsin(ratio), np.arcsin(ratio / _STEEP), -np.log(1 - ratio)])
    return np.ceil(widest * _SAFE / (ratio * _SURE / np.sqrt(3))).astype(np.int64)


def _boxes_of_cells(cells: PolarCells, asked: Indices) -> _Boxes:
    """Return the boxes of all cells; of those that are not asked for they are points at the scanner."""
    boxes = _Boxes(*(np.zeros((len(cells.start), *shape)) for shape in ((3,), (3,), ())))
    if len(asked):
        mask = np.zeros(len(cells.start), np.bool_)
        mask[asked] = True
        places = np.flatnonzero(np.repeat(mask, cells.count))
        count = cells.count[mask]
        start = np.cumsum(count) - count
        points, length = cells.points.take(places, axis=0), cells.length[places]
        for box, extreme in ((boxes.low, np.minimum), (boxes.high, np.maximum)):
            for axis in range(3):
                box[mask, axis] = extreme.reduceat(np.ascontiguousarray(points[:, axis]), start)
        boxes.farthest[mask] = np.maximum.reduceat(length, start)
    return boxes


def _boxes_of_groups(boxes: _Boxes, order: Indices, start: Indices) -> _Boxes:
    return _Boxes(
        np.minimum.reduceat(boxes.low.take(order, axis=0), start),
        np.maximum.reduceat(boxes.high.take(order, axis=0), start),
        np.maximum.reduceat(boxes.farthest[order], start),
    )


def _within_reach(boxes: _Boxes, one: Indices, other: Indices, ratio: float) -> Pairs:
    """Return the pairs of boxes of which two points may be linked."""
    low, high = boxes.low.take, boxes.high.take
    gap = np.maximum(low(one, axis=0) - high(other, axis=0), low(other, axis=0) - high(one, axis=0))
    np.maximum(gap, 0, out=gap)
    reach = ratio * _SAFE * np.maximum(boxes.farthest[one], boxes.farthest[other])
    near = np.einsum("ij,ij->i", gap, gap) <= reach**2
    return one[near], other[near]


def _by_all_points(cells: PolarCells, component: Indices, pairs: Pairs, ratio: float) -> Indices:
    """Join the pairs of cells that hold two linked points."""
    size = cells.count[pairs[0]] * cells.count[pairs[1]]
    by_size = np.argsort(size, kind="stable")
    one, other, size = pairs[0][by_size], pairs[1][by_size], size[by_size]
    small = int(np.searchsorted(size, _LARGE))
    borders = np.searchsorted(np.cumsum(size[:small]), np.arange(0, size[:small].sum(), _PAIRS), side="right")
    for first, last in pairwise(np.unique([*borders, small])):
        # Cells that earlier parts have joined need no comparison.
        a, b = _of_two_components(component, one[first:last], other[first:last])
        pair, p, q = products(cells.count[a], cells.count[b])
        linked = _near(cells.points, cells.length, cells.start[a[pair]] + p, cells.start[b[pair]] + q, ratio)
        found = np.unique(pair[linked])
        component = _joined_by(component, a[found], b[found])
    for a, b in zip(one[small:], other[small:], strict=True):
        if component[a] != component[b] and _linked_by_tree(cells, a, b, ratio):
            component = _joined_by(component, np.array([a]), np.array([b]))
    return component


def _linked_by_tree(cells: PolarCells, a: int, b: int, ratio: float) -> bool:
    """Tell whether two cells hold two linked points: one whose nearest in the other is within its radius."""
    of_a, of_b = (slice(cells.start[cell], cells.start[cell] + cells.count[cell]) for cell in (a, b))
    return any(
        bool((KDTree(cells.points[to]).query(cells.points[of])[0] <= ratio * cells.length[of]).any())
        for of, to in ((of_a, of_b), (of_b, of_a))
    )


def _of_two_components(component: Indices, one: Indices, other: Indices) -> Pairs:
    apart = component[one] != component[other]
    return one[apart], other[apart]


def _near(points: Array, length: Array, one: Indices, other: Indices, ratio: float) -> BoolArray:
    """Tell which pairs of points are linked: the definition."""
    # Rows are taken in a fifth of the time of an index in brackets.
    difference = points.take(one, axis=0) - points.take(other, axis=0)
    squared = np.einsum("ij,ij->i", difference, difference)
    return squared <= (ratio * np.maximum(length[one], length[other])) ** 2


def _joined_by(component: Indices, one: Indices, other: Indices) -> Indices:
    """Return the components after pairs of their members are linked."""
    return _joined(component[one], component[other], int(component.max()) + 1)[component]


def _joined(one: Indices, other: Indices, count: int) -> Indices:
    """Return the component of each of `count` nodes, given pairs of them."""
    graph = coo_array((np.ones(len(one), np.bool_), (one, other)), (count, count))
    return connected_components(graph, directed=False)[1].astype(np.intp)
