"""The ground of streets: crowned road, kerbs, pavements, gardens, all on a slope."""

from dataclasses import dataclass

import numpy as np

from laserimg.simulate.materials import MATERIALS
from laserimg.simulate.objects.loft import quads_mesh
from laserimg.simulate.things import Thing

HALF_LENGTH_M = 30.0
BEHIND_M = 6.0
CROWN = 0.025


@dataclass(frozen=True, slots=True)
class Street:
    """Sizes of a street along x.

    Parameters
    ----------
    edge_m, pave_m, garden_m : float
        Half width of the road, width of each pavement, depth of the gardens behind it (0: none).
    kerb_m, slope : float
        Height of the kerb, rise of the street along x.
    lane_m : float
        Where the middle of each lane is.
    is_across : tuple of bool
        Whether cars park across, at y < 0 and at y > 0.
    is_grass : bool
        Whether a strip of grass is behind the pavement.
    """

    edge_m: float
    pave_m: float
    garden_m: float
    kerb_m: float
    slope: float
    lane_m: float
    is_across: tuple[bool, bool]
    is_grass: bool

    @staticmethod
    def drawn(rng: np.random.Generator) -> "Street":
        """Return sizes as `laserimg.simulate.scenes.street.street` says."""
        lane = rng.uniform(2.75, 3.25)
        across = (bool(rng.random() < 0.25), bool(rng.random() < 0.15))
        strips = [rng.uniform(4.8, 5.3) if turned else rng.uniform(2.0, 2.3) for turned in across]
        is_narrow = not any(across) and rng.random() < 0.5
        edge = 2.1 + 1.75 if is_narrow else lane + max(strips)
        garden = rng.uniform(2.0, 6.0) if rng.random() < 0.4 else 0.0
        slope = 0.0 if rng.random() < 0.3 else rng.uniform(-0.04, 0.04)
        kerb = rng.uniform(0.08, 0.15)
        lane_m = 0.0 if is_narrow else lane / 2
        return Street(edge, rng.uniform(1.8, 4.5), garden, kerb, slope, lane_m, across, garden > 0)

    @property
    def pave_height_m(self) -> float:
        """Height of the pavement over the crown of the road: the kerb stands on the road's edge."""
        return self.kerb_m - CROWN * self.edge_m

    def height_m(self, x: float, y: float) -> float:
        """Return the height of the ground."""
        return self.slope * x + (self.pave_height_m if abs(y) > self.edge_m else -CROWN * abs(y))


def street_ground(rng: np.random.Generator, place: Street) -> Thing:
    """Return strips along the street: road and pavement rough by 2 mm, grass by 1-3 cm."""
    edge, back = place.edge_m, place.edge_m + place.pave_m
    lawn = np.linspace(0, BEHIND_M, 13 if place.is_grass else 3)[1:]
    half = np.concatenate([
        np.linspace(0, edge, 6), [edge + 0.001, edge + place.pave_m / 2, back], back + lawn,
    ])  # fmt: skip
    y = np.concatenate([-half[:0:-1], half])
    x = np.linspace(-HALF_LENGTH_M, HALF_LENGTH_M, 121 if place.is_grass else 61)
    raised, grass = np.abs(y) > edge, (np.abs(y) > back + 0.01) & place.is_grass
    rough = np.where(grass, rng.uniform(0.01, 0.03), 0.002)
    z = np.where(raised, place.pave_height_m, -CROWN * np.abs(y)) + place.slope * x[:, None]
    z = z + rng.normal(0, 1, z.shape) * rough
    grid = np.stack([*np.meshgrid(x, y, indexing="ij"), z], -1)
    quads = np.stack([grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]], 2).reshape(-1, 4, 3)
    both = raised[:-1] & raised[1:]
    which = np.tile(np.where(grass[:-1] | grass[1:], 2, both.astype(int)), len(x) - 1)
    return Thing("ground", quads_mesh(quads, [MATERIALS[k] for k in ("asphalt", "concrete", "grass")], which))
