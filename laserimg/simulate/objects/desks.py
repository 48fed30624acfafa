"""Desks and tables. The sitter of a desk is at +x."""

import numpy as np

from laserimg.simulate.materials import Material
from laserimg.simulate.mesh import Mesh, joined, prism
from laserimg.simulate.objects.copies import Row, boxes, rods
from laserimg.simulate.objects.devices import desk_things
from laserimg.simulate.objects.loft import varied
from laserimg.simulate.things import Thing

FORMS = ("straight", "round_end", "corner")


def desk(rng: np.random.Generator, form: str | None = None, size: tuple[float, float] | None = None) -> Thing:
    """Return a desk with things on it: straight, with a round end, or L-shaped; with or without pedestals.

    EN 527-1: top 0.65-0.76 m above the floor (fixed ones 0.74), at least 0.60 m deep; 1.2-2.0 m wide.
    Pedestals 0.42 m wide, 0.5-0.6 m high.

    Parameters
    ----------
    rng : Generator
    form : str, optional
        One of `FORMS`, drawn by default.
    size : tuple of float, optional
        Depth and width of the top, drawn by default.
    """
    chosen = form or str(rng.choice(FORMS, p=[0.6, 0.22, 0.18]))
    deep, wide = size or (rng.uniform(0.62, 0.9), rng.uniform(1.2, 2.0))
    top = 0.74 + rng.uniform(-0.02, 0.02) if rng.random() < 0.7 else rng.uniform(0.66, 0.76)
    thick = rng.uniform(0.018, 0.035)
    plate = varied(rng, str(rng.choice(["wood", "plastic_light", "wood"])), 0.3)
    parts = [_plate(rng, chosen, deep, wide, thick, top, plate), _legs(rng, deep, wide, top - thick)]
    rows = _pedestals(rng, deep, wide)
    if rng.random() < 0.35:
        rows.append((-deep / 2 + 0.06, 0, 0.3, 0.018, wide - 0.15, top - thick - 0.3))
    if rng.random() < 0.2:
        rows.append((-deep / 2 + 0.01, 0, top, 0.03, wide, rng.uniform(0.3, 0.55)))
    parts.append(boxes(rows, plate))
    return Thing("desk", joined([*parts, *desk_things(rng, deep, wide, top)]))


def table(rng: np.random.Generator) -> Thing:
    """Return a table: 0.6-1.8 m long, 0.45-0.9 m wide, 0.40-0.76 m high; one in three is round, on a stem."""
    high = rng.uniform(0.70, 0.76) if rng.random() < 0.7 else rng.uniform(0.40, 0.55)
    plate, thick = varied(rng, "wood", 0.4), rng.uniform(0.02, 0.04)
    if rng.random() < 0.3:
        radius = rng.uniform(0.3, 0.6)
        angle = 2 * np.pi * np.arange(28) / 28
        disc = prism(radius * np.c_[np.cos(angle), np.sin(angle)], thick, plate).at(0, 0, high - thick)
        foot = boxes([(0, 0, 0, radius, 0.07, 0.04), (0, 0, 0, 0.07, radius, 0.04)], "metal_painted")
        stem = rods([((0, 0, 0), (0, 0, high - thick))], 0.035, "metal_painted")
        return Thing("table", joined([disc, stem, foot]))
    deep, wide = rng.uniform(0.45, 0.9), rng.uniform(0.6, 1.8)
    rows = [
        (0, 0, high - thick, deep, wide, thick),
        *_posts(deep, wide, high - thick, rng.uniform(0.03, 0.07)),
    ]
    for _ in range(int(rng.integers(0, 5))):
        x, y = rng.uniform(-0.3, 0.3) * deep, rng.uniform(-0.35, 0.35) * wide
        rows.append((x, y, high, *rng.uniform(0.08, 0.28, 2), rng.uniform(0.02, 0.25)))
    return Thing("table", boxes(rows, plate))


def pedestal(rng: np.random.Generator) -> Thing:
    """Return a chest of drawers on castors: 0.40-0.44 m wide, 0.5-0.8 m deep, 0.52-0.62 m high."""
    deep, wide, high = rng.uniform(0.5, 0.8), rng.uniform(0.40, 0.44), rng.uniform(0.52, 0.62)
    rows = [(0, 0, 0.05, deep, wide, high - 0.05), *_posts(deep, wide, 0.05, 0.04)]
    rows += [(deep / 2, 0, z * high, 0.03, 0.14, 0.012) for z in (0.35, 0.6, 0.85)]
    return Thing("pedestal", boxes(rows, varied(rng, str(rng.choice(["wood", "metal_painted"])), 0.3)))


def _plate(
    rng: np.random.Generator, form: str, deep: float, wide: float, thick: float, top: float, wood: Material
) -> Mesh:
    """The top; a round end is at +y, the arm of an L reaches towards +x there and stands on its own leg."""
    low = top - thick
    if form == "corner":
        arm, reach = rng.uniform(0.55, 0.7), rng.uniform(0.5, 0.8)
        middle = (deep / 2 + reach / 2, wide / 2 - arm / 2)
        leg = (deep / 2 + reach - 0.06, wide / 2 - arm / 2, 0, 0.05, 0.4, low)
        return boxes([(0, 0, low, deep, wide, thick), (*middle, low, reach, arm, thick), leg], wood)
    if form == "round_end":
        angle = np.radians(np.linspace(0, 180, 13))
        arc = np.c_[deep / 2 * np.cos(angle), wide / 2 - 0.3 + rng.uniform(0.3, 0.5) * np.sin(angle)]
        corners = [(-deep / 2, -wide / 2), (deep / 2, -wide / 2)]
        return prism(np.concatenate([corners, arc]), thick, wood).at(0, 0, low)
    return boxes([(0, 0, low, deep, wide, thick)], wood)


def _legs(rng: np.random.Generator, deep: float, wide: float, below: float) -> Mesh:
    metal = varied(rng, str(rng.choice(["metal_painted", "metal_bare"])), 0.3)
    kind = rng.random()
    y = wide / 2 - rng.uniform(0.05, 0.12) - (0.25 if kind > 0.9 else 0)
    if kind < 0.5:
        return boxes(_posts(deep, 2 * y + 0.05, below, rng.uniform(0.03, 0.06)), metal)
    if kind < 0.75:
        rows = [(0, s * y, 0, 0.85 * deep, 0.06, 0.04) for s in (-1, 1)]
        rows += [(-0.1 * deep, s * y, 0.04, 0.09, 0.05, below - 0.04) for s in (-1, 1)]
        return boxes([*rows, (-0.1 * deep, 0, below - 0.08, 0.04, 2 * y, 0.06)], metal)
    return boxes([(0, s * y, 0, 0.9 * deep, 0.025, below) for s in (-1, 1)], varied(rng, "wood", 0.3))


def _posts(deep: float, wide: float, high: float, size: float) -> list[Row]:
    x, y = (deep - size) / 2, (wide - size) / 2
    return [(a * x, b * y, 0, size, size, high) for a in (-1, 1) for b in (-1, 1)]


def _pedestals(rng: np.random.Generator, deep: float, wide: float) -> list[Row]:
    rows: list[Row] = []
    for side in (-1, 1):
        if rng.random() < 0.3:
            high = rng.uniform(0.5, 0.6)
            y = side * (wide / 2 - 0.38)
            rows.append((0, y, 0.04, 0.85 * deep, 0.42, high))
            rows += [(0.43 * deep, y, 0.04 + f * high, 0.03, 0.14, 0.012) for f in (0.3, 0.6, 0.88)]
    return rows
