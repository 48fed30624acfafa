"""Images of an object: from virtual places around its points, or its crop out of a scan."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from laserimg.classify.clouds import ObjectCloud
from laserimg.errors import ScanError
from laserimg.regions import bounding_box
from laserimg.scan import BoolArray, Float32Array, Scan

SIDE_PX = 64
# Distance of a virtual scanner in bounding radii.
DISTANCE_RADII = 3.0
# Holes up to this many times the usual distance of points are closed.
CLOSED_SPACINGS = 1.5
_MAX_CLOSED_PX = 10.0


@dataclass(frozen=True, eq=False, slots=True)
class ObjectImages:
    """Range and reflectance images of one object, from one or several places, each cropped to it.

    The frame of an image is x right, y down, z away from the scanner.

    Parameters
    ----------
    range : (v, h, w) array of float32
        Metres; 0 outside the object.
    directions : (v, h, w, 3) array of float32
        Unit vectors in the frame of the image.
    reflectance : (v, h, w) array of float32 or None
        0 outside the object.
    """

    range: Float32Array
    directions: Float32Array
    reflectance: Float32Array | None = None

    @property
    def known(self) -> BoolArray:
        """(v, h, w) mask of the object."""
        return self.range > 0

    def points(self) -> Float32Array:
        """(v, h, w, 3) points in the frame of the image, metres."""
        return self.range[..., None] * self.directions


def views_of_cloud(cloud: ObjectCloud, views: int) -> ObjectImages:
    """Return images of an object as scanners around it would see it.

    Virtual scanners stand level with the object's middle at 3 times its bounding radius, the first in line
    with the longer of its horizontal axes, the others at even angles from there. The nearest point of every
    pixel counts; holes between points are closed.

    Parameters
    ----------
    cloud : ObjectCloud
    views : int

    Returns
    -------
    ObjectImages
        64 x 64 pixels each, stretched to the object's own extent.
    """
    points = cloud.points
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    radius = max(float(np.linalg.norm(points - middle, axis=1).max()), 1e-3)
    first = _principal_azimuth(points)
    images = [
        _view(points - middle, cloud.reflectance, first + 2 * np.pi * view / views, DISTANCE_RADII * radius)
        for view in range(views)
    ]
    values = [image.reflectance for image in images if image.reflectance is not None]
    return ObjectImages(
        np.concatenate([image.range for image in images]),
        np.concatenate([image.directions for image in images]),
        np.concatenate(values) if values else None,
    )


def crop_of_scan(scan: Scan, mask: BoolArray) -> ObjectImages:
    """Return the image of an object in a scan, resampled to 64 x 64 pixels.

    Parameters
    ----------
    scan : Scan
    mask : (H, W) array of bool
        Pixels of the object; it may lie across the seam of a full turn.

    Raises
    ------
    ScanError
        If the object has no return, or just one.
    """
    pixels = np.flatnonzero(mask & scan.valid)
    if len(pixels) < 2:
        raise ScanError(f"an object needs at least 2 returns in a scan, got {len(pixels)}")
    return crop_of_pixels(scan, pixels)


def crop_of_pixels(scan: Scan, pixels: NDArray[np.intp]) -> ObjectImages:
    """Return the image of the object that some pixels show, as `crop_of_scan`.

    Parameters
    ----------
    scan : Scan
    pixels : (n,) array of int
        Valid returns, as positions in the flattened grid; at least 2.
    """
    width = scan.shape[1]
    left, top, across, down = (int(side) for side in bounding_box(pixels, width, scan.wraps))
    row, column = np.divmod(pixels, width)
    inside = np.zeros((down, across), np.bool_)
    inside[row - top, (column - left) % width] = True
    columns = np.arange(left, left + across) % width
    window = slice(top, top + down), columns
    rays = scan.directions[window]
    frame = _frame(rays[inside].mean(axis=0).astype(np.float64), scan.up)
    range_m = _resized(scan.range[window], inside)
    values = None if scan.reflectance is None else _resized(scan.reflectance[window], inside)[None]
    large = np.asarray(cv2.resize(rays @ frame.T.astype(np.float32), (SIDE_PX, SIDE_PX)), np.float32)
    large /= np.maximum(np.linalg.norm(large, axis=-1, keepdims=True), np.float32(1e-9))
    return ObjectImages(range_m[None], large[None], values)


def _principal_azimuth(points: NDArray[np.float64]) -> float:
    level = points[:, :2] - points[:, :2].mean(axis=0)
    _, axes = np.linalg.eigh(level.T @ level)
    return float(np.arctan2(axes[1, 1], axes[0, 1]))


def _frame(forward: NDArray[np.float64], up: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the rows right, down, forward."""
    forward = forward / max(float(np.linalg.norm(forward)), 1e-9)
    right = np.cross(forward, up)
    if np.linalg.norm(right) < 1e-6:
        right = np.cross(forward, [0.0, 1.0, 0.0]) + np.cross(forward, [1.0, 0.0, 0.0])
    right = right / np.linalg.norm(right)
    return np.stack([right, np.cross(forward, right), forward])


def _view(
    points: NDArray[np.float64], reflectance: NDArray[np.float64] | None, azimuth: float, distance: float
) -> ObjectImages:
    """Return what a scanner sees at `azimuth` of points around their middle."""
    to_scanner = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
    seen = (points - distance * to_scanner) @ _frame(-to_scanner, np.array([0.0, 0.0, 1.0])).T
    length = np.linalg.norm(seen, axis=1)
    across, down = np.arctan2(seen[:, 0], seen[:, 2]), np.arcsin(seen[:, 1] / length)
    (column, columns), (row, rows) = _pixels(across), _pixels(down)
    far_to_near = np.argsort(-length, kind="stable")
    source = np.full(SIDE_PX * SIDE_PX, -1, np.intp)
    # Written from far to near: the nearest is written last.
    source[(row * SIDE_PX + column)[far_to_near]] = far_to_near
    source, known = _closed(source.reshape(SIDE_PX, SIDE_PX))
    level = np.cos(rows)[:, None]
    rays = np.stack(
        [
            level * np.sin(columns)[None],
            np.repeat(np.sin(rows)[:, None], SIDE_PX, 1),
            level * np.cos(columns)[None],
        ],
        axis=-1,
    )
    values = None if reflectance is None else (reflectance[source] * known).astype(np.float32)[None]
    range_m = (length[source] * known).astype(np.float32)
    return ObjectImages(range_m[None], rays.astype(np.float32)[None], values)


def _pixels(angle: NDArray[np.float64]) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """Return the pixel of every angle along one side, and the angles of the middles of all pixels."""
    low, span = float(angle.min()), max(float(np.ptp(angle)), 1e-6)
    pixel = np.minimum(((angle - low) / span * SIDE_PX).astype(np.intp), SIDE_PX - 1)
    return pixel, low + (np.arange(SIDE_PX) + 0.5) / SIDE_PX * span


def _closed(source: NDArray[np.intp]) -> tuple[NDArray[np.intp], BoolArray]:
    """Close the holes of an image that tells the point of every pixel, -1 for none.

    Returns
    -------
    source : (h, w) array
        The point of the nearest pixel that has one.
    known : (h, w) array of bool
        Pixels with a point, and holes between them.
    """
    pad = int(_MAX_CLOSED_PX) + 2
    taken = np.pad(source >= 0, pad)
    spacing = source.size**0.5 / np.sqrt(np.count_nonzero(taken))
    radius = float(np.clip(CLOSED_SPACINGS * spacing, 1.5, _MAX_CLOSED_PX))
    distance, label = cv2.distanceTransformWithLabels(
        (~taken).astype(np.uint8), cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL
    )
    grown = (np.asarray(distance) <= radius).astype(np.uint8)
    known = taken | (np.asarray(cv2.distanceTransform(grown, cv2.DIST_L2, 5)) > radius)
    label = np.asarray(label, np.intp)
    point = np.zeros(int(label.max()) + 1, np.intp)
    point[label[taken]] = source[source >= 0]
    inner = slice(pad, -pad), slice(pad, -pad)
    return point[label[inner]], known[inner]


def _resized(values: Float32Array, inside: BoolArray) -> Float32Array:
    """Return values of an object at 64 x 64 pixels, without mixing in what is outside."""
    size = (SIDE_PX, SIDE_PX)
    share = np.asarray(cv2.resize(inside.astype(np.float32), size))
    total = np.asarray(cv2.resize(np.where(inside, values, 0).astype(np.float32), size))
    return np.where(share >= 0.5, total / np.maximum(share, np.float32(1e-6)), np.float32(0))
