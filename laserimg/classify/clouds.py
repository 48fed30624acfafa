"""The points of one object, and the stray points among them."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from laserimg.errors import ScanError

MIN_POINTS = 10
# Longer than any house of a street; in millimetres a wastebasket is.
MAX_SIDE_M = 300.0
# Voxels that touch, also at a corner, hold together; parts with less than this share are stray. One
# point of 2218 doubled the box of a sign.
VOXEL_M = 0.4
MIN_SHARE = 0.02


@dataclass(frozen=True, eq=False, slots=True)
class ObjectCloud:
    """The points of one object.

    Parameters
    ----------
    points : (n, 3) array of float64
        Metres, z up; any origin.
    reflectance : (n,) array of float64, optional
        The sensor's own values.

    Raises
    ------
    ScanError
        If the shapes differ, fewer than 10 points are finite, or they reach over more than 300 m.

    Examples
    --------
    >>> ObjectCloud(np.zeros((3, 3)))
    Traceback (most recent call last):
    laserimg.errors.ScanError: an object needs at least 10 points, got 3
    """

    points: NDArray[np.float64]
    reflectance: NDArray[np.float64] | None = None

    def __post_init__(self) -> None:
        points = np.asarray(self.points, np.float64)
        if points.ndim != 2 or points.shape[1] != 3:
            raise ScanError(f"points must be (n, 3), got {points.shape}")
        known = np.isfinite(points).all(axis=1)
        if int(known.sum()) < MIN_POINTS:
            raise ScanError(f"an object needs at least {MIN_POINTS} points, got {int(known.sum())}")
        # Without the ends: a stray point far away is taken out later.
        largest = float(np.diff(np.quantile(points[known], (MIN_SHARE, 1 - MIN_SHARE), axis=0), axis=0).max())
        if largest > MAX_SIDE_M:
            raise ScanError(
                f"the points reach over {largest:.0f} m, an object over {MAX_SIDE_M:.0f} at most: "
                "are they in millimetres (--scale 0.001)?"
            )
        if self.reflectance is not None:
            values = np.asarray(self.reflectance, np.float64)
            if values.shape != (len(points),):
                raise ScanError(f"reflectance must be ({len(points)},), got {values.shape}")
            object.__setattr__(self, "reflectance", np.nan_to_num(values, posinf=0, neginf=0)[known])
        object.__setattr__(self, "points", points[known])

    def kept(self, mask: NDArray[np.bool_]) -> Self:
        """Return the object with the points of a mask only."""
        return type(self)(self.points[mask], None if self.reflectance is None else self.reflectance[mask])

    def without_strays(self) -> Self:
        """Return the object without the small parts that lie apart from the rest.

        Examples
        --------
        >>> line = np.linspace([0, 0, 0], [0, 0, 3], 100)
        >>> len(ObjectCloud(np.concatenate([line, [[5, 0, 0]]])).without_strays().points)
        100
        """
        voxel = np.floor((self.points - self.points.min(axis=0)) / VOXEL_M)
        places, inverse = np.unique(voxel, axis=0, return_inverse=True)
        touching = KDTree(places).query_pairs(1.8, output_type="ndarray")
        edges = coo_array((np.ones(len(touching)), (touching[:, 0], touching[:, 1])), (len(places),) * 2)
        part = connected_components(edges, directed=False)[1][inverse.ravel()]
        share = np.bincount(part) / len(part)
        return self.kept((share >= min(MIN_SHARE, share.max()))[part])
