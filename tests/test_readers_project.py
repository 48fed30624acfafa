"""Points in any order on a spherical grid."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from laserimg.errors import ScanError
from laserimg.projection import directions_from_angles, project
from laserimg.scan import Scan


def grid_points(rows, columns, across_deg, seed, full=False):
    """Points of an even grid with random ranges, and that grid's range image."""
    rng = np.random.default_rng(seed)
    if full:
        azimuth = np.pi - (np.arange(columns) + 0.5) * 2 * np.pi / columns
    else:
        azimuth = np.radians(np.linspace(across_deg / 2, -across_deg / 2, columns))
    elevation = np.radians(np.linspace(20, -30, rows))
    range_m = rng.uniform(1, 20, (rows, columns)).astype(np.float32)
    return range_m[..., None] * directions_from_angles(azimuth, elevation), range_m


@given(st.integers(3, 20), st.integers(3, 30), st.booleans(), st.integers(0, 99))
def test_shuffled_points_of_a_grid_find_their_places(rows, columns, full, seed):
    columns = columns + 37 if full else columns
    points, range_m = grid_points(rows, columns, 90, seed, full)
    shuffled = np.random.default_rng(seed).permutation(points.reshape(-1, 3))
    scan = Scan.from_points(shuffled, shape=(rows, columns))
    np.testing.assert_allclose(scan.range, range_m, rtol=1e-5)
    assert scan.wraps == full
    assert not scan.filled.any()


def test_the_nearest_return_wins_and_keeps_its_reflectance():
    far_and_near = [[4, 2, 0], [9, 0, 1], [3, 0, 1 / 3], [8, 0, 8 / 9], [4, -2, 0]]
    grid = project(far_and_near, reflectance=[1, 2, 3, 4, 5], shape=(2, 3))
    assert grid.range[0, 1] == pytest.approx(np.hypot(3, 1 / 3))
    assert grid.reflectance[0, 1] == 3
    np.testing.assert_allclose(grid.directions[0, 1], np.array([3, 0, 1 / 3]) / np.hypot(3, 1 / 3), rtol=1e-6)


def test_one_pixel_gaps_are_marked_and_only_filled_when_asked():
    points, range_m = grid_points(5, 9, 40, 3)
    keep = np.ones((5, 9), bool)
    keep[2, 4] = keep[0, 6] = keep[4, 0] = False
    keep[1:4, 7:] = False
    given_points = points[keep]
    scan = Scan.from_points(given_points, shape=(5, 9))
    assert scan.filled[2, 4]
    assert scan.filled[0, 6]
    assert not scan.filled[4, 0] and not scan.filled[2, 8]
    assert not (scan.range[scan.filled] > 0).any()
    closed = Scan.from_points(given_points, shape=(5, 9), fill_gaps=True)
    assert closed.range[2, 4] == pytest.approx((range_m[2, 3] + range_m[2, 5]) / 2)
    np.testing.assert_array_equal(closed.range[keep], scan.range[keep])


@pytest.mark.parametrize("pitch_deg", [0.3, 1.0, 3.0])
def test_the_estimated_pitch_is_that_of_the_points(pitch_deg):
    columns, rows = round(60 / pitch_deg), round(50 / pitch_deg)
    points, _ = grid_points(rows + 1, columns + 1, 60, 1)
    scan = Scan.from_points(np.random.default_rng(0).permutation(points.reshape(-1, 3)))
    assert scan.shape == pytest.approx((rows + 1, columns + 1), rel=0.12, abs=3)


def test_the_origin_becomes_the_pose():
    points, range_m = grid_points(4, 6, 30, 2)
    scan = Scan.from_points(np.add(points.reshape(-1, 3), (10, 20, 1)), origin=(10, 20, 1), shape=(4, 6))
    np.testing.assert_allclose(scan.range, range_m, rtol=1e-5)
    np.testing.assert_array_equal(scan.world_from_scan[:3, 3], [10, 20, 1])


@pytest.mark.parametrize(
    ("points", "options", "message"),
    [
        (np.zeros((0, 3)), {}, "no point is a return"),
        (np.full((5, 3), np.nan), {}, "no point is a return"),
        (np.ones((4, 2)), {}, r"points must be \(n, 3\)"),
        (np.eye(3), {"pitch": -1.0}, "must be above 0"),
        (np.eye(3), {"pitch": float("nan")}, "must be above 0"),
        (np.eye(3), {"shape": (100_000, 100_000)}, "too large"),
        (np.eye(3), {"reflectance": [1.0]}, r"reflectance must be \(3,\)"),
    ],
)
def test_what_makes_no_grid_is_refused(points, options, message):
    with pytest.raises(ScanError, match=message):
        Scan.from_points(points, **options)


@given(st.integers(0, 10_000))
def test_any_points_make_a_scan(seed):
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(rng.integers(1, 40), 3)) * 10.0 ** rng.uniform(-2, 4, 3)
    scan = Scan.from_points(points)
    np.testing.assert_allclose(np.linalg.norm(scan.directions, axis=-1), 1, atol=1e-5)
