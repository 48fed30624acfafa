"""A street of 60 m: road, kerbs, pavements, houses and gardens, parked rows, people, trees and poles."""

from collections.abc import Sequence

import numpy as np

from laserimg.simulate.mesh import pose_at
from laserimg.simulate.objects.bicycles import bicycle
from laserimg.simulate.objects.cars import car
from laserimg.simulate.objects.facades import front
from laserimg.simulate.objects.hedges import hedge
from laserimg.simulate.objects.lorries import lorry
from laserimg.simulate.objects.outdoor import (
    bench,
    fence,
    litter_bin,
    low_wall,
    planter,
    shrub,
    utility_box,
    wheelie_bin,
)  # fmt: skip
from laserimg.simulate.objects.people import person
from laserimg.simulate.objects.poles import bollard, lamp_post, sign_post, traffic_light
from laserimg.simulate.objects.trees import tree
from laserimg.simulate.scenes.furnishing import Maker, one_of
from laserimg.simulate.scenes.grounds import HALF_LENGTH_M, Street, street_ground
from laserimg.simulate.scenes.plots import Plot
from laserimg.simulate.things import Scene, Thing

POLES: tuple[tuple[Maker, float], ...] = (
    (lamp_post, 0.35), (sign_post, 0.3), (traffic_light, 0.12), (bollard, 0.23),
)  # fmt: skip
ON_PAVEMENT: tuple[tuple[Maker, float], ...] = (
    (litter_bin, 0.25), (bench, 0.15), (utility_box, 0.2), (planter, 0.15), (wheelie_bin, 0.25),
)  # fmt: skip
BORDERS: tuple[tuple[Maker, float], ...] = ((hedge, 0.35), (low_wall, 0.35), (fence, 0.3))


def street(rng: np.random.Generator, extras: Sequence[Maker] = ()) -> Scene:
    """Return a street along x that falls by up to 4 %, the scanner on the road or a pavement.

    Lanes 2.75-3.25 m, parking strips 2-2.3 m, pavements 1.8-4.5 m (ranges of the German RASt 06), kerbs
    0.08-0.15 m; in two of five streets gardens 2-6 m deep before the houses, behind hedges, walls and fences.
    Cars park along the road, in one of four rows side by side across it. One street in five is nearly empty.
    The scanner is 1.2-2.0 m above the ground. Of the makers `extras` 1-4 things each stand on the pavements.
    """
    density = 0.25 if rng.random() < 0.2 else rng.uniform(0.6, 1.2)
    place = Street.drawn(rng)
    plot = Plot(place.height_m)
    x, y = rng.uniform(-4, 4), rng.uniform(-1, 1) * (place.edge_m + place.pave_m - 0.8)
    plot.keep_free(x, y, 1.0, 1.0)
    houses: list[Thing] = []
    for side in (-1, 1):
        houses += _houses(rng, place, side)
        if place.garden_m:
            _gardens(rng, plot, place, side, density)
        _parked(rng, plot, place, side, density)
    _extras(rng, plot, place, extras)
    _on_the_road(rng, plot, place, density)
    for side in (-1, 1):
        _along_the_kerb(rng, plot, place, side, density)
        _on_the_pavement(rng, plot, place, side, density)
    _people(rng, plot, place, density)
    pose = pose_at(x, y, place.height_m(x, y) + rng.uniform(1.2, 2.0), rng.uniform(0, 360))
    return Scene((street_ground(rng, place), *houses, *plot.things), (pose,), "street")


def _houses(rng: np.random.Generator, place: Street, side: int) -> list[Thing]:
    """Fronts side by side, some set back, some places empty; sunk into ground that falls along them."""
    things, x = [], -HALF_LENGTH_M
    line = place.edge_m + place.pave_m + place.garden_m
    while x < HALF_LENGTH_M:
        width = rng.uniform(8, 16)
        if rng.random() < 0.85:
            back = line + rng.choice([0.0, rng.uniform(0, 2.0)])
            middle = x + width / 2
            foot = place.height_m(middle, side * line) - abs(place.slope) * width / 2
            things += [t.at(middle, side * back, foot, -90 * side) for t in front(rng, width)]
        x += width
    return things


def _gardens(rng: np.random.Generator, plot: Plot, place: Street, side: int, density: float) -> None:
    """Hedges, walls and fences at the back of the pavement with gaps, shrubs and trees behind them."""
    border, x = one_of(rng, BORDERS), -HALF_LENGTH_M + 3.0
    line = place.edge_m + place.pave_m
    while x < HALF_LENGTH_M - 3:
        if rng.random() < 0.15:
            border = one_of(rng, BORDERS)
        deep, long = border.mesh.extents[:2]
        if rng.random() < 0.8:
            plot.put(border, x + long / 2, side * (line + deep / 2 + 0.05), 90.0, 0.0)
        x += long + rng.choice([0.02, rng.uniform(0.9, 3.0)], p=[0.6, 0.4])
    for _ in range(rng.poisson(8 * density)):
        deep = rng.uniform(0.8, max(place.garden_m - 0.6, 0.9))
        room = place.garden_m - deep - 0.1
        thing = shrub(rng) if rng.random() < 0.8 or room < 1.5 else _tree_within(rng, room)
        plot.put(thing, rng.uniform(-25, 25), side * (line + deep), rng.uniform(0, 360))


def _parked(rng: np.random.Generator, plot: Plot, place: Street, side: int, density: float) -> None:
    """A row of cars along the kerb, or side by side across; in nearly empty streets with many gaps."""
    share, across = min(rng.uniform(0.35, 1.0) * density, 0.95), place.is_across[(side + 1) // 2]
    x = -HALF_LENGTH_M + rng.uniform(1, 4)
    while x < HALF_LENGTH_M - 2.5:
        if rng.random() > share:
            x += rng.uniform(1.5, 6.0)
            continue
        thing = lorry(rng) if rng.random() < 0.07 else car(rng)
        length, width, _ = thing.mesh.extents
        step = width if across else length
        yaw = (90.0 if across else 0.0) + rng.choice([0, 180]) + rng.normal(0, 1.5)
        y = side * (place.edge_m - (length if across else width) / 2 - rng.uniform(0.1, 0.35))
        if x + step < HALF_LENGTH_M - 0.5:
            plot.put(thing, x + step / 2, y, yaw, 0.02)
        x += step + rng.uniform(0.35, 1.5)


def _on_the_road(rng: np.random.Generator, plot: Plot, place: Street, density: float) -> None:
    for _ in range(rng.poisson(1.2 * density)):
        thing = lorry(rng) if rng.random() < 0.15 else car(rng)
        lane = rng.choice([-1, 1])
        plot.put(thing, rng.uniform(-25, 25), lane * place.lane_m, 90.0 - 90.0 * lane + rng.normal(0, 2), 0.5)


def _extras(rng: np.random.Generator, plot: Plot, place: Street, extras: Sequence[Maker]) -> None:
    for maker in extras:
        for _ in range(int(rng.integers(1, 5))):
            y = rng.choice([-1, 1], 8) * (place.edge_m + rng.uniform(0.3, place.pave_m - 0.2, 8))
            plot.put_first(maker(rng), zip(rng.uniform(-12, 12, 8), y, rng.uniform(0, 360, 8), strict=True))


def _along_the_kerb(rng: np.random.Generator, plot: Plot, place: Street, side: int, density: float) -> None:
    """Trees and poles 5-11 m apart, rows of bollards, bicycles."""
    curb = side * (place.edge_m + 0.5)
    for x in np.arange(-27, 28, rng.uniform(5, 11)) + rng.uniform(0, 4):
        if rng.random() < density:
            # Crowns stay off the houses.
            room = place.pave_m + place.garden_m - 0.6
            thing = _tree_within(rng, room) if rng.random() < 0.5 else one_of(rng, POLES)
            plot.put(thing, x, curb, rng.uniform(0, 360))
    if rng.random() < 0.35 * density:
        post, start = bollard(rng), rng.uniform(-20, 15)
        for x in start + np.arange(int(rng.integers(3, 9))) * rng.uniform(1.2, 2.0):
            plot.put(post, x, curb)
    for _ in range(rng.poisson(1.2 * density)):
        x, yaw, step = rng.uniform(-20, 20), rng.uniform(60, 120), rng.uniform(0.45, 0.8)
        for k in range(int(rng.integers(1, 6))):
            plot.put(bicycle(rng), x + k * step, curb + side * 0.6, yaw + rng.normal(0, 5), -0.15)


def _on_the_pavement(rng: np.random.Generator, plot: Plot, place: Street, side: int, density: float) -> None:
    """Bins, benches, boxes and planters by the kerb or by the houses; bicycles that lean there."""
    for _ in range(rng.poisson(7 * density)):
        thing, by_house = one_of(rng, ON_PAVEMENT), rng.random() < 0.6
        half = float(thing.mesh.extents[0]) / 2
        y = place.edge_m + (place.pave_m - half - 0.1 if by_house else 0.25 + half)
        plot.put(thing, rng.uniform(-25, 25), side * y, -90.0 * side + rng.normal(0, 3))
    for _ in range(rng.poisson(2 * density)):
        y = side * (place.edge_m + place.pave_m - 0.4)
        plot.put(bicycle(rng), rng.uniform(-25, 25), y, rng.choice([0, 180]) + rng.normal(0, 5))


def _people(rng: np.random.Generator, plot: Plot, place: Street, density: float) -> None:
    """On the pavements, alone or in twos, beside cars, trees and poles, some on the road."""
    hosts = [thing for thing in plot.things if thing.label in ("car", "tree", "pole", "bicycle")]
    for _ in range(rng.poisson(11 * density)):
        one = person(rng, "standing" if rng.random() < 0.5 else "walking")
        if hosts and rng.random() < 0.35:
            plot.put_near(rng, one, hosts[rng.integers(len(hosts))], (0.25, 0.8))
            continue
        y = rng.choice([-1, 1]) * (place.edge_m + rng.uniform(0.4, place.pave_m - 0.3))
        y = rng.uniform(-1, 1) * place.edge_m if rng.random() < 0.12 else y
        x, yaw = rng.uniform(-22, 22), rng.uniform(0, 360)
        if plot.put(one, x, y, yaw) and rng.random() < 0.3:
            plot.put(person(rng, "walking"), x + rng.uniform(-0.2, 0.2), y + rng.uniform(0.6, 0.9), yaw)


def _tree_within(rng: np.random.Generator, room_m: float) -> Thing:
    """A tree whose crown reaches less far than that; after 8 that do not, a pole."""
    for _ in range(8):
        drawn = tree(rng)
        if drawn.footprint < room_m:
            return drawn
    return one_of(rng, POLES)
