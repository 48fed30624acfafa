"""A simulated scan is the scene's geometry plus the scanner's noise."""

import numpy as np
import pytest

from laserimg.simulate.measure import simulated
from laserimg.simulate.mesh import box, pose_at
from laserimg.simulate.scanner import SCANNERS
from laserimg.simulate.things import Scene, Thing

pytest.importorskip("embreex")


@pytest.mark.parametrize("name", SCANNERS)
def test_noise_rounding_and_truth_in_a_room(name):
    scanner = SCANNERS[name]
    room = Thing("room", box((8, 6, 3), "plaster"))
    result = simulated(Scene((room,), (pose_at(1, 0.5, 1, 90),), "room"), 0, scanner, 7)
    points = result.truth_range[..., None] * scanner.directions
    world = points @ pose_at(0, 0, 0, 90)[:3, :3].T + (1, 0.5, 1)
    x, y, z = np.moveaxis(world, -1, 0)
    walls = np.abs([np.abs(x) - 4, np.abs(y) - 3, z * (z - 3)])
    assert walls.min(axis=0).max() < 1e-3
    error = result.scan.range - result.truth_range
    assert error.std() == pytest.approx(scanner.noise_m, rel=0.02)
    steps = result.scan.range / scanner.step_m
    assert np.abs(steps - steps.round()).max() < 1e-2
    assert (np.einsum("ijk,ijk->ij", result.truth_normals, scanner.directions) < 0).all()
    assert (result.thing == 0).all()
    again = simulated(Scene((room,), (pose_at(1, 0.5, 1, 90),), "room"), 0, scanner, 7)
    np.testing.assert_array_equal(again.scan.range, result.scan.range)
