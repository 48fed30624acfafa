"""Things that stand on desks or beside them: PCs, monitors, printers, lamps, robots."""

import numpy as np
from numpy.typing import NDArray

from laserimg.simulate.mesh import Mesh, cylinder, joined
from laserimg.simulate.objects.copies import balls, boxes, rods
from laserimg.simulate.objects.loft import varied
from laserimg.simulate.things import Thing


def computer(rng: np.random.Generator) -> Thing:
    """Return a tower PC: 0.16-0.21 m wide, 0.36-0.48 m deep and high (ATX cases)."""
    size = rng.uniform(0.36, 0.48), rng.uniform(0.16, 0.21), rng.uniform(0.36, 0.48)
    case = varied(rng, str(rng.choice(["plastic_light", "plastic_dark", "metal_painted"])), 0.3)
    return Thing(
        "computer", boxes([(0, 0, 0, *size), (size[0] / 2, 0, 0.7 * size[2], 0.01, 0.14, 0.08)], case)
    )


def monitor(rng: np.random.Generator) -> Thing:
    """Return a screen facing +x: flat, 17-27 inches, or one in four a tube 0.35-0.42 m deep."""
    wide = rng.uniform(0.36, 0.62)
    high, foot = wide * rng.uniform(0.6, 0.8), rng.uniform(0.06, 0.16)
    case = varied(rng, str(rng.choice(["plastic_light", "plastic_dark"])), 0.3)
    rows = [
        (0.02, 0, foot, 0.04, wide, high),
        (-0.03, 0, 0, 0.2, 0.24, 0.015),
        (-0.04, 0, 0, 0.03, 0.07, foot + 0.1),
    ]
    if rng.random() < 0.25:
        wide, deep = rng.uniform(0.36, 0.44), rng.uniform(0.35, 0.42)
        high = 0.85 * wide
        rows = [(0.05, 0, 0.05, 0.1, wide, high), (-0.09, 0, 0.07, 0.18, 0.85 * wide, 0.85 * high)]
        rows += [
            (-0.05 - deep / 2, 0, 0.09, deep / 3, 0.55 * wide, 0.6 * high),
            (-0.03, 0, 0, 0.26, 0.26, 0.05),
        ]
    return Thing("monitor", boxes(rows, case))


def printer(rng: np.random.Generator) -> Thing:
    """Return a printer or copier of two or three boxes: 0.35-0.6 m wide, 0.2-0.45 m high."""
    deep, wide, high = rng.uniform(0.35, 0.5), rng.uniform(0.35, 0.6), rng.uniform(0.2, 0.45)
    rows = [
        (0, 0, 0, deep, wide, 0.7 * high),
        (-0.1 * deep, 0, 0.7 * high, 0.8 * deep, 0.9 * wide, 0.3 * high),
    ]
    rows.append((0.55 * deep, 0, 0.3 * high, 0.15, 0.6 * wide, 0.02))
    return Thing("printer", boxes(rows, varied(rng, "plastic_light", 0.4)))


def floor_lamp(rng: np.random.Generator) -> Thing:
    """Return a lamp on a stem, 1.3-1.9 m high, base 0.2-0.32 m wide."""
    height, base = rng.uniform(1.3, 1.9), rng.uniform(0.1, 0.16)
    shade = cylinder(rng.uniform(0.12, 0.22), rng.uniform(0.12, 0.3), varied(rng, "paper", 0.3), 16, 0.1)
    stem = rods([((0, 0, 0.02), (0, 0, height))], 0.013, "metal_painted")
    parts = [cylinder(base, 0.025, "metal_painted", 16), stem, shade.at(0, 0, height - 0.1)]
    return Thing("floor_lamp", joined(parts))


def robot(rng: np.random.Generator) -> Thing:
    """Return a wheeled robot: body 0.35-0.65 m long, 0.25-0.5 m high, four wheels, sensors, a mast or arm."""
    long, wide, high = rng.uniform(0.35, 0.65), rng.uniform(0.3, 0.5), rng.uniform(0.12, 0.3)
    wheel = rng.uniform(0.06, 0.13)
    body = varied(rng, str(rng.choice(["metal_painted", "plastic_dark", "metal_bare"])), 0.4)
    x, y = 0.35 * long, wide / 2
    ends = [
        ((a * x, s * (y - 0.05), wheel), (a * x, s * (y + 0.04), wheel)) for a in (-1, 1) for s in (-1, 1)
    ]
    parts = [rods(ends, wheel, "rubber"), boxes([(0, 0, 0.7 * wheel, long, wide - 0.1, high)], body)]
    top = 0.7 * wheel + high
    sensors = [
        (rng.uniform(-0.4, 0.4) * long, rng.uniform(-0.3, 0.3) * wide) for _ in range(int(rng.integers(1, 5)))
    ]
    sizes = rng.uniform(0.05, 0.18, (len(sensors), 3))
    parts.append(boxes(np.c_[sensors, np.full(len(sensors), top), sizes], "plastic_dark"))
    if rng.random() < 0.6:
        mast = rng.uniform(0.2, 0.8)
        parts.append(rods([((-0.2 * long, 0, top), (-0.2 * long, 0, top + mast))], 0.02, "metal_bare"))
        parts.append(boxes([(-0.2 * long, 0, top + mast, *rng.uniform(0.08, 0.25, 3))], "plastic_dark"))
    return Thing("robot", joined(parts))


def desk_things(rng: np.random.Generator, deep: float, wide: float, top: float) -> list[Mesh]:
    """Return what lies on a desk of that depth and width: screens, papers, cups, lamps, sometimes a PC.

    The sitter is at +x, so screens stand towards -x and face +x.
    """
    room = wide / 2 - 0.3
    parts = []
    for y in rng.uniform(-room, room, int(rng.choice([0, 1, 2, 3], p=[0.12, 0.4, 0.38, 0.1]))):
        screen = monitor(rng).mesh
        parts.append(screen.at(-deep / 2 + rng.uniform(0.28, 0.35) - 0.05, y, top, rng.uniform(-25, 25)))
    if rng.random() < 0.35:
        device = computer(rng) if rng.random() < 0.6 else printer(rng)
        parts.append(device.mesh.at(-deep / 2 + 0.27, rng.choice([-1, 1]) * room, top, rng.uniform(-8, 8)))
    count = int(rng.integers(3, 20))
    sizes = np.stack(
        [rng.uniform(0.1, 0.3, count), rng.uniform(0.08, 0.3, count), 0.01 + 0.3 * rng.random(count) ** 3], 1
    )
    x = rng.uniform(-0.5, 0.5, count) * (deep - 0.3)
    y = rng.uniform(-0.5, 0.5, count) * (wide - 0.3)
    keyboard = np.array([[0.5 * deep - 0.2, rng.uniform(-0.2, 0.2), top, 0.15, 0.44, 0.025]])
    rows = np.concatenate([keyboard, np.c_[x, y, np.full(count, top), sizes]])
    papers, dark = varied(rng, "paper", 0.3), varied(rng, "plastic_dark", 0.3)
    parts.append(boxes(rows, [papers, dark], rng.integers(0, 2, len(rows))))
    if rng.random() < 0.35:
        parts.append(_desk_lamp(rng, deep, room, top))
    if rng.random() < 0.5:
        parts.append(_cups(rng, deep, wide, top))
    return parts


def _desk_lamp(rng: np.random.Generator, deep: float, room: float, top: float) -> Mesh:
    y = rng.uniform(-room, room)
    foot, elbow = (
        np.array([-deep / 2 + 0.1, y, top]),
        np.array([-deep / 2 + 0.08, y, top + rng.uniform(0.25, 0.4)]),
    )
    head = elbow + np.array([0.2, rng.uniform(-0.2, 0.2), rng.uniform(-0.05, 0.2)])
    arms = rods([(foot, elbow), (elbow, head)], 0.012, "metal_painted")
    return joined(
        [
            arms,
            balls([head], (0.08, 0.08, 0.06), "metal_painted"),
            boxes([(*foot, 0.16, 0.16, 0.02)], "plastic_dark"),
        ]
    )


def _cups(rng: np.random.Generator, deep: float, wide: float, top: float) -> Mesh:
    count = int(rng.integers(1, 5))
    x, y = rng.uniform(-0.4, 0.4, count) * deep, rng.uniform(-0.4, 0.4, count) * wide
    low: NDArray = np.stack([x, y, np.full(count, top)], 1)
    high = low + np.c_[np.zeros((count, 2)), rng.uniform(0.08, 0.28, count)]
    return rods(np.stack([low, high], 1), rng.uniform(0.03, 0.045, count), varied(rng, "plastic_light", 0.3))
