"""Trees: deciduous, spreading, columnar, conifer, weeping, of several stems, young and bare."""

import numpy as np

from laserimg.simulate.materials import Material
from laserimg.simulate.mesh import Mesh, cylinder, joined
from laserimg.simulate.objects.copies import rods
from laserimg.simulate.objects.loft import faces_mesh, varied
from laserimg.simulate.things import Thing

HEIGHTS_M = {
    "deciduous": (5.0, 12.0), "conifer": (4.0, 12.0), "young": (2.5, 4.5), "bare": (5.0, 11.0),
    "columnar": (5.0, 12.0), "spreading": (5.0, 10.0), "weeping": (4.0, 9.0), "stems": (3.5, 8.0),
}  # fmt: skip
# Radius of the crown over the height, and the rise of limbs over their reach.
CROWN = {"conifer": (0.15, 0.22), "columnar": (0.08, 0.14), "spreading": (0.35, 0.48)}
RISE = {"conifer": (-0.25, 0.1), "columnar": (1.5, 3.0), "spreading": (0.1, 0.5), "weeping": (-0.5, 0.2)}
BOLE = {"conifer": (0.05, 0.2), "columnar": (0.1, 0.25), "stems": (0.15, 0.25)}


def tree(rng: np.random.Generator) -> Thing:
    """Return a tree of height `HEIGHTS_M`, trunk diameter 1/40 to 1/25 of the height.

    A leaf face stands for a spray of leaves, 0.08-0.2 m long: rays pass between the faces. Ranges are
    those of street and park trees up to middle age, set by eye, not from a survey.
    """
    kind = str(rng.choice(list(HEIGHTS_M), p=[0.3, 0.14, 0.2, 0.1, 0.08, 0.08, 0.05, 0.05]))
    height = rng.uniform(*HEIGHTS_M[kind])
    bark, leaf = varied(rng, "bark", 0.3), varied(rng, "leaves", 0.25)
    radius = height * rng.uniform(1 / 80, 1 / 50)
    bole = height * rng.uniform(*BOLE.get(kind, (0.25, 0.4)))
    tips, limbs = _branches(rng, kind, height, bole, radius, bark)
    parts = [cylinder(radius, 0.9 * height, bark, 12, 0.25 * radius), limbs]
    if kind == "stems":
        away = rng.uniform(-0.12, 0.12, (3, 2)) * height
        feet = np.c_[np.sign(away) * 1.5 * radius, np.zeros(3)]
        parts.append(rods(np.stack([feet, np.c_[away, np.full(3, 0.75 * height)]], 1), 0.6 * radius, bark))
    if kind != "bare":
        parts.append(_leaves(rng, tips, height, leaf))
    return Thing("tree", joined(parts), "tree")


def _branches(rng, kind: str, height: float, bole: float, radius: float, bark: Material):
    """Limbs from the trunk outwards; leaf clusters sit along them."""
    count = 40 if kind == "conifer" else int(rng.integers(14, 26))
    up = rng.uniform(0, 1, count)
    start = bole + (0.85 * height - bole) * up
    crown = height * rng.uniform(*CROWN.get(kind, (0.22, 0.35)))
    reach = crown * (
        (1 - up) * 0.95 + 0.05 if kind == "conifer" else np.sqrt(np.clip(1 - (2 * up - 0.8) ** 2 / 2, 0.1, 1))
    )
    reach = reach * rng.uniform(0.75, 1.1, count)
    azimuth = rng.uniform(0, 2 * np.pi, count)
    rise = reach * rng.uniform(*RISE.get(kind, (0.2, 0.8)), count)
    rise = np.minimum(rise, height - start)
    feet = np.stack([np.zeros(count), np.zeros(count), start], -1)
    tips = feet + np.stack([reach * np.cos(azimuth), reach * np.sin(azimuth), rise], -1)
    tips[:, 2] = np.maximum(tips[:, 2], 0.3)
    limbs = rods(np.stack([feet, tips], 1), 0.22 * radius, bark)
    along = rng.uniform(0.45, 1.0, (3, count, 1))
    return (feet + along * (tips - feet)).reshape(-1, 3), limbs


def _leaves(rng: np.random.Generator, clusters: np.ndarray, height: float, leaf: Material) -> Mesh:
    """Random triangles normally distributed around the clusters."""
    each = int(np.clip(8 * height, 25, 60))
    centres = np.repeat(clusters, each, axis=0)
    spread = rng.uniform(0.03, 0.055) * height
    centres = centres + np.clip(rng.normal(0, spread, centres.shape), -0.1 * height, 0.1 * height)
    centres[:, 2] = np.maximum(centres[:, 2], 0.25)
    size = rng.uniform(0.08, 0.2, (len(centres), 1, 1))
    corners = centres[:, None] + size * rng.uniform(-0.6, 0.6, (len(centres), 3, 3))
    faces = np.arange(3 * len(centres)).reshape(-1, 3)
    return faces_mesh(corners.reshape(-1, 3), faces, [leaf], np.zeros(len(faces), int))
