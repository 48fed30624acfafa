"""Corridors: doors, windows and glazing along the walls, pillars, radiators, now and then a cabinet."""

from collections.abc import Sequence

import numpy as np

from laserimg.simulate.mesh import pose_at
from laserimg.simulate.objects.carriers import carrier
from laserimg.simulate.objects.clutter import equipment, on_wall, trolley, whiteboard
from laserimg.simulate.objects.desks import table
from laserimg.simulate.objects.devices import printer
from laserimg.simulate.objects.fixtures import column, pipe, plant, radiator
from laserimg.simulate.objects.people import person
from laserimg.simulate.objects.seats import armchair, chair
from laserimg.simulate.objects.storage import cabinet, cardboard_boxes, coat_rack, shelf
from laserimg.simulate.objects.vessels import bucket, drum, some_wastebasket, umbrella_stand
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
from laserimg.simulate.scenes.rooms import BLANK, INSIDE, OUTSIDE, room
from laserimg.simulate.things import Scene

BY_WALL: tuple[tuple[Maker, float], ...] = (
    (radiator, 0.14), (cabinet, 0.16), (long_bench, 0.14), (shelf, 0.06), (plant, 0.08), (pipe, 0.1),
    (coat_rack, 0.05), (chair, 0.07), (armchair, 0.05), (cardboard_boxes, 0.07), (equipment, 0.05),
    (umbrella_stand, 0.03), (table, 0.05), (trolley, 0.04), (printer, 0.02), (whiteboard, 0.03),
    (drum, 0.02),
)  # fmt: skip


def corridor(rng: np.random.Generator, extras: Sequence[Maker] = ()) -> Scene:
    """Return a corridor along x, 8-30 m long, 1.5-3.5 m wide (one in four 3.5-6 m, a foyer), 2.3-3.6 m high.

    Doors on one or both sides, windows or glazing on others; pillars, pilasters and beams in rows, each in
    two or three of five; a wastebasket in three of five. The scanner, 0.35-1.6 m above the floor (the
    corridor scan: 0.36 m), looks along the corridor within 30 degrees. One scene in eight has no labelled
    object. Of the makers `extras` 1-4 things each come too.
    """
    is_labelled = rng.random() > 1 / 8
    width = rng.uniform(1.5, 3.5) if rng.random() < 0.75 else rng.uniform(3.5, 6.0)
    size = (rng.uniform(8, 30), width, rng.uniform(2.3, 3.6))
    long_sides = rng.permutation([INSIDE, rng.choice([INSIDE, OUTSIDE, BLANK])])
    ends = rng.choice([INSIDE, OUTSIDE, BLANK], 2, p=[0.4, 0.25, 0.35])
    sides = (str(ends[0]), str(long_sides[0]), str(ends[1]), str(long_sides[1]))
    walls = room(rng, size, sides, is_labelled=is_labelled)
    floor = Floor((0, 0), size[:2])
    for low, high in walls.keep_free:
        floor.keep_free(low, high)
    scanner_m = rng.uniform(0.35, 1.0) if rng.random() < 0.6 else rng.uniform(1.0, 1.6)
    x, y = size[0] * rng.uniform(0.15, 0.6), width * rng.uniform(0.4, 0.6)
    floor.keep_free((x - 0.5, y - 0.5, 0), (x + 0.5, y + 0.5, 2.2))
    _furnish(rng, floor, size, is_labelled, extras)
    hang_lamps(rng, floor, size)
    support = carrier(rng, scanner_m).at(x, y, 0, rng.uniform(0, 360))
    pose = pose_at(x, y, scanner_m, float(rng.normal(0, 15)))
    above = [ceiling_beams(rng, size)] if rng.random() < 0.4 and size[2] > 2.4 else []
    return Scene((*walls.things, *above, support, *floor.things), (pose,), "corridor")


def _furnish(
    rng: np.random.Generator,
    floor: Floor,
    size: tuple[float, float, float],
    is_labelled: bool,
    extras: Sequence[Maker],
) -> None:
    length, width, height = size
    if width > 2.2 and rng.random() < 0.4:
        pillar, y = column(rng, height), width * rng.choice([0.12, 0.88])
        for x in np.arange(rng.uniform(0.5, 2), length, rng.uniform(2.5, 5)):
            floor.put(pillar, x, y, slack_m=0.1)
    if rng.random() < 0.5:
        pilasters(rng, floor, size)
    put_extras(rng, floor, extras)
    basket = some_wastebasket if is_labelled else bucket
    for _ in range(rng.poisson(1.0)):
        put = floor.put_by_wall if rng.random() < 0.7 else floor.put_beside
        put(rng, basket(rng))
    dense = rng.uniform(0.3, 1.6)
    for _ in range(rng.poisson(dense * length / 2.5)):
        floor.put_by_wall(rng, one_of(rng, BY_WALL))
    for _ in range(rng.poisson(dense * length / 4)):
        floor.put_by_wall(rng, on_wall(rng), gap_m=0.0, jitter_deg=0.0)
    for _ in range(rng.poisson(0.7)):
        floor.put_anywhere(rng, person(rng, "walking" if rng.random() < 0.6 else "standing"))
    for _ in range(rng.poisson(dense * length / 12)):
        floor.put_anywhere(rng, one_of(rng, BY_WALL))
