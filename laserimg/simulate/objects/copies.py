"""Many boxes, rods or balls as one mesh, without a Python loop over them."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from laserimg.simulate.materials import MATERIALS, Material
from laserimg.simulate.mesh import Mesh, box, cylinder, ellipsoid
from laserimg.simulate.objects.loft import faces_mesh

Row = tuple[float, ...]
Materials = Material | str | list[Material]

BOX = box((1, 1, 1), "wood")
_ROD = cylinder(1, 1, "wood", 8)
_BALL = ellipsoid((1, 1, 1), "wood", 1)


def boxes(rows: ArrayLike, materials: Materials, which: ArrayLike = 0) -> Mesh:
    """Return upright boxes.

    Parameters
    ----------
    rows : (k, 6) array
        Centre x and y, bottom z, and size along x, y and z, in metres.
    materials : Material, name, or list of Material
    which : (k,) array of int
        Index into a list of materials for each box.
    """
    values = np.asarray(rows, np.float64).reshape(-1, 6)
    return copies(BOX, values[:, 3:, None] * np.eye(3), values[:, :3], materials, which)


def rods(ends: ArrayLike, radius_m: ArrayLike, materials: Materials, which: ArrayLike = 0) -> Mesh:
    """Return closed cylinders of 8 segments between the two points of each row of a (k, 2, 3) array."""
    start, end = np.moveaxis(np.asarray(ends, np.float64).reshape(-1, 2, 3), 1, 0)
    axis = end - start
    z = axis / np.linalg.norm(axis, axis=1, keepdims=True)
    x = np.cross(z, np.eye(3)[np.argmin(np.abs(z), axis=1)])
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    radius = np.broadcast_to(np.asarray(radius_m, np.float64), len(start))[:, None]
    linear = np.stack([radius * x, radius * np.cross(z, x), axis], axis=2)
    return copies(_ROD, linear, start, materials, which)


def balls(centres: ArrayLike, radii: ArrayLike, materials: Materials, which: ArrayLike = 0) -> Mesh:
    """Return ellipsoids of 8 segments at (k, 3) centres with (k, 3) radii along x, y and z."""
    places = np.asarray(centres, np.float64).reshape(-1, 3)
    sizes = np.broadcast_to(np.asarray(radii, np.float64), places.shape)
    return copies(_BALL, sizes[:, :, None] * np.eye(3), places, materials, which)


def copies(
    template: Mesh, linear: NDArray, shift: NDArray, materials: Materials, which: ArrayLike = 0
) -> Mesh:
    """Return k copies of a mesh, each turned and stretched by a (k, 3, 3) matrix, then shifted."""
    kinds = _listed(materials)
    points = np.einsum("kij,nj->kni", linear, template.vertices) + shift[:, None]
    count, corners = points.shape[:2]
    faces = template.faces + corners * np.arange(count)[:, None, None]
    chosen = np.repeat(np.broadcast_to(which, count), len(template.faces))
    return faces_mesh(points.reshape(-1, 3), faces.reshape(-1, 3), kinds, chosen)


def _listed(materials: Materials) -> list[Material]:
    if isinstance(materials, list):
        return materials
    return [MATERIALS[materials] if isinstance(materials, str) else materials]
