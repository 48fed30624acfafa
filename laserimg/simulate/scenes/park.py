"""A park: rough grass, a path, trees, people, poles and hedges."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from laserimg.simulate.materials import MATERIALS
from laserimg.simulate.objects.hedges import hedge
from laserimg.simulate.objects.loft import quads_mesh
from laserimg.simulate.objects.people import person
from laserimg.simulate.objects.poles import lamp_post, sign_post
from laserimg.simulate.objects.trees import tree
from laserimg.simulate.scenes.furnishing import Maker
from laserimg.simulate.things import Scene, Thing

HALF_SIZE_M = 25.0
STEP_M = 0.25
CLEAR_M = {"tree": 0.5, "hedge": 3.1, "person": 0.45}


def park(rng: np.random.Generator, extras: Sequence[Maker] = ()) -> Scene:
    """Return a park of 50 x 50 m with the scanner in the middle, 1.2-2.0 m above the ground.

    Ground tilted by up to 2 degrees, waves of 0.05-0.2 m over 15-30 m, grass rough by 1-4 cm standard
    deviation at 0.25 m, the path 2-3.5 m wide and rough by 3 mm. Ranges set by eye. One park in five
    has few objects. Of the makers `extras` 1-4 things each stand within 12 m.
    """
    tilt, phase = np.tan(np.radians(rng.uniform(-2, 2, 2))), rng.uniform(0, 6, 2)
    wave, length = rng.uniform(0.05, 0.2), rng.uniform(15, 30)

    def height(x, y) -> NDArray[np.float64]:
        k = 2 * np.pi / length
        return np.asarray(
            tilt[0] * x + tilt[1] * y + wave * np.sin(k * x + phase[0]) * np.cos(k * y + phase[1])
        )

    density = 0.25 if rng.random() < 0.2 else rng.uniform(0.6, 1.0)
    things, taken = [_ground(rng, height)], [(0.0, 0.0, 1.2)]
    for maker in extras:
        for _ in range(int(rng.integers(1, 5))):
            thing, (x, y) = maker(rng), rng.uniform(-12, 12, 2)
            if all(np.hypot(x - a, y - b) > r + thing.footprint for a, b, r in taken):
                taken.append((x, y, thing.footprint))
                things.append(thing.at(x, y, float(height(x, y)), rng.uniform(0, 360)))
    makers = [(tree, 14), (person, 8), (lamp_post, 3), (sign_post, 1), (hedge, 4)]
    for maker, expected in makers:
        for _ in range(rng.poisson(expected * density)):
            thing = (
                person(rng, "walking" if rng.random() < 0.6 else "standing")
                if maker is person
                else maker(rng)
            )
            x, y = rng.uniform(-22, 22, 2)
            radius = CLEAR_M.get(thing.kind, 0.3)
            if all(np.hypot(x - a, y - b) > r + radius for a, b, r in taken):
                taken.append((x, y, radius))
                things.append(thing.at(x, y, float(height(x, y)), rng.uniform(0, 360)))
    scanner = np.eye(4)
    scanner[2, 3] = float(height(0, 0)) + rng.uniform(1.2, 2.0)
    return Scene(tuple(things), (scanner,), "park")


def _ground(rng: np.random.Generator, height) -> Thing:
    along = np.arange(-HALF_SIZE_M, HALF_SIZE_M + STEP_M / 2, STEP_M)
    x, y = np.meshgrid(along, along, indexing="ij")
    path = np.abs(y - rng.uniform(-8, 8) - 4 * np.sin(x / 12)) < rng.uniform(1.0, 1.75)
    z = height(x, y) + rng.normal(0, 1, x.shape) * np.where(path, 0.003, rng.uniform(0.01, 0.04))
    grid = np.stack([x, y, z], -1)
    quads = np.stack([grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]], 2).reshape(-1, 4, 3)
    which = path[:-1, :-1].ravel().astype(int)
    return Thing("ground", quads_mesh(quads, [MATERIALS["grass"], MATERIALS["asphalt"]], which))
