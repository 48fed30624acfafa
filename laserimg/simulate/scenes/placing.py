"""Places for things on a floor without one standing in another."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from laserimg.simulate.mesh import Mesh
from laserimg.simulate.things import Thing

MAX_PARTS = 60
"""A thing of more separate parts (a full shelf, a plant) counts as one box."""


def part_boxes(mesh: Mesh) -> NDArray[np.float64]:
    """Return the (k, 2, 3) lowest and highest corners of a mesh's separate parts, in its own frame.

    `laserimg.simulate.mesh.joined` keeps a part's vertices together, so parts are runs of vertices that
    no face reaches across.
    """
    low, high = mesh.faces.min(axis=1), mesh.faces.max(axis=1)
    depth = np.zeros(len(mesh.vertices) + 1, int)
    np.add.at(depth, low + 1, 1)
    np.subtract.at(depth, high + 1, 1)
    starts = np.flatnonzero(np.cumsum(depth)[:-1] == 0)
    pair = np.minimum.reduceat(mesh.vertices, starts), np.maximum.reduceat(mesh.vertices, starts)
    if len(starts) > MAX_PARTS:
        pair = pair[0].min(axis=0, keepdims=True), pair[1].max(axis=0, keepdims=True)
    return np.stack(pair, axis=1)


@dataclass(frozen=True, eq=False, slots=True)
class Placed:
    """Boxes that are turned about z together.

    Parameters
    ----------
    centre, half : (k, 3) arrays
        In the world, and half sizes in the frame of the thing.
    yaw_rad : float
    """

    centre: NDArray[np.float64]
    half: NDArray[np.float64]
    yaw_rad: float

    @property
    def corners_xy(self) -> NDArray[np.float64]:
        """(k, 4, 2) corners seen from above."""
        signs = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
        return self.centre[:, None, :2] + (signs * self.half[:, None, :2]) @ _turn(self.yaw_rad).T


def placed(boxes: NDArray, x: float, y: float, z: float = 0.0, yaw_deg: float = 0.0) -> Placed:
    """Return `part_boxes` of a thing turned about z by `yaw_deg`, then shifted."""
    return _placed(boxes.mean(axis=1), (boxes[:, 1] - boxes[:, 0]) / 2, x, y, z, yaw_deg)


def _placed(middle: NDArray, half: NDArray, x: float, y: float, z: float, yaw_deg: float) -> Placed:
    centre = middle + np.array([x, y, z])
    yaw_rad = float(np.radians(yaw_deg))
    centre[:, :2] += middle[:, :2] @ _turn(yaw_rad).T - middle[:, :2]
    return Placed(centre, half, yaw_rad)


def penetration(first: Placed, second: Placed) -> float:
    """Return how deep any box of one stands in a box of the other, in metres; 0 or less when apart.

    Separating axes: z and the two sides of each of the two frames.
    """
    turn = _turn(first.yaw_rad - second.yaw_rad)
    away = first.centre[:, None] - second.centre[None]
    up = first.half[:, None, 2] + second.half[None, :, 2] - np.abs(away[..., 2])
    in_second = np.abs(away[..., :2] @ _turn(second.yaw_rad))
    in_first = np.abs(away[..., :2] @ _turn(first.yaw_rad))
    one, other = first.half[:, None, :2], second.half[None, :, :2]
    across_second = other + one @ np.abs(turn).T - in_second
    across_first = one + other @ np.abs(turn) - in_first
    return float(np.minimum(np.minimum(across_first, across_second).min(axis=-1), up).max())


class Floor:
    """Things put on a rectangle one after the other.

    Parameters
    ----------
    low_xy, high_xy : sequences of 2 floats
        Corners of the rectangle in metres; no thing reaches outside.
    """

    def __init__(self, low_xy: ArrayLike, high_xy: ArrayLike) -> None:
        self.low, self.high = np.asarray(low_xy, float), np.asarray(high_xy, float)
        self.things: list[Thing] = []
        self._taken: list[Placed] = []
        self._around = np.empty((0, 4))

    def put(
        self, thing: Thing, x: float, y: float, yaw_deg: float = 0.0, z: float = 0.0, slack_m: float = 0.01
    ) -> bool:
        """Put a thing there if it is inside and enters no other by more than `slack_m`; say whether."""
        return self.put_first(thing, [(x, y, yaw_deg)], z, slack_m) is not None

    def put_first(
        self,
        thing: Thing,
        places: Iterable[tuple[float, float, float]],
        z: float = 0.0,
        slack_m: float = 0.01,
    ) -> tuple[float, float, float] | None:
        """Put a thing, as `put` does, at the first free place (x, y, yaw in degrees); return it or None."""
        boxes = part_boxes(thing.mesh)
        radius = float(np.hypot(*np.abs(boxes[..., :2]).max(axis=(0, 1))))
        middle, half = boxes.mean(axis=1), (boxes[:, 1] - boxes[:, 0]) / 2
        for x, y, yaw_deg in places:
            # Things mostly fail by their neighbours' circles and boxes: the exact test comes last.
            there = _placed(middle, half, x, y, z, yaw_deg)
            if self._is_inside(there, slack_m) and not self._hits(
                there, (x, y), radius + thing.clear_m, slack_m
            ):
                self._add(there)
                self.things.append(thing.at(x, y, z, yaw_deg))
                return x, y, yaw_deg
        return None

    def keep_free(self, low: ArrayLike, high: ArrayLike) -> None:
        """Keep things out of the box between two corners (3,)."""
        self._add(_box_between(low, high))

    def is_free(self, low: ArrayLike, high: ArrayLike) -> bool:
        """Say whether nothing is in the box between two corners (3,)."""
        box = _box_between(low, high)
        return all(penetration(box, other) <= 0 for other in self._taken)

    def put_anywhere(self, rng: np.random.Generator, thing: Thing, tries: int = 12) -> bool:
        """Put a thing at a random place, turned any way, if one of `tries` is free."""
        xy, yaw = rng.uniform(self.low, self.high, (tries, 2)), rng.uniform(0, 360, tries)
        return self.put_first(thing, zip(xy[:, 0], xy[:, 1], yaw, strict=True)) is not None

    def put_by_wall(
        self,
        rng: np.random.Generator,
        thing: Thing,
        gap_m: float = 0.02,
        jitter_deg: float = 2.0,
        tries: int = 8,
    ) -> tuple[float, float, float] | None:
        """Put a thing with its back (-x) to a wall; return x, y and yaw in degrees, or None."""
        depth = -float(thing.mesh.vertices[:, 0].min()) + gap_m
        side = rng.integers(4, size=tries)
        normal = np.array([(1, 0), (0, 1), (-1, 0), (0, -1)])[side]
        wall = np.where(side[:, None] < 2, self.low, self.high)
        xy = np.where(normal != 0, wall + normal * depth, rng.uniform(self.low, self.high, (tries, 2)))
        yaw = 90.0 * side + rng.normal(0, jitter_deg, tries)
        return self.put_first(thing, zip(xy[:, 0], xy[:, 1], yaw, strict=True), slack_m=0.03)

    def put_in_corner(self, rng: np.random.Generator, thing: Thing) -> bool:
        """Put a thing into one of the four corners, if one is free."""
        half = np.abs(thing.mesh.vertices[:, :2]).max() + rng.uniform(0.01, 0.1)
        x, y = (rng.permutation(pair) for pair in np.stack([self.low + half, self.high - half], 1))
        corners = [(float(a), float(b), float(rng.uniform(0, 360))) for a in x for b in y]
        return self.put_first(thing, corners) is not None

    def put_beside(self, rng: np.random.Generator, thing: Thing, tries: int = 10) -> bool:
        """Put a thing 0-0.2 m beside what stands here already, if one of `tries` places is free."""
        if not len(self._around):
            return self.put_anywhere(rng, thing, tries)
        host = self._around[rng.integers(len(self._around), size=tries)]
        xy = rng.uniform(host[:, :2], host[:, 2:])
        axis, is_high = rng.integers(2, size=tries), rng.integers(2, size=tries)
        away = float(np.abs(thing.mesh.vertices[:, :2]).max()) + rng.uniform(0, 0.2, tries)
        each = np.arange(tries)
        xy[each, axis] = host[each, 2 * is_high + axis] + (2 * is_high - 1) * away
        return self.put_first(thing, zip(*xy.T, rng.uniform(0, 360, tries), strict=True)) is not None

    def _is_inside(self, there: Placed, slack_m: float) -> bool:
        corners = there.corners_xy
        low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
        return bool((low >= self.low - slack_m).all() and (high <= self.high + slack_m).all())

    def _hits(self, there: Placed, at: tuple[float, float], radius: float, slack_m: float) -> bool:
        low, high = np.subtract(at, radius), np.add(at, radius)
        near = (self._around[:, :2] < high).all(axis=1) & (self._around[:, 2:] > low).all(axis=1)
        return any(penetration(there, self._taken[k]) > slack_m for k in np.flatnonzero(near))

    def _add(self, there: Placed) -> None:
        corners = there.corners_xy
        around = np.concatenate([corners.min(axis=(0, 1)), corners.max(axis=(0, 1))])
        self._taken.append(there)
        self._around = np.concatenate([self._around, around[None]])


def _box_between(low: ArrayLike, high: ArrayLike) -> Placed:
    return placed(np.stack([np.asarray(low, float), np.asarray(high, float)])[None], 0, 0)


def _turn(angle_rad: float) -> NDArray[np.float64]:
    cos, sin = np.cos(angle_rad), np.sin(angle_rad)
    return np.array([[cos, -sin], [sin, cos]])
