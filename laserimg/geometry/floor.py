"""The floor: the plane below the scanner that heights are measured from."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from laserimg.geometry.planes import Plane, heights_over, planes_through, refit_plane
from laserimg.scan import Scan

MAX_TILT_RAD = float(np.radians(15))
MIN_SHARE = 0.02
MAX_RMS_M = 0.05
# Returns this near to the plane belong to it: twice the largest rms that a floor may have.
TOLERANCE_M = 2 * MAX_RMS_M

_TRIALS = 300
_SAMPLE = 2000
_SEARCHED = 30_000


@dataclass(frozen=True, eq=False, slots=True)
class Floor:
    """A floor as `contracts.md` defines it: near horizontal, below the scanner, well supported.

    Parameters
    ----------
    plane : Plane
        Its normal points up.
    share : float
        Share of the valid returns that lie within `TOLERANCE_M` of it.
    rms_m : float
        Root mean square distance of those returns.
    tilt_deg : float
        Angle between its normal and up.
    """

    plane: Plane
    share: float
    rms_m: float
    tilt_deg: float

    @property
    def height_below_m(self) -> float:
        """How far the floor lies below the scanner, along the floor's normal."""
        return -self.plane.offset_m

    @property
    def clearance_m(self) -> float:
        """Height over the floor below which a return is taken for floor."""
        return max(0.05, 3 * self.rms_m)

    def height_of(self, points: NDArray) -> NDArray:
        """Return the height in metres of (..., 3) points over the floor."""
        return self.plane.distance(points)


def find_floor(scan: Scan) -> Floor | None:
    """Return the floor of a scan, or None if no plane is good enough.

    The plane within 15 degrees of horizontal, below the scanner, with most returns, refitted;
    used only if it holds at least 2 % of the valid returns with an rms of 0.05 m or less. The
    search draws triples of returns with a fixed seed, so a scan has one floor.

    Examples
    --------
    >>> elevation = np.radians(np.arange(-10.0, -60.0, -2.0))
    >>> azimuth = np.radians(np.arange(45.0, -45.0, -2.0))
    >>> range_m = np.repeat(1.2 / np.sin(-elevation)[:, None], len(azimuth), axis=1)
    >>> floor = find_floor(Scan.from_range_image(range_m, azimuth, elevation))
    >>> round(floor.height_below_m, 3), round(floor.tilt_deg, 3)
    (1.2, 0.0)
    """
    points = _thinned_points(scan)
    below = points[points @ scan.up.astype(np.float32) < 0]
    if len(below) < 3:
        return None
    plane = _best_plane(below, scan.up)
    if plane is None:
        return None
    return _supported(refit_plane(plane, below, TOLERANCE_M), scan)


def _thinned_points(scan: Scan) -> NDArray[np.float32]:
    """Return valid points (n, 3), evenly thinned to at most about `_SEARCHED`."""
    pixels = np.flatnonzero(scan.valid)
    pixels = pixels[:: max(1, len(pixels) // _SEARCHED)]
    return scan.range.ravel()[pixels, None] * scan.directions.reshape(-1, 3)[pixels]


def _supported(plane: Plane, scan: Scan) -> Floor | None:
    """Return the plane as a floor if it is below, level and holds enough of all returns."""
    tilt = float(np.arccos(np.clip(plane.normal @ scan.up, -1, 1)))
    if tilt > MAX_TILT_RAD or plane.offset_m >= 0:
        return None
    valid = scan.valid
    distance = heights_over(plane, scan.range, scan.directions)
    near = valid & (np.abs(distance) <= TOLERANCE_M)
    held = distance[near]
    share = len(held) / int(np.count_nonzero(valid))
    rms = float(np.sqrt(held @ held / len(held))) if len(held) else float("inf")
    good = share >= MIN_SHARE and rms <= MAX_RMS_M
    return Floor(plane, share, rms, float(np.degrees(tilt))) if good else None


def _best_plane(points: NDArray, up: NDArray[np.float64]) -> Plane | None:
    """Draw triples, keep the near-horizontal planes, return the one with most points near it."""
    random = np.random.default_rng(0)
    triples = points[random.integers(0, len(points), (_TRIALS * 4, 3))].astype(np.float64)
    normals, offsets = planes_through(triples)
    sign = np.where(normals @ up < 0, -1.0, 1.0)
    normals, offsets = normals * sign[:, None], offsets * sign
    level = (normals @ up >= np.cos(MAX_TILT_RAD)) & (offsets < 0)
    normals, offsets = normals[level][:_TRIALS], offsets[level][:_TRIALS]
    if len(normals) == 0:
        return None
    sample = points[random.permutation(len(points))[:_SAMPLE]].astype(np.float64)
    near = np.abs(sample @ normals.T - offsets) <= TOLERANCE_M / 2
    best = int(np.argmax(near.sum(axis=0)))
    return Plane(normals[best], float(offsets[best]))
