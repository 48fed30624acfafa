"""Padded and moulded plates: seats, backrests, monitor shells."""

import numpy as np
from numpy.typing import NDArray

from laserimg.simulate.materials import Material
from laserimg.simulate.mesh import Mesh
from laserimg.simulate.objects.loft import lofted


def cushion(
    size_xyz: tuple[float, float, float], material: Material, squareness: float = 4.0, taper: float = 1.0
) -> Mesh:
    """Return a plate with rounded outline and edges that lies on z = 0, centred in x and y.

    Parameters
    ----------
    size_xyz : tuple of float
        Metres.
    material : Material
    squareness : float
        Exponent of the superellipse of the outline: 2 is an ellipse, 10 nearly a rectangle.
    taper : float
        Width along y at the +x end over that at the -x end.
    """
    x, y, z = size_xyz
    outline = _superellipse(squareness) * [x / 2, y / 2]
    outline[:, 1] *= 1 + (taper - 1) * (outline[:, 0] / x + 0.5)
    inset = min(0.4 * z, 0.25 * min(x, y))
    inner = outline * (1 - inset / np.array([x / 2, y / 2]))
    level = np.array([0, 0.25, 0.75, 1]) * z
    flat = (inner, outline, outline, inner)
    return lofted([np.c_[xy, np.full(len(xy), h)] for xy, h in zip(flat, level, strict=True)], [material])


def bent(mesh: Mesh, along: int, towards: int, depth_m: float, half_m: float) -> Mesh:
    """Return the mesh shifted along axis `towards` by `depth_m` times (position along `along` / half)^2."""
    vertices = mesh.vertices.copy()
    vertices[:, towards] += depth_m * (vertices[:, along] / half_m) ** 2
    return Mesh(vertices, mesh.faces, mesh.reflectance, mesh.specular, mesh.transmission)


def tilted(mesh: Mesh, degrees: float, at_xz: tuple[float, float] = (0.0, 0.0)) -> Mesh:
    """Return the mesh turned about y through (x, z), positive leaning towards +x."""
    cos, sin = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    turn = np.eye(4)
    turn[:3, :3] = [[cos, 0, sin], [0, 1, 0], [-sin, 0, cos]]
    centre = np.array([at_xz[0], 0, at_xz[1]])
    turn[:3, 3] = centre - turn[:3, :3] @ centre
    return mesh.moved(turn)


def _superellipse(squareness: float, points: int = 20) -> NDArray[np.float64]:
    angle = 2 * np.pi * (np.arange(points) + 0.5) / points
    xy = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return xy * (np.abs(xy) ** squareness).sum(axis=1, keepdims=True) ** (-1 / squareness)
