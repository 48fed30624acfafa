"""The points of a map: in the world, with class, cluster, brightness and the area each stands for."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from laserimg.geometry.pitch import sample_pitch
from laserimg.normals import normals
from laserimg.scan import BoolArray, Float32Array, Scan

# A picture needs some light: surfaces are lit from above and from the scanner.
_AMBIENT, _LIT = 0.62, 0.38


@dataclass(frozen=True, eq=False, slots=True)
class Cloud:
    """Points (n,) of a map.

    Parameters
    ----------
    points : (n, 3) array of float32
        In the world less `origin`, metres.
    origin : (3,) array of float64
        Worlds may be far from 0, where float32 has no centimetres.
    cluster : (n,) array of int32
        Number of the cluster in the map; 0 for the ground, -1 for loose returns.
    shade : (n,) array of uint8
        Brightness, from the slope of the surface and its reflectance.
    spacing : (n,) array of float32
        Distance of neighbouring returns, metres.
    """

    points: Float32Array
    origin: NDArray[np.float64]
    cluster: NDArray[np.int32]
    shade: NDArray[np.uint8]
    spacing: Float32Array


def joined(clouds: list[Cloud], firsts: list[int]) -> Cloud:
    """Return the clouds of several scans as one, with the origin of the first.

    Parameters
    ----------
    clouds : list of Cloud
    firsts : list of int
        The number that each scan's first cluster has in the map.
    """
    origin = clouds[0].origin
    points = [cloud.points + (cloud.origin - origin).astype(np.float32) for cloud in clouds]
    number = [
        np.where(cloud.cluster > 0, cloud.cluster + np.int32(first - 1), cloud.cluster)
        for cloud, first in zip(clouds, firsts, strict=True)
    ]
    return Cloud(
        np.concatenate(points),
        origin,
        np.concatenate(number),
        np.concatenate([cloud.shade for cloud in clouds]),
        np.concatenate([cloud.spacing for cloud in clouds]),
    )


def cloud_of(scan: Scan, cluster: NDArray[np.int32], shade: NDArray[np.uint8]) -> Cloud:
    """Return the valid returns of a scan as points of a map.

    Parameters
    ----------
    scan : Scan
    cluster : (H, W) array of int32
    shade : (H, W) array of uint8
    """
    pixels = np.flatnonzero(scan.valid)
    _, across, up = sample_pitch(scan, np.ones(scan.shape, np.bool_))
    pitch = np.float32(np.sqrt(np.median(across) * np.median(up)))
    range_m = scan.range.ravel()[pixels]
    points = range_m[:, None] * scan.directions.reshape(-1, 3)[pixels]
    turn = scan.world_from_scan[:3, :3].T.astype(np.float32)
    return Cloud(
        np.asarray(points @ turn, np.float32),
        scan.world_from_scan[:3, 3].copy(),
        cluster.ravel()[pixels],
        shade.ravel()[pixels],
        range_m * pitch,
    )


def shades(scan: Scan) -> NDArray[np.uint8]:
    """Return how bright every pixel of a scan is drawn, (H, W): 255 is the full colour of its class."""
    facing = normals(scan)
    up = scan.up.astype(np.float32)
    # Light from above and a little from the side, so that walls around a corner differ.
    light = up + np.float32(0.45) * _level(scan, 0) + np.float32(0.25) * _level(scan, 1)
    lit = np.abs(facing @ (light / np.linalg.norm(light)).astype(np.float32))
    if scan.reflectance is not None:
        lit = np.float32(0.55) * lit + np.float32(0.45) * even_reflectance(scan.reflectance, scan)
    return np.rint(255 * (_AMBIENT + _LIT * np.clip(lit, 0, 1))).astype(np.uint8)


def even_reflectance(reflectance: Float32Array, scan: Scan) -> Float32Array:
    """Return reflectance from 0 to 1 with its trend over range taken out.

    Many sensors give what comes back, which falls with the range squared; others correct for it. The
    trend of log reflectance over log range is fitted, whatever it is.
    """
    valid: BoolArray = scan.valid & (reflectance > 0)
    if int(valid.sum()) < 3:
        return np.full(scan.shape, 0.5, np.float32)
    far = np.asarray(cv2.log(np.maximum(scan.range, np.float32(0.05))), np.float32)
    value = np.asarray(cv2.log(np.maximum(reflectance, np.float32(1e-12))), np.float32)
    step = max(1, int(valid.sum()) // 20_000)
    x, y = far[valid][::step].astype(np.float64), value[valid][::step].astype(np.float64)
    slope = float(np.cov(x, y)[0, 1] / max(np.var(x), 1e-9))
    even = value - np.float32(slope) * far
    low, high = np.percentile(y - slope * x, [3, 97])
    share = (even - np.float32(low)) / np.float32(max(high - low, 1e-6))
    return np.where(valid, np.clip(share, 0, 1), np.float32(0)).astype(np.float32)


def _level(scan: Scan, axis: int) -> Float32Array:
    """A level unit vector of the world, in the frame of the scan."""
    return scan.world_from_scan[axis, :3].astype(np.float32)
