"""Shelves, cabinets, boxes, suitcases and coat racks; their fronts face +x."""

import numpy as np

from laserimg.simulate.mesh import joined
from laserimg.simulate.objects.copies import Row, balls, boxes, rods
from laserimg.simulate.objects.loft import varied
from laserimg.simulate.things import Thing


def shelf(rng: np.random.Generator) -> Thing:
    """Return a bookcase: 0.4-1.2 m wide, 0.25-0.40 m deep, 0.8-2.2 m high, boards 0.28-0.40 m apart.

    With or without back; each board full, half full or empty of books and binders (0.15-0.32 m high).
    """
    deep, wide, high = rng.uniform(0.25, 0.40), rng.uniform(0.4, 1.2), rng.uniform(0.8, 2.2)
    count = max(2, round(high / rng.uniform(0.28, 0.40)))
    level = np.linspace(0.05, high - 0.02, count + 1)
    rows: list[Row] = [(0, s * (wide / 2 - 0.01), 0, deep, 0.02, high) for s in (-1, 1)]
    rows += [(0, 0, z, deep, wide - 0.04, 0.02) for z in level]
    if rng.random() < 0.7:
        rows.append((-deep / 2 + 0.005, 0, 0.05, 0.008, wide - 0.04, high - 0.06))
    frame = boxes(rows, varied(rng, str(rng.choice(["wood", "metal_painted"])), 0.3))
    books = [_books(rng, deep, wide - 0.06, z + 0.02, level[1] - level[0] - 0.04) for z in level[:-1]]
    rows_of_books = np.concatenate(books)
    kinds = [varied(rng, name, 0.4) for name in ("paper", "plastic_dark", "cardboard")]
    filled = boxes(rows_of_books, kinds, rng.integers(0, 3, len(rows_of_books)))
    return Thing("shelf", joined([frame, filled]))


def _books(rng: np.random.Generator, deep: float, wide: float, z: float, room: float) -> np.ndarray:
    """Rows of `boxes` side by side from one end up to a random fill, and now and then a box."""
    if rng.random() < 0.15:
        return np.empty((0, 6))
    thick = rng.uniform(0.02, 0.08, int(wide / 0.02))
    right = np.cumsum(thick)
    used = right <= wide * rng.uniform(0.3, 1.0)
    thick, right = thick[used], right[used]
    side = rng.choice([-1, 1])
    sizes = [rng.uniform(0.5, 0.95, len(thick)) * (deep - 0.02), thick - 0.002]
    sizes.append(np.minimum(rng.uniform(0.15, 0.32, len(thick)), room))
    back = -deep / 2 + 0.01 + sizes[0] / 2 + rng.uniform(0, 0.04) * (sizes[0] < 0.7 * deep)
    return np.stack([back, side * (right - thick / 2 - wide / 2), np.full(len(thick), z), *sizes], 1)


def cabinet(rng: np.random.Generator) -> Thing:
    """Return a closed cabinet, locker or filing cabinet: 0.4-1.2 m wide, 0.35-0.65 m deep, 0.7-2.0 m high."""
    deep, wide, high = rng.uniform(0.35, 0.65), rng.uniform(0.4, 1.2), rng.uniform(0.7, 2.0)
    rows: list[Row] = [(0, 0, 0.05, deep, wide, high - 0.05), (0, 0, 0, deep - 0.06, wide - 0.04, 0.06)]
    if rng.random() < 0.5:
        gap = rng.uniform(0.02, 0.06)
        rows += [(deep / 2, s * gap, 0.5 * high, 0.04, 0.02, 0.14) for s in (-1, 1)]
        rows += [(deep / 2, s * wide / 4, 0.08, 0.02, wide / 2 - 0.01, high - 0.1) for s in (-1, 1)]
    else:
        drawers = max(2, round(high / 0.33))
        step = (high - 0.08) / drawers
        rows += [(deep / 2, 0, 0.07 + k * step, 0.02, wide - 0.02, step - 0.015) for k in range(drawers)]
        rows += [(deep / 2 + 0.015, 0, 0.07 + (k + 0.7) * step, 0.03, 0.16, 0.015) for k in range(drawers)]
    for _ in range(int(rng.integers(0, 4)) if high < 1.5 else 0):
        place = rng.uniform(-0.25, 0.25) * deep, rng.uniform(-0.35, 0.35) * wide
        rows.append((*place, high, *rng.uniform(0.08, 0.28, 2), rng.uniform(0.03, 0.35)))
    return Thing("cabinet", boxes(rows, varied(rng, str(rng.choice(["wood", "metal_painted"])), 0.3)))


def cardboard_boxes(rng: np.random.Generator) -> Thing:
    """Return one to four cartons beside and on each other, edges 0.2-0.6 m, some with open flaps."""
    material = varied(rng, "cardboard", 0.3)
    size = rng.uniform(0.2, 0.6, 3) * [1, 1, 0.85]
    parts = [boxes([(0, 0, 0, *size)], material)]
    if rng.random() < 0.4:
        flap = size[1] * rng.uniform(0.3, 0.5)
        x = size[0] / 2
        parts.append(
            boxes([(s * (x - 0.003), 0, size[2], 0.005, size[1] - 0.01, flap) for s in (-1, 1)], material)
        )
    elif rng.random() < 0.5:
        second = size * rng.uniform(0.5, 0.95, 3)
        parts.append(boxes([(0, 0, size[2], *second)], material).at(0, 0, 0, rng.uniform(-15, 15)))
    if rng.random() < 0.4:
        beside = rng.uniform(0.2, 0.5, 3)
        y = size[1] / 2 + 0.75 * float(np.hypot(*beside[:2])) / 1.2
        parts.append(boxes([(0, 0, 0, *beside)], material).at(0, y, 0, rng.uniform(-10, 10)))
    return Thing("cardboard_boxes", joined(parts))


def suitcase(rng: np.random.Generator) -> Thing:
    """Return a trolley case on castors or a standing briefcase: 0.36-0.5 m wide, 0.3-0.75 m high."""
    deep, wide, high = rng.uniform(0.15, 0.3), rng.uniform(0.36, 0.5), rng.uniform(0.3, 0.75)
    cloth = varied(rng, str(rng.choice(["fabric_dark", "plastic_dark"])), 0.4)
    lift = 0.05 if high > 0.5 else 0.0
    rows: list[Row] = [(0, 0, lift, deep, wide, high - lift)]
    if lift:
        rows += [
            (a * (deep / 2 - 0.03), b * (wide / 2 - 0.04), 0, 0.03, 0.05, 0.06)
            for a in (-1, 1)
            for b in (-1, 1)
        ]
    top = high + (rng.uniform(0.2, 0.4) if lift and rng.random() < 0.5 else 0.05)
    bar = [((0, -0.09, high - 0.01), (0, -0.09, top)), ((0, 0.09, high - 0.01), (0, 0.09, top))]
    handle = rods([*bar, ((0, -0.09, top), (0, 0.09, top))], 0.008, "metal_bare")
    return Thing("suitcase", joined([boxes(rows, cloth), handle]))


def coat_rack(rng: np.random.Generator) -> Thing:
    """Return a coat stand 1.6-1.9 m high with up to 4 coats 0.7-1.1 m long."""
    high = rng.uniform(1.6, 1.9)
    angle = np.radians(90 * np.arange(4) + rng.uniform(0, 90))
    way = np.stack([np.cos(angle), np.sin(angle)], 1)
    feet = np.stack([np.c_[0 * way, np.full(4, 0.15)], np.c_[0.26 * way, np.full(4, 0.02)]], 1)
    hooks = np.stack([np.c_[0 * way, np.full(4, high - 0.12)], np.c_[0.16 * way, np.full(4, high - 0.04)]], 1)
    stem = [((0, 0, 0.1), (0, 0, high))]
    parts = [rods(np.concatenate([feet, hooks, stem]), 0.018, varied(rng, "wood", 0.3))]
    hung = way[: int(rng.integers(0, 5))]
    if len(hung):
        long = rng.uniform(0.7, 1.1, len(hung))
        centre = np.c_[0.14 * hung, high - 0.06 - long / 2]
        sizes = np.c_[rng.uniform(0.08, 0.15, len(hung)), rng.uniform(0.12, 0.2, len(hung)), long / 2]
        parts.append(balls(centre, sizes, varied(rng, "fabric_dark", 0.5)))
    return Thing("coat_rack", joined(parts))
