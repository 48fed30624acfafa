"""Thin-walled open vessels: wastebaskets, buckets, umbrella stands, pots; and drums."""

import numpy as np
from numpy.typing import NDArray

from laserimg.simulate.materials import Material
from laserimg.simulate.mesh import Mesh, joined
from laserimg.simulate.objects.copies import balls, boxes
from laserimg.simulate.objects.loft import lofted, quads_mesh, varied
from laserimg.simulate.things import Thing

_SHELLS = ("plastic_dark", "plastic_light", "metal_painted", "metal_bare")


def wastebasket(rng: np.random.Generator) -> Thing:
    """Return an open wastebasket: round, square or oblong, straight or tapered, with rim, bag, contents.

    Height 0.22-0.60 m and width 0.20-0.40 m, the limits of the paper's rule (section 4); seven in ten are
    25-42 cm high, as catalogues of 12-30 litre office baskets. Oblong ones are 0.55-0.85 as deep as
    wide. Walls 2-5 mm, tapers 0-14 degrees.
    """
    outline, foot, height, shell = _basket(rng)
    parts = [shell]
    if rng.random() < 0.4:
        parts.append(_bag(rng, outline, foot, height))
    if rng.random() < 0.6:
        parts.append(_contents(rng, outline, foot, height))
    return Thing("wastebasket", joined(parts), "wastebasket")


def full_wastebasket(rng: np.random.Generator) -> Thing:
    """Return a `wastebasket` that shows no hollow: filled to the brim, or under a lid, flat or domed."""
    outline, foot, height, shell = _basket(rng)
    parts = [shell]
    if rng.random() < 0.4:
        parts.append(_bag(rng, outline, foot, height))
    is_filled = rng.random() < 0.5
    top = _contents(rng, outline, foot, height, (0.85, 1.02)) if is_filled else _lid(rng, outline, height)
    return Thing("full_wastebasket", joined([*parts, top]), "wastebasket")


def some_wastebasket(rng: np.random.Generator) -> Thing:
    """Return a wastebasket as rooms have them: one in eight is full or has a lid."""
    return full_wastebasket(rng) if rng.random() < 1 / 8 else wastebasket(rng)


def _basket(rng: np.random.Generator) -> tuple[NDArray[np.float64], float, float, Mesh]:
    """The outline at the brim, the foot as a share of it, the height, and the empty shell."""
    height = rng.uniform(0.25, 0.42) if rng.random() < 0.7 else rng.uniform(0.22, 0.58)
    width = float(np.clip(height * rng.uniform(0.62, 1.05), 0.205, 0.36))
    slim = rng.uniform(0.55, 0.85) if rng.random() < 0.3 else 1.0
    outline = _outline(slim, _squareness(rng)) * width / 2
    foot = max(rng.uniform(0.62, 1.0), 1 - 2 * height * np.tan(np.radians(14)) / width)
    shell = varied(rng, str(rng.choice(_SHELLS)), 0.3)
    return outline, foot, height, _vessel(rng, outline, foot, height, shell, has_rim=rng.random() < 0.55)


def bucket(rng: np.random.Generator) -> Thing:
    """Return a small bucket or pot, 0.10-0.18 m high: too low for a wastebasket."""
    height = rng.uniform(0.10, 0.18)
    outline = _outline(1.0, 2.0) * height * rng.uniform(0.45, 0.7)
    shell = varied(rng, str(rng.choice(_SHELLS)), 0.3)
    return Thing("bucket", _vessel(rng, outline, rng.uniform(0.65, 0.9), height, shell, has_rim=True))


def umbrella_stand(rng: np.random.Generator) -> Thing:
    """Return an umbrella stand with up to 4 umbrellas: 0.62-0.75 m high, 0.2-0.28 m wide."""
    height, width = rng.uniform(0.62, 0.75), rng.uniform(0.2, 0.28)
    outline = _outline(1.0, _squareness(rng)) * width / 2
    parts = [_vessel(rng, outline, 1.0, height, varied(rng, str(rng.choice(_SHELLS)), 0.3), has_rim=False)]
    for angle in rng.uniform(0, 2 * np.pi, int(rng.integers(0, 5))):
        x, y = 0.25 * width * np.array([np.cos(angle), np.sin(angle)])
        rod = boxes([(x, y, 0.01, 0.05, 0.05, height + rng.uniform(0.05, 0.2))], "fabric_dark")
        parts.append(rod)
    return Thing("umbrella_stand", joined(parts))


def drum(rng: np.random.Generator) -> Thing:
    """Return a closed drum with two hoops.

    Steel drums are 0.57-0.60 m wide and 0.85-0.90 m high (ISO 15750-2, 200 litres); smaller ones of
    30-120 litres, 0.32-0.5 m wide, are set by eye.
    """
    is_large = rng.random() < 0.4
    radius = rng.uniform(0.285, 0.30) if is_large else rng.uniform(0.16, 0.25)
    height = rng.uniform(0.85, 0.90) if is_large else radius * rng.uniform(2.4, 3.4)
    level = height * np.array([0, 0.32, 0.33, 0.35, 0.36, 0.64, 0.65, 0.67, 0.68, 1])
    wide = radius + 0.012 * np.array([0, 0, 1, 1, 0, 0, 1, 1, 0, 0])
    circle = _outline(1.0, 2.0)
    rings = np.stack([np.c_[r * circle, np.full(len(circle), z)] for r, z in zip(wide, level, strict=True)])
    return Thing(
        "drum", lofted(rings, [varied(rng, str(rng.choice(["metal_painted", "plastic_dark"])), 0.4)])
    )


def _squareness(rng: np.random.Generator) -> float:
    """Exponent of the superellipse: 2 is a circle."""
    return 2.0 if rng.random() < 0.6 else float(rng.uniform(5, 14))


def _outline(slim: float, squareness: float, points: int = 28) -> NDArray[np.float64]:
    angle = 2 * np.pi * (np.arange(points) + 0.5) / points
    xy = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    radius = (np.abs(xy) ** squareness).sum(axis=1, keepdims=True) ** (-1 / squareness)
    return xy * radius * [slim, 1.0]


def _ring(outline: NDArray, scale: float, z: float | NDArray, thicker_m: float = 0.0) -> NDArray[np.float64]:
    away = 1 + thicker_m / np.linalg.norm(outline, axis=1, keepdims=True)
    return np.c_[outline * scale * away, np.broadcast_to(z, len(outline))]


def _vessel(
    rng: np.random.Generator, outline: NDArray, foot: float, height: float, shell: Material, *, has_rim: bool
) -> Mesh:
    """Outside up, over the rim, inside down to a floor 1 cm above the ground."""
    thick, level = rng.uniform(0.002, 0.005), 0.01
    rings = [_ring(outline, foot, 0.0)]
    if has_rim:
        lip, fall = rng.uniform(0.006, 0.014), rng.uniform(0.008, 0.035)
        below = foot + (1 - foot) * (1 - fall / height)
        rings += [
            _ring(outline, below, height - fall),
            _ring(outline, below, height - fall, lip),
            _ring(outline, 1.0, height, lip),
        ]
    rings += [
        _ring(outline, 1.0, height),
        _ring(outline, 1.0, height, -thick),
        _ring(outline, foot, level, -thick),
    ]
    return lofted(np.stack(rings), [shell])


def _bag(rng: np.random.Generator, outline: NDArray, foot: float, height: float) -> Mesh:
    """A bag folded over the edge, wavy, hanging 3-10 cm outside."""
    count = len(outline)
    wave = np.sin(2 * np.pi * np.arange(count) / count * rng.integers(3, 7) + rng.uniform(0, 6))
    fall = np.minimum(rng.uniform(0.03, 0.1) * (1 + 0.3 * wave), 0.4 * height)
    crumple = rng.uniform(-0.002, 0.002, (count, 1)) + 0.003 * wave[:, None]
    deep = 0.25 * height
    inside = 0.97 * (foot + (1 - foot) * 0.25)
    rings = np.stack(
        [
            _ring(outline, 1.0, height - fall, 0.002),
            _ring(outline, 1.0, height - fall, 0.013),
            _ring(outline, 1.0, height + 0.008, 0.011),
            _ring(outline, 1.0, height + 0.008, -0.012),
            _ring(outline, inside, deep, -0.009),
            _ring(outline, inside, deep, -0.008),
            _ring(outline, 1.0, height + 0.002, -0.008),
            _ring(outline, 1.0, height + 0.002, 0.002),
        ]
    )
    rings[1:3, :, :2] += (crumple * outline / np.linalg.norm(outline, axis=1, keepdims=True))[None]
    on, beside = np.roll(rings, -1, axis=0), np.roll(rings, -1, axis=1)
    quads = np.stack([rings, beside, np.roll(on, -1, axis=1), on], 2).reshape(-1, 4, 3)
    film = varied(rng, str(rng.choice(["plastic_dark", "plastic_light"])), 0.3)
    return quads_mesh(quads, [film], np.zeros(len(quads), int))


def _lid(rng: np.random.Generator, outline: NDArray, height: float) -> Mesh:
    """A lid that reaches over the brim, flat or domed, up to 0.60 m over the ground."""
    over, edge = rng.uniform(0.002, 0.008), rng.uniform(0.005, 0.02)
    dome = min(rng.uniform(0.0, 0.05), max(0.6 - height - edge, 0.0))
    rings = [
        _ring(outline, 1.0, height - edge, over),
        _ring(outline, 1.0, height + edge, over),
        _ring(outline, rng.uniform(0.4, 0.9), height + edge + dome),
    ]
    return lofted(np.stack(rings), [varied(rng, str(rng.choice(_SHELLS)), 0.3)])


def _contents(
    rng: np.random.Generator,
    outline: NDArray,
    foot: float,
    height: float,
    levels: tuple[float, float] = (0.15, 0.85),
) -> Mesh:
    """Crumpled paper, cartons and bottles up to a random level, a share of the height."""
    level = rng.uniform(*levels) * height
    inside = 0.8 * (foot + (1 - foot) * level / height)
    count = int(rng.integers(4, 10))
    places = outline[rng.integers(len(outline), size=count)] * inside * np.sqrt(rng.random((count, 1))) * 0.8
    size = rng.uniform(0.02, 0.055, (count, 3)) * np.min(np.linalg.norm(outline, axis=1)) / 0.15
    filled = _ring(outline, inside, 0.015), _ring(outline, inside, max(level - 0.03, 0.02))
    lumps = balls(np.c_[places, np.full(count, level - 0.02)], size, varied(rng, "paper", 0.3))
    return joined([lofted(np.stack(filled), [varied(rng, "paper", 0.3)]), lumps])
