"""Surfaces through rings of points, and materials that vary from object to object."""

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from laserimg.simulate.materials import MATERIALS, Material
from laserimg.simulate.mesh import Mesh


def varied(rng: np.random.Generator, name: str, spread: float = 0.25) -> Material:
    """Return a material by name, its reflectance scaled by 1 +- `spread`, kept within 0.02..0.95."""
    material = MATERIALS[name]
    scaled = material.reflectance * rng.uniform(1 - spread, 1 + spread)
    return replace(material, reflectance=float(np.clip(scaled, 0.02, 0.95)))


def faces_mesh(vertices: ArrayLike, faces: ArrayLike, materials: list[Material], which: ArrayLike) -> Mesh:
    """Return the mesh of (n, 3) vertices and (m, 3) faces, `which` (m,) choosing each face's material."""
    values = np.array([(m.reflectance, m.specular, m.transmission) for m in materials], np.float32)
    reflectance, specular, transmission = values[np.asarray(which, int)].T
    points = np.asarray(vertices, np.float64)
    return Mesh(points, np.asarray(faces, np.int32), reflectance, specular, transmission)


def quads_mesh(quads: ArrayLike, materials: list[Material], which: ArrayLike) -> Mesh:
    """Return the mesh of (k, 4, 3) quadrilaterals, corners in turn, `which` (k,) as in `faces_mesh`."""
    corners = np.asarray(quads, np.float64)
    first = 4 * np.arange(len(corners))[:, None]
    faces = np.concatenate([first + np.array(half) for half in ([0, 1, 2], [0, 2, 3])])
    return faces_mesh(corners.reshape(-1, 3), faces, materials, np.tile(np.asarray(which, int), 2))


def lofted(rings: ArrayLike, materials: list[Material], which: ArrayLike = 0) -> Mesh:
    """Return the closed surface through (k, n, 3) rings of points.

    Parameters
    ----------
    rings : (k, n, 3) array
        Cross-sections with corresponding points; first and last are closed by fans.
    materials : list of Material
        The first one also covers both ends.
    which : (k - 1, n) array of int
        Material of the strip from ring i to i + 1 between points j and j + 1.
    """
    points = np.asarray(rings, np.float64)
    k, n, _ = points.shape
    here = np.arange((k - 1) * n).reshape(k - 1, n)
    beside = np.roll(here, -1, axis=1)
    sides = np.stack([here, beside, beside + n, here, beside + n, here + n], -1).reshape(-1, 3)
    ring, turned = np.arange(n), np.roll(np.arange(n), -1)
    foot = np.stack([np.full(n, k * n), turned, ring], -1)
    head = np.stack([np.full(n, k * n + 1), ring, turned], -1) + np.array([0, (k - 1) * n, (k - 1) * n])
    vertices = np.concatenate([points.reshape(-1, 3), points[[0, -1]].mean(axis=1)])
    chosen = np.repeat(np.broadcast_to(which, (k - 1, n)).ravel(), 2)
    faces = np.concatenate([sides, foot, head])
    return faces_mesh(vertices, faces, materials, np.append(chosen, np.zeros(2 * n, int)))
