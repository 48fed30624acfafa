"""Walls with holes, floors and ceilings, all a little uneven."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from laserimg.simulate.materials import Material
from laserimg.simulate.objects.loft import quads_mesh
from laserimg.simulate.things import Thing

WAVE_M = 0.004
"""Amplitude of each of two waves of floors and walls; together with the noise they stay within 1 cm."""


@dataclass(frozen=True, slots=True)
class Hole:
    """An opening in a wall.

    Parameters
    ----------
    middle_m, bottom_m : float
        Centre along the wall from its middle, and height of the lower edge.
    width_m, height_m : float
    """

    middle_m: float
    bottom_m: float
    width_m: float
    height_m: float

    @property
    def sides(self) -> tuple[float, float]:
        """Ends along the wall."""
        return self.middle_m - self.width_m / 2, self.middle_m + self.width_m / 2


def wall(
    rng: np.random.Generator,
    length_m: float,
    height_m: float,
    thick_m: float,
    material: Material,
    holes: Sequence[Hole] = (),
) -> Thing:
    """Return a wall along y, centred, whose front is the plane x = 0 and whose back is x = -thick_m."""
    y = _breaks(-length_m / 2, length_m / 2, [side for hole in holes for side in hole.sides])
    z = _breaks(0.0, height_m, [edge for h in holes for edge in (h.bottom_m, h.bottom_m + h.height_m)], 0.8)
    grid_y, grid_z = np.meshgrid(y, z, indexing="ij")
    middle_y, middle_z = (y[1:] + y[:-1]) / 2, (z[1:] + z[:-1]) / 2
    solid = np.ones((len(y) - 1, len(z) - 1), bool)
    for hole in holes:
        inside_y = (middle_y > hole.sides[0]) & (middle_y < hole.sides[1])
        inside_z = (middle_z > hole.bottom_m) & (middle_z < hole.bottom_m + hole.height_m)
        solid &= ~(inside_y[:, None] & inside_z)
    front = np.stack([_uneven(rng, grid_y, grid_z), grid_y, grid_z], -1)
    back = np.stack([-thick_m + _uneven(rng, grid_y, grid_z), grid_y, grid_z], -1)
    quads = [_cells(front)[solid.ravel()], _cells(back)[solid.ravel()][:, ::-1]]
    quads += [_reveal(hole, thick_m) for hole in holes]
    quads.append(_rim(length_m, height_m, thick_m))
    all_quads = np.concatenate(quads)
    return Thing("wall", quads_mesh(all_quads, [material], np.zeros(len(all_quads), int)))


def plate(
    rng: np.random.Generator, low: Sequence[float], high: Sequence[float], z: float, material: Material
) -> Thing:
    """Return an uneven floor at z between two corners (x, y)."""
    x, y = np.meshgrid(_breaks(low[0], high[0]), _breaks(low[1], high[1]), indexing="ij")
    quads = _cells(np.stack([x, y, z + _uneven(rng, x, y)], -1))
    return Thing("floor", quads_mesh(quads, [material], np.zeros(len(quads), int)))


def ceiling(
    rng: np.random.Generator, low: Sequence[float], high: Sequence[float], z: float, material: Material
) -> Thing:
    """Return a ceiling at z between two corners (x, y), facing down."""
    mesh = plate(rng, low, high, z, material).mesh
    mirror = np.diag([1.0, 1.0, -1.0, 1.0])
    mirror[2, 3] = 2 * z
    return Thing("ceiling", mesh.moved(mirror))


def _breaks(low: float, high: float, edges: Sequence[float] = (), step: float = 0.6) -> NDArray[np.float64]:
    regular = np.linspace(low, high, max(2, round((high - low) / step) + 1))
    away = [value for value in regular[1:-1] if all(abs(value - edge) > 0.05 for edge in edges)]
    within = np.clip(np.asarray([*edges], float), low, high)
    return np.unique(np.concatenate([[low, high], away, within]))


def _uneven(rng: np.random.Generator, u: NDArray, v: NDArray) -> NDArray[np.float64]:
    total = rng.normal(0, 0.0006, u.shape)
    for _ in range(2):
        (a, b), phase = 2 * np.pi / rng.uniform(1.5, 6, 2), rng.uniform(0, 6)
        total += WAVE_M * rng.random() * np.sin(a * u + b * v + phase)
    return total


def _cells(grid: NDArray) -> NDArray[np.float64]:
    corners = [grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]]
    return np.stack(corners, 2).reshape(-1, 4, 3)


def _reveal(hole: Hole, thick: float) -> NDArray[np.float64]:
    """Four sides that look into the hole."""
    (a, b), low, high = hole.sides, hole.bottom_m, hole.bottom_m + hole.height_m
    x0, x1 = -thick, 0.0
    corners = [(a, low), (b, low), (b, high), (a, high)]
    return np.array(
        [
            [(x1, *p), (x1, *q), (x0, *q), (x0, *p)]
            for p, q in zip(corners, corners[1:] + corners[:1], strict=True)
        ]
    )


def _rim(length: float, height: float, thick: float) -> NDArray[np.float64]:
    """The two ends and the top."""
    y, x0, x1 = length / 2, -thick, 0.0
    return np.array(
        [
            [(x1, y, 0), (x0, y, 0), (x0, y, height), (x1, y, height)],
            [(x0, -y, 0), (x1, -y, 0), (x1, -y, height), (x0, -y, height)],
            [(x1, -y, height), (x1, y, height), (x0, y, height), (x0, -y, height)],
        ]
    )
