"""What lies about in offices: bags, cables, stacks, heaps of equipment, trolleys, boards and screens."""

import numpy as np
from numpy.typing import NDArray

from laserimg.simulate.mesh import Mesh, joined
from laserimg.simulate.objects.copies import BOX, Row, balls, boxes, copies, rods
from laserimg.simulate.objects.loft import lofted, varied
from laserimg.simulate.things import Thing

_HARD = ("plastic_dark", "plastic_light", "metal_painted", "metal_bare", "cardboard", "wood")


def bag(rng: np.random.Generator) -> Thing:
    """Return a rucksack or bag: 0.25-0.45 m wide, 0.12-0.25 m deep, 0.22-0.5 m high, with a handle."""
    deep, wide, high = rng.uniform(0.12, 0.25), rng.uniform(0.25, 0.45), rng.uniform(0.22, 0.5)
    angle = 2 * np.pi * (np.arange(16) + 0.5) / 16
    round_xy = np.stack([np.cos(angle), np.sin(angle)], 1)
    outline = np.sign(round_xy) * np.abs(round_xy) ** rng.uniform(0.4, 0.8) * [deep / 2, wide / 2]
    level = np.array([0, 0.04, 0.3, 0.7, 0.92, 1.0])
    scale = np.array([0.9, 1, rng.uniform(0.9, 1.1), rng.uniform(0.75, 1), rng.uniform(0.5, 0.8), 0.3])
    lean = rng.uniform(-0.2, 0.2, 2) * high
    rings = [np.c_[s * outline + k * lean, np.full(16, k * high)] for s, k in zip(scale, level, strict=True)]
    cloth = varied(rng, str(rng.choice(["fabric_dark", "fabric_light"])), 0.4)
    y, top = 0.15 * wide, high - 0.01
    handle = np.array([(0, -y, top), (0, -0.5 * y, top + 0.08), (0, 0.5 * y, top + 0.08), (0, y, top)])
    handle[:, :2] += lean
    loop = rods(np.stack([handle[:-1], handle[1:]], 1), 0.012, cloth)
    return Thing("bag", joined([lofted(np.stack(rings), [cloth]), loop]))


def cables(rng: np.random.Generator) -> Thing:
    """Return 2-6 cables 0.5-2 m long and 6-16 mm thick on the floor, most with a socket strip."""
    ends = []
    for _ in range(int(rng.integers(2, 7))):
        turn = np.cumsum(rng.normal(0, 0.5, 7)) + rng.uniform(0, 6)
        way = np.stack([np.cos(turn), np.sin(turn)], 1) * rng.uniform(0.08, 0.28)
        line = np.c_[np.cumsum(way, 0) + rng.uniform(-0.2, 0.2, 2), np.full(7, 0.008)]
        ends.append(np.stack([line[:-1], line[1:]], 1))
    parts = [rods(np.concatenate(ends), rng.uniform(0.003, 0.008), "rubber")]
    if rng.random() < 0.7:
        parts.append(boxes([(0, 0, 0, 0.06, rng.uniform(0.2, 0.45), 0.045)], varied(rng, "plastic_light")))
    return Thing("cables", joined(parts))


def stack(rng: np.random.Generator) -> Thing:
    """Return a stack of 3-12 books, binders or devices, 0.2-0.45 m wide, up to about 0.7 m high."""
    count = int(rng.integers(3, 13))
    sizes = np.c_[rng.uniform(0.2, 0.35, count), rng.uniform(0.2, 0.45, count), rng.uniform(0.01, 0.1, count)]
    low = np.concatenate([[0], np.cumsum(sizes[:-1, 2])])
    shift = np.c_[rng.normal(0, 0.02, (count, 2)), low]
    kinds = [varied(rng, name, 0.4) for name in ("paper", "cardboard", "plastic_dark")]
    return Thing("stack", _turned_boxes(rng, sizes, shift, kinds, 12))


def equipment(rng: np.random.Generator) -> Thing:
    """Return a heap of 4-14 boxes, tubes and balls, 0.3-1 m wide and 0.2-1.3 m high: half-built machines.

    The office scan shows several such things amid its desks; sizes set by eye.
    """
    count, half = int(rng.integers(4, 15)), rng.uniform(0.15, 0.45)
    sizes = rng.uniform(0.06, 0.45, (count, 3)) * [1, 1, 0.8]
    level, shift = np.zeros(count), rng.uniform(-1, 1, (count, 2)) * half * 0.6
    for k in range(1, count):
        # A thing lies on one of those before it, near its middle, up to 1.1 m.
        under = int(rng.integers(-1, k))
        top = level[under] + sizes[under, 2]
        if under >= 0 and top < 1.1:
            level[k], shift[k] = top - 0.005, shift[under] + rng.uniform(-0.3, 0.3, 2) * sizes[under, :2]
    kinds = [varied(rng, str(rng.choice(_HARD)), 0.4) for _ in range(3)]
    parts = [_turned_boxes(rng, sizes, np.c_[shift, level], kinds, 90)]
    host = rng.integers(0, count, int(rng.integers(1, 8)))
    foot = np.c_[shift[host], level[host] + 0.5 * sizes[host, 2]]
    way = rng.normal((0, 0, 0.15), 0.2, (len(host), 3))
    head = np.maximum(foot + way, [-np.inf, -np.inf, 0.02])
    parts.append(rods(np.stack([foot, head], 1), rng.uniform(0.008, 0.04, len(host)), kinds[0]))
    if rng.random() < 0.5:
        parts.append(balls(head[:2], rng.uniform(0.03, 0.12, (len(head[:2]), 3)), kinds[1]))
    mesh = joined(parts)
    return Thing("equipment", mesh.at(0, 0, -float(mesh.vertices[:, 2].min())))


def trolley(rng: np.random.Generator) -> Thing:
    """Return a trolley of 2-3 loaded boards on castors: 0.4-0.6 m deep, 0.5-0.9 m wide, 0.7-1.5 m high."""
    deep, wide, high = rng.uniform(0.4, 0.6), rng.uniform(0.5, 0.9), rng.uniform(0.7, 1.2)
    levels = np.linspace(0.15, high - 0.03, int(rng.integers(2, 4)))
    rows: list[Row] = [(0, 0, z, deep, wide, 0.025) for z in levels]
    x, y = deep / 2 - 0.02, wide / 2 - 0.02
    posts = [((a * x, b * y, 0.02), (a * x, b * y, high)) for a in (-1, 1) for b in (-1, 1)]
    for z in levels:
        for side in (-1, 1):
            if rng.random() < 0.7:
                size = rng.uniform(0.12, 0.4, 3) * [deep / 0.5, wide / 0.8, 0.8]
                rows.append((0, side * wide / 4, z + 0.025, *size))
    wheels = balls([end[0] for end in posts], (0.03, 0.03, 0.02), "rubber")
    metal = varied(rng, str(rng.choice(_HARD[:4])), 0.4)
    return Thing("trolley", joined([boxes(rows, metal), rods(posts, 0.014, "metal_bare"), wheels]))


def whiteboard(rng: np.random.Generator) -> Thing:
    """Return a board on a stand, 0.7-1.8 m wide, its top 1.7-2.0 m high."""
    wide, top = rng.uniform(0.7, 1.8), rng.uniform(1.7, 2.0)
    high, y = rng.uniform(0.9, 1.2), wide / 2 - 0.03
    board = boxes([(0, 0, top - high, 0.025, wide, high)], varied(rng, "paint_white", 0.1))
    ends = [((0, s * y, 0.03), (0, s * y, top)) for s in (-1, 1)]
    ends += [((-0.28, s * y, 0.03), (0.28, s * y, 0.03)) for s in (-1, 1)]
    return Thing("whiteboard", joined([board, rods(ends, 0.02, "metal_bare")]))


def screen(rng: np.random.Generator) -> Thing:
    """Return a free partition, 0.8-1.8 m wide and 1.1-1.8 m high, 3-6 cm thick, on two feet."""
    thick, wide, high = rng.uniform(0.03, 0.06), rng.uniform(0.8, 1.8), rng.uniform(1.1, 1.8)
    rows = [(0, 0, 0.06, thick, wide, high - 0.06)]
    rows += [(0, s * (wide / 2 - 0.1), 0, 0.4, 0.05, 0.06) for s in (-1, 1)]
    return Thing("screen", boxes(rows, varied(rng, "fabric_light", 0.5)))


def on_wall(rng: np.random.Generator) -> Thing:
    """Return what hangs on a wall behind x = 0: a board or picture, a cabinet, or a shelf with books.

    Lower edge 0.9-1.6 m above the floor: it does not stand on z = 0.
    """
    low, wide, kind = rng.uniform(0.9, 1.6), rng.uniform(0.4, 1.8), rng.random()
    if kind < 0.5:
        high = rng.uniform(0.3, 1.0)
        return Thing("board", boxes([(0.015, 0, low, 0.03, wide, high)], varied(rng, "paint_white", 0.4)))
    deep = rng.uniform(0.18, 0.35)
    if kind < 0.65:
        rows: list[Row] = [(deep / 2, 0, low, deep, wide, rng.uniform(0.35, 0.7))]
        return Thing("wall_cabinet", boxes(rows, varied(rng, "wood", 0.4)))
    rows = [(deep / 2, 0, low, deep, wide, 0.025)]
    y = -wide / 2 + np.cumsum(rng.uniform(0.02, 0.12, int(wide * rng.uniform(4, 12))))
    for k, place in enumerate(y[y < wide / 2 - 0.05]):
        thick = min(0.06, float(np.diff(y, prepend=-wide / 2)[k])) * 0.95
        rows.append(
            (deep * 0.45, place, low + 0.025, deep * rng.uniform(0.5, 0.9), thick, rng.uniform(0.1, 0.32))
        )
    return Thing("wall_shelf", boxes(rows, varied(rng, "wood", 0.4)))


def _turned_boxes(
    rng: np.random.Generator, sizes: NDArray, shift: NDArray, kinds: list, turn_deg: float
) -> Mesh:
    """Boxes of (k, 3) sizes at (k, 3) feet, each turned about z by up to `turn_deg`."""
    angle = np.radians(rng.uniform(-turn_deg, turn_deg, len(sizes)))
    cos, sin, none = np.cos(angle), np.sin(angle), 0 * angle
    turn = np.stack([cos, -sin, none, sin, cos, none, none, none, none + 1], 1).reshape(-1, 3, 3)
    return copies(BOX, turn * sizes[:, None, :], shift, kinds, rng.integers(0, len(kinds), len(sizes)))
