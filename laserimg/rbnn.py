"""Clusters of points no farther apart than a share of their range: radially bounded nearest neighbours."""

from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from laserimg.clusters import LINK
from laserimg.errors import ConfigError, ScanError
from laserimg.lattice import Offset, connected
from laserimg.projection import ranges_of
from laserimg.regions import MIN_PIXELS, Labels
from laserimg.scan import BoolArray, Scan

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

MAX_RATIO = 0.5

# Rounding must not join what the definition leaves apart: what is this near the limit is computed in full.
_SURE = 1 - 1e-9
# Pairs of points compared at a time.
_PAIRS = 1 << 21


def rbnn(
    points: ArrayLike, ratio: float = LINK, min_points: int = MIN_PIXELS, origin: ArrayLike = (0.0, 0.0, 0.0)
) -> Labels:
    """Return the clusters of points in any order.

    Two points are linked if their distance is at most `ratio` times the range of the farther one;
    connected sets of at least `min_points` points are clusters. The result is exact, and does not
    depend on the order of the points but for the numbering.

    Parameters
    ----------
    points : (n, 3) array
        Metres. Points that are no measurement (not finite, at the scanner) belong to no cluster.
    ratio : float
        Radius in metres at a range of 1 m; above 0, at most 0.5.
    min_points : int
    origin : (3,) array
        Where the scanner stood.

    Returns
    -------
    (n,) array of int32
        Numbered from 1 in the order of their first points; 0 = no cluster.

    Raises
    ------
    ScanError
        If the points are not (n, 3).
    ConfigError
        If `ratio` is out of bounds.

    Notes
    -----
    Paper 1, section 4.1, and K. Klasing, D. Wollherr, M. Buss, "A clustering method for efficient
    segmentation of 3D laser data", 2008, doi:10.1109/ROBOT.2008.4543661: every point joins the clusters
    of all points within a radius. Differs from the latter: the radius grows with range; the smaller
    clusters are left out.

    In the four coordinates log range and direction the radius is the same everywhere: |p - q| <=
    ratio * range holds where these are no farther apart than `ratio`, and never beyond ratio / (1 - ratio).
    Points in one small cell of these coordinates are linked at once; cells are linked through one point of
    each where that is enough; what is left is compared point by point.

    Examples
    --------
    >>> rbnn([[10, 0, 0], [10, 0.2, 0], [10, 0.6, 0], [30, 0, 0], [30, 0.6, 0]], 1 / 30, 2).tolist()
    [1, 1, 0, 2, 2]
    """
    array = np.asarray(points, np.float64)
    if array.ndim != 2 or array.shape[1] != 3:
        raise ScanError(f"points must be (n, 3), got {array.shape}")
    _check_ratio(ratio)
    array = array - np.asarray(origin, np.float64)
    length, known = ranges_of(array)
    labels = np.zeros(len(array), np.int32)
    if known.any():
        component = _components(array[known], length[known], ratio)
        labels[known] = numbered(component, min_points)
    return labels


def rbnn_of_scan(
    scan: Scan,
    takes_part: BoolArray | None = None,
    ratio: float = LINK,
    min_points: int = MIN_PIXELS,
    reach: tuple[int, int] = (1, 1),
) -> Labels:
    """Return the clusters of a scan, found on its lattice.

    Two returns are linked if they are at most `reach` rows and columns apart and their distance is at
    most `ratio` times the range of the farther one. Columns wrap where the scan does.

    Parameters
    ----------
    scan : Scan
    takes_part : (H, W) array of bool, optional
        Returns to cluster, such as those that are not ground; by default all valid ones.
    ratio : float
        Radius in metres at a range of 1 m; above 0, at most 0.5.
    min_points : int
    reach : (int, int)
        Rows and columns; (1, 1) are the 8 neighbours.

    Returns
    -------
    (H, W) array of int32
        Numbered from 1 in raster order of their first pixels; 0 = no cluster.

    Raises
    ------
    ConfigError
        If `ratio` or `reach` is out of bounds.
    """
    _check_ratio(ratio)
    if min(reach) < 1:
        raise ConfigError(f"reach must be at least 1 row and 1 column, got {reach}")
    takes_part = scan.valid if takes_part is None else scan.valid & takes_part
    points = np.asarray(scan.points(), np.float64)
    reach = min(reach[0], scan.shape[0] - 1), min(reach[1], (scan.shape[1] - 1) // 2)
    links = {offset: _links(scan, points, takes_part, offset, ratio) for offset in _offsets(reach)}
    return connected(takes_part, links, min_points)


def numbered(component: NDArray[np.integer], min_points: int) -> Labels:
    """Return numbers from 1 for the components with enough points, in the order of their first ones.

    Examples
    --------
    >>> numbered(np.array([5, 2, 5, 7, 2]), 2).tolist()
    [1, 2, 1, 0, 2]
    """
    _, first, place, count = np.unique(component, return_index=True, return_inverse=True, return_counts=True)
    large = np.flatnonzero(count >= min_points)
    number = np.zeros(len(first), np.int32)
    number[large[np.argsort(first[large])]] = np.arange(1, len(large) + 1)
    return number[place]


def _check_ratio(ratio: float) -> None:
    if not 0 < ratio <= MAX_RATIO:
        raise ConfigError(f"ratio must be above 0 and at most {MAX_RATIO}, got {ratio}")


def _components(points: Array, length: Array, ratio: float) -> Indices:
    """Return the component of every point."""
    place = np.column_stack([np.log(length), points / length[:, None]])
    cell_of, order, start = _cells(place, ratio * _SURE / np.sqrt(3))
    leader = place[order[start]]
    tree = _tree(leader)
    cell = _joined(len(start), tree.query_pairs(ratio * _SURE, output_type="ndarray"))
    candidates = _apart(place[order], start, cell, ratio / (1 - ratio))
    members = order, start, np.diff(start, append=len(order))
    links = _links_of_cells(points, length, ratio, members, candidates, cell)
    return _merged(cell, links)[cell_of]


def _cells(place: Array, side: float) -> tuple[Indices, Indices, Indices]:
    """Return the cell of every point, the points in order of cells, and where each cell begins.

    A cell is a square on a face of the cube around the scanner, and an interval of log range. Seen
    from the scanner it is smaller than on the cube, so no two of its points are farther apart than
    `side` times the root of 3.
    """
    direction = place[:, 1:]
    axis = np.abs(direction).argmax(axis=1)
    rows = np.arange(len(place))
    largest = direction[rows, axis]
    # The two other axes, on a face of the cube.
    across, down = (direction[rows, (axis + step) % 3] / np.abs(largest) for step in (1, 2))
    face = 2 * axis + (largest < 0)
    parts = [np.floor(part / side).astype(np.int64) for part in (place[:, 0], across, down)]
    key = face.astype(np.int64)
    for part in parts:
        part -= part.min()
        key = key * (int(part.max()) + 1) + part
    order = np.argsort(key, kind="stable")
    first = np.diff(key[order], prepend=-1) > 0
    cell_of = np.empty(len(place), np.intp)
    cell_of[order] = np.cumsum(first) - 1
    return cell_of, order, np.flatnonzero(first)


def _tree(places: Array) -> KDTree:
    """Return a tree split at the middle: made in half the time of one split at the median."""
    return KDTree(places, balanced_tree=False, compact_nodes=False)


def _joined(count: int, pairs: NDArray) -> Indices:
    graph = coo_array((np.ones(len(pairs), np.bool_), (pairs[:, 0], pairs[:, 1])), (count, count))
    return connected_components(graph, directed=False)[1].astype(np.intp)


def _merged(component: Indices, links: NDArray) -> Indices:
    """Return the components after pairs of their members are linked."""
    return _joined(int(component.max()) + 1, component[links])[component]


def _apart(place: Array, start: Indices, component: Indices, reach: float) -> NDArray:
    """Return the pairs (m, 2) of cells of different components whose bounding boxes are within `reach`."""
    low, high = np.minimum.reduceat(place, start), np.maximum.reduceat(place, start)
    middle = (low + high) / 2
    across = reach + float(np.linalg.norm(high - low, axis=1).max())
    # One of two components is not the largest; of that, only cells near another one matter.
    largest = component == np.bincount(component).argmax()
    near = ~largest
    if largest.any() and near.any():
        cells = np.flatnonzero(largest)
        distance, _ = _tree(middle[near]).query(middle[cells], distance_upper_bound=across)
        near[cells[np.isfinite(distance)]] = True
    cells = np.flatnonzero(near)
    pairs = cells[_tree(middle[cells]).query_pairs(across, output_type="ndarray")].reshape(-1, 2)
    pairs = pairs[component[pairs[:, 0]] != component[pairs[:, 1]]]
    one, other = pairs.T
    gap = np.maximum(low[one] - high[other], low[other] - high[one])
    return pairs[(np.maximum(gap, 0) ** 2).sum(axis=1) <= (reach * (1 + 1e-9)) ** 2]


def _links_of_cells(
    points: Array,
    length: Array,
    ratio: float,
    members: tuple[Indices, Indices, Indices],
    candidates: NDArray,
    component: Indices,
) -> NDArray:
    """Return the pairs of cells, of those given, that hold two linked points."""
    order, start, count = members
    size = count[candidates[:, 0]] * count[candidates[:, 1]]
    sorted_by_size = np.argsort(size)
    candidates, size = candidates[sorted_by_size], size[sorted_by_size]
    borders = np.searchsorted(np.cumsum(size), np.arange(_PAIRS, size.sum() + _PAIRS, _PAIRS))
    links = np.zeros((0, 2), np.intp)
    for first, last in pairwise(np.unique([0, *borders, len(candidates)])):
        part, n = candidates[first:last], size[first:last]
        # Cells that earlier parts have joined need no comparison.
        if len(links):
            now = _merged(component, links)
            needed = now[part[:, 0]] != now[part[:, 1]]
            part, n = part[needed], n[needed]
        pair = np.repeat(np.arange(len(part)), n)
        step = np.arange(len(pair)) - np.repeat(np.cumsum(n) - n, n)
        a, b = part[pair, 0], part[pair, 1]
        p = order[start[a] + step // count[b]]
        q = order[start[b] + step % count[b]]
        linked = _near(points[p], points[q], length[p], length[q], ratio)
        links = np.concatenate([links, part[np.unique(pair[linked])]])
    return links


def _near(p: Array, q: Array, length_p: Array, length_q: Array, ratio: float) -> BoolArray:
    """Tell which points p, q (..., 3) are linked: the definition."""
    difference = p - q
    squared = np.einsum("...k,...k->...", difference, difference)
    return squared <= (ratio * np.maximum(length_p, length_q)) ** 2


def _offsets(reach: tuple[int, int]) -> list[Offset]:
    rows, columns = reach
    right = [(0, column) for column in range(1, columns + 1)]
    return right + [(row, column) for row in range(1, rows + 1) for column in range(-columns, columns + 1)]


def _links(scan: Scan, points: Array, takes_part: BoolArray, offset: Offset, ratio: float) -> BoolArray:
    """Return (H, W): whether a pixel is linked to the one at `offset`."""
    rows, columns = offset
    height, width = scan.shape[0] - rows, scan.shape[1]
    length = scan.range.astype(np.float64)
    near = _near(points[:height], _shifted(points, offset), length[:height], _shifted(length, offset), ratio)
    link = np.zeros(scan.shape, np.bool_)
    link[:height] = near & takes_part[:height] & _shifted(takes_part, offset)
    if not scan.wraps and columns:
        link[:, slice(width - columns, width) if columns > 0 else slice(0, -columns)] = False
    return link


def _shifted(values: NDArray, offset: Offset) -> NDArray:
    """Return what stands at `offset` of every pixel; columns wrap, the last rows are left out."""
    return np.roll(values[offset[0] :], -offset[1], axis=1)
