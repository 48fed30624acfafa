"""Workplaces: desks alone, in rows and in islands, with their seats, baskets, PCs and bags."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from laserimg.simulate.mesh import joined
from laserimg.simulate.objects.clutter import bag, cables, stack
from laserimg.simulate.objects.copies import boxes
from laserimg.simulate.objects.desks import desk, pedestal
from laserimg.simulate.objects.devices import computer
from laserimg.simulate.objects.loft import varied
from laserimg.simulate.objects.people import person
from laserimg.simulate.objects.seats import chair, office_chair, stool
from laserimg.simulate.objects.storage import cardboard_boxes, suitcase
from laserimg.simulate.objects.vessels import bucket, some_wastebasket
from laserimg.simulate.scenes.furnishing import Maker, one_of
from laserimg.simulate.scenes.placing import Floor
from laserimg.simulate.things import Thing

Pose = tuple[float, float, float]
GROUPS = (1, 2, 3, 4, 6)
AROUND: tuple[tuple[Maker, float], ...] = (
    (computer, 0.65), (pedestal, 0.35), (cardboard_boxes, 0.2), (bag, 0.35), (suitcase, 0.07),
    (stack, 0.2), (cables, 0.4),
)  # fmt: skip


def workplaces(rng: np.random.Generator, floor: Floor, count: int, *, is_labelled: bool) -> None:
    """Put about `count` desks: one by one, in rows of 2-4 by a wall or free, back to back in islands."""
    while count > 0:
        wanted = int(rng.choice(GROUPS, p=(0.35, 0.25, 0.15, 0.15, 0.1)))
        places = _group(rng, floor, min(count, wanted))
        for at, size in places:
            if rng.random() < 0.92:
                _seat(rng, floor, at, size, is_labelled)
            _around_desk(rng, floor, at, size, is_labelled)
        count -= max(len(places), 1)


def _group(rng: np.random.Generator, floor: Floor, count: int) -> list[tuple[Pose, tuple[float, float]]]:
    """Desks of one size put side by side, half of the groups of 2 and more also back to back."""
    size = rng.uniform(0.62, 0.9), rng.uniform(1.2, 2.0)
    is_island = count > 1 and rng.random() < 0.55
    first = desk(rng, None if count == 1 else "straight", size)
    at = None
    if not is_island and rng.random() < 0.65:
        at = floor.put_by_wall(rng, first, rng.uniform(0.01, 0.2))
    if at is None:
        xy, yaw = rng.uniform(floor.low, floor.high, (12, 2)), 90.0 * rng.integers(4) + rng.normal(0, 4)
        at = floor.put_first(first, [(x, y, yaw) for x, y in xy])
    if at is None:
        return []
    found, rows = [(at, size)], 2 if is_island else 1
    gap = rng.uniform(0.02, 0.12)
    for k in range(1, count):
        along, back = np.array([(k // rows) * (size[1] + 0.02)]), np.array([-(size[0] + gap) * (k % rows)])
        (there,) = _from_desk(at, back, along, np.array([180.0 * (k % rows)]))
        if floor.put(desk(rng, "straight", size), *there):
            found.append((there, size))
    if is_island and gap > 0.05 and rng.random() < 0.6:
        _screens(rng, floor, at, size, gap, (count + 1) // 2)
    return found


def _screens(
    rng: np.random.Generator, floor: Floor, at: Pose, size: tuple[float, float], gap: float, count: int
) -> None:
    """A screen along the middle of an island, 1.05-1.6 m high."""
    rows = [(0, 0, 0.3, gap - 0.025, size[1] - 0.02, rng.uniform(0.75, 1.3))]
    panel = Thing("screen", boxes(rows, varied(rng, "fabric_light", 0.5)))
    x = np.full(count, -(size[0] + gap) / 2)
    for there in _from_desk(at, x, np.arange(count) * (size[1] + 0.02), np.zeros(count)):
        floor.put(panel, *there)


def _seat(
    rng: np.random.Generator, floor: Floor, at: Pose, size: tuple[float, float], is_labelled: bool
) -> None:
    """A seat before a desk, most partly under it, some drawn away; now and then a person on it."""
    seat = (
        office_chair(rng)
        if is_labelled and rng.random() < 0.85
        else one_of(rng, ((chair, 0.7), (stool, 0.3)))
    )
    x, y = rng.uniform(-0.1, 0.6, 10) + size[0] / 2, rng.uniform(-0.3, 0.3, 10) * size[1]
    if rng.random() < 0.1:
        sitter = person(rng, "sitting")
        both = Thing("", joined([seat.mesh, sitter.mesh]))
        place = floor.put_first(both, _from_desk(at, x + 0.15, y, 180 + rng.normal(0, 15, 10)))
        if place:
            a, b, yaw = place
            floor.things[-1:] = [seat.at(a, b, 0, yaw), sitter.at(a, b, 0, yaw)]
    else:
        floor.put_first(seat, _from_desk(at, x, y, 180 + rng.normal(0, 55, 10)))


def _around_desk(
    rng: np.random.Generator, floor: Floor, at: Pose, size: tuple[float, float], is_labelled: bool
) -> None:
    """A basket, PC and more under the desk or beside it."""
    deep, wide = size
    beside = rng.choice([-1, 1], 10) * (wide / 2 + rng.uniform(0.15, 0.4, 10))
    under = rng.uniform(-0.45, 0.45, 10) * wide
    if rng.random() < 0.45:
        basket = some_wastebasket(rng) if is_labelled else bucket(rng)
        x, y = rng.uniform(-0.4, 0.5, 10) * deep, under if rng.random() < 0.65 else beside
        floor.put_first(basket, _from_desk(at, x, y, rng.uniform(0, 360, 10)))
    for maker, share in AROUND:
        if rng.random() < share:
            x, y = rng.uniform(-0.35, 0.3, 10) * deep, under if rng.random() < 0.7 else beside
            floor.put_first(maker(rng), _from_desk(at, x, y, rng.normal(0, 8, 10)))


def _from_desk(at: Pose, x: NDArray, y: NDArray, turn_deg: NDArray) -> Iterator[Pose]:
    """Places in the frame of a desk at (x, y, yaw in degrees), as places in the room."""
    cos, sin = np.cos(np.radians(at[2])), np.sin(np.radians(at[2]))
    return zip(at[0] + cos * x - sin * y, at[1] + sin * x + cos * y, at[2] + turn_deg, strict=True)
