"""The metric box: what is measured of a region, in metres."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from laserimg.geometry.floor import Floor
from laserimg.projection import angles_from_directions
from laserimg.regions import Region
from laserimg.scan import Scan
from laserimg.thinning import evenly

# Spans are between these quantiles, so that a stray return does not stretch an object.
QUANTILE = 0.01
# An object whose lowest point is nearer to the floor than this stands on it.
STANDS_WITHIN_M = 0.25

_MAX_MEASURED = 1024


@dataclass(frozen=True, slots=True)
class MetricBox:
    """The measured sizes and place of a region's returns, in metres and degrees.

    Parameters
    ----------
    width, depth : float
        Across and along the horizontal line of sight to the median point.
    height : float
        From the lowest point to the top along up; from the floor if the object stands on it.
    length, breadth : float
        Long and short side of the oriented rectangle seen from above.
    x, y, z : float
        Median point in the scanner's frame.
    range : float
        Median range.
    azimuth_deg, elevation_deg : float
        Direction of the median point.
    height_above_floor : float or None
        Of the lower face of the box; 0 if the object stands on the floor, None without a floor.
    points : int
        Returns in the region.
    """

    width: float
    depth: float
    height: float
    length: float
    breadth: float
    x: float
    y: float
    z: float
    range: float
    azimuth_deg: float
    elevation_deg: float
    height_above_floor: float | None
    points: int


def metric_box(scan: Scan, region: Region, floor: Floor | None) -> MetricBox:
    """Measure a region.

    All sizes are spans between the 1 % and 99 % quantiles of the region's points (of an even
    selection of 1024 if there are more). This is the box of paper 2, section 4
    ("27cm x 12cm x 31cm (width, depth, height)"), with three differences: the spans are robust;
    a ray stands for its whole pixel, so that spans grow by half the pitch at both ends (an edge
    lies anywhere between the last ray that hits and the first that misses); and the height counts
    from the floor when the lowest point is within 0.25 m of it, because the foot is usually cut
    away with the floor.

    Parameters
    ----------
    scan : Scan
        Gives the directions of the pixels and "up".
    region : Region
    floor : Floor or None
    """
    thin = evenly(len(region.pixels), _MAX_MEASURED)
    measured, ranges = region.pixels[thin], region.ranges[thin]
    points = (ranges[:, None] * scan.directions.reshape(-1, 3)[measured]).astype(np.float64)
    middle, typical = np.median(points, axis=0), float(np.median(ranges))
    axes = _axes(points, middle, scan.up)
    half_pixel = _half_pixel(scan, measured[len(measured) // 2], axes) * typical
    low, high = _spans(points, axes if floor is None else np.vstack([axes, floor.plane.normal]))
    width, depth, height, first, second = high[:5] - low[:5] + 2 * half_pixel
    above = None
    if floor is not None:
        bottom, top = low[5] + floor.height_below_m, high[5] + floor.height_below_m
        stands = bottom <= STANDS_WITHIN_M
        above = 0.0 if stands else float(bottom)
        height = max(top + half_pixel[2], 0.0) if stands else height
    azimuth, elevation = angles_from_directions(middle)
    return MetricBox(
        width=float(width),
        depth=float(depth),
        height=float(height),
        length=float(max(first, second)),
        breadth=float(min(first, second)),
        x=float(middle[0]),
        y=float(middle[1]),
        z=float(middle[2]),
        range=typical,
        azimuth_deg=float(np.degrees(azimuth)),
        elevation_deg=float(np.degrees(elevation)),
        height_above_floor=above,
        points=len(region.pixels),
    )


def _axes(points: NDArray, middle: NDArray, up: NDArray) -> NDArray[np.float64]:
    """Unit vectors (5, 3): across and along the line of sight, up, and the sides of the rectangle."""
    level = middle - (middle @ up) * up
    if level @ level < 1e-12:  # straight above or below the scanner every horizontal will do
        level = _cross(up, np.array((1.0, 0.0, 0.0) if abs(up[0]) < 0.9 else (0.0, 1.0, 0.0)))
    along = level / np.sqrt(level @ level)
    across = _cross(up, along)
    seen_from_above = (points @ np.stack([along, across], axis=1)).astype(np.float32)
    angle = np.radians(cv2.minAreaRect(seen_from_above)[2])
    side = np.cos(angle) * along + np.sin(angle) * across
    return np.stack([across, along, up, side, _cross(up, side)])


def _cross(a: NDArray, b: NDArray) -> NDArray[np.float64]:
    """Cross product of two vectors; `np.cross` takes ten times as long for one pair."""
    return np.array(
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]], np.float64
    )


def _half_pixel(scan: Scan, pixel: int, axes: NDArray) -> NDArray[np.float64]:
    """Half the footprint of a pixel along every axis (5,), as a share of the range."""
    height, width = scan.shape
    row, column = divmod(int(pixel), width)
    left, right = max(column - 2, 0), min(column + 2, width - 1)
    upper, lower = max(row - 2, 0), min(row + 2, height - 1)
    across = (scan.directions[row, right] - scan.directions[row, left]) / (right - left)
    upwards = (scan.directions[upper, column] - scan.directions[lower, column]) / (lower - upper)
    half = (np.abs(axes @ across) + np.abs(axes @ upwards)) / 2
    half[1] = 0.0  # along the line of sight a pixel has no extent
    # The sides of the rectangle lie between across and along.
    half[3:] = np.abs(axes[3:] @ axes[0]) * half[0]
    return half


def _spans(points: NDArray, axes: NDArray) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Low and high quantile of the points along every axis."""
    cut = int(QUANTILE * len(points))
    along_axes = np.partition(axes @ points.T, (cut, len(points) - 1 - cut), axis=1)
    return along_axes[:, cut], along_axes[:, len(points) - 1 - cut]
