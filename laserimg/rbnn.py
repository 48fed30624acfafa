"""Clusters of points no farther apart than a share of their range: radially bounded nearest neighbours."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from laserimg.clusters import LINK
from laserimg.errors import ConfigError, ScanError
from laserimg.lattice import Offset, connected
from laserimg.linked_points import linked_components
from laserimg.projection import ranges_of
from laserimg.regions import MIN_PIXELS, Labels
from laserimg.scan import BoolArray, Scan

Array = NDArray[np.float64]

MIN_RATIO, MAX_RATIO = 1e-4, 0.5


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
        Radius in metres at a range of 1 m; from 0.0001 to 0.5.
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

    In elevation, azimuth and log range the radius is the same everywhere, but for the bounds that
    `linked_points` keeps to.

    Examples
    --------
    >>> rbnn([[10, 0, 0], [10, 0.2, 0], [10, 0.6, 0], [30, 0, 0], [30, 0.6, 0]], 1 / 30, 2).tolist()
    [1, 1, 0, 2, 2]
    """
    array = np.asarray(points, np.float64)
    if array.ndim != 2 or array.shape[1] != 3:
        raise ScanError(f"points must be (n, 3), got {array.shape}")
    _check_ratio(ratio)
    place = np.asarray(origin, np.float64)
    array = array - place if place.any() else array
    length, known = ranges_of(array)
    if known.all() and len(known):
        return numbered(linked_components(array, length, ratio), min_points)
    labels = np.zeros(len(array), np.int32)
    if known.any():
        component = linked_components(array[known], length[known], ratio)
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
        Radius in metres at a range of 1 m; from 0.0001 to 0.5.
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
    rows, columns = scan.shape
    farthest = (columns - 1) // 2 if scan.wraps else columns - 1
    reach = max(min(reach[0], rows - 1), 1), max(min(reach[1], farthest), 1)
    links = {offset: _links(scan, points, takes_part, offset, ratio) for offset in _offsets(reach)}
    return connected(takes_part, links, min_points)


def numbered(component: NDArray[np.integer], min_points: int) -> Labels:
    """Return numbers from 1 for the components with enough points, in the order of their first ones.

    Examples
    --------
    >>> numbered(np.array([5, 2, 5, 7, 2]), 2).tolist()
    [1, 2, 1, 0, 2]
    """
    count = np.bincount(component)
    first = np.zeros(len(count), np.intp)
    first[component[::-1]] = np.arange(len(component))[::-1]  # of several, the last one stays
    large = np.flatnonzero(count >= max(min_points, 1))
    number = np.zeros(len(count), np.int32)
    number[large[np.argsort(first[large])]] = np.arange(1, len(large) + 1)
    return number[component]


def _check_ratio(ratio: float) -> None:
    if not MIN_RATIO <= ratio <= MAX_RATIO:
        raise ConfigError(f"ratio must be from {MIN_RATIO} to {MAX_RATIO}, got {ratio}")


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
