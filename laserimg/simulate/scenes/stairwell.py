"""Stairwells: a hall whose wall at x = 0 opens to stairs that climb or fall away towards -x."""

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
from laserimg.simulate.objects.vessels import bucket, umbrella_stand
from laserimg.simulate.scenes.foyer import foyer
from laserimg.simulate.scenes.furnishing import Maker, hang_lamps, one_of, put_extras
from laserimg.simulate.scenes.placing import Floor
from laserimg.simulate.scenes.rooms import BLANK, INSIDE, OPEN, OUTSIDE, room
from laserimg.simulate.scenes.walls import Hole, wall
from laserimg.simulate.things import Scene, Thing

FORMS = ("up", "down", "dogleg", "free", "foyer")
THINGS: tuple[tuple[Maker, float], ...] = (
    (radiator, 0.2), (cabinet, 0.2), (plant, 0.2), (coat_rack, 0.1), (cardboard_boxes, 0.15), (bucket, 0.05),
    (umbrella_stand, 0.1),
)  # fmt: skip


def stairwell(rng: np.random.Generator, extras: Sequence[Maker] = ()) -> Scene:
    """Return a hall of 4-12 x 3-8 m, 2.6-5 m high, with stairs in sight.

    Up (27 %): one flight between walls, with a landing behind. Dogleg (20 %): up to a landing, back up
    beside, and down below. Down (13 %): one flight that leaves the hall, seen from above. Free (15 %):
    steps that stand in the hall, half of them open, without risers; of the others three in ten are. The
    rest is `laserimg.simulate.scenes.foyer`. The scanner is 0.4-1.7 m above the floor and looks to the
    stairs within 35 degrees. Sizes of flights as in `laserimg.simulate.objects.stairs`. Of the makers
    `extras` 1-4 things each come too.
    """
    form = str(rng.choice(FORMS, p=[0.27, 0.13, 0.2, 0.15, 0.25]))
    if form == "foyer":
        return foyer(rng, extras)
    size = (rng.uniform(4, 12), rng.uniform(3.0, 8.0), rng.uniform(2.6, 5.0))
    others = rng.choice([INSIDE, OUTSIDE, BLANK], 3, p=[0.4, 0.2, 0.4])
    is_behind = form != "free"
    walls = room(rng, size, (OPEN if is_behind else BLANK, str(others[0]), str(others[1]), str(others[2])))
    floor = Floor((0, 0), size[:2])
    for low, high in walls.keep_free:
        floor.keep_free(low, high)
    stone = varied(rng, "plaster", 0.2)
    if is_behind:
        middle, wide, things = _behind(rng, form, size, stone)
        floor.keep_free((0, middle - wide / 2, 0), (1.2, middle + wide / 2, 2.5))
        target = (0.0, middle)
    else:
        things, target = _in_the_hall(rng, floor, size)
    scanner_m = rng.uniform(0.4, 1.0) if rng.random() < 0.6 else rng.uniform(1.0, 1.7)
    x, y = _place(rng, floor, size, target, form)
    put_extras(rng, floor, extras)
    _furnish(rng, floor, size[0] * size[1])
    hang_lamps(rng, floor, size)
    heading = np.degrees(np.arctan2(target[1] - y, target[0] - x)) + rng.normal(0, 18)
    support = carrier(rng, scanner_m).at(x, y, 0, rng.uniform(0, 360))
    return Scene(
        (*walls.things, *things, support, *floor.things), (pose_at(x, y, scanner_m, heading),), "stairwell"
    )


def _place(rng: np.random.Generator, floor: Floor, size, target, form: str) -> tuple[float, float]:
    """A free place for the scanner, of twenty tried the first far enough from the stairs.

    At least 1.5 m; above a flight that falls away 1.3-2.2 m, where its steps are still in sight.
    """
    x, y = size[0] * 0.6, size[1] * 0.5
    for _ in range(20):
        x, y = rng.uniform(0.8, size[0] - 0.7), rng.uniform(0.7, size[1] - 0.7)
        if form == "down":
            x, y = rng.uniform(1.3, 2.2), np.clip(target[1] + rng.normal(0, 0.7), 0.7, size[1] - 0.7)
        away = np.hypot(x - target[0], y - target[1])
        if away > (1.2 if form == "down" else 1.5) and floor.is_free(
            (x - 0.5, y - 0.5, 0), (x + 0.5, y + 0.5, 2.2)
        ):
            break
    floor.keep_free((x - 0.5, y - 0.5, 0), (x + 0.5, y + 0.5, 2.2))
    return x, y


def _furnish(rng: np.random.Generator, floor: Floor, area: float) -> None:
    for _ in range(rng.poisson(area / 12)):
        floor.put_by_wall(rng, one_of(rng, THINGS))
    for _ in range(rng.poisson(area / 40)):
        floor.put_anywhere(rng, one_of(rng, THINGS))
    for _ in range(rng.poisson(0.4)):
        floor.put_anywhere(rng, person(rng, "walking" if rng.random() < 0.6 else "standing"))


def _behind(rng: np.random.Generator, form: str, size, stone: Material) -> tuple[float, float, list[Thing]]:
    """Middle and width of the opening in the wall at x = 0, and the wall, the shaft and the flights."""
    lanes = 2 if form == "dogleg" else 1
    gap = rng.uniform(0.05, 0.3) if lanes == 2 else 0.0
    wide = min(rng.uniform(1.0, 2.2) if lanes == 2 else rng.uniform(1.0, 3.4), (size[1] - 0.4 - gap) / lanes)
    flight = flight_size(rng, int(rng.integers(7, 12)) if lanes == 2 else None, wide)
    whole = lanes * wide + gap
    middle = rng.uniform(whole / 2 + 0.1, size[1] - whole / 2 - 0.1)
    landing = rng.uniform(max(1.2, wide if lanes == 2 else 1.2), 3.5)
    low, high = (-flight.height_m if form == "down" else 0.0), flight.height_m + rng.uniform(2.3, 3.0)
    if form == "dogleg":
        low, high = -flight.height_m, 2 * flight.height_m + 2.5
    if form == "down":
        high = size[2]
    lintel = min(size[2], high, rng.uniform(2.1, size[2]) if rng.random() < 0.4 else size[2])
    shaft = _shaft(rng, flight.run_m + landing, whole, low, high, stone)
    face = wall(rng, size[1] + 0.4, size[2], 0.02, stone, [Hole(middle - size[1] / 2, 0.0, whole, lintel)])
    things = [thing.at(0, middle) for thing in shaft] + [face.at(0, size[1] / 2)]
    things += [thing.at(0, middle) for thing in _flights(rng, form, flight, landing, (wide + gap) / 2)]
    return middle, whole, things


def _flights(rng: np.random.Generator, form: str, flight: Flight, landing: float, lane: float) -> list[Thing]:
    """Flights and landings around y = 0; of a dogleg the lanes are at y = -lane and y = lane."""
    run, up, wide = flight.run_m, flight.height_m, flight.width_m
    stone = varied(rng, "concrete", 0.3)

    def slab(z: float, full: float) -> Thing:
        return Thing("landing", boxes([(-run - landing / 2, 0, z - 0.15, landing, full, 0.15)], stone))

    is_open = rng.random() < 0.3
    first = steps(rng, flight, is_open=is_open, to_floor=form == "up" and rng.random() < 0.6)
    if form == "down":
        return [first.at(-run, 0, -up, 180), *_rails(rng, flight, -run, 0, -up, 180), slab(-up, wide)]
    if form == "up":
        return [first, *_rails(rng, flight, 0, 0, 0, 0), slab(up, wide)]
    back = steps(rng, flight, is_open=is_open, to_floor=False)
    side = rng.choice([-1, 1])
    things = [slab(up, 2 * lane + wide), first.at(0, side * lane), back.at(-run, -side * lane, up, 180)]
    things += [back.at(-run, -side * lane, -up, 180), slab(-up, 2 * lane + wide)]
    inner = wide / 2 - 0.03
    things.append(side_of_stairs(rng, flight, -side * inner).at(0, side * lane))
    things.append(side_of_stairs(rng, flight, -side * inner).at(-run, -side * lane, up, 180))
    return things


def _rails(rng: np.random.Generator, flight: Flight, x: float, y: float, z: float, yaw: float) -> list[Thing]:
    """A rail at none, one or both sides, and in wide flights sometimes one in the middle."""
    sides = [s * (flight.width_m / 2 - 0.07) for s in (-1, 1) if rng.random() < 0.45]
    if flight.width_m > 2 and rng.random() < 0.3:
        sides.append(0.0)
    return [side_of_stairs(rng, flight, side).at(x, y, z, yaw) for side in sides]


def _shaft(rng: np.random.Generator, deep: float, wide: float, low: float, high: float, stone: Material):
    """Side walls, back wall, floor and ceiling of the space behind x = 0."""
    tall = high - low
    sides = [wall(rng, deep, tall, 0.1, stone).at(-deep / 2, s * wide / 2, low, -90 * s) for s in (-1, 1)]
    back = wall(rng, wide + 0.2, tall, 0.1, stone).at(-deep, 0, low)
    ends = [(-deep / 2, 0, z, deep, wide + 0.2, 0.1) for z in (low - 0.12, high)]
    return [*sides, back, Thing("shaft", boxes(ends, stone))]


def _in_the_hall(rng: np.random.Generator, floor: Floor, size) -> tuple[list[Thing], tuple[float, float]]:
    """Steps with their rails that stand on the floor, up to the ceiling or to nowhere."""
    for _ in range(20):
        flight = flight_size(rng, int(rng.integers(3, 14)))
        if flight.run_m > size[0] - 2.5 or flight.width_m > size[1] - 1.5 or flight.height_m > size[2]:
            continue
        whole = steps(rng, flight, is_open=rng.random() < 0.5)
        x = rng.uniform(flight.run_m, size[0] - 1.8)
        y = rng.choice([flight.width_m / 2 + 0.2, size[1] / 2, size[1] - flight.width_m / 2 - 0.2])
        kind = str(rng.choice(["rail", "rail", "parapet"]))
        sides = [s * flight.width_m / 2 for s in (-1, 1) if rng.random() < 0.7]
        things = [whole, *(side_of_stairs(rng, flight, side, kind) for side in sides)]
        half = flight.width_m / 2
        low, high = (x - flight.run_m, y - half - 0.15, 0), (x + 1.0, y + half + 0.15, size[2])
        if floor.is_free(low, high):
            floor.keep_free(low, high)
            return [thing.at(x, y) for thing in things], (x - flight.run_m / 2, y)
    floor.put(column(rng, size[2]), size[0] / 3, size[1] / 2)
    return [], (size[0] / 3, size[1] / 2)
