"""Rectangular rooms: four walls with doors, windows and openings, and what is seen through them."""

from dataclasses import dataclass

import numpy as np

from laserimg.simulate.materials import Material
from laserimg.simulate.objects.copies import Row, boxes
from laserimg.simulate.objects.doors import door, door_size
from laserimg.simulate.objects.loft import varied
from laserimg.simulate.objects.windows import glazing, window, window_size
from laserimg.simulate.scenes.walls import Hole, ceiling, plate, wall
from laserimg.simulate.things import Thing

BLANK, INSIDE, OUTSIDE, OPEN = "blank", "inside", "outside", "open"


@dataclass(frozen=True, eq=False, slots=True)
class Room:
    """A room from (0, 0) to (length_m, width_m) and what stands in its walls.

    Parameters
    ----------
    length_m, width_m, height_m : float
        Along x, y and z.
    things : tuple of Thing
        Walls, floor, ceiling, doors, windows and what is behind them.
    keep_free : tuple of ((3,), (3,)) corners
        Boxes before doors and openings, for ways and swinging leaves.
    """

    length_m: float
    width_m: float
    height_m: float
    things: tuple[Thing, ...]
    keep_free: tuple[tuple[tuple[float, ...], tuple[float, ...]], ...]


def room(
    rng: np.random.Generator,
    size: tuple[float, float, float],
    sides: tuple[str, str, str, str],
    *,
    is_labelled: bool = True,
) -> Room:
    """Return a room.

    Parameters
    ----------
    rng : Generator
    size : tuple of float
        Metres along x, y and z.
    sides : tuple of str
        What is beyond the walls at x = 0, y = 0, x = length and y = width: "blank" walls have no holes,
        "inside" ones doors, wide openings or glazing to a space 1.5-9 m deep, "outside" ones windows
        (or, one in five, glazing); where it is "open" there is no wall, floor and ceiling end.
    is_labelled : bool
        Doors and windows may be there; without them only openings and glazing.
    """
    length, width, height = size
    paint = varied(rng, str(rng.choice(["plaster", "plaster", "concrete", "paint_white"])), 0.15)
    ground = varied(rng, str(rng.choice(["carpet", "tiles", "wood"])), 0.3)
    above = varied(rng, "paint_white", 0.1)
    past = [0.0 if beyond == OPEN else 0.4 for beyond in sides]
    low, high = (-past[0], -past[1]), (length + past[2], width + past[3])
    things = [plate(rng, low, high, 0.0, ground), ceiling(rng, low, high, height, above)]
    zones = []
    for number, beyond in enumerate(sides):
        long = width if number % 2 == 0 else length
        side, zone = _side(rng, long, height, beyond, (paint, ground, above), is_labelled)
        place = [(0, width / 2), (length / 2, 0), (length, width / 2), (length / 2, width)][number]
        things += [thing.at(*place, 0, 90.0 * number) for thing in side]
        zones += [_turned(low, high, place, number) for low, high in zone]
    return Room(length, width, height, tuple(things), tuple(zones))


def _side(rng, long: float, height: float, beyond: str, materials: tuple[Material, ...], is_labelled: bool):
    """A wall along y seen from +x with its fillings, and the boxes to keep free before it."""
    if beyond == OPEN:
        return [], []
    thick = rng.uniform(0.25, 0.4) if beyond == OUTSIDE else rng.uniform(0.1, 0.25)
    holes, things, zones = [], [], []
    for kind, hole in _holes(rng, long, height, beyond, is_labelled):
        holes.append(hole)
        things += _filling(rng, kind, hole, thick)
        if kind != "window":
            a, b = hole.sides
            zones.append(((0.0, a, 0.0), (1.1 if kind == "door" else 0.5, b, 2.0)))
    things.append(wall(rng, long + 2 * thick, height, thick, materials[0], holes))
    if holes and beyond == INSIDE:
        things += _hall(rng, long + 1.0, height, thick, materials)
    if holes and beyond == OUTSIDE:
        things += _outdoors(rng, thick)
    return things, zones


def _holes(rng, long: float, height: float, beyond: str, is_labelled: bool) -> list[tuple[str, Hole]]:
    """Kinds and places of holes, from one end of the wall to the other, with 0.15-3.5 m between them."""
    found, at = [], -long / 2 + rng.uniform(0.15, 1.2)
    outer = "window" if is_labelled and rng.random() < 0.8 else "glazing"
    (usual_wide, usual_high), sill = window_size(rng), rng.uniform(0.6, 1.1)
    while beyond != BLANK:
        kind = (
            outer
            if beyond == OUTSIDE
            else str(rng.choice(["door", "opening", "glazing"], p=[0.75, 0.15, 0.1]))
        )
        kind = "opening" if kind == "door" and not is_labelled else kind
        low, (wide, high) = 0.0, (rng.uniform(1.0, 2.5), rng.uniform(2.0, height - 0.2))
        if kind == "window":
            low, wide, high = (
                sill,
                usual_wide * rng.uniform(0.95, 1.05),
                min(usual_high, height - sill - 0.15),
            )
        elif kind == "door":
            wide, high = door_size(rng)
        if at + wide > long / 2 - 0.12:
            break
        found.append((kind, Hole(at + wide / 2, low, wide, high)))
        at += wide + (rng.uniform(0.15, 1.2) if beyond == OUTSIDE else rng.uniform(0.4, 3.5))
    return found


def _filling(rng, kind: str, hole: Hole, thick: float) -> list[Thing]:
    size = hole.width_m, hole.height_m
    if kind == "door":
        return [door(rng, size, thick).at(0, hole.middle_m)]
    if kind == "window":
        return [window(rng, size, thick).at(0, hole.middle_m, hole.bottom_m)]
    if kind == "glazing":
        return [glazing(rng, size, thick).at(0, hole.middle_m)]
    return []


def _hall(rng, long: float, height: float, thick: float, materials: tuple[Material, ...]) -> list[Thing]:
    """The space beyond: floor, ceiling, three walls and a few blocks of furniture."""
    paint, ground, above = materials
    deep = rng.uniform(1.5, 3.0) if rng.random() < 0.5 else rng.uniform(3.0, 9.0)
    low, high = (-thick - deep, -long / 2), (-thick + 0.02, long / 2)
    ends = [
        wall(rng, deep, height, 0.1, paint).at(-thick - deep / 2, side * long / 2, 0, -90 * side)
        for side in (-1, 1)
    ]
    far = wall(rng, long, height, 0.1, paint).at(-thick - deep, 0)
    count = int(rng.integers(0, 2 + int(long * deep / 8)))
    blocks = np.c_[
        rng.uniform(-deep + 0.5, -0.9, count) - thick if deep > 1.5 else np.full(count, -thick - 1.2),
        rng.uniform(-0.45, 0.45, count) * long,
        np.zeros(count),
        rng.uniform(0.2, 0.8, (count, 2)),
        rng.uniform(0.4, 2.0, count),
    ]
    things = [
        plate(rng, low, high, -0.001, ground),
        ceiling(rng, low, high, height + 0.001, above),
        far,
        *ends,
    ]
    if count:
        things.append(Thing("furniture", boxes(blocks, varied(rng, "wood", 0.4))))
    return things


def _outdoors(rng, thick: float) -> list[Thing]:
    """What windows look at: nothing on 2 in 5, else facades 2-30 m away, and sometimes the ground."""
    if rng.random() < 0.4:
        return []
    away = -thick - rng.uniform(2, 30)
    rows: list[Row] = [(away, 0, -12, 0.5, 60, rng.uniform(10, 30))]
    for _ in range(int(rng.integers(0, 8))):
        x, wide = rng.uniform(away + 0.8, -thick - 0.8), rng.uniform(0.1, 0.8)
        rows.append((x, rng.uniform(-15, 15), -12, wide, wide, rng.uniform(11, 18)))
    if rng.random() < 0.6:
        rows.append((-thick - 16, 0, -0.2 - rng.choice([0.2, rng.uniform(0.3, 9)]), 31, 60, 0.2))
    return [Thing("outdoors", boxes(rows, varied(rng, "brick", 0.4)))]


def _turned(low, high, place, quarter: int):
    """The box between two corners after `quarter` turns of 90 degrees and a shift."""
    cos, sin = np.round(np.cos(np.pi / 2 * quarter)), np.round(np.sin(np.pi / 2 * quarter))
    corners = np.array([low, high]) @ np.array([[cos, sin, 0], [-sin, cos, 0], [0, 0, 1]])
    corners[:, :2] += place
    return tuple(corners.min(axis=0)), tuple(corners.max(axis=0))
