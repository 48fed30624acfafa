"""One object a cluster, on the lattice: points that stand for blocks of pixels, and what they say of all."""

import numpy as np
from numpy.typing import NDArray

from laserimg.clusters import LINK, linked, median_pitch
from laserimg.mixed_pixels import with_mixed_pixels
from laserimg.object_clusters import object_clusters
from laserimg.regions import Labels
from laserimg.scan import BoolArray, Float32Array, Scan

# `object_clusters` takes 0.2 s for so many points.
MOST_POINTS = 60_000
# Rows are no farther apart than this: half of it is less than 0.4 times `LINK`.
_MAX_STEP_RAD = 0.026
# A pixel nearer than this share of the radius to the point of its own block belongs with it.
_SURE = 0.25
_AROUND = tuple((rows, columns) for rows in (-1, 0, 1) for columns in (-1, 0, 1))


def object_labels(
    scan: Scan, above: BoolArray, height_m: Float32Array, ratio: float = LINK
) -> tuple[Labels, Float32Array]:
    """Return the clusters of the returns above the ground, of which most are one object each.

    `object_clusters` of the nearest return of every block of pixels, so that thin things before others are
    kept; blocks are single pixels where there are 60,000 returns or fewer. Every other pixel goes with the
    nearest of these points in its own and the eight blocks around, within the radius; what is left holds
    together by itself, as `clusters.linked` has it, and mixed pixels go to the edge they lie on.

    Parameters
    ----------
    scan : Scan
    above : (H, W) array of bool
        Returns that are not ground.
    height_m : (H, W) array of float32
        Over the ground.
    ratio : float
        Radius in metres at a range of 1 m.

    Returns
    -------
    labels : (H, W) array of int32
        From 1; 0 for none.
    range_m : (H, W) array of float32
        Metres to measure with.
    """
    labels = np.zeros(scan.shape, np.int32)
    if above.any():
        block = _block(scan, above)
        chosen = _nearest_of_blocks(scan.range, above, block)
        pixels = chosen[chosen >= 0]
        points = scan.range.ravel()[pixels, None] * scan.directions.reshape(-1, 3)[pixels]
        pitch = block[1] * median_pitch(scan.directions)[0]
        found = object_clusters(points, height_m.ravel()[pixels], scan.up, ratio, 1, pitch)
        labels.ravel()[pixels] = found
        if max(block) > 1:
            _carry(labels, scan, above, chosen, ratio, block)
    rest, _ = linked(scan.range, scan.directions, above & (labels == 0), scan.wraps, ratio)
    labels = np.where(rest > 0, rest + labels.max(), labels)
    return with_mixed_pixels(labels, scan.range, above & (labels == 0), scan.wraps)


def _block(scan: Scan, above: BoolArray) -> tuple[int, int]:
    """Rows and columns of blocks of which no more than about `MOST_POINTS` hold returns.

    Rows first: where clusters are cut heights count half, and gaps between columns are what parts people.
    """
    up = median_pitch(scan.directions)[1]
    wanted = -(-int(above.sum()) // MOST_POINTS)
    rows = int(np.clip(_MAX_STEP_RAD / max(up, 1e-6), 1, wanted))
    return rows, -(-wanted // rows)


def _nearest_of_blocks(range_m: Float32Array, above: BoolArray, block: tuple[int, int]) -> NDArray[np.intp]:
    """Return the pixel with the nearest return of every block, -1 where there is none."""
    rows, columns = (-(-size // step) for size, step in zip(range_m.shape, block, strict=True))
    padded = np.full((rows * block[0], columns * block[1]), np.inf, np.float32)
    padded[: range_m.shape[0], : range_m.shape[1]] = np.where(above, range_m, np.inf)
    parts = padded.reshape(rows, block[0], columns, block[1]).transpose(0, 2, 1, 3).reshape(rows, columns, -1)
    place = parts.argmin(axis=2)
    row = np.arange(rows)[:, None] * block[0] + place // block[1]
    column = np.arange(columns) * block[1] + place % block[1]
    return np.where(np.isfinite(parts.min(axis=2)), row * range_m.shape[1] + column, -1)


def _carry(
    labels: Labels,
    scan: Scan,
    above: BoolArray,
    chosen: NDArray[np.intp],
    ratio: float,
    block: tuple[int, int],
) -> None:
    """Give the pixels without a label that of the nearest chosen one around, if it is within the radius."""
    flat = labels.ravel()
    pixels = np.flatnonzero(above & (labels == 0))
    row, column = np.divmod(pixels, scan.shape[1])
    row, column = row // block[0], column // block[1]
    own = chosen[row, column]
    near = _distance(scan, pixels, own) / (ratio * scan.range.ravel()[pixels])
    sure = near <= _SURE
    flat[pixels[sure]] = flat[own[sure]]
    pixels, row, column = pixels[~sure], row[~sure], column[~sure]
    best = np.full(len(pixels), ratio, np.float32) * scan.range.ravel()[pixels]
    carried = np.zeros(len(pixels), np.int32)
    for rows, columns in _AROUND:
        other = _at(chosen, row + rows, column + columns, scan.wraps)
        distance = np.where(other >= 0, _distance(scan, pixels, other), np.inf)
        nearer = distance <= best
        carried[nearer], best[nearer] = flat[other[nearer]], distance[nearer]
    flat[pixels] = carried


def _at(
    chosen: NDArray[np.intp], row: NDArray[np.intp], column: NDArray[np.intp], wraps: bool
) -> NDArray[np.intp]:
    """Return the chosen pixels of some blocks, -1 beyond the grid."""
    rows, columns = chosen.shape
    inside = (row >= 0) & (row < rows) & (wraps | ((column >= 0) & (column < columns)))
    return np.where(inside, chosen[np.clip(row, 0, rows - 1), column % columns], -1)


def _distance(scan: Scan, pixels: NDArray[np.intp], others: NDArray[np.intp]) -> Float32Array:
    range_m, directions = scan.range.ravel(), scan.directions.reshape(-1, 3)
    away = range_m[pixels, None] * directions[pixels] - range_m[others, None] * directions[others]
    return np.sqrt(np.einsum("ij,ij->i", away, away))
