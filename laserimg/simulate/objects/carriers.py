"""What carries the scanner: a small robot or a tripod, seen from above as near returns."""

import numpy as np

from laserimg.simulate.mesh import Mesh, joined
from laserimg.simulate.objects.copies import boxes, rods
from laserimg.simulate.objects.loft import lofted, varied
from laserimg.simulate.things import Thing


def carrier(rng: np.random.Generator, scanner_m: float) -> Thing:
    """Return the carrier of a scanner `scanner_m` above the floor, around the scanner's vertical axis.

    Its upper edge hides what is more than 40-60 degrees below the horizon, in waves of 2-6 degrees, 0.15-0.45
    m from the scanner: in the office scan the robot fills the beams below -43 to -60 degrees, 0.1-0.5 m away.
    """
    count = 72
    angle = 2 * np.pi * np.arange(count) / count
    waves = sum(
        rng.uniform(0.3, 1.0) * np.sin(k * angle + rng.uniform(0, 6))
        for k in rng.choice(np.arange(1, 9), 4, False)
    )
    edge = np.radians(np.clip(rng.uniform(44, 56) + rng.uniform(1, 3) * waves, 40, 72))
    reach = rng.uniform(0.15, 0.3) * (1 + 0.25 * np.sin(2 * angle + rng.uniform(0, 6)))
    reach = np.minimum(reach, 0.9 * scanner_m / np.tan(edge))
    level = scanner_m - reach * np.tan(edge)
    way = np.stack([np.cos(angle), np.sin(angle)], 1)
    low = np.maximum(level - 0.15, 0.3 * level)
    rings = [
        np.c_[0.8 * reach[:, None] * way, low],
        np.c_[reach[:, None] * way, level],
        np.c_[0.4 * reach[:, None] * way, np.maximum(level, scanner_m - 0.16)],
    ]
    dark = varied(rng, "plastic_dark", 0.5)
    return Thing("carrier", joined([lofted(np.stack(rings), [dark]), _below(rng, float(low.min()))]))


def _below(rng: np.random.Generator, top: float) -> Mesh:
    """Three legs, or a base with wheels."""
    if rng.random() < 0.4 and top > 0.3:
        angle = 2 * np.pi * np.arange(3) / 3 + rng.uniform(0, 2)
        way = np.stack([np.cos(angle), np.sin(angle)], 1)
        ends = np.stack([np.c_[0.05 * way, np.full(3, top)], np.c_[0.45 * top * way, np.zeros(3)]], 1)
        return rods(ends, 0.018, "metal_bare")
    long, wide, high = rng.uniform(0.35, 0.6), rng.uniform(0.3, 0.45), min(rng.uniform(0.2, 0.35), top + 0.02)
    body = [
        (0, 0, 0.4 * high, long, wide, 0.6 * high),
        (0, 0, 0.9 * high, 0.12, 0.12, max(top - 0.8 * high, 0.02)),
    ]
    x, y, wheel = 0.35 * long, wide / 2, 0.3 * high
    hubs = [
        ((a * x, s * (y - 0.03), wheel), (a * x, s * (y + 0.04), wheel)) for a in (-1, 1) for s in (-1, 1)
    ]
    return joined([boxes(body, varied(rng, "metal_painted", 0.4)), rods(hubs, wheel, "rubber")])
