"""A park: rough grass, a path, trees, people, benches, bins, lamps, hedges, shrubs, walls and fences."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from laserimg.simulate.materials import MATERIALS
from laserimg.simulate.mesh import pose_at
from laserimg.simulate.objects.bicycles import bicycle
from laserimg.simulate.objects.cars import car
from laserimg.simulate.objects.hedges import hedge
from laserimg.simulate.objects.loft import quads_mesh
from laserimg.simulate.objects.outdoor import bench, fence, litter_bin, low_wall, shrub
from laserimg.simulate.objects.people import person
from laserimg.simulate.objects.poles import bollard, lamp_post, sign_post
from laserimg.simulate.objects.trees import tree
from laserimg.simulate.scenes.furnishing import Maker
from laserimg.simulate.scenes.plots import Plot
from laserimg.simulate.things import Scene, Thing

HALF_SIZE_M = 25.0
STEP_M = 0.25
MAKERS: tuple[tuple[Maker, float], ...] = (
    (tree, 13.0), (shrub, 6.0), (hedge, 3.0), (low_wall, 1.0), (fence, 1.5), (lamp_post, 1.5),
    (sign_post, 1.5), (bicycle, 1.5), (bench, 1.0), (litter_bin, 1.0), (bollard, 1.0), (car, 0.5),
)  # fmt: skip


def park(rng: np.random.Generator, extras: Sequence[Maker] = ()) -> Scene:
    """Return a park of 50 x 50 m with the scanner in the middle, 1.2-2.0 m above the ground.

    Ground tilted by up to 2 degrees, waves of 0.05-0.2 m over 15-30 m, grass rough by 1-4 cm standard
    deviation at 0.25 m, the path 2-3.5 m wide and rough by 3 mm; benches with people, lamps and bins along
    it. Ranges set by eye. One park in five has few objects. Of the makers `extras` 1-4 things each stand
    within 12 m.
    """
    tilt, phase = np.tan(np.radians(rng.uniform(-2, 2, 2))), rng.uniform(0, 6, 2)
    wave, length = rng.uniform(0.05, 0.2), rng.uniform(15, 30)

    def height(x, y) -> NDArray[np.float64]:
        k = 2 * np.pi / length
        return np.asarray(
            tilt[0] * x + tilt[1] * y + wave * np.sin(k * x + phase[0]) * np.cos(k * y + phase[1])
        )

    density = 0.25 if rng.random() < 0.2 else rng.uniform(0.6, 1.2)
    start, half = rng.uniform(-8, 8), rng.uniform(1.0, 1.75)
    plot = Plot(lambda x, y: float(height(x, y)))
    plot.keep_free(0, 0, 1.2, 1.2)
    for maker in extras:
        for _ in range(int(rng.integers(1, 5))):
            places = np.c_[rng.uniform(-12, 12, (8, 2)), rng.uniform(0, 360, 8)]
            plot.put_first(maker(rng), [(x, y, yaw) for x, y, yaw in places])
    _along_the_path(rng, plot, start, half, density)
    for maker, expected in MAKERS:
        for _ in range(rng.poisson(expected * density)):
            (x, y), yaw = rng.uniform(-22, 22, 2), rng.uniform(0, 360)
            plot.put(maker(rng), x, y, yaw, 0.3)
    _people(rng, plot, density)
    pose = pose_at(0, 0, float(height(0, 0)) + rng.uniform(1.2, 2.0))
    ground = _ground(rng, height, start, half)
    return Scene((ground, *plot.things), (pose,), "park")


def _path_y(x, start: float):
    return start + 4 * np.sin(x / 12)


def _along_the_path(rng: np.random.Generator, plot: Plot, start: float, half: float, density: float) -> None:
    """Lamps in a row; benches facing the path, some with people, most with a bin beside them."""
    lamp, side = lamp_post(rng), int(rng.choice([-1, 1]))
    for x in np.arange(-20, 21, rng.uniform(9, 15)) if rng.random() < 0.7 else ():
        plot.put(lamp, x, _path_y(x, start) + side * (half + 0.5), -90.0 * side)
    for _ in range(rng.poisson(2.5 * density)):
        x, side, seat = rng.uniform(-20, 20), int(rng.choice([-1, 1])), bench(rng)
        y, yaw = _path_y(x, start) + side * (half + 0.7), -90.0 * side
        if not plot.put(seat, x, y, yaw):
            continue
        if rng.random() < 0.7:
            plot.put(litter_bin(rng), x + 0.8 + seat.mesh.extents[1] / 2, y, yaw)
        for along in (-0.3, 0.3):
            if rng.random() < 0.4:
                # On the seat, which is 0.40-0.48 m high where the sitter's is 0.45 m.
                where = x + along * seat.mesh.extents[1], y, plot.height_m(x, y)
                plot.things.append(person(rng, "sitting").at(*where, yaw))


def _people(rng: np.random.Generator, plot: Plot, density: float) -> None:
    hosts = [thing for thing in plot.things if thing.label in ("tree", "pole", "bench", "bicycle")]
    for _ in range(rng.poisson(9 * density)):
        one = person(rng, "walking" if rng.random() < 0.6 else "standing")
        if hosts and rng.random() < 0.3:
            plot.put_near(rng, one, hosts[rng.integers(len(hosts))], (0.2, 0.8))
        else:
            x, y = rng.uniform(-20, 20, 2)
            plot.put(one, x, y, rng.uniform(0, 360))


def _ground(rng: np.random.Generator, height, start: float, half: float) -> Thing:
    along = np.arange(-HALF_SIZE_M, HALF_SIZE_M + STEP_M / 2, STEP_M)
    x, y = np.meshgrid(along, along, indexing="ij")
    path = np.abs(y - _path_y(x, start)) < half
    z = height(x, y) + rng.normal(0, 1, x.shape) * np.where(path, 0.003, rng.uniform(0.01, 0.04))
    grid = np.stack([x, y, z], -1)
    quads = np.stack([grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]], 2).reshape(-1, 4, 3)
    which = path[:-1, :-1].ravel().astype(int)
    return Thing("ground", quads_mesh(quads, [MATERIALS["grass"], MATERIALS["asphalt"]], which))
