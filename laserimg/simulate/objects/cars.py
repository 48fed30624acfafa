"""Cars: hatchback, saloon, estate, SUV and van."""

from dataclasses import dataclass

import numpy as np

from laserimg.simulate.materials import MATERIALS
from laserimg.simulate.mesh import Mesh, cylinder, joined
from laserimg.simulate.objects.copies import boxes, copies
from laserimg.simulate.objects.loft import lofted, varied
from laserimg.simulate.things import Thing

# Axles as fractions of the length from the front.
WHEELS = (0.19, 0.80)
PAINTS = ("paint_white", "paint_dark", "metal_painted")
_WHEEL = cylinder(1, 1, "rubber", 20)
# Pillars as fractions of the cabin's side: A, B, C, D.
SIDE = np.array([0.0, 0.04, 0.33, 0.37, 0.64, 0.68, 0.94, 1.0])
ACROSS = np.array([-1.0, -0.92, -0.4, 0.4, 0.92, 1.0])
# Heights of the cabin's rings as fractions from waist to roof; the second strip is glass.
LEVELS = np.array([0.0, 0.08, 0.80, 0.93, 1.0])


@dataclass(frozen=True, slots=True)
class Style:
    """Ranges in metres, and the cabin's foot and roof as fractions of the length from the front."""

    length_m: tuple[float, float]
    width_m: tuple[float, float]
    height_m: tuple[float, float]
    foot: tuple[float, float]
    roof: tuple[float, float]


STYLES = {
    "hatchback": Style((3.6, 4.35), (1.65, 1.82), (1.43, 1.55), (0.24, 0.97), (0.42, 0.86)),
    "saloon": Style((4.4, 4.95), (1.75, 1.90), (1.40, 1.50), (0.27, 0.86), (0.43, 0.70)),
    "estate": Style((4.4, 4.90), (1.75, 1.88), (1.44, 1.55), (0.26, 0.98), (0.42, 0.90)),
    "suv": Style((4.2, 4.90), (1.80, 2.00), (1.60, 1.80), (0.24, 0.97), (0.40, 0.88)),
    "van": Style((4.4, 5.30), (1.80, 2.00), (1.80, 2.00), (0.13, 0.99), (0.28, 0.95)),
}


def car(rng: np.random.Generator) -> Thing:
    """Return a passenger car, front towards +x.

    Sizes lie in `STYLES`, the range of makers' data for European segments B to E, SUV and small van
    (chosen from common knowledge of such cars, not from a standard); mirrors reach up to 0.14 m
    beyond the width on each side.
    """
    style = STYLES[str(rng.choice(list(STYLES)))]
    length, width, height = (rng.uniform(*r) for r in (style.length_m, style.width_m, style.height_m))
    paint = varied(rng, str(rng.choice(PAINTS)), 0.3)
    waist = height * rng.uniform(0.60, 0.65)
    wheel = rng.uniform(0.29, 0.33) * (1.1 if height > 1.55 else 1.0)
    parts = [
        _body(length, width, waist, wheel, style, paint),
        _cabin(length, width, waist, height, style, paint),
        *_wheels(length, width, wheel),
        _mirrors_and_seats(length, width, waist, style, paint),
    ]
    return Thing("car", joined(parts), "car")


def _body(length, width, waist, wheel, style, paint) -> Mesh:
    """Rounded cross-sections along the length; the bonnet and boot fall off to the ends.

    The underside rises over the wheels: arches, seen from the side.
    """
    arch = np.array([-1.0, -0.85, -0.5, 0.0, 0.5, 0.85, 1.0]) * 1.22 * wheel / length
    middles = np.array(WHEELS)[:, None] + arch
    station = np.array([0.0, 0.02, 0.06, style.foot[0], 0.5, style.foot[1] - 0.02, 0.985, 1.0])
    apart = np.abs(station[:, None] - np.array(WHEELS)).min(axis=1) > 1.25 * wheel / length
    station = np.sort(np.concatenate([station[apart], middles.ravel()]))
    narrow = np.interp(station, [0, 0.02, 0.1, 0.3, 0.8, 0.97, 1], [0.84, 0.9, 0.97, 1, 1, 0.95, 0.88])
    top = np.interp(station, [0, 0.06, style.foot[0], 0.97, 1], np.array([0.72, 0.84, 1, 1, 0.9]) * waist)
    bottom = np.interp(station, [0, 0.06, 0.94, 1], np.array([1.0, 0.6, 0.6, 1.1]) * wheel)
    for middle in WHEELS:
        off = (station - middle) * length / (1.22 * wheel)
        raised = wheel * (1 + 1.22 * np.sqrt(np.clip(1 - off**2, 0, 1)))
        bottom = np.where(np.abs(off) < 0.99, np.minimum(raised, 0.9 * top), bottom)
    angle = 2 * np.pi * np.arange(16) / 16
    across, up = (np.sign(f) * np.abs(f) ** 0.4 for f in (np.cos(angle), np.sin(angle)))
    y = narrow[:, None] * across * width / 2
    z = (top + bottom)[:, None] / 2 + (top - bottom)[:, None] / 2 * up
    x = np.broadcast_to((0.5 - station)[:, None] * length, y.shape)
    return lofted(np.stack([x, y, z], -1), [paint])


def _cabin(length, width, waist, height, style, paint) -> Mesh:
    """Rings from waist to roof; front and rear lean in, sides lean by the tumblehome."""
    lean = np.minimum(LEVELS / 0.93, 1)
    front = (0.5 - np.interp(lean, [0, 1], [style.foot[0], style.roof[0]])) * length
    rear = (0.5 - np.interp(lean, [0, 1], [style.foot[1], style.roof[1]])) * length
    half = width / 2 * np.interp(LEVELS, [0, 0.93, 1], [0.95, 0.80, 0.72])
    front, rear = front - 0.12 * (LEVELS == 1), rear + 0.12 * (LEVELS == 1)
    unit = np.concatenate([
        np.stack([np.ones(5), ACROSS[:-1]], -1),
        np.stack([1 - SIDE[:-1], np.ones(7)], -1),
        np.stack([np.zeros(5), ACROSS[:0:-1]], -1),
        np.stack([SIDE[:-1], -np.ones(7)], -1),
    ])  # fmt: skip
    bulge = 0.06 * (1 - unit[:, 1] ** 2) * np.where(unit[:, 0] == 1, 1, np.where(unit[:, 0] == 0, -0.5, 0))
    x = rear[:, None] + (front - rear)[:, None] * unit[:, 0] + bulge
    y = half[:, None] * unit[:, 1]
    z = np.broadcast_to((waist - 0.04 + (height - waist + 0.04) * LEVELS)[:, None], x.shape)
    end, side = [0, 1, 1, 1, 0], [0, 1, 0, 1, 0, 1, 0]
    which = np.zeros((len(LEVELS) - 1, len(unit)), int)
    which[1] = [*end, *side, *end, *side[::-1]]
    return lofted(np.stack([x, y, z], -1), [paint, MATERIALS["glass"]], which)


def _wheels(length, width, radius) -> list[Mesh]:
    """Tyres and rims, their axes along y."""
    x = np.repeat([(0.5 - middle) * length for middle in WHEELS], 2)
    y = np.tile([-1.0, 1.0], 2) * (width / 2 - 0.10)
    parts = []
    for size, thick, material in ((radius, 0.22, "rubber"), (0.62 * radius, 0.24, "metal_painted")):
        linear = np.array([(size, 0, 0), (0, 0, -thick), (0, size, 0)])
        foot = np.stack([x, y + thick / 2, np.full(4, radius)], 1)
        parts.append(copies(_WHEEL, np.repeat(linear[None], 4, 0), foot, material))
    return parts


def _mirrors_and_seats(length, width, waist, style, paint) -> Mesh:
    x = (0.5 - style.foot[0] - 0.08) * length
    rows = [(x, side * (width / 2 + 0.05), waist, 0.12, 0.18, 0.14) for side in (-1, 1)]
    middle = (0.5 - (style.roof[0] + style.roof[1]) / 2) * length
    for dx in (0.35, -0.45):
        rows += [(middle + dx, dy * width, waist - 0.1, 0.14, 0.45, 0.35) for dy in (-0.2, 0.2)]
    # What is between the wheels: one does not see through the arches.
    rows.append((0, 0, 0.22, 0.6 * length, 0.72 * width, waist - 0.25))
    dark = [MATERIALS["fabric_dark"], MATERIALS["plastic_dark"]]
    return boxes(rows, [paint, *dark], [0, 0, 1, 1, 1, 1, 2])
