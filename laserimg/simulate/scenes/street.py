"""A street of 60 m: road, kerbs, pavements, facades, cars, people, trees and poles."""

from collections.abc import Sequence

import numpy as np

from laserimg.simulate.materials import MATERIALS
from laserimg.simulate.objects.cars import car
from laserimg.simulate.objects.facades import facade
from laserimg.simulate.objects.loft import quads_mesh
from laserimg.simulate.objects.people import person
from laserimg.simulate.objects.poles import bollard, lamp_post, sign_post, traffic_light
from laserimg.simulate.objects.trees import tree
from laserimg.simulate.scenes.furnishing import Maker
from laserimg.simulate.things import Scene, Thing

HALF_LENGTH_M = 30.0
POLES = (lamp_post, sign_post, traffic_light, bollard)


def street(rng: np.random.Generator, extras: Sequence[Maker] = ()) -> Scene:
    """Return a street along x with the scanner near the middle, 1.2-2.0 m above the ground.

    Lanes 2.75-3.25 m, parking strips 2.2 m, pavements 2-4 m (ranges of the German RASt 06), kerbs
    0.08-0.15 m. One scene in five has few objects. Of the makers `extras` 1-4 things each stand on the
    pavements.
    """
    road, pave, kerb = rng.uniform(7.5, 8.7), rng.uniform(2.5, 4.0), rng.uniform(0.08, 0.15)
    density = 0.25 if rng.random() < 0.2 else rng.uniform(0.6, 1.0)
    things, taken = [_ground(rng, road, pave, kerb)], [(0.0, 0.0, 1.0)]
    for maker in extras:
        for _ in range(int(rng.integers(1, 5))):
            thing, side = maker(rng), rng.choice([-1, 1])
            x, y = rng.uniform(-12, 12), side * (road / 2 + rng.uniform(0.5, pave - 0.4))
            things += _free(thing, x, y, kerb, rng.uniform(0, 360), taken, thing.footprint)
    for side in (-1, 1):
        things += _row_of_houses(rng, side, side * (road / 2 + pave), kerb)
        curb, wall = side * road / 2, side * (road / 2 + pave)
        for x in np.arange(-27, 28, 6.0):
            if rng.random() < 0.6 * density:
                things += _free(
                    car(rng),
                    x + rng.uniform(-0.3, 0.3),
                    curb - side * 1.25,
                    -0.025 * (road / 2 - 1.25),
                    _along(rng),
                    taken,
                    1.0,
                )
        for x in np.arange(-27, 28, 9.0) + rng.uniform(0, 4):
            if rng.random() < density:
                thing = _street_tree(rng, pave - 0.6) if rng.random() < 0.5 else _pole(rng)
                things += _free(thing, x, curb + side * 0.5, kerb, rng.uniform(0, 360), taken, 0.35)
        for _ in range(rng.poisson(5 * density)):
            y = side * rng.uniform(abs(curb) + 1.1, abs(wall) - 0.6)
            things += _free(
                person(rng, _upright(rng)), rng.uniform(-25, 25), y, kerb, rng.uniform(0, 360), taken, 0.45
            )
    scanner = np.eye(4)
    heading = rng.uniform(0, 2 * np.pi)
    scanner[:2, :2] = [[np.cos(heading), -np.sin(heading)], [np.sin(heading), np.cos(heading)]]
    scanner[2, 3] = rng.uniform(1.2, 2.0)
    return Scene(tuple(things), (scanner,), "street")


def _pole(rng: np.random.Generator) -> Thing:
    return POLES[rng.choice(4, p=[0.4, 0.3, 0.15, 0.15])](rng)


def _street_tree(rng: np.random.Generator, room_m: float) -> Thing:
    """A tree whose crown stays off the facades; after 8 that do not, a pole."""
    for _ in range(8):
        drawn = tree(rng)
        if np.linalg.norm(drawn.mesh.vertices[:, :2], axis=1).max() < room_m:
            return drawn
    return _pole(rng)


def _along(rng: np.random.Generator) -> float:
    return float(rng.choice([0, 180]) + rng.normal(0, 2))


def _upright(rng: np.random.Generator) -> str:
    return "standing" if rng.random() < 0.5 else "walking"


def _free(
    thing: Thing, x: float, y: float, z: float, yaw_deg: float, taken: list, radius: float
) -> list[Thing]:
    """The thing at its place, or nothing where its circle (cars: three along x) meets one taken."""
    along = (-1.6, 0.0, 1.6) if thing.label == "car" else (0.0,)
    circles = [(x + dx, y, radius) for dx in along]
    if any(np.hypot(a - c, b - d) < r + s for a, b, r in circles for c, d, s in taken):
        return []
    taken.extend(circles)
    return [thing.at(x, y, z, yaw_deg)]


def _row_of_houses(rng: np.random.Generator, side: int, y: float, z: float) -> list[Thing]:
    """Facades side by side, some set back, some places empty."""
    things, x = [], -HALF_LENGTH_M
    while x < HALF_LENGTH_M:
        width = rng.uniform(8, 16)
        if rng.random() < 0.85:
            back = side * rng.choice([0.0, rng.uniform(0, 2.0)])
            things += [t.at(x + width / 2, y + back, z, -90 * side) for t in facade(rng, width)]
        x += width
    return things


def _ground(rng: np.random.Generator, road: float, pave: float, kerb: float) -> Thing:
    """Strips across the street, crowned 2.5 % towards the gutters, pavement rough by 2 mm."""
    edge = road / 2
    y = np.concatenate(
        [
            -edge - pave - np.array([6, 2, 0.0]),
            [-edge - pave / 2, -edge - 0.001, -edge],
            np.linspace(-edge, edge, 9)[1:-1],
        ]
    )
    y = np.concatenate([y, -y[:6][::-1]])
    x = np.linspace(-HALF_LENGTH_M, HALF_LENGTH_M, 61)
    raised = np.abs(y) > edge
    z = np.where(raised, kerb, -0.025 * np.abs(y)) + rng.normal(0, 0.002, (len(x), len(y)))
    grid = np.stack([*np.meshgrid(x, y, indexing="ij"), z], -1)
    quads = np.stack([grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]], 2).reshape(-1, 4, 3)
    which = np.tile((raised[:-1] & raised[1:]).astype(int), len(x) - 1)
    return Thing("ground", quads_mesh(quads, [MATERIALS["asphalt"], MATERIALS["concrete"]], which))
