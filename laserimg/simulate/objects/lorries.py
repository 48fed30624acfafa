"""Delivery vans, lorries and buses, front towards +x."""

import numpy as np

from laserimg.simulate.materials import MATERIALS, Material
from laserimg.simulate.mesh import Mesh, joined
from laserimg.simulate.objects.copies import Row, boxes, rods
from laserimg.simulate.objects.loft import lofted, varied
from laserimg.simulate.things import Thing


def lorry(rng: np.random.Generator) -> Thing:
    """Return a delivery van (1 in 2), a lorry with a box or flat bed, or a bus.

    Vans 4.9-6.9 m long, 1.95-2.1 m wide, 2.3-2.8 m high; lorries 6-9.5 m long, 2.3-2.55 m wide, 2.6-3.7 m
    high; buses 8-12 m long, 2.5 m wide, 2.9-3.2 m high (2.55 m and 4 m are the limits of EU 96/53).
    """
    paint = varied(rng, str(rng.choice(["paint_white", "metal_painted", "paint_dark"])), 0.3)
    kind = rng.random()
    if kind < 0.5:
        length, width, high = rng.uniform(4.9, 6.9), rng.uniform(1.95, 2.1), rng.uniform(2.3, 2.8)
        nose = [(0.0, 0.72), (0.45, 1.0), (0.95, 1.12), (1.6, high)]
        parts = [_hull(length, width, high, nose, paint, 0.22 * length)]
        wheel, axles = 0.34, (0.32 * length, -0.3 * length)
    elif kind < 0.85:
        length, width, high = rng.uniform(6.0, 9.5), rng.uniform(2.3, 2.55), rng.uniform(2.6, 3.7)
        cab = rng.uniform(1.6, 2.2)
        tall = min(high, rng.uniform(2.4, 2.9))
        front = _hull(cab, width - 0.1, tall, [(0.0, 1.2), (0.06, 1.5), (0.2, tall)], paint, 0.6 * cab, 0.5)
        deck: list[Row] = [(-cab / 2, 0, 0.75, length - cab - 0.1, 0.9, 0.25)]
        back = length - cab - 0.15
        if rng.random() < 0.7:
            deck.append((-cab / 2 - 0.02, 0, 1.0, back, width, high - 1.0))
        else:
            deck += [(-cab / 2, 0, 1.0, back, width, 0.15)]
            deck += [(-cab / 2, s * (width / 2 - 0.02), 1.15, back, 0.04, 0.4) for s in (-1, 1)]
        parts = [front.at((length - cab) / 2, 0), boxes(deck, varied(rng, "metal_painted", 0.4))]
        wheel, axles = 0.48, (length / 2 - 0.9 * cab, -0.28 * length)
    else:
        length, width, high = rng.uniform(8.0, 12.0), 2.5, rng.uniform(2.9, 3.2)
        parts = [_hull(length, width, high, [(0.0, 0.9), (0.05, 1.2), (0.12, high)], paint, length - 0.2)]
        wheel, axles = 0.48, (0.3 * length, -0.25 * length)
    parts.append(_wheels(width, wheel, axles))
    return Thing("lorry", joined(parts), "lorry")


def _hull(
    length: float,
    width: float,
    high: float,
    nose: list[tuple[float, float]],
    paint: Material,
    glazed_m: float,
    floor: float = 0.3,
) -> Mesh:
    """Upright sections from the front back: their tops follow `nose` (metres back, height), then the roof.

    The sides are glass in the upper half as far back as `glazed_m`; the steep part of the nose is too.
    """
    back = np.array([x for x, _ in nose] + [glazed_m, length - 0.05, length])
    top = np.array([z for _, z in nose] + [high, high, high - 0.06])
    order = np.argsort(back)
    back, top = back[order], top[order]
    low = np.where(back < 0.05, floor + 0.12, floor)
    waist = np.minimum(low + 0.45 * (high - low), top - 0.02)
    half = width / 2 * np.where((back < 0.05) | (back > length - 0.02), 0.9, 1.0)
    inner = np.where(top > 0.8 * high, 0.93, 0.97)
    y = np.stack([half, half, half * inner, -half * inner, -half, -half], 1)
    z = np.stack([low, waist, top, top, waist, low], 1)
    x = np.broadcast_to((length / 2 - back)[:, None], y.shape)
    which = np.zeros((len(back) - 1, 6), int)
    is_glazed = back[1:] <= glazed_m + 1e-9
    which[is_glazed & (back[1:] > 0.4), 1] = 1
    which[is_glazed & (back[1:] > 0.4), 3] = 1
    steep = np.diff(top) > 0.8 * np.maximum(np.diff(back), 1e-6)
    which[steep & (top[1:] > 0.6 * high), 2] = 1
    return lofted(np.stack([x, y, z], -1), [paint, MATERIALS["glass"]], which)


def _wheels(width: float, radius: float, axles: tuple[float, ...]) -> Mesh:
    ends = [
        ((x, s * (width / 2 - 0.28), radius), (x, s * (width / 2 + 0.005), radius))
        for x in axles
        for s in (-1, 1)
    ]
    return rods(ends, radius, "rubber")
