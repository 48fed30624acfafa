"""Places for things on open ground that is not level."""

from collections.abc import Callable, Iterable

import numpy as np
from numpy.typing import NDArray

from laserimg.simulate.mesh import Mesh
from laserimg.simulate.scenes.placing import Placed, penetration, placed
from laserimg.simulate.things import Thing

REACH_M = 2.2
"""What of a thing is higher than this, as the crown of a tree, stands in nothing's way."""
Height = Callable[[float, float], float]


class Plot:
    """Things put on ground of a given height one after the other, each as the rectangle around its foot.

    Parameters
    ----------
    height_m : callable
        Height of the ground at x and y.
    """

    def __init__(self, height_m: Height) -> None:
        self.height_m = height_m
        self.things: list[Thing] = []
        self._taken: list[Placed] = []
        self._circles = np.empty((0, 3))

    def put(self, thing: Thing, x: float, y: float, yaw_deg: float = 0.0, clear_m: float = 0.1) -> bool:
        """Put a thing there unless it comes nearer than `clear_m` to another; say whether."""
        there = placed(foot_box(thing.mesh, clear_m / 2), x, y, 0.0, yaw_deg)
        if self._hits(there):
            return False
        self._add(there)
        self.things.append(thing.at(x, y, self.height_m(x, y), yaw_deg))
        return True

    def put_first(
        self, thing: Thing, places: Iterable[tuple[float, float, float]], clear_m: float = 0.1
    ) -> bool:
        """Put a thing at the first free place (x, y, yaw in degrees); say whether there was one."""
        return any(self.put(thing, float(x), float(y), float(yaw), clear_m) for x, y, yaw in places)

    def put_near(
        self, rng: np.random.Generator, thing: Thing, host: Thing, away_m: tuple[float, float]
    ) -> bool:
        """Put a thing, turned any way, that far from the sides of another, if one of six places is free."""
        low, high = (f(host.mesh.vertices[:, :2], axis=0) for f in (np.min, np.max))
        places = []
        for _ in range(6):
            at, axis, end = rng.uniform(low, high), int(rng.integers(2)), int(rng.integers(2))
            at[axis] = (low, high)[end][axis] + (2 * end - 1) * rng.uniform(*away_m)
            places.append((at[0], at[1], rng.uniform(0, 360)))
        return self.put_first(thing, places)

    def keep_free(self, x: float, y: float, half_x: float, half_y: float) -> None:
        """Keep things out of a rectangle."""
        corners = np.array([[(-half_x, -half_y, 0.0), (half_x, half_y, 1.0)]])
        self._add(placed(corners, x, y))

    def _hits(self, there: Placed) -> bool:
        x, y, radius = _circle(there)
        away = np.hypot(self._circles[:, 0] - x, self._circles[:, 1] - y)
        near = np.flatnonzero(away < self._circles[:, 2] + radius)
        return any(penetration(there, self._taken[k]) > 0 for k in near)

    def _add(self, there: Placed) -> None:
        self._taken.append(there)
        self._circles = np.concatenate([self._circles, [_circle(there)]])


def foot_box(mesh: Mesh, wider_m: float = 0.0) -> NDArray[np.float64]:
    """Return (1, 2, 3): the rectangle around what is below `REACH_M`, wider on each side, 1 m high."""
    points = mesh.vertices[mesh.vertices[:, 2] < REACH_M]
    low, high = points.min(axis=0) - wider_m, points.max(axis=0) + wider_m
    low[2], high[2] = 0.0, 1.0
    return np.stack([low, high])[None]


def _circle(there: Placed) -> tuple[float, float, float]:
    x, y = there.centre[0, :2]
    return float(x), float(y), float(np.hypot(*there.half[0, :2]))
