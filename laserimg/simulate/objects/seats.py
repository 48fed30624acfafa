"""Office chairs, plain chairs, stools and armchairs. A seat's front is +x: its back stands at -x."""

import numpy as np

from laserimg.simulate.materials import Material
from laserimg.simulate.mesh import Mesh, joined
from laserimg.simulate.objects.copies import balls, boxes, rods
from laserimg.simulate.objects.cushions import bent, cushion, tilted
from laserimg.simulate.objects.loft import varied
from laserimg.simulate.things import Thing


def office_chair(rng: np.random.Generator) -> Thing:
    """Return a swivel chair: five-star base on castors, gas column, seat, backrest, arms on two in three.

    EN 1335-1: seat 0.40-0.53 m high, 0.38-0.48 m deep, 0.42-0.52 m wide, backrest at least 0.36 m
    high, armrests 0.19-0.26 m above the seat. Base radius 0.28-0.36 m and headrests set by eye.
    """
    seat_m, deep, wide = rng.uniform(0.40, 0.53), rng.uniform(0.39, 0.48), rng.uniform(0.42, 0.52)
    cloth = varied(rng, str(rng.choice(["fabric_dark", "fabric_light", "plastic_dark"])), 0.4)
    hard = varied(rng, str(rng.choice(["plastic_dark", "metal_bare", "plastic_light"])), 0.3)
    thick = rng.uniform(0.05, 0.10)
    seat = cushion((deep, wide, thick), cloth, rng.uniform(3, 8), rng.uniform(0.85, 1.0))
    seat = bent(seat, 1, 2, rng.uniform(-0.01, 0.02), wide / 2)
    under = boxes([(-0.02, 0, seat_m - thick - 0.06, 0.22, 0.2, 0.06)], hard)
    parts = [_star(rng, hard, seat_m - thick - 0.03), seat.at(0, 0, seat_m - thick), under]
    parts.append(_backrest(rng, cloth, hard, seat_m, deep, wide))
    if rng.random() < 2 / 3:
        parts.append(_arms(rng, hard, seat_m, wide, thick))
    return Thing("office_chair", joined(parts), "office_chair", clear_m=0.05)


def _star(rng: np.random.Generator, hard: Material, top: float) -> Mesh:
    angle = np.radians(72 * np.arange(5) + rng.uniform(0, 72))
    radius, hub, tip = rng.uniform(0.28, 0.36), rng.uniform(0.09, 0.14), rng.uniform(0.065, 0.085)
    way = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    ends = np.stack([np.c_[0.02 * way, np.full(5, hub)], np.c_[radius * way, np.full(5, tip)]], axis=1)
    castor = rng.uniform(0.025, 0.032)
    wheels = balls(np.c_[radius * way, np.full(5, castor)], (castor, castor, castor), "plastic_dark")
    column = [((0, 0, hub - 0.03), (0, 0, (hub + top) / 2)), ((0, 0, hub), (0, 0, top))]
    return joined([rods(ends, rng.uniform(0.016, 0.026), hard), wheels, rods(column, [0.03, 0.02], hard)])


def _backrest(
    rng: np.random.Generator, cloth: Material, hard: Material, seat_m: float, deep: float, wide: float
) -> Mesh:
    high, gap = rng.uniform(0.36, 0.72), rng.uniform(0.02, 0.16)
    width, thick = wide * rng.uniform(0.8, 1.0), rng.uniform(0.025, 0.09)
    flat = cushion((high, width, thick), cloth, rng.uniform(2.2, 8), rng.uniform(0.7, 1.05))
    flat = bent(flat, 1, 2, rng.uniform(0.0, 0.07), width / 2)
    # The plate lies: its +x end becomes the top, its upper side the front.
    upright = tilted(flat, -90).at(0, 0, high / 2)
    back_x = -deep / 2 + rng.uniform(0.0, 0.04)
    lean = -rng.uniform(3, 20)
    pieces = [upright.at(0, 0, gap)]
    if rng.random() < 0.12:
        head = cushion((rng.uniform(0.12, 0.18), rng.uniform(0.24, 0.32), 0.05), cloth, 4)
        pieces.append(tilted(head, -90).at(0, 0, gap + high + 0.13))
        pieces.append(boxes([(-0.03, 0, gap + high - 0.06, 0.02, 0.06, 0.14)], hard))
    if rng.random() < 0.1:
        jacket = cushion((high * rng.uniform(0.7, 1.0), width + 0.05, thick + 0.06), cloth, 5)
        pieces.append(tilted(jacket, -90).at(0.03, 0, gap + high / 2 + 0.05))
    bar = rods([((0, 0, 0), (-thick, 0, gap + 0.45 * high))], rng.uniform(0.012, 0.03), hard)
    beam = rods([((0.1, 0, seat_m - 0.08), (back_x, 0, seat_m - 0.03))], 0.018, hard)
    return joined([tilted(joined([*pieces, bar]), lean).at(back_x, 0, seat_m - 0.03), beam])


def _arms(rng: np.random.Generator, hard: Material, seat_m: float, wide: float, thick: float) -> Mesh:
    level, away = seat_m + rng.uniform(0.19, 0.26), wide / 2 + rng.uniform(0.02, 0.05)
    length, is_loop = rng.uniform(0.2, 0.32), rng.random() < 0.3
    ends, pads = [], []
    for y in (-away, away):
        low = seat_m - thick / 2
        ends += [((0, 0.6 * y, low), (0, y, low)), ((0, y, low), (0, y, level))]
        if is_loop:
            ends += [((-0.17, 0.7 * y, low), (-0.17, y, level)), ((-0.17, y, level), (0.12, y, level))]
        pads.append((0, y, level, length, 0.07, 0.03))
    return joined([rods(ends, rng.uniform(0.012, 0.02), hard), boxes(pads, hard)])


def chair(rng: np.random.Generator) -> Thing:
    """Return a chair without castors: four legs or a cantilever frame; it has no label.

    Seat 0.43-0.48 m high, 0.38-0.46 m deep and wide, overall 0.75-0.95 m (EN 16139, EN 1729-1 size 6).
    """
    seat_m, deep, wide = rng.uniform(0.43, 0.48), rng.uniform(0.38, 0.46), rng.uniform(0.38, 0.46)
    cloth, hard = varied(rng, str(rng.choice(["wood", "fabric_dark", "plastic_light"])), 0.3), "metal_bare"
    radius, rise = rng.uniform(0.009, 0.018), rng.uniform(0.32, 0.46)
    x, y = deep / 2 - 0.02, wide / 2 - 0.02
    ends, has_four_legs = [], rng.random() < 0.6
    for side in (-y, y):
        ends += [
            ((x, side, 0), (x, side, seat_m)),
            ((-x, side, seat_m - 0.02), (-x - 0.05, side, seat_m + rise)),
        ]
        if has_four_legs:
            ends.append(((-x, side, 0), (-x, side, seat_m)))
        else:
            ends.append(((-x, side, radius), (x, side, radius)))
    thick = rng.uniform(0.015, 0.05)
    seat = cushion((deep, wide, thick), cloth, rng.uniform(3, 9)).at(0, 0, seat_m - thick)
    high = rng.uniform(0.15, rise - 0.03)
    back = tilted(bent(cushion((high, wide, 0.03), cloth, 5), 1, 2, 0.02, wide / 2), -90 - 8)
    frame = rods(ends, radius, hard)
    return Thing("chair", _standing([frame, seat, back.at(-x - 0.03, 0, seat_m + rise - high / 2)]))


def stool(rng: np.random.Generator) -> Thing:
    """Return a stool on three or four legs, 0.40-0.75 m high, seat 0.28-0.40 m wide."""
    height, wide, legs = rng.uniform(0.40, 0.75), rng.uniform(0.28, 0.40), int(rng.integers(3, 5))
    angle = 2 * np.pi * np.arange(legs) / legs
    way = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    top = np.c_[0.3 * wide * way, np.full(legs, height - 0.02)]
    ends = np.stack([np.c_[0.5 * wide * way, np.full(legs, 0.0)], top], axis=1)
    seat = cushion((wide, wide, 0.04), varied(rng, "wood", 0.3), 2.0).at(0, 0, height - 0.04)
    return Thing("stool", _standing([rods(ends, 0.014, "metal_bare"), seat]))


def armchair(rng: np.random.Generator) -> Thing:
    """Return an upholstered armchair or sofa: 0.7-1.9 m wide, 0.7-0.9 m deep, seat 0.38-0.45 m high."""
    wide = rng.uniform(0.7, 0.95) if rng.random() < 0.7 else rng.uniform(1.4, 1.9)
    deep, seat_m, cloth = rng.uniform(0.7, 0.9), rng.uniform(0.38, 0.45), varied(rng, "fabric_light", 0.6)
    arm, back = rng.uniform(0.1, 0.2), rng.uniform(0.15, 0.25)
    base = boxes([(0, 0, 0.08, deep, wide, seat_m - 0.2)], cloth)
    seat = cushion((deep - back, wide - 2 * arm, 0.12), cloth, 8).at(back / 2, 0, seat_m - 0.12)
    rows = [(back / 2 - deep / 2, 0, 0.08, back, wide, rng.uniform(0.65, 0.85))]
    rows += [(0, y, 0.08, deep, arm, rng.uniform(0.45, 0.5)) for y in ((arm - wide) / 2, (wide - arm) / 2)]
    feet = [
        (x * (deep / 2 - 0.06), y * (wide / 2 - 0.06), 0, 0.05, 0.05, 0.1) for x in (-1, 1) for y in (-1, 1)
    ]
    return Thing("armchair", joined([base, seat, boxes(rows, cloth), boxes(feet, "wood")]))


def _standing(parts: list[Mesh]) -> Mesh:
    """The parts as one mesh whose lowest point is on z = 0."""
    mesh = joined(parts)
    return mesh.at(0, 0, -float(mesh.vertices[:, 2].min()))
