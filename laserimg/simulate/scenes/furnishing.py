"""Drawing things by weight, and lamps under the ceiling."""

from collections.abc import Callable

import numpy as np

from laserimg.simulate.objects.fixtures import ceiling_lamp
from laserimg.simulate.scenes.placing import Floor
from laserimg.simulate.things import Thing

Maker = Callable[[np.random.Generator], Thing]


def hang_lamps(rng: np.random.Generator, floor: Floor, size: tuple[float, float, float]) -> None:
    """Hang rows of equal lamps in a room of that size, at least 2.1 m above the floor."""
    length, width, height = size
    lamp, yaw = ceiling_lamp(rng), float(rng.choice([0, 90]))
    rows, columns = int(rng.integers(0, 3)), max(1, int(length / rng.uniform(2.0, 3.5)))
    if height + lamp.mesh.vertices[:, 2].min() < 2.1:
        return
    for x in (np.arange(columns) + 0.5) * length / columns:
        for y in (np.arange(rows) + 0.5) * width / max(rows, 1):
            floor.put(lamp, x, y, yaw, height)


def one_of(rng: np.random.Generator, makers: tuple[tuple[Maker, float], ...]) -> Thing:
    """Return a thing of one of the makers, drawn by their weights."""
    weights = np.array([weight for _, weight in makers])
    return makers[rng.choice(len(makers), p=weights / weights.sum())][0](rng)
