"""Bicycles on their stands."""

import numpy as np
from numpy.typing import NDArray

from laserimg.simulate.mesh import Mesh, joined
from laserimg.simulate.objects.copies import boxes, rods
from laserimg.simulate.objects.loft import varied
from laserimg.simulate.things import Thing


def bicycle(rng: np.random.Generator) -> Thing:
    """Return a bicycle along x, its front wheel towards +x: 1.5-1.95 m long, 0.95-1.15 m high.

    Wheels of 26 or 28 inches (0.33-0.35 m radius, ISO 5775) or small ones of 20-24 inches; with mudguards,
    rack, basket or child seat on some. Handlebars 0.5-0.7 m wide.
    """
    radius = rng.uniform(0.33, 0.355) if rng.random() < 0.8 else rng.uniform(0.25, 0.31)
    base = rng.uniform(0.98, 1.15)
    rear, front = np.array([-base / 2, 0, radius]), np.array([base / 2, 0, radius])
    crank = np.array([-0.08, 0, radius - 0.05])
    saddle = np.array([-0.24, 0, rng.uniform(0.85, 1.02)])
    head = np.array([base / 2 - rng.uniform(0.1, 0.2), 0, rng.uniform(0.82, 0.95)])
    low = head + np.array([0.03, 0, -0.16])
    seat_tube = crank + 0.8 * (saddle - crank)
    top = seat_tube if rng.random() < 0.6 else crank + 0.4 * (saddle - crank)
    steel = varied(rng, "metal_painted", 0.5)
    tubes = [
        (crank, saddle),
        (top, head),
        (crank, low),
        (rear, crank),
        (rear, seat_tube),
        (low, front),
        (low, head),
    ]
    frame = rods(np.array(tubes), 0.019, steel)
    parts = [frame, _wheel(rear, radius), _wheel(front, radius), _handlebar(rng, head)]
    rows = [(*saddle[:2], saddle[2], 0.25, 0.14, 0.06)]
    if rng.random() < 0.55:
        rows.append((rear[0] - 0.02, 0, 2 * radius + 0.06, 0.36, 0.14, 0.02))
        if rng.random() < 0.4:
            rows.append(
                (rear[0] - 0.02, 0, 2 * radius + 0.08, *rng.uniform((0.2, 0.2, 0.1), (0.4, 0.4, 0.45)))
            )
        if rng.random() < 0.3:
            rows += [(rear[0], s * 0.15, radius, 0.32, 0.12, 0.3) for s in (-1, 1)]
    if rng.random() < 0.25:
        rows.append((head[0] + 0.2, 0, head[2] - 0.1, 0.28, 0.36, 0.24))
    parts.append(boxes(rows, varied(rng, "fabric_dark", 0.5)))
    parts.append(rods([((crank[0], 0.02, crank[2]), (crank[0] - 0.1, 0.18, 0.0))], 0.012, steel))
    mesh = joined(parts)
    return Thing("bicycle", mesh.at(0, 0, -float(mesh.vertices[:, 2].min())), "bicycle")


def _wheel(hub: NDArray, radius: float) -> Mesh:
    """Tyre as a ring of 16 rods, four spokes that stand for the wire ones, and a mudguard's arc."""
    angle = 2 * np.pi * np.arange(17) / 16
    ring = hub + (radius - 0.02) * np.stack([np.cos(angle), 0 * angle, np.sin(angle)], 1)
    tyre = np.stack([ring[:-1], ring[1:]], 1)
    spokes = np.stack([ring[[0, 2, 4, 6]], ring[[8, 10, 12, 14]]], 1)
    return rods(np.concatenate([tyre, spokes]), [0.02] * 16 + [0.004] * 4, "rubber")


def _handlebar(rng: np.random.Generator, head: NDArray) -> Mesh:
    half, rise = rng.uniform(0.25, 0.35), rng.uniform(0.05, 0.18)
    stem = head + np.array([-0.02, 0, rise])
    grips = [stem + np.array([-rng.uniform(0, 0.15), s * half, 0]) for s in (-1, 1)]
    return rods(np.array([(head, stem), (stem, grips[0]), (stem, grips[1])]), 0.014, "metal_bare")
