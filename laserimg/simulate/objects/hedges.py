"""Hedges."""

import numpy as np

from laserimg.simulate.mesh import box, joined
from laserimg.simulate.objects.loft import faces_mesh, varied
from laserimg.simulate.things import Thing


def hedge(rng: np.random.Generator) -> Thing:
    """Return a clipped hedge along y, 2-6 m long, 0.5-1.0 m thick, 0.8-1.8 m high.

    A dense core of 0.6 of the thickness in a coat of 250 leaf faces a square metre of outer surface. Sizes
    set by eye: those of cars and low walls are meant to overlap.
    """
    size = np.array([rng.uniform(0.5, 1.0), rng.uniform(2.0, 6.0), rng.uniform(0.8, 1.8)])
    x, y, z = size
    count = int(250 * (2 * z * (x + y) + x * y))
    where = rng.uniform(-0.5, 0.5, (count, 3))
    axis = rng.choice(3, count, p=np.array([y * z, x * z, x * y / 2]) / (y * z + x * z + x * y / 2))
    face = np.where(axis == 2, 1, rng.choice([-1, 1], count))
    where[np.arange(count), axis] = face * rng.uniform(0.38, 0.5, count)
    centres = (where + np.array([0, 0, 0.5])) * size
    corners = centres[:, None] + rng.uniform(-0.08, 0.08, (count, 3, 3))
    corners[..., 2] = np.clip(corners[..., 2], 0, z)
    leaf, faces = varied(rng, "leaves", 0.25), np.arange(3 * count).reshape(-1, 3)
    coat = faces_mesh(corners.reshape(-1, 3), faces, [leaf], np.zeros(count, int))
    return Thing("hedge", joined([box((0.6 * x, 0.95 * y, 0.9 * z), leaf), coat]), "hedge")
