"""The default partition: objects, each the returns that hold together after floor and walls are gone."""

import cv2
import numpy as np
from numpy.typing import NDArray

from laserimg.geometry.floor import Floor
from laserimg.geometry.large_planes import TOLERANCE_M, LargePlane, large_planes
from laserimg.geometry.planes import heights_over
from laserimg.lattice import Offset, connected, step_links
from laserimg.mixed_pixels import with_mixed_pixels
from laserimg.regions import MIN_PIXELS, Labels, Partition
from laserimg.scan import BoolArray, Float32Array, Scan

# Two returns hold together if they are no farther apart than this share of their range: 4 cm at
# 1.3 m, where a wastebasket stands 12 cm before a desk, and 0.4 m at 12 m, where a windscreen
# gives no return. `tools/region_variants.py` prints what other shares, the reference step and the
# angle criterion of Bogoslavskyi and Stachniss (2016) give on the same scans.
LINK = 1 / 30

# Rays that are compared, in pixels apart: neighbours, these, and the farthest that `LINK` allows.
BRIDGES = (2, 4, 8)
MAX_REACH = 16

# Planes are searched on about so many pixels of the lattice.
_THIN_PIXELS = 10_000
# Rows and columns that the angles between rays are taken from.
_FEW = 4
_LOG_STEPS = 5000


def find_clusters(scan: Scan, floor: Floor | None, link: float = LINK) -> Partition:
    """Return the objects of a scan as a partition of its pixels.

    Floor and large planes are taken out; two returns up to 16 pixels apart in a row or a
    column are linked if their distance in 3D is at most `link` times their range; connected sets of more
    than 15 pixels are clusters, numbered from 1 in raster order of their first pixel, and get back
    the mixed pixels at their edge. This is
    the radially bounded nearest neighbour of Klasing et al. (2008, doi:10.1109/ROBOT.2008.4543661)
    with the radius in proportion to range (paper 1, section 4.1), on the lattice of the scan in
    place of a k-d tree. Columns wrap where the scan does.

    Differs from paper 2, section 4, whose constant step of 5 cm (`regions.reference_regions`) lets
    objects flow into the floor and fall apart at windscreens.

    Parameters
    ----------
    scan : Scan
    floor : Floor or None
        As `find_floor` gives it; None takes no floor out.
    link : float
        Largest distance between linked returns, as a share of their range.

    Returns
    -------
    Partition
        Label 0 = no cluster: no return, floor, large plane, or too few pixels.
    """
    objects = standing_objects(scan, floor)
    labels, range_m = linked(scan.range, scan.directions, objects, scan.wraps, link)
    return Partition(labels, range_m, objects)


def linked(
    range_m: Float32Array, directions: Float32Array, objects: BoolArray, wraps: bool, link: float
) -> tuple[Labels, Float32Array]:
    """Return the connected sets of `objects`, mixed pixels included, and the ranges to measure with."""
    links = step_links(fixed_log(range_m), objects, link_limits(directions, link), wraps)
    labels = connected(objects, links, MIN_PIXELS)
    return with_mixed_pixels(labels, range_m, objects & (labels == 0), wraps)


def fixed_log(range_m: Float32Array) -> NDArray[np.uint16]:
    """Logarithm of the range in units of 1 / `_LOG_STEPS`: half the memory of floats, compared twice as fast.

    It reaches from 5 cm to 18 km.
    """
    scaled = np.asarray(cv2.log(np.maximum(range_m, np.float32(0.05))))
    scaled += np.float32(3.0)
    scaled *= np.float32(_LOG_STEPS)
    return scaled.astype(np.uint16)


def standing_objects(scan: Scan, floor: Floor | None) -> BoolArray:
    """Return the (H, W) mask of valid returns that are neither floor nor large plane."""
    objects = scan.valid
    if floor is not None:
        objects &= heights_over(floor.plane, scan.range, scan.directions) > floor.clearance_m
    step = max(1, round(np.sqrt(objects.size / _THIN_PIXELS)))
    thin_points = scan.range[::step, ::step, None] * scan.directions[::step, ::step]
    across, up = median_pitch(scan.directions)
    thin_objects = np.ascontiguousarray(objects[::step, ::step])
    for large in large_planes(thin_points, thin_objects, (across * step, up * step), scan.wraps):
        _take_out(objects, scan, large, step)
    return objects


def link_limits(directions: Float32Array, link: float) -> dict[Offset, NDArray[np.uint16]]:
    """Return, for every offset, the largest difference of log range that links two pixels, in fixed point.

    The squared distance of two returns as a share of their range is the squared difference of log
    range plus the squared chord between the rays. Neighbouring rays may always be linked, by at
    least half of `link`: some scanners have beams farther apart than that.
    """
    limits = {}
    for offset in _offsets(directions, link):
        least = (link / 2) ** 2 if max(offset) == 1 else 0.0
        chords = _chords_of_rows(directions, offset), _chords_of_columns(directions, offset)
        limits[offset] = _fixed_limit(*chords, link**2, least)
    return limits


def _offsets(directions: Float32Array, link: float) -> list[Offset]:
    """Offsets worth comparing, up to the farthest whose rays are no more than `link` apart."""
    offsets: list[Offset] = []
    for axis, pitch in enumerate(median_pitch(directions)):
        farthest = min(int(link / max(pitch, 1e-6)), MAX_REACH, directions.shape[1 - axis] // 2 - 1)
        reaches = sorted({1, *(reach for reach in BRIDGES if reach < farthest), max(farthest, 1)})
        offsets += [(0, reach) if axis == 0 else (reach, 0) for reach in reaches]
    return offsets


def median_pitch(directions: Float32Array) -> tuple[float, float]:
    """Median angle between neighbouring rays, across and up."""
    across = np.median(_chords_of_columns(directions, (0, 1)))
    up = np.median(_chords_of_rows(directions, (1, 0)))
    return float(np.sqrt(across)), float(np.sqrt(up))


# A panorama's, a tilting laser's and an unevenly turned head's chords between rays are products of a
# factor of the row and one of the column, so that a few columns tell all rows and a few rows all columns.


def _chords_of_rows(directions: Float32Array, offset: Offset) -> NDArray:
    """Squared distance of the tips of two rays `offset` apart: the mean of every row (H,)."""
    rows, columns = offset
    height, width = directions.shape[0] - rows, directions.shape[1] - columns
    few = np.linspace(0, width - 1, _FEW).astype(int)
    chords = directions[rows:, few + columns] - directions[:height, few]
    return _to_length(np.einsum("ijk,ijk->i", chords, chords) / _FEW, directions.shape[0])


def _chords_of_columns(directions: Float32Array, offset: Offset) -> NDArray:
    """Squared distance of the tips of two rays `offset` apart: the mean of every column (W,)."""
    rows, columns = offset
    height, width = directions.shape[0] - rows, directions.shape[1] - columns
    few = np.linspace(0, height - 1, _FEW).astype(int)
    chords = directions[few + rows, columns:] - directions[few, :width]
    return _to_length(np.einsum("ijk,ijk->j", chords, chords) / _FEW, directions.shape[1])


def _to_length(values: NDArray, length: int) -> NDArray:
    """Repeat the last value; `np.pad` takes ten times as long."""
    return np.concatenate([values, np.full(length - len(values), values[-1])])


def _fixed_limit(
    by_row: NDArray, by_column: NDArray, link_squared: float, least: float
) -> NDArray[np.uint16]:
    """Limit (H, W) of the difference of log range; seen from one row or column where that says it all."""
    across, down = (np.ptp(values) <= 0.02 * link_squared for values in (by_column, by_row))
    if across:
        chord = by_row[:, None]
    elif down:
        chord = by_column[None]
    else:
        chord = by_row[:, None] * (by_column / max(float(by_column.mean()), 1e-12))[None]
    limit = np.rint(np.sqrt(np.maximum(link_squared - chord, least)) * _LOG_STEPS).astype(np.uint16)
    return np.broadcast_to(limit, (len(by_row), len(by_column)))


def _take_out(objects: BoolArray, scan: Scan, large: LargePlane, step: int) -> None:
    """Clear the returns of `objects` near the plane, within the thinned patch and a step around it."""
    patch = _with_neighbours(large.mask, scan.wraps)
    rows, columns = np.flatnonzero(patch.any(axis=1)), np.flatnonzero(patch.any(axis=0))
    coarse = patch[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
    full = cv2.resize(coarse, None, fx=step, fy=step, interpolation=cv2.INTER_NEAREST).view(np.bool_)
    window = (
        slice(rows[0] * step, (rows[-1] + 1) * step),
        slice(columns[0] * step, (columns[-1] + 1) * step),
    )
    inside = objects[window]
    distance = heights_over(large.plane, scan.range[window], scan.directions[window])
    near = np.abs(distance, out=distance) <= TOLERANCE_M
    near &= full[: inside.shape[0], : inside.shape[1]]
    inside &= ~near


def _with_neighbours(mask: BoolArray, wraps: bool) -> NDArray[np.uint8]:
    """The mask and a pixel around it; the last column is beside the first where they close a full turn."""
    side = int(wraps)
    pixels = cv2.copyMakeBorder(mask.view(np.uint8), 0, 0, side, side, cv2.BORDER_WRAP)
    grown = np.asarray(cv2.dilate(pixels, np.ones((3, 3), np.uint8)), np.uint8)
    return grown[:, side : grown.shape[1] - side]
