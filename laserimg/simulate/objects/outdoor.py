"""What stands in streets and parks: benches, litter bins, boxes, fences, low walls, planters, shrubs."""

import numpy as np

from laserimg.simulate.mesh import Mesh, cylinder, joined
from laserimg.simulate.objects.copies import Row, boxes, rods
from laserimg.simulate.objects.loft import quads_mesh, varied
from laserimg.simulate.things import Thing


def bench(rng: np.random.Generator) -> Thing:
    """Return a bench facing +x: 1.2-2.2 m long, seat 0.40-0.48 m high, of slats, most with a back."""
    long, seat, deep = rng.uniform(1.2, 2.2), rng.uniform(0.40, 0.48), rng.uniform(0.38, 0.5)
    slats = int(rng.integers(3, 6))
    rows: list[Row] = [
        (x, 0, seat - 0.04, 0.8 * deep / slats, long, 0.04) for x in np.linspace(-0.5, 0.5, slats) * deep
    ]
    if rng.random() < 0.75:
        rows += [(-deep / 2 - 0.05 - 0.1 * k, 0, seat + 0.14 + 0.16 * k, 0.035, long, 0.11) for k in range(2)]
        y = 0.42 * long
        rows += [(-deep / 2 - 0.08, s * y, seat - 0.05, 0.06, 0.06, 0.45) for s in (-1, 1)]
    legs: list[Row] = [(0, s * 0.42 * long, 0, deep, rng.choice([0.06, 0.12]), seat - 0.04) for s in (-1, 1)]
    wood = boxes(rows, varied(rng, "wood", 0.4))
    return Thing("bench", joined([wood, boxes(legs, varied(rng, "concrete", 0.4))]), "bench")


def litter_bin(rng: np.random.Generator) -> Thing:
    """Return a litter bin: 0.28-0.55 m wide and 0.65-1.2 m high, round or square, on a post or on its own.

    In streets and parks; wastebaskets indoors are another class.
    """
    metal = varied(rng, str(rng.choice(["metal_painted", "plastic_dark", "plastic_light"])), 0.4)
    wide, high = rng.uniform(0.28, 0.55), rng.uniform(0.65, 1.2)
    if rng.random() < 0.3:
        radius, tall = rng.uniform(0.15, 0.22), rng.uniform(0.45, 0.65)
        low = rng.uniform(0.25, 0.45)
        post = cylinder(0.035, low + tall + 0.1, "metal_bare", 10).at(-radius - 0.03, 0)
        vessel = cylinder(0.9 * radius, tall, metal, 20, radius, open_top=True).at(0, 0, low)
        return Thing("litter_bin", joined([post, vessel]), "litter_bin")
    if rng.random() < 0.5:
        body = [cylinder(wide / 2, 0.82 * high, metal, 22, open_top=True)]
        body += [cylinder(wide / 2, 0.1 * high, metal, 22).at(0, 0, 0.9 * high)]
        posts = [((a, b, 0.8 * high), (a, b, 0.92 * high)) for a in (-1, 1) for b in (-1, 1)]
        body.append(rods(np.array(posts) * [0.32 * wide, 0.32 * wide, 1], 0.012, metal))
        return Thing("litter_bin", joined(body), "litter_bin")
    deep = wide * rng.uniform(0.7, 1.0)
    rows: list[Row] = [(0, 0, 0, deep, wide, 0.75 * high), (0, 0, 0.9 * high, deep, wide, 0.1 * high)]
    rows += [(0, s * (wide / 2 - 0.02), 0.75 * high, deep, 0.04, 0.15 * high) for s in (-1, 1)]
    return Thing("litter_bin", boxes(rows, metal), "litter_bin")


def wheelie_bin(rng: np.random.Generator) -> Thing:
    """Return a refuse bin on two wheels; it has no label.

    EN 840-1, 60-240 litres: 0.45-0.58 m wide, 0.5-0.74 m deep, 0.93-1.10 m high.
    """
    wide, deep, high = rng.uniform(0.45, 0.58), rng.uniform(0.5, 0.74), rng.uniform(0.93, 1.10)
    shell = varied(rng, "plastic_dark", 0.5)
    corners = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) / 2
    low, top = corners * [0.7 * deep, 0.8 * wide], corners * [0.95 * deep, 0.97 * wide]
    rings = [np.c_[low, np.full(4, 0.05)], np.c_[top, np.full(4, high - 0.06)]]
    beside = [np.roll(ring, -1, axis=0) for ring in rings]
    quads = np.stack([rings[0], beside[0], beside[1], rings[1]], 1)
    rows: list[Row] = [
        (0.01, 0, high - 0.06, deep, wide, 0.06),
        (-0.5 * deep, 0, high - 0.1, 0.06, 0.8 * wide, 0.04),
    ]
    x, y = -0.38 * deep, 0.42 * wide
    wheels = rods([((x, s * y, 0.1), (x, s * (y + 0.05), 0.1)) for s in (-1, 1)], 0.1, "rubber")
    sides = quads_mesh(quads, [shell], np.zeros(4, int))
    mesh = joined([sides, boxes(rows, shell), wheels])
    return Thing("wheelie_bin", mesh.at(0, 0, -float(mesh.vertices[:, 2].min())))


def utility_box(rng: np.random.Generator) -> Thing:
    """Return a cabinet of telephone or power networks or a letter box: 0.4-1.6 m wide, 0.8-1.6 m high."""
    deep, wide, high = rng.uniform(0.3, 0.5), rng.uniform(0.4, 1.6), rng.uniform(0.8, 1.6)
    rows: list[Row] = [(0, 0, 0, deep - 0.03, wide - 0.03, 0.12), (0, 0, 0.1, deep, wide, high - 0.14)]
    rows.append((0, 0, high - 0.05, deep + 0.05, wide + 0.05, 0.05))
    return Thing("utility_box", boxes(rows, varied(rng, "plastic_light", 0.4)))


def planter(rng: np.random.Generator) -> Thing:
    """Return a tub with a shrub: 0.5-1.5 m long, 0.4-0.7 m high without the shrub."""
    deep, long, high = rng.uniform(0.4, 0.8), rng.uniform(0.5, 1.5), rng.uniform(0.35, 0.7)
    tub = boxes([(0, 0, 0, deep, long, high)], varied(rng, "concrete", 0.3))
    leaves = _foliage(rng, np.array([0.5 * deep, 0.5 * long, rng.uniform(0.15, 0.5)]), 120).at(
        0, 0, high + 0.1
    )
    return Thing("planter", joined([tub, leaves]))


def shrub(rng: np.random.Generator) -> Thing:
    """Return a shrub of 1-4 rounded masses, 0.6-2.5 m high, as wide or wider; it has no label."""
    high, parts = rng.uniform(0.6, 2.5), []
    for _ in range(int(rng.integers(1, 5))):
        half = high * rng.uniform(0.3, 0.55, 3)
        half[2] = high * rng.uniform(0.35, 0.5)
        mass = _foliage(rng, half, int(180 + 120 * half[0] * half[1]))
        x, y = rng.uniform(-0.35, 0.35, 2) * high
        parts.append(mass.at(x, y, half[2]))
    stems = rods(
        [((0, 0, 0), (*rng.uniform(-0.2, 0.2, 2) * high, 0.6 * high)) for _ in range(4)], 0.012, "bark"
    )
    mesh = joined([*parts, stems])
    mesh.vertices[:, 2] = np.clip(mesh.vertices[:, 2], 0, None)
    return Thing("shrub", mesh)


def fence(rng: np.random.Generator) -> Thing:
    """Return a piece of fence along y, 2-6 m long and 0.8-1.9 m high: pickets, boards, bars or wire mesh."""
    long, high, kind = rng.uniform(2.0, 6.0), rng.uniform(0.8, 1.9), rng.random()
    every = rng.uniform(1.5, 2.5)
    posts: list[Row] = [
        (0, float(y), 0, 0.08, 0.08, high) for y in np.arange(-long / 2, long / 2 + 0.01, every)
    ]
    rails: list[Row] = [(0, 0, f * high, 0.04, long, 0.07) for f in (0.2, 0.8)]
    material = varied(rng, str(rng.choice(["wood", "metal_painted"])), 0.4)
    if kind < 0.6:
        wide, step = (0.09, rng.uniform(0.13, 0.2)) if kind < 0.35 else (0.02, 0.12)
        bars = [(0.03, float(y), 0.06, 0.02, wide, high - 0.06) for y in np.arange(-long / 2, long / 2, step)]
        return Thing("fence", boxes([*posts, *rails, *bars], material), "fence")
    if kind < 0.8:
        boards = boxes([(0.02, 0, 0.05, 0.02, long, high - 0.05)], material)
        return Thing("fence", joined([boxes(posts, material), boards]), "fence")
    wires = np.arange(0.1, high, 0.2)
    ends = [((0, -long / 2, z), (0, long / 2, z)) for z in wires]
    ends += [((0, y, 0.05), (0, y, high)) for y in np.arange(-long / 2, long / 2, 0.25)]
    return Thing("fence", joined([boxes(posts, material), rods(ends, 0.006, "metal_bare")]), "fence")


def low_wall(rng: np.random.Generator) -> Thing:
    """Return a piece of garden wall along y: 2-6 m long, 0.4-1.6 m high, 0.15-0.4 m thick, most capped."""
    long, high, thick = rng.uniform(2.0, 6.0), rng.uniform(0.4, 1.6), rng.uniform(0.15, 0.4)
    rows: list[Row] = [(0, 0, 0, thick, long, high)]
    if rng.random() < 0.7:
        rows.append((0, 0, high, thick + 0.06, long, 0.06))
    if rng.random() < 0.3:
        rows += [(0, s * (long / 2 - 0.2), 0, thick + 0.12, 0.4, high + 0.2) for s in (-1, 1)]
    return Thing(
        "low_wall", boxes(rows, varied(rng, str(rng.choice(["brick", "concrete"])), 0.4)), "low_wall"
    )


def _foliage(rng: np.random.Generator, half: np.ndarray, count: int) -> Mesh:
    """Leaf faces 0.06-0.16 m long near the surface of an ellipsoid around the origin."""
    way = rng.normal(size=(count, 3))
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    centre = way * half * rng.uniform(0.7, 1.0, (count, 1))
    first, second = rng.normal(size=(2, count, 3))
    size = rng.uniform(0.03, 0.08, (count, 1))
    first *= size / np.linalg.norm(first, axis=1, keepdims=True)
    second *= size / np.linalg.norm(second, axis=1, keepdims=True)
    corners = centre[:, None] + np.stack([first, second, -first, -second], 1)
    return quads_mesh(corners, [varied(rng, "leaves", 0.3)], np.zeros(count, int))
