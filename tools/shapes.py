"""Solids that a ray can hit: convex bodies, frustums and ellipsoids, cast with plain NumPy.

A shape works in its own frame and answers one question: where along each ray is the first hit,
with which normal, on which of its smooth faces. `Part` puts it into a parent's frame and gives
it a material; `raycast` finds the nearest of many parts.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


class Hits(NamedTuple):
    """First hits of n rays: distance (inf: none), outward normal (n, 3), number of the smooth face."""

    distance: Array
    normal: Array
    face: NDArray[np.intp]


class Shape(Protocol):
    """A solid in its own frame."""

    faces: int

    @property
    def corners(self) -> Array:
        """(8, 3) corners of a box around the solid."""
        ...

    def is_planar(self, face: int) -> bool:
        """Tell whether a face is a plane."""
        ...

    def hit(self, origin: Array, directions: Array) -> Hits:
        """Return the first hits of the rays from `origin` (3,) along unit `directions` (n, 3)."""
        ...


@dataclass(frozen=True, eq=False)
class Convex:
    """The points where every ``normals @ p <= offsets``; seen from inside, its walls are hit.

    One half-space is endless ground; six make a box.
    """

    normals: Array
    offsets: Array
    corners: Array

    @property
    def faces(self) -> int:
        """One face per plane."""
        return len(self.offsets)

    def is_planar(self, face: int) -> bool:
        """Every face is a plane."""
        return True

    def hit(self, origin: Array, directions: Array) -> Hits:
        """Clip every ray with every plane."""
        slope = directions @ self.normals.T
        room = self.offsets - self.normals @ origin
        with np.errstate(divide="ignore", invalid="ignore"):
            at = room / slope
        inside = bool((room > 0).all())
        if inside:
            at[~(slope > 0)] = np.inf
            face = at.argmin(axis=1)
            distance = at[np.arange(len(at)), face]
        else:
            enter = np.where(slope < 0, at, -np.inf)
            leave = np.where(slope > 0, at, np.inf).min(axis=1)
            leave[((slope == 0) & (room < 0)).any(axis=1)] = -np.inf
            face = enter.argmax(axis=1)
            distance = enter[np.arange(len(at)), face]
            distance = np.where((distance > 0) & (distance <= leave), distance, np.inf)
        return Hits(distance, self.normals[face], face)


@dataclass(frozen=True, eq=False)
class Frustum:
    """A cylinder or cut-off cone standing on z = 0; with `open_top` one sees its inner wall.

    Faces: 0 side, 1 bottom, 2 top.
    """

    bottom_radius: float
    top_radius: float
    height: float
    open_top: bool = False
    faces: int = field(default=3, init=False)

    @property
    def corners(self) -> Array:
        """Corners of the box around it."""
        radius = max(self.bottom_radius, self.top_radius)
        return box_corners([-radius, -radius, 0], [radius, radius, self.height])

    def is_planar(self, face: int) -> bool:
        """Bottom and top are planes, the side is round."""
        return face > 0

    def hit(self, origin: Array, directions: Array) -> Hits:
        """Take the nearest of the two crossings of the side and those of the end discs."""
        ways = [*self._side(origin, directions), self._disc(origin, directions, 0.0, self.bottom_radius)]
        if not self.open_top:
            ways.append(self._disc(origin, directions, self.height, self.top_radius))
        distances = np.stack(ways)
        way = distances.argmin(axis=0)
        distance = distances[way, np.arange(len(directions))]
        face = np.array([0, 0, 1, 2])[way]
        return Hits(distance, self._normal(origin, directions, distance, face), face)

    def _side(self, origin: Array, directions: Array) -> list[Array]:
        taper = (self.top_radius - self.bottom_radius) / self.height
        radius = self.bottom_radius + taper * origin[2]
        drift = taper * directions[:, 2]
        a = directions[:, 0] ** 2 + directions[:, 1] ** 2 - drift**2
        b = directions[:, :2] @ origin[:2] - radius * drift
        c = origin[0] ** 2 + origin[1] ** 2 - radius**2
        with np.errstate(divide="ignore", invalid="ignore"):
            root = np.sqrt(b * b - a * c)
            roots = [(-b - root) / a, (-b + root) / a]
        return [np.where(self._on_side(origin, directions, at), at, np.inf) for at in roots]

    def _on_side(self, origin: Array, directions: Array, at: Array) -> NDArray[np.bool_]:
        with np.errstate(invalid="ignore"):
            z = origin[2] + at * directions[:, 2]
            return (at > 0) & (z >= 0) & (z <= self.height)

    @staticmethod
    def _disc(origin: Array, directions: Array, z: float, radius: float) -> Array:
        with np.errstate(divide="ignore", invalid="ignore"):
            at = (z - origin[2]) / directions[:, 2]
            x, y = origin[:2, None] + at * directions[:, :2].T
            return np.where((at > 0) & (x * x + y * y <= radius * radius), at, np.inf)

    def _normal(self, origin: Array, directions: Array, distance: Array, face: NDArray) -> Array:
        at = np.where(np.isfinite(distance), distance, 0.0)
        point = origin + at[:, None] * directions
        taper = (self.top_radius - self.bottom_radius) / self.height
        radial = np.hypot(point[:, 0], point[:, 1])
        side = np.stack([point[:, 0], point[:, 1], -taper * radial], axis=1)
        side /= np.maximum(np.linalg.norm(side, axis=1, keepdims=True), 1e-12)
        ends = np.zeros_like(side)
        ends[:, 2] = np.where(face == 1, -1.0, 1.0)
        return np.where((face == 0)[:, None], side, ends)


@dataclass(frozen=True, eq=False)
class Ellipsoid:
    """An ellipsoid, or sphere, around the origin of its frame."""

    radii: tuple[float, float, float]
    faces: int = field(default=1, init=False)

    @property
    def corners(self) -> Array:
        """Corners of the box around it."""
        return box_corners(-np.array(self.radii), self.radii)

    def is_planar(self, face: int) -> bool:
        """It is round."""
        return False

    def hit(self, origin: Array, directions: Array) -> Hits:
        """Solve the quadratic in the frame where it is a unit sphere."""
        start, along = origin / self.radii, directions / self.radii
        a = np.einsum("ij,ij->i", along, along)
        b = along @ start
        with np.errstate(invalid="ignore"):
            distance = (-b - np.sqrt(b * b - a * (start @ start - 1))) / a
            distance = np.where(distance > 0, distance, np.inf)
        at = np.where(np.isfinite(distance), distance, 0.0)
        normal = (start + at[:, None] * along) / self.radii
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        return Hits(distance, normal, np.zeros(len(directions), np.intp))


def box_corners(low: ArrayLike, high: ArrayLike) -> Array:
    """Return the (8, 3) corners of an upright box."""
    ends = np.stack([np.asarray(low, float), np.asarray(high, float)])
    return np.array([[ends[i, 0], ends[j, 1], ends[k, 2]] for i in (0, 1) for j in (0, 1) for k in (0, 1)])


def box(length: float, width: float, height: float) -> Convex:
    """Return a box around the z axis, standing on z = 0; faces +x -x +y -y top bottom."""
    normals = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], float)
    offsets = np.array([length / 2, length / 2, width / 2, width / 2, height, 0])
    low, high = [-length / 2, -width / 2, 0], [length / 2, width / 2, height]
    return Convex(normals, offsets, box_corners(low, high))


def prism(profile: ArrayLike, width: float) -> Convex:
    """Return a convex profile of (x, z) corners, counter-clockwise seen from -y, drawn out along y.

    Faces: one per side of the profile in order, then +y and -y.
    """
    outline = np.asarray(profile, float)
    side = np.roll(outline, -1, axis=0) - outline
    normals = np.stack([side[:, 1], np.zeros(len(side)), -side[:, 0]], axis=1)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    offsets = normals[:, 0] * outline[:, 0] + normals[:, 2] * outline[:, 1]
    low, high = outline.min(axis=0), outline.max(axis=0)
    return Convex(
        np.concatenate([normals, [[0, 1, 0], [0, -1, 0]]]),
        np.concatenate([offsets, [width / 2, width / 2]]),
        box_corners([low[0], -width / 2, low[1]], [high[0], width / 2, high[1]]),
    )


def ground(normal: ArrayLike = (0.0, 0.0, 1.0)) -> Convex:
    """Return endless ground through the origin of its frame."""
    direction = np.asarray(normal, float) / np.linalg.norm(normal)
    far = 1e4
    return Convex(direction[None], np.zeros(1), box_corners([-far] * 3, [far] * 3))


def pose(
    x: float = 0, y: float = 0, z: float = 0, yaw: float = 0, pitch: float = 0, roll: float = 0
) -> Array:
    """Return the (4, 4) matrix of a place in metres and turns in degrees: roll, then pitch, then yaw."""
    cy, cp, cr = np.cos(np.radians([yaw, pitch, roll]))
    sy, sp, sr = np.sin(np.radians([yaw, pitch, roll]))
    about_z = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    about_y = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    about_x = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    matrix = np.eye(4)
    matrix[:3, :3] = about_z @ about_y @ about_x
    matrix[:3, 3] = x, y, z
    return matrix


@dataclass(frozen=True, eq=False)
class Part:
    """A shape at its place in a parent's frame, with its material.

    `reflectance` is one value, or one per face; a face of reflectance 0 gives no return (a mirror or
    a windscreen, which also hides what is behind it).
    """

    shape: Shape
    pose: Array = field(default_factory=pose)
    reflectance: float | Sequence[float] = 0.5

    def moved(self, parent: Array) -> "Part":
        """Return the part in the frame in which its parent stands at `parent`."""
        return Part(self.shape, parent @ self.pose, self.reflectance)

    @property
    def corners(self) -> Array:
        """(8, 3) corners of the box around the shape, in the parent's frame."""
        return self.shape.corners @ self.pose[:3, :3].T + self.pose[:3, 3]

    def face_reflectance(self) -> Array:
        """(faces,) reflectance of each face."""
        return np.broadcast_to(np.asarray(self.reflectance, float), (self.shape.faces,))

    def hit(self, directions: Array) -> Hits:
        """Return the first hits of rays from the origin of the parent's frame."""
        turn = self.pose[:3, :3]
        hits = self.shape.hit(-self.pose[:3, 3] @ turn, directions @ turn)
        return hits._replace(normal=hits.normal @ turn.T)

    def in_reach(self, directions: Array) -> NDArray[np.intp]:
        """Return the rays that pass the ball around the shape: most rays miss most parts."""
        middle = self.corners.mean(axis=0)
        radius, away = np.linalg.norm(self.corners - middle, axis=1).max(), np.linalg.norm(middle)
        if away <= radius:
            return np.arange(len(directions))
        return np.flatnonzero(directions @ (middle / away) >= np.sqrt(1 - (radius / away) ** 2) - 1e-9)


class Cast(NamedTuple):
    """What n rays hit first: distance (inf: nothing), normal facing the scanner, part and face."""

    distance: Array
    normal: Array
    part: NDArray[np.intp]
    face: NDArray[np.intp]


def raycast(parts: Sequence[Part], directions: Array) -> Cast:
    """Return the nearest hit of rays from the origin over all parts.

    Parameters
    ----------
    parts : sequence of Part
    directions : (n, 3) array of unit vectors
    """
    count = len(directions)
    cast = Cast(
        np.full(count, np.inf), np.zeros((count, 3)), np.full(count, -1, np.intp), np.zeros(count, np.intp)
    )
    for number, part in enumerate(parts):
        rays = part.in_reach(directions)
        hits = part.hit(directions[rays])
        nearer = hits.distance < cast.distance[rays]
        won = rays[nearer]
        cast.distance[won] = hits.distance[nearer]
        cast.normal[won] = hits.normal[nearer]
        cast.part[won] = number
        cast.face[won] = hits.face[nearer]
    away = np.einsum("ij,ij->i", cast.normal, directions) > 0
    cast.normal[away] *= -1
    return cast
