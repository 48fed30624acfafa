"""Grids recovered from the order of points: scanners simulated with every trait of the real ones."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from laserimg.errors import ScanError
from laserimg.projection import directions_from_angles
from laserimg.readers.grid import scan_from_grid
from laserimg.readers.hidden_grid import recover
from laserimg.readers.points import scan_from_points

QUICK = settings(deadline=None, max_examples=40)


def fan(tilts, beams, pole, centre=(0, 0, 0), arm=0.0, rng=None, missing=0.0):
    """Points of a fan of `beams` (radians from its heading) that turns through `tilts` about `pole`.

    Ranges are those of a room of 8 x 6 x 4 m. The laser sits `arm` metres beside the axis. Returns
    (L, B, 3) points and the (L, B) mask of those present.
    """
    tilts = np.asarray(tilts)
    if pole == "z":
        axis, heading = [0, 0, 1.0], np.stack([np.cos(tilts), np.sin(tilts), 0 * tilts], axis=1)
    else:
        axis, heading = [0, 1.0, 0], np.stack([np.cos(tilts), 0 * tilts, np.sin(tilts)], axis=1)
    normal = np.cross(heading, axis)
    beams = np.broadcast_to(beams, (len(tilts), np.shape(beams)[-1]))
    rays = np.cos(beams)[..., None] * heading[:, None] + np.sin(beams)[..., None] * np.array(axis)
    start = np.asarray(centre, float) + arm * normal[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        hits = (np.sign(rays) * np.array([4.0, 3.0, 2.0]) - start) / rays
    points = start + rays * np.nanmin(np.where(hits > 0, hits, np.inf), axis=-1)[..., None]
    present = np.ones(points.shape[:2], bool) if rng is None else rng.random(points.shape[:2]) >= missing
    return points, present


def recovered(points, present):
    grid = recover(points[present])
    assert grid is not None
    return grid


@QUICK
@given(
    st.integers(20, 60),
    st.integers(12, 90),
    st.sampled_from(["z", "y"]),
    st.floats(0.0, 0.3),
    st.booleans(),
    st.booleans(),
    st.integers(0, 1000),
)
def test_a_fan_with_missing_beams_is_recovered(lines, beams, pole, missing, back, down, seed):
    rng = np.random.default_rng(seed)
    # Uneven steps of the head, as a turning 2D laser on a free motor makes them.
    tilts = np.cumsum(rng.uniform(0.5, 1.5, lines)) * np.radians(2.0)
    tilts = tilts - tilts.mean()
    angles = np.radians(np.linspace(-80, 85, beams))
    points, present = fan(
        -tilts if back else tilts, -angles if down else angles, pole, rng=rng, missing=missing
    )
    present[:, [0, -1]] = present[[0, -1]] = True
    grid = recovered(points, present)
    row, column = np.zeros(present.shape, int), np.zeros(present.shape, int)
    row[present], column[present] = grid.row, grid.column
    line, beam = (column, row) if pole == "z" else (row, column)
    line, beam = (np.where(present, plane, -1) for plane in (line, beam))
    assert grid.kept.all()
    for k in range(lines):
        assert set(line[k][present[k]]) in ({k}, {lines - 1 - k})
    for k in range(beams):
        assert set(beam[:, k][present[:, k]]) in ({k}, {beams - 1 - k})


def test_a_fan_that_pans_all_round_wraps_and_begins_below_plus_180():
    tilts = np.radians(26 + np.arange(0, 360, 2.0))
    rng = np.random.default_rng(0)
    points, present = fan(tilts, np.radians(np.linspace(85, -85, 86)), "z", rng=rng, missing=0.1)
    scan = scan_from_points(points[present])
    assert scan.shape == (86, 180)
    assert scan.wraps
    azimuth = np.degrees(np.arctan2(scan.directions[40, :, 1], scan.directions[40, :, 0]))
    np.testing.assert_allclose(azimuth, np.arange(180.0, -180, -2), atol=1e-3)
    elevation = np.degrees(np.arcsin(scan.directions[:, 7, 2]))
    np.testing.assert_allclose(elevation, np.linspace(85, -85, 86), atol=1e-2)


def test_a_standing_head_writes_lines_that_are_one_and_the_first_point_wins():
    tilts = np.repeat(np.radians(np.arange(-40, 40, 1.5)), 2)
    tilts[1::2] += np.radians(0.02)
    points, present = fan(tilts, np.radians(np.linspace(-60, 60, 61)), "z")
    points[1::2] *= 1.01
    present[4, 10] = False
    scan = scan_from_points(points[present])
    assert scan.shape == (61, 54)
    expected = scan_from_grid(np.where(present[..., None], points, 0)[::2].transpose(1, 0, 2)).range
    different = np.argwhere(np.abs(scan.range - expected) > 1e-5)
    # Where the first line has no return the second one's counts.
    assert len(different) == 1
    assert expected[tuple(different[0])] == 0


def test_steps_of_a_hundredth_of_a_degree_stay_lines():
    tilts = np.radians(np.arange(200) * 0.02)
    points, present = fan(tilts, np.radians(np.linspace(-60, 60, 61)), "z")
    assert scan_from_points(points[present]).shape == (61, 200)


def test_the_laser_beside_its_axis_above_the_floor_is_found():
    rng = np.random.default_rng(2)
    tilts = np.radians(np.linspace(40, -50, 120))
    points, present = fan(tilts, np.radians(np.arange(-90.0, 91)), "y", (0, 0, 0.4), 0.15, rng, 0.05)
    scan = scan_from_points(points[present])
    normals = np.stack([-np.sin(tilts), 0 * tilts, np.cos(tilts)], axis=1)
    expected = np.array([0, 0, 0.4]) - 0.15 * -normals.mean(axis=0)
    np.testing.assert_allclose(np.abs(scan.world_from_scan[:3, 3]), np.abs(expected), atol=1e-3)
    assert scan.shape[0] == 120
    # Every return is kept, and is where it was.
    world = scan.points()[scan.range > 0] + scan.world_from_scan[:3, 3]
    np.testing.assert_allclose(np.sort(world, axis=0), np.sort(points[present], axis=0), atol=1e-4)


@pytest.mark.parametrize("down", [False, True])
def test_interlaced_beams_keep_every_return_in_order(down):
    phase = np.radians(np.tile([0, 0.25, 0.5, 0.75], 30))
    beams = np.radians(np.arange(-80.0, 81)) + phase[:, None]
    tilts = np.radians(np.linspace(30, -50, 120))
    points, present = fan(tilts, -beams if down else beams, "y")
    scan = scan_from_points(points[present])
    assert (scan.range > 0).sum() == present.sum()
    assert scan.shape[0] == 120
    azimuth = np.arctan2(scan.directions[..., 1], np.hypot(scan.directions[..., 0], scan.directions[..., 2]))
    for row in range(120):
        assert (np.diff(azimuth[row][scan.range[row] > 0]) < 0).all()


def spinning(rings, columns, rng, missing, begin_deg=0.0, clockwise=False, jitter=0.0):
    """Rings one after the other, upper first; the scanner spins in coarse units of angle."""
    elevation = np.radians(np.linspace(3, -24, rings))
    azimuth = (np.arange(columns) + 0.5) * 2 * np.pi / columns + jitter * rng.normal(size=(rings, columns))
    azimuth = np.radians(begin_deg) + (-azimuth if clockwise else azimuth)
    level = np.cos(elevation)[:, None]
    up = np.broadcast_to(np.sin(elevation)[:, None], azimuth.shape)
    rays = np.stack([level * np.cos(azimuth), level * np.sin(azimuth), up], axis=-1)
    present = rng.random(azimuth.shape) >= missing
    return rays * rng.uniform(3, 60, (rings, columns, 1)), present


@QUICK
@given(
    st.integers(8, 40),
    st.integers(200, 600),
    st.floats(0, 0.3),
    st.booleans(),
    st.sampled_from([0, 90, 180]),
    st.integers(0, 99),
)
def test_rings_are_recovered(rings, columns, missing, clockwise, begin, seed):
    points, present = spinning(rings, columns, np.random.default_rng(seed), missing, begin, clockwise)
    scan = scan_from_points(points[present])
    assert scan.shape[0] == rings
    assert scan.wraps
    assert (scan.range > 0).sum() == present.sum()
    np.testing.assert_array_equal((scan.range > 0).sum(axis=1), present.sum(axis=1))
    assert scan.shape[1] == pytest.approx(columns, rel=0.03 + missing / 2)


def test_rings_that_see_only_ahead_are_recovered():
    points, present = spinning(24, 1200, np.random.default_rng(4), 0.1, begin_deg=-180)
    present[:, :450] = present[:, 750:] = False
    scan = scan_from_points(points[present])
    assert scan.shape[0] == 24
    assert not scan.wraps
    assert scan.shape[1] == pytest.approx(300, abs=6)
    assert (scan.range > 0).sum() == present.sum()


def test_jitter_turns_no_ring_around():
    rng = np.random.default_rng(5)
    points, present = spinning(32, 900, rng, 0.1, jitter=np.radians(0.05))
    scan = scan_from_points(points[present])
    assert scan.shape[0] == 32
    assert (scan.range > 0).sum() > 0.99 * present.sum()


def test_firings_of_uneven_beams_become_rings():
    rng = np.random.default_rng(3)
    elevation = np.radians(
        np.sort(np.r_[-30, -22, -15, -11, -8, -6, -4, -2.5, -1, 0.7, 3, 6, 10, 14, 19, 25])[::-1]
    )
    offset = np.radians(rng.uniform(-2, 2, 16))
    azimuth = np.radians(np.arange(0, 360, 0.5))[:, None] + offset
    points = directions_from_angles(azimuth, np.broadcast_to(elevation, azimuth.shape)) * rng.uniform(
        2, 9, (720, 16, 1)
    )
    present = rng.random((720, 16)) > 0.1
    scan = scan_from_points(points[present].astype(np.float64))
    assert scan.shape[0] == 16
    assert scan.wraps
    np.testing.assert_allclose(np.arcsin(scan.directions[..., 2]).mean(axis=1), elevation, atol=1e-4)


def test_points_in_no_order_have_no_hidden_grid():
    rng = np.random.default_rng(1)
    points, present = fan(np.radians(np.arange(-40, 40, 1.0)), np.radians(np.linspace(-60, 60, 61)), "z")
    assert recover(rng.permutation(points[present])) is None
    assert recover(rng.normal(size=(5000, 3))) is None


def test_a_fan_that_tilts_over_the_zenith_is_one_fan():
    tilts = np.radians(np.linspace(150, -30, 91))
    points, present = fan(tilts, np.radians(np.linspace(-70, 70, 71)), "y")
    grid = recovered(points, present)
    lines = grid.row.reshape(present.shape)
    assert (np.diff(lines, axis=0) == 1).all() or (np.diff(lines, axis=0) == -1).all()


def test_numbers_that_are_none_of_rings_are_projected():
    points, present = fan(np.radians(np.arange(-40, 40, 1.0)), np.radians(np.linspace(-60, 60, 61)), "z")
    numbers = np.arange(present.sum())
    assert recover(points[present], numbers) is None
    assert (scan_from_points(points[present], ring=numbers).range > 0).any()


@pytest.mark.parametrize("count", [0, 1, 5, 40])
def test_few_points_have_no_hidden_grid(count):
    assert recover(np.random.default_rng(0).normal(size=(count, 3))) is None
    assert recover(np.zeros((count, 3))) is None
    assert recover(np.full((count, 3), 2.0)) is None


def test_a_grid_of_any_orientation_comes_out_upright_and_not_mirrored():
    points, _ = fan(np.radians(np.linspace(50, -50, 30)), np.radians(np.linspace(40, -40, 20)), "z")
    upright = points.transpose(1, 0, 2)
    expected = scan_from_grid(upright)
    np.testing.assert_allclose(expected.points(), upright, atol=1e-5)
    for turned in (upright[::-1], upright[:, ::-1], upright[::-1, ::-1]):
        np.testing.assert_array_equal(scan_from_grid(turned).range, expected.range)


@given(st.sampled_from(["pan", "tilt", "pinhole"]), st.floats(0, 0.6), st.integers(0, 999))
def test_rays_without_return_point_where_the_grid_says(kind, missing, seed):
    rng = np.random.default_rng(seed)
    if kind == "pinhole":
        v, u = np.mgrid[:20, :30]
        points = np.stack([np.full(v.shape, 20.0), 15.0 - u, 10.0 - v], axis=-1)
    else:
        grid, _ = fan(
            np.radians(np.linspace(50, -50, 30)), np.radians(np.linspace(60, -60, 20)), "zy"[kind == "tilt"]
        )
        points = grid.transpose(1, 0, 2) if kind == "pan" else grid
    whole = scan_from_grid(points)
    present = rng.random(points.shape[:2]) >= missing
    present[0, :2] = present[5:7, 3] = True
    holes = scan_from_grid(np.where(present[..., None], points, np.nan))
    assert np.degrees(np.abs(holes.directions - whole.directions).max()) < 0.1


@settings(deadline=None, max_examples=150)
@given(
    st.integers(1, 400),
    st.integers(0, 2**16),
    st.sampled_from(["noise", "line", "sweeps", "repeats", "plane", "pole", "ring"]),
    st.floats(-6, 6),
    st.booleans(),
)
def test_any_points_in_any_order_make_a_scan_or_one_error(count, seed, kind, power, holes):
    rng = np.random.default_rng(seed)
    t = np.arange(count)
    points = {
        "noise": rng.normal(size=(count, 3)),
        "line": np.outer(t, rng.normal(size=3)) + rng.normal(size=3),
        "sweeps": np.stack([np.ones(count), np.sin(t / 9.0), t / count], axis=1),
        "repeats": np.repeat(rng.normal(size=(count // 3 + 1, 3)), 3, axis=0)[:count],
        "plane": np.stack([t // 20, t % 20, np.ones(count)], axis=1),
        "pole": np.stack([np.zeros(count), np.zeros(count), t + 1.0], axis=1),
        "ring": np.stack([np.cos(t / 7.0), np.sin(t / 7.0), t / 99.0], axis=1),
    }[kind] * 10.0**power
    points = points.astype(float)
    if holes:
        points[rng.random(count) < 0.3] = rng.choice([0, np.nan, np.inf, 1e30, -1e300, 1e-300])
    ring = rng.integers(0, 40, count) if seed % 5 == 0 else None
    try:
        scan = scan_from_points(points, np.ones(count), ring)
    except ScanError as error:
        assert "no point is a return" in str(error)
    else:
        assert scan.range.size < 1 << 23
