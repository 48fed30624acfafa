"""Lamp posts, sign posts, traffic lights and bollards."""

import numpy as np

from laserimg.simulate.mesh import Mesh, box, cylinder, joined, tube
from laserimg.simulate.objects.loft import varied
from laserimg.simulate.things import Thing


def lamp_post(rng: np.random.Generator) -> Thing:
    """Return a lamp post, label pole: 3.5-8 m (nominal heights of EN 40-2), foot 0.11-0.18 m wide."""
    height, radius = rng.uniform(3.5, 8.0), rng.uniform(0.055, 0.09)
    metal = varied(rng, "metal_painted", 0.3)
    arm = rng.uniform(0.4, 1.5)
    parts = [cylinder(radius, height, metal, 16, 0.55 * radius)]
    parts.append(tube([(0, 0, height - 0.05), (arm, 0, height + 0.1)], 0.03, metal))
    parts.append(box((0.6, 0.25, 0.12), metal).at(arm, 0, height + 0.05))
    return Thing("lamp_post", joined(parts), "pole")


def sign_post(rng: np.random.Generator) -> Thing:
    """Return a traffic sign, label pole: tube 60-76 mm, clear height 2.0-2.3 m, plates 0.42-0.75 m.

    Two in three plates retroreflect, as far as `MATERIALS` has it: brighter than paint, not a hundred times.
    """
    radius, clear = rng.uniform(0.030, 0.038), rng.uniform(2.0, 2.3)
    size = float(rng.choice([0.42, 0.6, 0.75]))
    face = "retroreflector" if rng.random() < 2 / 3 else "paint_white"
    plate = _disc(size / 2, face) if rng.random() < 0.5 else box((0.01, size, size), face)
    parts = [cylinder(radius, clear + size + 0.05, varied(rng, "metal_bare", 0.2), 12)]
    parts.append(plate.at(radius + 0.01, 0, clear))
    return Thing("sign_post", joined(parts), "pole")


def traffic_light(rng: np.random.Generator) -> Thing:
    """Return a traffic light, label pole: 3.0-3.6 m, heads of three 200 mm lamps (EN 12368)."""
    height = rng.uniform(3.0, 3.6)
    parts = [cylinder(rng.uniform(0.05, 0.075), height, varied(rng, "metal_painted", 0.3), 14)]
    parts.append(box((0.2, 0.28, 0.85), "plastic_dark").at(0.18, 0, height - 0.95))
    return Thing("traffic_light", joined(parts), "pole")


def bollard(rng: np.random.Generator) -> Thing:
    """Return a bollard 0.8-1.1 m high: not a pole, as those of paper 1 are taller than a person."""
    metal = varied(rng, "metal_painted", 0.4)
    return Thing("bollard", cylinder(rng.uniform(0.04, 0.11), rng.uniform(0.8, 1.1), metal, 16), "bollard")


def _disc(radius: float, material: str) -> Mesh:
    """A round plate facing +x that stands on z = 0."""
    matrix = np.eye(4)
    matrix[:3, :3] = [[0, 0, 1], [0, 1, 0], [-1, 0, 0]]
    matrix[2, 3] = radius
    return cylinder(radius, 0.01, material, 24).moved(matrix)
