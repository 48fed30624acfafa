"""Foyers: a wide flight in the middle of a high hall, floor beside it, another hall above it."""

from collections.abc import Sequence

import numpy as np

from laserimg.simulate.materials import Material
from laserimg.simulate.mesh import pose_at
from laserimg.simulate.objects.carriers import carrier
from laserimg.simulate.objects.copies import boxes
from laserimg.simulate.objects.fixtures import column, plant, radiator
from laserimg.simulate.objects.loft import varied
from laserimg.simulate.objects.people import person
from laserimg.simulate.objects.stairs import Flight, flight_size, side_of_stairs, steps
from laserimg.simulate.objects.storage import cabinet, cardboard_boxes, coat_rack
from laserimg.simulate.objects.vessels import bucket
from laserimg.simulate.scenes.furnishing import (
    Maker,
    ceiling_beams,
    hang_lamps,
    long_bench,
    one_of,
    pilasters,
    put_extras,
)
from laserimg.simulate.scenes.placing import Floor
from laserimg.simulate.scenes.rooms import BLANK, INSIDE, OPEN, OUTSIDE, room
from laserimg.simulate.scenes.walls import ceiling, plate, wall
from laserimg.simulate.things import Scene, Thing

THINGS: tuple[tuple[Maker, float], ...] = (
    (radiator, 0.15), (cabinet, 0.15), (plant, 0.2), (coat_rack, 0.1), (cardboard_boxes, 0.1), (bucket, 0.05),
    (long_bench, 0.25),
)  # fmt: skip


def foyer(rng: np.random.Generator, extras: Sequence[Maker] = ()) -> Scene:
    """Return a hall of 5-14 x 5-14 m, 3.5-9 m high; a flight of 6-18 steps, 2-8 m wide, climbs behind it.

    On both sides of the flight the floor goes on or walls close it in; pillars, rails or parapets beside
    it. The scanner is 0.4-1.7 m above the floor, 2-10 m before the first step (the staircase scan: 0.55 m
    and 5 m), and looks to it within 25 degrees. Of the makers `extras` 1-4 things each come too.
    """
    size = (rng.uniform(5, 14), rng.uniform(5, 14), rng.uniform(3.5, 9.0))
    wide = size[1] * (rng.uniform(0.3, 0.7) if rng.random() < 0.7 else rng.uniform(0.7, 0.95))
    flight = flight_size(rng, int(rng.integers(6, 19)), float(np.clip(wide, 2.0, 8.0)))
    size = (*size[:2], max(size[2], flight.height_m + 2.3))
    others = rng.choice([INSIDE, OUTSIDE, BLANK], 3, p=[0.4, 0.3, 0.3])
    walls = room(rng, size, (OPEN, str(others[0]), str(others[1]), str(others[2])))
    floor = Floor((0, 0), size[:2])
    for low, high in walls.keep_free:
        floor.keep_free(low, high)
    middle = size[1] / 2 + rng.uniform(-0.5, 0.5) * (size[1] - flight.width_m) * 0.6
    floor.keep_free((0, middle - flight.width_m / 2, 0), (1.5, middle + flight.width_m / 2, 2.5))
    behind = _behind(rng, size, flight, middle, varied(rng, "plaster", 0.2))
    scanner_m = rng.uniform(0.4, 1.0) if rng.random() < 0.5 else rng.uniform(1.0, 1.7)
    x, y = rng.uniform(2.0, min(size[0] - 0.7, 10.0)), size[1] * rng.uniform(0.25, 0.75)
    floor.keep_free((x - 0.5, y - 0.5, 0), (x + 0.5, y + 0.5, 2.2))
    put_extras(rng, floor, extras)
    _furnish(rng, floor, size)
    heading = np.degrees(np.arctan2(middle - y, -x)) + rng.normal(0, 12)
    support = carrier(rng, scanner_m).at(x, y, 0, rng.uniform(0, 360))
    things = (*walls.things, *behind, support, *floor.things)
    return Scene(things, (pose_at(x, y, scanner_m, heading),), "stairwell")


def _behind(rng, size, flight: Flight, middle: float, stone: Material) -> list[Thing]:
    """The flight with what is beside it, and the upper hall."""
    run, up, wide = flight.run_m, flight.height_m, flight.width_m
    deep, high = rng.uniform(2.5, 12.0), size[2]
    things = [steps(rng, flight, is_open=False, to_floor=True).at(0, middle)]
    kind = str(rng.choice(["rail", "parapet", "parapet"]))
    sides = [s * wide / 2 for s in (-1, 1) if rng.random() < 0.8]
    sides += [0.0] if wide > 3 and rng.random() < 0.3 else []
    things += [
        side_of_stairs(rng, flight, side, "rail" if side == 0 else kind).at(0, middle) for side in sides
    ]
    slab = boxes([(-run - deep / 2, size[1] / 2, 0, deep, size[1], up - 0.005)], stone)
    things.append(Thing("landing", slab))
    reach = run + deep
    things.append(ceiling(rng, (-reach, 0), (0, size[1]), high, stone))
    things.append(plate(rng, (-run, 0), (0, size[1]), 0.0, varied(rng, "tiles", 0.3)))
    things += [
        wall(rng, reach, high, 0.2, stone).at(-reach / 2, y, 0, a) for y, a in ((0, 90), (size[1], -90))
    ]
    things.append(wall(rng, size[1] + 0.4, high, 0.2, stone).at(-reach, size[1] / 2))
    is_closed = rng.random() < 0.4
    for s in (-1, 1):
        edge, end = middle + s * wide / 2, size[1] if s > 0 else 0.0
        if is_closed and abs(end - edge) > 0.1:
            # Blocks up to the ceiling beside the flight.
            block = boxes([(-run / 2, (edge + end) / 2, 0, run, abs(end - edge) - 0.02, high)], stone)
            things.append(Thing("shaft", block))
        elif rng.random() < 0.6:
            things += _pillars(rng, reach, edge + s * 0.4, high, size[1])
    return things


def _pillars(rng: np.random.Generator, reach: float, y: float, high: float, width: float) -> list[Thing]:
    """A row of pillars beside the flight."""
    if not 0.35 < y < width - 0.35:
        return []
    pillar = column(rng, high)
    return [pillar.at(-float(x), y) for x in np.arange(rng.uniform(0.3, 1.5), reach, rng.uniform(2, 4.5))]


def _furnish(rng: np.random.Generator, floor: Floor, size: tuple[float, float, float]) -> None:
    if rng.random() < 0.6:
        pilasters(rng, floor, size)
    if rng.random() < 0.3:
        pillar, y = column(rng, size[2]), size[1] * rng.choice([0.15, 0.85])
        for x in np.arange(rng.uniform(0.5, 2), size[0], rng.uniform(2.5, 5)):
            floor.put(pillar, float(x), y, slack_m=0.1)
    for _ in range(rng.poisson(size[0] * size[1] / 12)):
        floor.put_by_wall(rng, one_of(rng, THINGS))
    for _ in range(rng.poisson(size[0] * size[1] / 40)):
        floor.put_anywhere(rng, one_of(rng, THINGS))
    for _ in range(rng.poisson(0.7)):
        floor.put_anywhere(rng, person(rng, "walking" if rng.random() < 0.6 else "standing"))
    hang_lamps(rng, floor, size)
    if rng.random() < 0.4:
        floor.things.append(ceiling_beams(rng, size))
