"""Connected components on the pixel lattice, from any set of links between near pixels."""

from collections.abc import Mapping

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from laserimg.errors import LaserImgError

BoolArray = NDArray[np.bool_]
Values = NDArray[np.float32] | NDArray[np.uint16]
Offset = tuple[int, int]
Window = tuple[slice, slice]
Links = Mapping[Offset, BoolArray]


def step_links(
    values: Values, takes_part: BoolArray, limits: Mapping[Offset, float | Values], wraps: bool
) -> dict[Offset, BoolArray]:
    """Return, for every offset, which pixels have a value near that of the pixel at that offset.

    Parameters
    ----------
    values : (H, W) array of float32 or uint16
    takes_part : (H, W) array of bool
        Other pixels are linked to none.
    limits : mapping of offset to number or (H, W) array of the type of `values`
        Largest |difference|. An offset is (rows, columns), rows not negative.
    wraps : bool
        The columns close a full turn.

    Returns
    -------
    dict of (H, W) arrays of bool
        Element (y, x) tells of the pair (y, x), (y + rows, x + columns).

    Examples
    --------
    >>> values = np.array([[1.0, 1.1, 3.0]], np.float32)
    >>> step_links(values, values > 0, {(0, 1): 0.5}, wraps=False)[0, 1].tolist()
    [[True, False, False]]
    """
    links = {}
    for offset, limit in limits.items():
        link = np.zeros(values.shape, np.bool_)
        for first, second in _pairs(values.shape, offset, wraps):
            near = np.asarray(cv2.absdiff(values[first], values[second]))
            allowed = limit[first] if isinstance(limit, np.ndarray) else values.dtype.type(limit)
            np.less_equal(near, allowed, out=link[first])
            link[first] &= takes_part[first]
            link[first] &= takes_part[second]
        links[offset] = link
    return links


def _pairs(shape: tuple[int, int], offset: Offset, wraps: bool) -> list[tuple[Window, Window]]:
    """Return the windows of the grid that hold the first and the second pixels of all pairs."""
    (height, width), (rows, columns) = shape, offset
    upper, lower = slice(0, height - rows), slice(rows, height)
    left, right = slice(0, width - abs(columns)), slice(abs(columns), width)
    first, second = (left, right) if columns >= 0 else (right, left)
    pairs = [((upper, first), (lower, second))]
    if wraps and columns:
        border, start = slice(width - abs(columns), width), slice(0, abs(columns))
        first, second = (border, start) if columns > 0 else (start, border)
        pairs.append(((upper, first), (lower, second)))
    return [pair for pair in pairs if height > rows and width > abs(columns)]


def connected(takes_part: BoolArray, links: Links, min_pixels: int) -> NDArray[np.int32]:
    """Return the components of the pixels that take part, numbered from 1 in raster order.

    Pixels joined along a row are first taken together as runs, so that the graph has one node a
    run instead of one a pixel.

    Parameters
    ----------
    takes_part : (H, W) array of bool
    links : mapping of offset to (H, W) array of bool
        As `step_links` gives them; must hold the offset (0, 1).
    min_pixels : int
        Components with fewer pixels are left out.

    Returns
    -------
    (H, W) array of int32
        0 where there is no component.

    Raises
    ------
    LaserImgError
        If the links lack (0, 1).
    """
    if (0, 1) not in links:
        raise LaserImgError("links must hold the offset (0, 1)")
    first, run = _runs(takes_part, links[0, 1])
    edges = [_run_edges(run, offset, mask) for offset, mask in _needed(links).items()]
    one, other = np.concatenate(edges, axis=1) - 1
    graph = coo_array((np.ones(len(one), np.bool_), (one, other)), (len(first), len(first)))
    _, component = connected_components(graph, directed=False)
    length = np.diff(first, append=run.size)
    number = _numbered(component, length * takes_part.ravel()[first], min_pixels)
    return np.repeat(number, length).reshape(takes_part.shape)


def _runs(takes_part: BoolArray, right: BoolArray) -> tuple[NDArray[np.intp], NDArray[np.int32]]:
    """Return the first pixel of every run, and the (H, W) number of every pixel's run, from 1.

    A run is a stretch of one row whose pixels are linked, or a stretch that takes no part.
    """
    start = np.ones(takes_part.shape, np.bool_)
    np.logical_not(right[:, :-1], out=start[:, 1:])
    start[:, 1:] &= takes_part[:, 1:] | takes_part[:, :-1]
    return np.flatnonzero(start), np.cumsum(start, dtype=np.int32).reshape(start.shape)


def _needed(links: Links) -> dict[Offset, BoolArray]:
    """Leave out the links that follow from two shorter ones, and (0, 1) inside a row."""
    right = links[0, 1]
    needed = {}
    for offset, mask in links.items():
        mask = mask.copy()
        if offset == (0, 1):
            mask[:, :-1] = False  # inside a row the run says it; across the seam it does not
        elif offset == (1, 0):
            both_right = right[:-1, :-1] & right[1:, :-1]
            mask[:-1, 1:] &= ~(mask[:-1, :-1] & both_right)
        else:
            _drop_implied(mask, offset, links)
        needed[offset] = mask
    return needed


def _drop_implied(mask: BoolArray, offset: Offset, links: Links) -> None:
    """Clear links of `offset` that two links of `links` imply, where no seam is involved."""
    rows, columns = offset
    for first, via in links.items():
        second = (rows - first[0], columns - first[1])
        if second not in links or min(first[1], second[1], columns) < 0:
            continue
        inner_rows, inner_columns = mask.shape[0] - first[0], mask.shape[1] - first[1]
        implied = via[:inner_rows, :inner_columns] & links[second][first[0] :, first[1] :]
        mask[:inner_rows, :inner_columns] &= ~implied


def _run_edges(run: NDArray[np.int32], offset: Offset, mask: BoolArray) -> NDArray[np.int32]:
    """Return the (2, n) pairs of runs that the links of one offset join."""
    width = run.shape[1]
    pixel = np.flatnonzero(mask)
    column = pixel % width
    other = pixel - column + (column + offset[1]) % width + offset[0] * width
    return np.stack([run.ravel()[pixel], run.ravel()[other]])


def _numbered(component: NDArray[np.int32], pixels: NDArray[np.intp], min_pixels: int) -> NDArray[np.int32]:
    """Return for every run the number of its component: 0 if too small, else by its first run."""
    total = int(component.max()) + 1
    size = np.bincount(component, weights=pixels, minlength=total)
    first = np.full(total, len(component))
    np.minimum.at(first, component, np.arange(len(component)))
    large = np.flatnonzero(size >= min_pixels)
    number = np.zeros(total, np.int32)
    number[large[np.argsort(first[large])]] = np.arange(1, len(large) + 1)
    return number[component]
