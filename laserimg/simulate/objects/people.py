"""People who stand, walk and sit."""

import numpy as np

from laserimg.simulate.materials import Material
from laserimg.simulate.mesh import Mesh, box, ellipsoid, joined
from laserimg.simulate.objects.copies import balls, boxes, rods
from laserimg.simulate.objects.loft import lofted, varied
from laserimg.simulate.things import Thing

POSES = ("standing", "walking", "sitting")
SEAT_M = 0.45


def person(rng: np.random.Generator, pose: str | None = None) -> Thing:
    """Return a person facing +x: legs, trunk, arms, head, one in three with a bag.

    Stature 1.50-1.95 m (about the 5th percentile of women to above the 95th of men, DIN 33402-2, with
    shoes); segment lengths as fractions of it after Drillis and Contini (1966): hip 0.53, knee 0.285,
    shoulder 0.82, upper arm 0.19, forearm and hand 0.25. A sitting person's hip is on 0.45 m.
    """
    chosen = pose or str(rng.choice(POSES, p=[0.45, 0.45, 0.1]))
    stature, girth = rng.uniform(1.50, 1.95), rng.uniform(0.9, 1.2)
    top, bottom = (varied(rng, str(rng.choice(["fabric_light", "fabric_dark"])), 0.4) for _ in range(2))
    skin, hair = varied(rng, "skin", 0.2), varied(rng, "fabric_dark", 0.4)
    hip = SEAT_M + 0.09 if chosen == "sitting" else 0.52 * stature
    parts = [
        *_legs(rng, chosen, stature, girth, hip, bottom),
        *_arms(rng, chosen, stature, girth, hip, top, skin),
    ]
    parts += [_trunk(stature, girth, hip, top), *_head(stature, hip, skin, hair)]
    if chosen != "sitting" and rng.random() < 1 / 3:
        parts.append(_bag(rng, stature, girth, hip))
    mesh = joined(parts)
    return Thing("person", mesh.at(0, 0, -float(mesh.vertices[:, 2].min())), "person")


def _legs(rng, pose: str, stature: float, girth: float, hip: float, cloth: Material) -> list[Mesh]:
    thigh, shank = 0.245 * stature, 0.25 * stature
    stride = np.radians(rng.uniform(12, 28)) if pose == "walking" else np.radians(rng.uniform(0, 4))
    ends, shoes = [], []
    for side in (-1, 1):
        swing = np.radians(88) if pose == "sitting" else side * stride
        bend = np.radians(2) if pose == "sitting" else swing - (side < 0) * stride * 0.6
        start = np.array([0, side * 0.055 * stature, hip])
        knee = start + thigh * np.array([np.sin(swing), 0, -np.cos(swing)])
        ankle = knee + shank * np.array([np.sin(bend), 0, -np.cos(bend)])
        ends += [(start, knee), (knee, ankle)]
        shoes.append((ankle[0] + 0.05, ankle[1], ankle[2] - 0.05, 0.15 * stature, 0.09, 0.07))
    thick = np.tile([0.043, 0.032], 2) * stature * girth
    return [rods(np.array(ends), thick, cloth), boxes(shoes, "rubber")]


def _arms(rng, pose, stature, girth, hip, cloth, skin) -> list[Mesh]:
    shoulder_m = hip + 0.29 * stature
    swing = np.radians(rng.uniform(10, 25)) if pose == "walking" else np.radians(rng.uniform(-5, 15))
    ends, hands = [], []
    for side in (-1, 1):
        angle = -side * swing if pose == "walking" else swing
        bend = angle + np.radians(rng.uniform(5, 80 if pose != "walking" else 35))
        start = np.array([0, side * 0.118 * stature * girth, shoulder_m - 0.03])
        elbow = start + 0.18 * stature * np.array([np.sin(angle), side * 0.1, -np.cos(angle)])
        wrist = elbow + 0.15 * stature * np.array([np.sin(bend), 0, -np.cos(bend)])
        ends += [(start, elbow), (elbow, wrist)]
        hands.append(wrist)
    thick = np.tile([0.027, 0.022], 2) * stature
    return [rods(np.array(ends), thick, cloth), balls(hands, (0.05, 0.035, 0.055), skin)]


def _trunk(stature: float, girth: float, hip: float, cloth: Material) -> Mesh:
    """Elliptic sections from hip to neck."""
    level = hip + stature * np.array([-0.05, 0.0, 0.10, 0.20, 0.27, 0.30, 0.32])
    half_y = stature * girth * np.array([0.085, 0.098, 0.082, 0.098, 0.115, 0.075, 0.035])
    half_x = stature * girth * np.array([0.06, 0.07, 0.062, 0.072, 0.062, 0.045, 0.035])
    angle = 2 * np.pi * np.arange(16) / 16
    x, y = half_x[:, None] * np.cos(angle), half_y[:, None] * np.sin(angle)
    return lofted(np.stack([x, y, np.broadcast_to(level[:, None], x.shape)], -1), [cloth])


def _head(stature: float, hip: float, skin: Material, hair: Material) -> list[Mesh]:
    middle = hip + 0.41 * stature
    neck = rods([((0, 0, middle - 0.16), (0, 0, middle))], 0.055, skin)
    face = ellipsoid((0.095, 0.075, 0.067 * stature), skin, 2).at(0.01, 0, middle)
    return [neck, face, ellipsoid((0.095, 0.083, 0.06 * stature), hair, 2).at(-0.02, 0, middle + 0.025)]


def _bag(rng, stature, girth, hip) -> Mesh:
    cloth = varied(rng, "fabric_dark", 0.5)
    if rng.random() < 0.5:
        return box((0.16, 0.28, 0.42), cloth).at(-0.07 * stature * girth - 0.07, 0, hip + 0.06 * stature)
    return box((0.34, 0.12, 0.28), cloth).at(0, 0.16 * stature * girth, hip - 0.30)
