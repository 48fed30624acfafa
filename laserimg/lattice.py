"""Connected components on the pixel lattice, from any set of links between near pixels."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from laserimg.errors import LaserImgError

BoolArray = NDArray[np.bool_]
Offset = tuple[int, int]
Links = Mapping[Offset, BoolArray]


def step_links(
    values: NDArray[np.float32], limits: Mapping[Offset, float | NDArray[np.float32]], wraps: bool
) -> dict[Offset, BoolArray]:
    """Return, for every offset, which pixels have a value near that of the pixel at that offset.

    Parameters
    ----------
    values : (H, W) array of float32
        NaN where the pixel takes no part.
    limits : mapping of offset to float or (H, W) array
        Largest |difference|, in the unit of `values`. An offset is (rows, columns), rows not
        negative.
    wraps : bool
        The columns close a full turn.

    Returns
    -------
    dict of (H, W) arrays of bool
        Element (y, x) tells of the pair (y, x), (y + rows, x + columns).

    Examples
    --------
    >>> values = np.array([[1.0, 1.1, 3.0]], np.float32)
    >>> step_links(values, {(0, 1): 0.5}, wraps=False)[0, 1].tolist()
    [[True, False, False]]
    """
    height, width = values.shape
    reach = max(max(rows, abs(columns)) for rows, columns in limits)
    padded = np.full((height + reach, width + 2 * reach), np.nan, np.float32)
    padded[:height, reach : reach + width] = values
    if wraps:
        padded[:height, :reach] = values[:, -reach:]
        padded[:height, reach + width :] = values[:, :reach]
    difference = np.empty_like(values)
    links = {}
    for (rows, columns), limit in limits.items():
        other = padded[rows : rows + height, reach + columns : reach + columns + width]
        np.subtract(values, other, out=difference)
        np.abs(difference, out=difference)
        links[rows, columns] = difference <= limit
    return links


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
    one, other = np.concatenate(edges, axis=1)
    graph = coo_array((np.ones(len(one), np.bool_), (one, other)), (len(first), len(first)))
    _, component = connected_components(graph, directed=False)
    pixels = np.diff(first, append=run.size) * takes_part.ravel()[first]
    return _numbered(component, pixels, min_pixels)[run]


def _runs(takes_part: BoolArray, right: BoolArray) -> tuple[NDArray[np.intp], NDArray[np.int32]]:
    """Return the first pixel of every run, and the (H, W) run of every pixel.

    A run is a stretch of one row whose pixels are linked, or a stretch that takes no part.
    """
    start = np.ones(takes_part.shape, np.bool_)
    np.logical_not(right[:, :-1], out=start[:, 1:])
    start[:, 1:] &= takes_part[:, 1:] | takes_part[:, :-1]
    run = np.cumsum(start, dtype=np.int32).reshape(start.shape)
    run -= 1
    return np.flatnonzero(start), run


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
