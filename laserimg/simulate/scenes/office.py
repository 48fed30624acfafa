"""Offices: desks with chairs and wastebaskets, furniture along the walls, clutter between."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from laserimg.simulate.mesh import joined, pose_at
from laserimg.simulate.objects.carriers import carrier
from laserimg.simulate.objects.copies import boxes
from laserimg.simulate.objects.desks import desk, pedestal, table
from laserimg.simulate.objects.devices import computer, floor_lamp, printer, robot
from laserimg.simulate.objects.fixtures import column, pipe, plant, radiator
from laserimg.simulate.objects.people import person
from laserimg.simulate.objects.seats import armchair, chair, office_chair, stool
from laserimg.simulate.objects.storage import cabinet, cardboard_boxes, coat_rack, shelf, suitcase
from laserimg.simulate.objects.vessels import bucket, drum, umbrella_stand, wastebasket
from laserimg.simulate.scenes.furnishing import Maker, hang_lamps, one_of
from laserimg.simulate.scenes.placing import Floor
from laserimg.simulate.scenes.rooms import BLANK, INSIDE, OUTSIDE, room
from laserimg.simulate.things import Scene, Thing

BY_WALL: tuple[tuple[Maker, float], ...] = (
    (shelf, 0.26), (cabinet, 0.26), (radiator, 0.12), (table, 0.08), (coat_rack, 0.08), (plant, 0.08),
    (armchair, 0.06), (printer, 0.03), (pipe, 0.03),
)  # fmt: skip
ANYWHERE: tuple[tuple[Maker, float], ...] = (
    (cardboard_boxes, 0.2), (robot, 0.1), (plant, 0.13), (drum, 0.08), (suitcase, 0.08), (computer, 0.08),
    (pedestal, 0.07), (bucket, 0.05), (umbrella_stand, 0.05), (stool, 0.05), (floor_lamp, 0.04),
    (table, 0.07),
)  # fmt: skip
Pose = tuple[float, float, float]
MAX_OFFICE_CHAIRS = 5
SCANNER_RADIUS_M = 0.55


def office(rng: np.random.Generator) -> Scene:
    """Return an office of 3-12 x 3-8 m, 2.4-3.4 m high, with 1-8 desks and the scanner amid them.

    A desk for each 6-11 square metres; up to 5 office chairs, 0-5 wastebaskets, under desks, beside them or
    by walls. The scanner is 0.4-1.0 m above the floor on a small robot, in two of five scenes 1.0-1.6 m
    (the office scan: 1.29 m). One scene in eight has no labelled object but perhaps a person.
    """
    is_labelled = rng.random() > 1 / 8
    length, width = rng.uniform(3.0, 12.0), rng.uniform(3.0, 8.0)
    size = (length, width, rng.uniform(2.4, 3.4))
    sides = tuple(
        str(side) for side in rng.permutation([INSIDE, OUTSIDE, rng.choice([INSIDE, BLANK]), BLANK])
    )
    walls = room(rng, size, (sides[0], sides[1], sides[2], sides[3]), is_labelled=is_labelled)
    floor = Floor((0, 0), (length, width))
    for low, high in walls.keep_free:
        floor.keep_free(low, high)
    scanner_m = rng.uniform(0.4, 1.0) if rng.random() < 0.6 else rng.uniform(1.0, 1.6)
    place = np.array([length, width]) * rng.uniform(0.25, 0.75, 2)
    x, y = (float(value) for value in place)
    floor.keep_free((*(place - SCANNER_RADIUS_M), 0.0), (*(place + SCANNER_RADIUS_M), 2.2))
    _furnish(rng, floor, length * width, size[2], is_labelled)
    hang_lamps(rng, floor, size)
    things = [*walls.things, carrier(rng, scanner_m).at(x, y, 0, rng.uniform(0, 360)), *floor.things]
    pose = pose_at(x, y, scanner_m, _heading_deg(rng, place, (length / 2, width / 2)))
    return Scene(tuple(things), (pose,), "office")


def _furnish(rng: np.random.Generator, floor: Floor, area: float, height: float, is_labelled: bool) -> None:
    """Partitions first, then workplaces, then walls, then what stands about."""
    if area > 25 and rng.random() < 0.5:
        floor.put_anywhere(rng, _partition(rng, height), 6)
    for _ in range(int(rng.integers(0, 2 + int(area > 40)))):
        floor.put_anywhere(rng, column(rng, height), 4)
    chairs = MAX_OFFICE_CHAIRS if is_labelled else 0
    for _ in range(max(1, round(area / rng.uniform(6, 11)))):
        chairs -= _workplace(rng, floor, chairs > 0, is_labelled)
    basket = wastebasket if is_labelled else bucket
    for _ in range(rng.poisson(0.7)):
        (floor.put_by_wall if rng.random() < 0.7 else floor.put_anywhere)(rng, basket(rng))
    for _ in range(rng.poisson(1.2 + area / 10)):
        floor.put_by_wall(rng, one_of(rng, BY_WALL))
    for _ in range(rng.poisson(1.0 + area / 10)):
        floor.put_anywhere(rng, one_of(rng, ANYWHERE))
    for _ in range(rng.poisson(0.4)):
        floor.put_anywhere(rng, person(rng, "standing"))
    if chairs > 0 and rng.random() < 0.5:
        floor.put_anywhere(rng, office_chair(rng))


def _workplace(rng: np.random.Generator, floor: Floor, may_swivel: bool, is_labelled: bool) -> int:
    """A desk, by a wall or free, with its seat, basket and PC; return how many office chairs came."""
    thing = desk(rng)
    at = floor.put_by_wall(rng, thing, rng.uniform(0.01, 0.2)) if rng.random() < 0.65 else None
    if at is None:
        xy, yaw = rng.uniform(floor.low, floor.high, (10, 2)), 90.0 * rng.integers(4) + rng.normal(0, 4)
        at = floor.put_first(thing, [(x, y, yaw) for x, y in xy])
    if at is None:
        return 0
    deep, wide, _ = thing.mesh.extents
    size = min(float(deep), 0.9), float(wide)
    count = _seat(rng, floor, at, size, may_swivel) if rng.random() < 0.85 else 0
    _around_desk(rng, floor, at, size, is_labelled)
    return count


def _seat(
    rng: np.random.Generator, floor: Floor, at: Pose, size: tuple[float, float], may_swivel: bool
) -> int:
    """A seat before a desk, pushed under it or drawn away, some with a person on it."""
    swivels = may_swivel and rng.random() < 0.85
    seat = office_chair(rng) if swivels else one_of(rng, ((chair, 0.7), (stool, 0.3)))
    x, y = rng.uniform(-0.05, 0.6, 10) + size[0] / 2, rng.uniform(-0.3, 0.3, 10) * size[1]
    if rng.random() < 0.12:
        sitter = person(rng, "sitting")
        both = Thing("", joined([seat.mesh, sitter.mesh]))
        place = floor.put_first(both, _from_desk(at, x + 0.15, y, 180 + rng.normal(0, 15, 10)))
        if place:
            a, b, yaw = place
            floor.things[-1:] = [seat.at(a, b, 0, yaw), sitter.at(a, b, 0, yaw)]
    else:
        place = floor.put_first(seat, _from_desk(at, x, y, 180 + rng.normal(0, 55, 10)))
    return int(swivels and place is not None)


def _around_desk(
    rng: np.random.Generator, floor: Floor, at: Pose, size: tuple[float, float], is_labelled: bool
) -> None:
    """A basket, PC and more under the desk or beside it."""
    deep, wide = size
    beside = rng.choice([-1, 1], 10) * (wide / 2 + rng.uniform(0.15, 0.4, 10))
    under = rng.uniform(-0.45, 0.45, 10) * wide
    if rng.random() < 0.55:
        basket = wastebasket(rng) if is_labelled else bucket(rng)
        x, y = rng.uniform(-0.4, 0.45, 10) * deep, under if rng.random() < 0.6 else beside
        floor.put_first(basket, _from_desk(at, x, y, rng.uniform(0, 360, 10)))
    for maker, share in ((computer, 0.5), (pedestal, 0.25), (cardboard_boxes, 0.12), (suitcase, 0.1)):
        if rng.random() < share:
            x, y = rng.uniform(-0.3, 0.2, 10) * deep, under if rng.random() < 0.7 else beside
            floor.put_first(maker(rng), _from_desk(at, x, y, rng.normal(0, 8, 10)))


def _from_desk(at: Pose, x: NDArray, y: NDArray, turn_deg: NDArray) -> Iterator[Pose]:
    """Places in the frame of a desk at (x, y, yaw in degrees), as places in the room."""
    cos, sin = np.cos(np.radians(at[2])), np.sin(np.radians(at[2]))
    return zip(at[0] + cos * x - sin * y, at[1] + sin * x + cos * y, at[2] + turn_deg, strict=True)


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
