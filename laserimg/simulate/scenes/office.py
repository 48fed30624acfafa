"""Offices: desks with chairs and wastebaskets, furniture along the walls, clutter between."""

from collections.abc import Sequence

import numpy as np

from laserimg.simulate.mesh import pose_at
from laserimg.simulate.objects.carriers import carrier
from laserimg.simulate.objects.clutter import (
    bag,
    cables,
    equipment,
    on_wall,
    screen,
    stack,
    trolley,
    whiteboard,
)  # fmt: skip
from laserimg.simulate.objects.copies import boxes
from laserimg.simulate.objects.desks import pedestal, table
from laserimg.simulate.objects.devices import computer, floor_lamp, printer, robot
from laserimg.simulate.objects.fixtures import column, pipe, plant, radiator
from laserimg.simulate.objects.people import person
from laserimg.simulate.objects.seats import armchair, chair, office_chair, stool
from laserimg.simulate.objects.storage import cabinet, cardboard_boxes, coat_rack, shelf, suitcase
from laserimg.simulate.objects.vessels import bucket, drum, some_wastebasket, umbrella_stand
from laserimg.simulate.scenes.furnishing import Maker, hang_lamps, one_of, put_extras, put_somewhere
from laserimg.simulate.scenes.placing import Floor
from laserimg.simulate.scenes.rooms import BLANK, INSIDE, OUTSIDE, room
from laserimg.simulate.scenes.workplaces import workplaces
from laserimg.simulate.things import Scene, Thing

BY_WALL: tuple[tuple[Maker, float], ...] = (
    (shelf, 0.28), (cabinet, 0.2), (radiator, 0.1), (table, 0.08), (coat_rack, 0.07), (plant, 0.06),
    (armchair, 0.05), (printer, 0.03), (pipe, 0.03), (equipment, 0.06), (whiteboard, 0.04),
)  # fmt: skip
ANYWHERE: tuple[tuple[Maker, float], ...] = (
    (cardboard_boxes, 0.15), (robot, 0.1), (equipment, 0.17), (plant, 0.07), (drum, 0.05), (suitcase, 0.04),
    (computer, 0.05), (pedestal, 0.05), (bucket, 0.04), (umbrella_stand, 0.02), (stool, 0.03), (chair, 0.04),
    (floor_lamp, 0.03), (table, 0.03), (bag, 0.05), (stack, 0.05), (trolley, 0.05), (cables, 0.06),
    (screen, 0.04), (whiteboard, 0.03),
)  # fmt: skip
SCANNER_RADIUS_M = 0.55


def office(rng: np.random.Generator, extras: Sequence[Maker] = ()) -> Scene:
    """Return an office of 3.5-14 x 3-9 m, 2.4-3.4 m high, full of desks, with the scanner amid them.

    A desk for each 3.1-8.3 square metres, most with an office chair; wastebaskets under desks, beside them
    and other furniture, in corners or by walls. The scanner is 0.6-1.7 m above the floor (the office scan:
    1.29 m). One scene in eight has no labelled object but perhaps a person. Of the makers `extras` 1-4
    things each come too.
    """
    is_labelled = rng.random() > 1 / 8
    length, width = rng.uniform(3.5, 14.0), rng.uniform(3.0, 9.0)
    size = (length, width, rng.uniform(2.4, 3.4))
    sides = tuple(
        str(side) for side in rng.permutation([INSIDE, OUTSIDE, rng.choice([INSIDE, BLANK]), BLANK])
    )
    walls = room(rng, size, (sides[0], sides[1], sides[2], sides[3]), is_labelled=is_labelled)
    floor = Floor((0, 0), (length, width))
    for low, high in walls.keep_free:
        floor.keep_free(low, high)
    scanner_m = rng.uniform(0.6, 1.7)
    place = np.array([length, width]) * rng.uniform(0.25, 0.75, 2)
    x, y = (float(value) for value in place)
    floor.keep_free((*(place - SCANNER_RADIUS_M), 0.0), (*(place + SCANNER_RADIUS_M), 2.2))
    _furnish(rng, floor, size, is_labelled, extras)
    hang_lamps(rng, floor, size)
    things = [*walls.things, carrier(rng, scanner_m).at(x, y, 0, rng.uniform(0, 360)), *floor.things]
    pose = pose_at(x, y, scanner_m, _heading_deg(rng, place, (length / 2, width / 2)))
    return Scene(tuple(things), (pose,), "office")


def _furnish(
    rng: np.random.Generator,
    floor: Floor,
    size: tuple[float, float, float],
    is_labelled: bool,
    extras: Sequence[Maker],
) -> None:
    """Partitions first, then workplaces, then walls, then what stands about."""
    area, height = size[0] * size[1], size[2]
    if area > 25 and rng.random() < 0.5:
        floor.put_anywhere(rng, _partition(rng, height), 6)
    for _ in range(int(rng.integers(0, 2 + int(area > 40)))):
        floor.put_anywhere(rng, column(rng, height), 4)
    dense = rng.uniform(0.6, 1.6)
    workplaces(rng, floor, max(1, round(dense * area / 5)), is_labelled=is_labelled)
    put_extras(rng, floor, extras)
    basket = some_wastebasket if is_labelled else bucket
    for _ in range(rng.poisson(0.8)):
        put_somewhere(rng, floor, basket(rng))
    for _ in range(rng.poisson(dense * (3 + area / 4))):
        floor.put_by_wall(rng, one_of(rng, BY_WALL))
    for _ in range(rng.poisson(dense * (1.5 + area / 8))):
        floor.put_by_wall(rng, on_wall(rng), gap_m=0.0, jitter_deg=0.0)
    for _ in range(rng.poisson(dense * (3 + area / 3))):
        put = floor.put_anywhere if rng.random() < 0.5 else floor.put_beside
        put(rng, one_of(rng, ANYWHERE))
    for _ in range(rng.poisson(0.5)):
        floor.put_anywhere(rng, person(rng, "standing"))
    if is_labelled and rng.random() < 0.5:
        floor.put_anywhere(rng, office_chair(rng))


def _partition(rng: np.random.Generator, height: float) -> Thing:
    """A stub of wall or a corner block up to the ceiling, or a screen 1.2-1.9 m high."""
    if rng.random() < 0.4:
        return Thing(
            "partition",
            boxes([(0, 0, 0, 0.06, rng.uniform(1.0, 2.5), rng.uniform(1.2, 1.9))], "fabric_light"),
        )
    return Thing(
        "partition", boxes([(0, 0, 0, rng.uniform(0.12, 1.5), rng.uniform(1.0, 2.5), height)], "plaster")
    )


def _heading_deg(rng: np.random.Generator, place, target) -> float:
    """Towards the target, give or take 60 degrees: a tilting scanner sees half of the room only."""
    away = np.subtract(target, place)
    return float(np.degrees(np.arctan2(away[1], away[0])) + rng.normal(0, 60))
