"""Planes: exact fits and a seeded consensus search."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from laserimg.errors import ScanError
from laserimg.scan import Float32Array


@dataclass(frozen=True, eq=False, slots=True)
class Plane:
    """All points p with ``normal . p = offset_m``.

    Parameters
    ----------
    normal : (3,) array
        Unit vector.
    offset_m : float
        Distance of the plane from the scanner, along the normal.
    """

    normal: NDArray[np.float64]
    offset_m: float

    def distance(self, points: ArrayLike) -> NDArray:
        """Return the signed distance in metres of (..., 3) points, positive on the normal's side.

        Examples
        --------
        >>> Plane(np.array([0.0, 0.0, 1.0]), -1.5).distance([[4.0, 0.0, -1.0]]).tolist()
        [0.5]
        """
        array = np.asarray(points)
        return array @ self.normal.astype(array.dtype, copy=False) - array.dtype.type(self.offset_m)

    def towards(self, direction: ArrayLike) -> "Plane":
        """Return the same plane with its normal on the side of `direction`."""
        if float(self.normal @ np.asarray(direction)) >= 0:
            return self
        return Plane(-self.normal, -self.offset_m)


def heights_over(plane: Plane, range_m: Float32Array, directions: Float32Array) -> Float32Array:
    """Return the signed distance (H, W) in metres of returns from a plane, without making the points.

    Parameters
    ----------
    plane : Plane
    range_m : (H, W) array of float32
    directions : (H, W, 3) array of float32
    """
    heights = np.asarray(cv2.transform(directions, plane.normal[None].astype(np.float32)), np.float32)
    heights *= range_m
    heights -= np.float32(plane.offset_m)
    return heights


def fit_plane(points: ArrayLike) -> Plane:
    """Return the plane with the least squared distances to the points.

    Parameters
    ----------
    points : (n, 3) array
        Metres.

    Raises
    ------
    ScanError
        If there are fewer than 3 points.
    """
    array = np.asarray(points, np.float64)
    if array.ndim != 2 or array.shape[1] != 3 or len(array) < 3:
        raise ScanError(f"a plane needs at least 3 points, got {array.shape}")
    centre = array.mean(axis=0)
    centred = array - centre
    _, vectors = np.linalg.eigh(centred.T @ centred)
    normal = vectors[:, 0]
    return Plane(normal, float(normal @ centre))


def planes_through(points: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return unit normals (n, 3) and offsets (n,) of planes through triples of points (n, 3, 3).

    The normal of a triple on one line is zero.
    """
    normals = np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0])
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = np.divide(normals, length, out=np.zeros_like(normals), where=length > 1e-9)
    return normals, np.einsum("ij,ij->i", normals, points[:, 0])


def refit_plane(plane: Plane, points: NDArray, tolerance_m: float, rounds: int = 3) -> Plane:
    """Return `plane` refitted to the points within `tolerance_m` of it, a few times over."""
    for _ in range(rounds):
        near = np.abs(plane.distance(points)) <= tolerance_m
        if int(near.sum()) < 3:
            break
        plane = fit_plane(points[near]).towards(plane.normal)
    return plane
