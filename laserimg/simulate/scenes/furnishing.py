"""Drawing things by weight; lamps and beams under the ceiling, pilasters and benches along walls."""

from collections.abc import Callable, Sequence

import numpy as np

from laserimg.simulate.objects.copies import Row, boxes
from laserimg.simulate.objects.fixtures import ceiling_lamp
from laserimg.simulate.objects.loft import varied
from laserimg.simulate.scenes.placing import Floor
from laserimg.simulate.things import Thing

Maker = Callable[[np.random.Generator], Thing]


def hang_lamps(rng: np.random.Generator, floor: Floor, size: tuple[float, float, float]) -> None:
    """Hang rows of equal lamps in a room of that size, at least 2.1 m above the floor."""
    length, width, height = size
    lamp, yaw = ceiling_lamp(rng), float(rng.choice([0, 90]))
    rows, columns = int(rng.integers(0, 3)), max(1, int(length / rng.uniform(2.0, 3.5)))
    if height + lamp.mesh.vertices[:, 2].min() < 2.1:
        return
    for x in (np.arange(columns) + 0.5) * length / columns:
        for y in (np.arange(rows) + 0.5) * width / max(rows, 1):
            floor.put(lamp, x, y, yaw, height)


def ceiling_beams(rng: np.random.Generator, size: tuple[float, float, float]) -> Thing:
    """Return beams across a room every 1.2-4 m, or ducts along it: 0.1-0.4 m deep, 2.1 m up or more."""
    length, width, height = size
    deep, wide = min(rng.uniform(0.1, 0.4), height - 2.1), rng.uniform(0.12, 0.5)
    rows: list[Row] = []
    if rng.random() < 0.7:
        x = np.arange(rng.uniform(0.3, 1.5), length, rng.uniform(1.2, 4.0))
        rows = [(float(a), width / 2, height - deep, wide, width, deep) for a in x]
    else:
        for y in rng.uniform(0.1, 0.9, int(rng.integers(1, 3))) * width:
            rows.append((length / 2, y, height - deep - 0.02, length, wide, deep))
    return Thing("beam", boxes(rows, varied(rng, str(rng.choice(["plaster", "metal_painted"])), 0.2)))


def pilasters(rng: np.random.Generator, floor: Floor, size: tuple[float, float, float]) -> None:
    """Put equal pilasters, 0.2-0.6 m wide and 0.05-0.35 m proud, along one or both of the long walls."""
    length, width, height = size
    proud, wide, every = rng.uniform(0.05, 0.35), rng.uniform(0.2, 0.6), rng.uniform(1.8, 5.0)
    thing = Thing("pilaster", boxes([(0, 0, 0, wide, proud, height)], varied(rng, "plaster", 0.2)))
    for y in rng.permutation([proud / 2, width - proud / 2])[: int(rng.integers(1, 3))]:
        for x in np.arange(rng.uniform(0.4, 2.0), length - wide, every):
            floor.put(thing, float(x), float(y), slack_m=0.03)


def long_bench(rng: np.random.Generator) -> Thing:
    """Return a bench, sill or duct along a wall: 1.2-4 m long, 0.2-0.5 m deep and high, closed or on feet."""
    deep, long, high = rng.uniform(0.2, 0.5), rng.uniform(1.2, 4.0), rng.uniform(0.2, 0.5)
    rows: list[Row] = [(0, 0, 0, deep, long, high)]
    if rng.random() < 0.5:
        rows = [(0, 0, high - 0.06, deep, long, 0.06)]
        rows += [(0, y, 0, 0.8 * deep, 0.06, high - 0.06) for y in np.array([-0.42, 0, 0.42]) * long]
    return Thing("long_bench", boxes(rows, varied(rng, str(rng.choice(["wood", "concrete"])), 0.3)))


def put_somewhere(rng: np.random.Generator, floor: Floor, thing: Thing) -> bool:
    """Put a thing where small things stand: in a corner, beside furniture, by a wall, or free."""
    where = rng.random()
    if where < 0.2:
        return floor.put_in_corner(rng, thing)
    if where < 0.6:
        return floor.put_beside(rng, thing)
    if where < 0.8:
        return floor.put_by_wall(rng, thing) is not None
    return floor.put_anywhere(rng, thing)


def put_extras(rng: np.random.Generator, floor: Floor, extras: Sequence[Maker]) -> None:
    """Put 1-4 things of each maker, each tried at four kinds of places as far as there is room."""
    for maker in extras:
        for _ in range(int(rng.integers(1, 5))):
            thing = maker(rng)
            any(put_somewhere(rng, floor, thing) for _ in range(4))


def one_of(rng: np.random.Generator, makers: tuple[tuple[Maker, float], ...]) -> Thing:
    """Return a thing of one of the makers, drawn by their weights."""
    weights = np.array([weight for _, weight in makers])
    return makers[rng.choice(len(makers), p=weights / weights.sum())][0](rng)
