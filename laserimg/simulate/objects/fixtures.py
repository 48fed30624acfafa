"""What is built in: radiators, columns, pipes, ceiling lamps; and potted plants."""

import numpy as np

from laserimg.simulate.mesh import Mesh, cylinder, joined
from laserimg.simulate.objects.copies import Row, boxes, rods
from laserimg.simulate.objects.loft import quads_mesh, varied
from laserimg.simulate.things import Thing


def radiator(rng: np.random.Generator) -> Thing:
    """Return a radiator facing +x, its back on x = 0: 0.4-1.8 m long, 0.3-0.9 m high, 0.06-0.16 m deep.

    Plain plates, or columns 45-60 mm apart, with two pipes to the floor (sizes as EN 442 catalogues).
    """
    deep, wide, high, lift = (
        rng.uniform(0.06, 0.16),
        rng.uniform(0.4, 1.8),
        rng.uniform(0.3, 0.9),
        rng.uniform(0.08, 0.15),
    )
    white = varied(rng, "paint_white", 0.15)
    if rng.random() < 0.5:
        count = max(3, int(wide / rng.uniform(0.045, 0.06)))
        rows: list[Row] = [
            (deep / 2 + 0.03, y, lift, deep, 0.6 * wide / count, high)
            for y in np.linspace(-0.5, 0.5, count) * wide
        ]
    else:
        rows = [(x, 0, lift, 0.02, wide, high) for x in (0.04, deep + 0.02)]
        rows.append((deep / 2 + 0.03, 0, lift + high - 0.02, deep, wide, 0.02))
    feet = [
        ((deep / 2 + 0.03, s * 0.45 * wide, 0), (deep / 2 + 0.03, s * 0.45 * wide, lift + 0.03))
        for s in (-1, 1)
    ]
    return Thing("radiator", joined([boxes(rows, white), rods(feet, 0.01, white)]))


def column(rng: np.random.Generator, height_m: float | None = None) -> Thing:
    """Return a pillar, round or square: 0.25-0.6 m wide, by default 2.4-3.2 m high."""
    wide, high = rng.uniform(0.25, 0.6), height_m or rng.uniform(2.4, 3.2)
    stone = varied(rng, str(rng.choice(["concrete", "plaster"])), 0.2)
    if rng.random() < 0.5:
        return Thing("column", cylinder(wide / 2, high, stone, 24))
    return Thing("column", boxes([(0, 0, 0, wide, wide * rng.uniform(0.7, 1.0), high)], stone))


def pipe(rng: np.random.Generator, height_m: float | None = None) -> Thing:
    """Return one to three riser pipes 20-110 mm wide, by default 2.4-3.2 m high."""
    high, count = height_m or rng.uniform(2.4, 3.2), int(rng.integers(1, 4))
    y = 0.14 * np.arange(count)
    ends = np.stack([np.c_[0 * y, y, 0 * y], np.c_[0 * y, y, 0 * y + high]], 1)
    return Thing("pipe", rods(ends, rng.uniform(0.01, 0.055, count), varied(rng, "metal_painted", 0.3)))


def ceiling_lamp(rng: np.random.Generator) -> Thing:
    """Return a ceiling lamp whose top is at z = 0: a tray 1.2-1.6 m long, 0-0.5 m below, or a disc."""
    drop = rng.uniform(0.0, 0.5) if rng.random() < 0.6 else 0.0
    if rng.random() < 0.25:
        radius = rng.uniform(0.12, 0.25)
        return Thing("ceiling_lamp", cylinder(radius, 0.1, "plastic_light", 20).at(0, 0, -0.1))
    long, wide = rng.uniform(1.2, 1.6), rng.uniform(0.08, 0.35)
    parts = [boxes([(0, 0, -drop - 0.07, long, wide, 0.07)], varied(rng, "metal_painted", 0.3))]
    if drop > 0.02:
        ends = [((x, 0, -drop - 0.01), (x, 0, 0)) for x in (-0.4 * long, 0.4 * long)]
        parts.append(rods(ends, 0.006, "metal_bare"))
    return Thing("ceiling_lamp", joined(parts))


def plant(rng: np.random.Generator) -> Thing:
    """Return a potted plant 0.5-2.0 m high: pot 0.18-0.45 m wide, 40-160 leaves of 6-30 cm on stems."""
    high, pot = rng.uniform(0.5, 2.0), rng.uniform(0.09, 0.22)
    tall = pot * rng.uniform(1.3, 2.2)
    shell = varied(rng, str(rng.choice(["plastic_dark", "brick", "plastic_light"])), 0.3)
    parts = [cylinder(pot * rng.uniform(0.65, 1.0), tall, shell, 20, pot)]
    crown = max(high - tall, 0.25)
    spread = rng.uniform(0.25, 0.55) * min(crown, 1.1)
    count = int(rng.integers(40, 160))
    height = crown * rng.beta(1.6, 1.3, count)
    angle = rng.uniform(0, 2 * np.pi, count)
    away = spread * np.sqrt(rng.random(count)) * np.sin(np.pi * np.clip(0.15 + 0.8 * height / crown, 0, 1))
    centre = np.stack([away * np.cos(angle), away * np.sin(angle), tall + height], 1)
    size = rng.uniform(0.03, 0.12) * rng.uniform(0.6, 1.25, count)
    parts.append(_leaves(rng, centre, size, rng.uniform(0.25, 0.8)))
    top = centre[rng.integers(0, count, int(rng.integers(2, 7)))]
    parts.append(
        rods(np.stack([top * [0.1, 0.1, 0] + [0, 0, tall - 0.02], top], 1), rng.uniform(0.004, 0.02), "bark")
    )
    return Thing("plant", joined(parts))


def _leaves(rng: np.random.Generator, centre: np.ndarray, size: np.ndarray, slim: float) -> Mesh:
    """Flat leaves turned any way."""
    first = rng.normal(size=(len(centre), 3))
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    second = np.cross(first, rng.normal(size=(len(centre), 3)))
    second *= slim / np.linalg.norm(second, axis=1, keepdims=True)
    corners = np.stack([first, second, -first, -second], 1) * size[:, None, None]
    return quads_mesh(centre[:, None] + corners, [varied(rng, "leaves", 0.3)], np.zeros(len(centre), int))
