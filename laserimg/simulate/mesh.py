"""Triangle meshes with optical properties for each face, and the primitives objects are made of."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from laserimg.simulate.materials import MATERIALS, Material


@dataclass(frozen=True, eq=False, slots=True)
class Mesh:
    """Triangles, counter-clockwise seen from outside.

    Parameters
    ----------
    vertices : (n, 3) array of float64
        Metres.
    faces : (m, 3) array of int32
    reflectance, specular, transmission : (m,) arrays of float32
        Shares in 0..1, as in `Material`.
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int32]
    reflectance: NDArray[np.float32]
    specular: NDArray[np.float32]
    transmission: NDArray[np.float32]

    def moved(self, matrix: ArrayLike) -> "Mesh":
        """Return the mesh moved by a 4x4 matrix; a mirroring one turns the faces over."""
        pose = np.asarray(matrix, np.float64)
        faces = self.faces if np.linalg.det(pose[:3, :3]) > 0 else self.faces[:, ::-1]
        return replace(self, vertices=self.vertices @ pose[:3, :3].T + pose[:3, 3], faces=faces)

    def at(self, x: float, y: float, z: float = 0.0, yaw_deg: float = 0.0) -> "Mesh":
        """Return the mesh turned about z by `yaw_deg`, then shifted."""
        return self.moved(pose_at(x, y, z, yaw_deg))

    @property
    def extents(self) -> NDArray[np.float64]:
        """(3,) metres along x, y and z."""
        return np.ptp(self.vertices, axis=0)


def pose_at(x: float, y: float, z: float = 0.0, yaw_deg: float = 0.0) -> NDArray[np.float64]:
    """Return the 4x4 matrix that turns about z, then shifts."""
    cos, sin = np.cos(np.radians(yaw_deg)), np.sin(np.radians(yaw_deg))
    return np.array([[cos, -sin, 0, x], [sin, cos, 0, y], [0, 0, 1, z], [0, 0, 0, 1]])


def mesh_of(vertices: ArrayLike, faces: ArrayLike, material: Material | str) -> Mesh:
    """Return a mesh of one material."""
    kind = MATERIALS[material] if isinstance(material, str) else material
    triangles = np.asarray(faces, np.int32).reshape(-1, 3)
    shares = (kind.reflectance, kind.specular, kind.transmission)
    values = (np.full(len(triangles), share, np.float32) for share in shares)
    return Mesh(np.asarray(vertices, np.float64).reshape(-1, 3), triangles, *values)


def box(size_xyz: Sequence[float], material: Material | str) -> Mesh:
    """Return a box that stands on z = 0, centred in x and y."""
    x, y, z = size_xyz
    return prism([(-x / 2, -y / 2), (x / 2, -y / 2), (x / 2, y / 2), (-x / 2, y / 2)], z, material)


def prism(polygon_xy: ArrayLike, height_m: float, material: Material | str) -> Mesh:
    """Return a simple polygon, in either order, raised from z = 0 to `height_m`."""
    xy = np.asarray(polygon_xy, np.float64)
    if _area(xy) < 0:
        xy = xy[::-1]
    n = len(xy)
    low, high = np.c_[xy, np.zeros(n)], np.c_[xy, np.full(n, height_m)]
    i = np.arange(n)
    j = (i + 1) % n
    cap = _ears(xy)
    faces = np.r_[np.c_[i, j, j + n], np.c_[i, j + n, i + n], cap[:, ::-1], cap + n]
    return mesh_of(np.r_[low, high], faces, material)


def cylinder(
    radius_m: float,
    height_m: float,
    material: Material | str,
    segments: int = 24,
    top_radius_m: float | None = None,
    open_top: bool = False,
) -> Mesh:
    """Return a cylinder or frustum on z = 0; one with an open top has an inner wall and floor too."""
    top = radius_m if top_radius_m is None else top_radius_m
    profile = [(0.0, 0.0), (radius_m, 0.0), (top, height_m)]
    if open_top:
        thin = min(0.003, radius_m / 4, top / 4, height_m / 4)
        profile += [(top - thin, height_m), (radius_m - thin, thin), (0.0, thin)]
    else:
        profile.append((0.0, height_m))
    return lathe(profile, material, segments)


def lathe(profile_rz: ArrayLike, material: Material | str, segments: int = 24) -> Mesh:
    """Return a profile of (radius, z) turned about z; going up the outside faces outwards."""
    profile = np.asarray(profile_rz, np.float64)
    angle = 2 * np.pi * np.arange(segments) / segments
    r, z = profile[:, :1], profile[:, 1:]
    vertices = np.stack([r * np.cos(angle), r * np.sin(angle), z + 0 * angle], axis=-1)
    return mesh_of(vertices.reshape(-1, 3), _ring_faces(profile[:, 0] > 0, segments), material)


def ellipsoid(radii_xyz: Sequence[float], material: Material | str, subdivisions: int = 2) -> Mesh:
    """Return an ellipsoid around the origin, of 4 * 2**subdivisions segments."""
    segments = 4 * 2**subdivisions
    angle = np.linspace(-np.pi / 2, np.pi / 2, segments // 2 + 1)
    radius = np.cos(angle)
    radius[[0, -1]] = 0
    return lathe(np.c_[radius, np.sin(angle)], material, segments).moved(np.diag([*radii_xyz, 1.0]))


def tube(points: ArrayLike, radius_m: float, material: Material | str, segments: int = 8) -> Mesh:
    """Return a closed cylinder along each piece of a line of points in space."""
    line = np.asarray(points, np.float64)
    return joined([_rod(start, end, radius_m, material, segments) for start, end in pairwise(line)])


def sheet(corners: ArrayLike, material: Material | str) -> Mesh:
    """Return a flat quadrangle; its front sees the corners counter-clockwise."""
    return mesh_of(corners, [(0, 1, 2), (0, 2, 3)], material)


def joined(meshes: Sequence[Mesh]) -> Mesh:
    """Return the meshes as one."""
    starts = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes[:-1])])
    faces = [mesh.faces + start for mesh, start in zip(meshes, starts, strict=True)]
    names = ("reflectance", "specular", "transmission")
    values = (np.concatenate([getattr(mesh, name) for mesh in meshes]) for name in names)
    vertices = np.concatenate([mesh.vertices for mesh in meshes])
    return Mesh(vertices, np.concatenate(faces).astype(np.int32), *values)


def _rod(start: NDArray, end: NDArray, radius_m: float, material: Material | str, segments: int) -> Mesh:
    length = float(np.linalg.norm(end - start))
    z = (end - start) / length
    x = np.cross(z, np.eye(3)[np.argmin(np.abs(z))])
    x /= np.linalg.norm(x)
    pose = np.eye(4)
    pose[:3] = np.c_[x, np.cross(z, x), z, start]
    return cylinder(radius_m, length, material, segments).moved(pose)


def _ring_faces(wide: NDArray[np.bool_], segments: int) -> NDArray[np.int64]:
    """Return faces between successive rings; a ring of radius 0 gives one triangle a segment, not two."""
    i = np.arange(segments)
    j = (i + 1) % segments
    faces = []
    for k in range(len(wide) - 1):
        low, high = k * segments, (k + 1) * segments
        if wide[k]:
            faces.append(np.c_[low + i, low + j, high + j])
        if wide[k + 1]:
            faces.append(np.c_[low + i, high + j, high + i])
    return np.concatenate(faces)


def _area(xy: NDArray) -> float:
    x, y = xy.T
    return float(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2


def _ears(xy: NDArray) -> NDArray[np.int64]:
    """Return triangles of a counter-clockwise simple polygon by cutting ears."""
    left, triangles = list(range(len(xy))), []
    while len(left) > 3:
        k = next((k for k in range(len(left)) if _is_ear(xy, left, k)), 0)
        triangles.append((left[k - 1], left[k], left[(k + 1) % len(left)]))
        del left[k]
    return np.array([*triangles, left])


def _is_ear(xy: NDArray, left: list[int], k: int) -> bool:
    corners = (left[k - 1], left[k], left[(k + 1) % len(left)])
    if _area(xy[list(corners)]) <= 0:
        return False
    a, b, c = xy[list(corners)]
    others = xy[[i for i in left if i not in corners]]
    sides = [_left_of(p, q, others) for p, q in ((a, b), (b, c), (c, a))]
    return not (np.array(sides) >= 0).all(axis=0).any()


def _left_of(start: NDArray, end: NDArray, points: NDArray) -> NDArray:
    along, offset = end - start, points - start
    return along[0] * offset[:, 1] - along[1] * offset[:, 0]
