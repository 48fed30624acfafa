"""Straight stairs: a flight starts at x = 0 and climbs towards -x, so that its front faces +x."""

from dataclasses import dataclass, replace

import numpy as np

from laserimg.simulate.materials import Material
from laserimg.simulate.mesh import Mesh, joined
from laserimg.simulate.objects.copies import BOX, boxes, copies, rods
from laserimg.simulate.objects.loft import varied
from laserimg.simulate.things import Thing

SIDES = ("none", "rail", "parapet")


@dataclass(frozen=True, slots=True)
class Flight:
    """Sizes of a flight in metres.

    Parameters
    ----------
    count : int
        Steps; the last one is level with the floor above.
    rise_m, going_m, width_m : float
    """

    count: int
    rise_m: float
    going_m: float
    width_m: float

    @property
    def run_m(self) -> float:
        """Length seen from above."""
        return self.count * self.going_m

    @property
    def height_m(self) -> float:
        """From the lower to the upper floor."""
        return self.count * self.rise_m


def flight_size(rng: np.random.Generator, count: int | None = None, width_m: float | None = None) -> Flight:
    """Return a flight of 3-18 steps, 0.14-0.19 m high, 0.24-0.36 m deep, 2 rises + going 0.59-0.65 m.

    Limits of DIN 18065; widths 0.8-3.2 m (0.8 m is its minimum in homes). Wider flights, as in foyers, are
    gentler: 0.12-0.16 m high, 0.29-0.38 m deep (the staircase scan: 0.126 and 0.31 m).
    """
    steps = count or (int(rng.integers(3, 8)) if rng.random() < 0.3 else int(rng.integers(8, 19)))
    rise = rng.uniform(0.14, 0.19)
    going = float(np.clip(rng.uniform(0.59, 0.65) - 2 * rise, 0.24, 0.36))
    if (width_m or 0) > 3.2:
        rise, going = rng.uniform(0.12, 0.16), rng.uniform(0.29, 0.38)
    return Flight(steps, rise, going, width_m or rng.uniform(0.8, 2.0) + rng.choice([0, 0, 1.2]))


def stairs(rng: np.random.Generator) -> Thing:
    """Return a flight without rails, around the origin: closed, or of treads on stringers (1 in 3)."""
    size = flight_size(rng)
    return steps(rng, size, is_open=rng.random() < 1 / 3).at(size.run_m / 2, 0)


def steps(rng: np.random.Generator, size: Flight, *, is_open: bool, to_floor: bool | None = None) -> Thing:
    """Return the steps of a flight, label stairs.

    Parameters
    ----------
    rng : Generator
    size : Flight
    is_open : bool
        Treads on two stringers or one beam, without risers.
    to_floor : bool, optional
        Closed steps are solid down to z = 0 instead of having a soffit along the slope; drawn by default.
    """
    stone = varied(rng, str(rng.choice(["concrete", "wood", "tiles"])), 0.3)
    x, level = -(np.arange(size.count) + 0.5) * size.going_m, (np.arange(size.count) + 1) * size.rise_m
    nosing, thick = rng.uniform(0, 0.03), rng.uniform(0.03, 0.06)
    full = np.ones(size.count)
    treads = np.stack(
        [
            x + nosing / 2,
            0 * x,
            level - thick,
            (size.going_m + nosing) * full,
            size.width_m * full,
            thick * full,
        ],
        1,
    )
    if is_open:
        return Thing("stairs", joined([boxes(treads, stone), _stringers(rng, size, thick)]), "stairs")
    solid = rng.random() < 0.5 if to_floor is None else to_floor
    low = np.zeros(size.count) if solid else np.maximum(level - 2 * size.rise_m - 0.1, 0)
    blocks = np.stack(
        [x, 0 * x, low, size.going_m * full, (size.width_m - 0.01) * full, level - low - 0.005], 1
    )
    return Thing("stairs", boxes(np.concatenate([treads, blocks]), stone), "stairs")


def _stringers(rng: np.random.Generator, size: Flight, thick: float) -> Mesh:
    metal = varied(rng, str(rng.choice(["metal_painted", "wood", "concrete"])), 0.3)
    deep = rng.uniform(0.15, 0.3)
    if rng.random() < 0.4:
        return _slope(size, [0.0], rng.uniform(0.12, 0.3), -thick - deep, deep, metal)
    side = size.width_m / 2 + rng.choice([-0.1, 0.02])
    return _slope(size, [-side, side], rng.uniform(0.03, 0.06), -0.6 * deep - thick / 2, deep, metal)


def side_of_stairs(rng: np.random.Generator, size: Flight, y: float, kind: str = "rail") -> Thing:
    """Return a handrail on posts or a sloping parapet at y beside a flight; it has no label.

    Handrails 0.80-1.00 m above the nosings (DIN 18065: 0.80-1.15), bars at most 0.12 m apart or none.
    """
    high = rng.uniform(0.85, 1.0)
    if kind == "parapet":
        stone = varied(rng, "plaster", 0.2)
        return Thing("parapet", _slope(size, [y], rng.uniform(0.08, 0.2), -0.3, high + 0.3, stone))
    metal = varied(rng, str(rng.choice(["metal_painted", "metal_bare", "wood"])), 0.3)
    every = float(rng.choice([0.12, 2 * size.going_m, 3 * size.going_m]))
    x = -np.linspace(0.05, size.run_m - 0.05, max(2, round(size.run_m / every)))
    z = (-x / size.going_m) * size.rise_m
    foot, head = np.c_[x, np.full(len(x), y), z], np.c_[x, np.full(len(x), y), z + high]
    radius = rng.uniform(0.018, 0.03)
    rails = [(head[0], head[-1])]
    if every > 0.2:
        rails += [(foot[0] + [0, 0, f * high], foot[-1] + [0, 0, f * high]) for f in (0.35, 0.65)]
    posts = rods(np.stack([foot, head], 1), 0.008 if every < 0.2 else 0.016, metal)
    return Thing("handrail", joined([posts, rods(rails, [radius, 0.01, 0.01][: len(rails)], metal)]))


def _slope(
    size: Flight, sides: list[float], wide: float, low: float, high: float, material: Material
) -> Mesh:
    """Upright slabs along the flight from `low` above its nosings, `high` metres tall, cut off at z = 0."""
    shear = np.array([[-size.run_m, 0, 0], [0, -wide, 0], [size.height_m, 0, high]])
    middle = [(-size.run_m / 2, y, size.height_m / 2 + low + size.rise_m / 2) for y in sides]
    slabs = copies(BOX, np.repeat(shear[None], len(sides), 0), np.array(middle), material)
    return replace(slabs, vertices=np.maximum(slabs.vertices, [-np.inf, -np.inf, 0.0]))
