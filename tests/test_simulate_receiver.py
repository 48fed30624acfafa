"""Echoes to pulses, against a slow reference; edges of planes and jumps."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from laserimg.projection import directions_from_angles
from laserimg.simulate.footprint import AROUND, Beam, near_edges, rays_around, within_reach
from laserimg.simulate.receiver import MIN_SHARE, Receiver, received
from laserimg.simulate.scanner import SCANNERS

ECHO = st.tuples(st.integers(0, 4), st.integers(5, 400), st.integers(0, 300))


def slow(echoes, receiver):
    """Echoes (distance, power) of one beam to range and power."""
    pulses = []
    for distance, power in sorted(e for e in echoes if e[1] >= MIN_SHARE * receiver.weakest):
        if pulses and distance - pulses[-1][-1][0] <= receiver.pulse_m:
            pulses[-1].append((distance, power))
        else:
            pulses.append([(distance, power)])
    measured = [rising_edge(pulse, receiver.pulse_m) for pulse in pulses]
    measured = [one for one in measured if one[1] >= receiver.weakest]
    if not measured:
        return 0.0, 0.0
    return max(measured, key=lambda one: one[1]) if receiver.strongest else measured[0]


def rising_edge(pulse, pulse_m):
    """Range and power of echoes that run into one."""
    nearest, total = pulse[0][0], sum(power for _, power in pulse)
    pulls = [p / total * (d - nearest) * max(1 - (d - nearest) / pulse_m, 0) for d, p in pulse]
    return nearest + sum(pulls), total


@settings(deadline=None)
@given(st.lists(ECHO, min_size=1, max_size=30), st.booleans())
def test_received_like_the_slow_reference(echoes, strongest):
    receiver = Receiver(reach_m=3.0, pulse_m=0.55, strongest=strongest)
    beam, distance, power = np.array(echoes).T
    distance, power = (distance / 10).astype(np.float32), (power / 7001).astype(np.float32)
    found = np.array(received(beam, distance, power, 5, receiver))
    for number in range(5):
        own = [(float(d), float(p)) for b, d, p in zip(beam, distance, power, strict=True) if b == number]
        expected = slow(own, receiver)
        if strongest and expected[1]:
            # Two pulses may be equally strong.
            assert found[1, number] == pytest.approx(expected[1], rel=1e-5)
        else:
            assert found[:, number] == pytest.approx(expected, rel=1e-5)


@settings(deadline=None)
@given(st.floats(-65, 65), st.floats(-50, 50), st.floats(0.5, 20), st.sampled_from(sorted(SCANNERS)))
def test_a_plane_however_steep_has_no_edges(yaw, pitch, distance, name):
    scanner = SCANNERS[name]
    top = len(scanner.directions) // 3
    directions = scanner.directions[top : top + 10, 150:200].astype(np.float64)
    middle = directions[5, 25]
    yaw, pitch = np.radians([yaw, pitch])
    aside = np.cross(middle, (0, 0, 1.0))
    normal = middle + np.tan(yaw) * aside / np.linalg.norm(aside) + np.tan(pitch) * np.cross(aside, middle)
    along = directions @ normal
    range_m = np.where(along > 0.02, distance * (middle @ normal) / np.maximum(along, 1e-3), np.inf)
    visible = (range_m < 40).all()
    assert not visible or not near_edges(range_m.astype(np.float32), 0.015, False).any()


def test_a_jump_is_found_on_both_sides_and_across_the_seam():
    range_m = np.full((8, 12), 3.0, np.float32)
    range_m[:, 5:8] = 2.9
    expected = np.isin(np.arange(12), (4, 5, 7, 8))
    assert (near_edges(range_m, 0.03, False) == expected).all()
    assert not near_edges(range_m, 0.3, False).any()
    range_m[:, -1] = np.inf
    assert near_edges(range_m, 0.03, True)[:, [0, 10, 11]].all()
    assert not near_edges(range_m, 0.03, False)[:, 0].any()


def test_beams_reach_as_far_as_they_are_wide_at_the_range_and_the_height_they_look():
    """Columns 1 degree apart at the horizon, half at 60 degrees; outer rays at 0.756 of the radius."""
    elevation = np.radians([60.0, 0.0])
    grid = directions_from_angles(np.radians(180 - np.arange(360)), elevation)
    edges, range_m = np.zeros((2, 360), bool), np.full((2, 360), 100.0, np.float32)
    edges[:, 100], edges[:, 0] = True, True
    for wide_deg, near, reach in ((3.0, 100.0, (2, 1)), (0.0, 0.5, (5, 2)), (0.0, 50.0, (0, 0))):
        range_m[:, 100] = range_m[:, 0] = near
        beam = Beam(0.06, np.radians(wide_deg), height=0.0)
        wraps, ends = (within_reach(edges, range_m, grid, beam, seam) for seam in (True, False))
        for row, k in enumerate(reach):
            expected = np.zeros(360, bool)
            expected[100 - k : 101 + k] = expected[: 1 + k] = True
            np.testing.assert_array_equal(ends[row], expected)
            expected[360 - k :] = True
            np.testing.assert_array_equal(wraps[row], expected)


def test_the_reach_turns_with_what_is_seen():
    rng = np.random.default_rng(0)
    scanner = SCANNERS["lms151_turn"]
    edges = rng.random(scanner.directions.shape[:2]) < 0.001
    range_m = rng.uniform(0.5, 5, edges.shape).astype(np.float32)
    reached = within_reach(edges, range_m, scanner.directions, scanner.beam, True)
    for shift in (1, 400):
        turned = (np.roll(a, shift, axis=1) for a in (edges, range_m))
        again = within_reach(*turned, scanner.directions, scanner.beam, True)
        assert (again != np.roll(reached, shift, axis=1)).mean() < 1e-4
    assert reached[:20].mean() > 3 * reached[350:400].mean()


def test_high_beams_reach_other_rows():
    grid = SCANNERS["lms200_tilt"].directions
    edges, range_m = np.zeros(grid.shape[:2], bool), np.full(grid.shape[:2], 9.0, np.float32)
    edges[100, 180] = True
    round_, flat = (within_reach(edges, range_m, grid, Beam(0, 0.03, high), False) for high in (1.0, 0.4))
    assert round_.any(axis=1).sum() == 3 and flat.any(axis=1).sum() == 1
    assert round_.any(axis=0).sum() == flat.any(axis=0).sum() == 3


@settings(deadline=None)
@given(st.floats(-1, 1), st.floats(-1, 1), st.floats(-1, 1), st.floats(0, 6.3))
def test_rays_around_a_beam_lie_on_its_cone(x, y, z, turn):
    direction = np.array([[x, y, z + 1e-3]])
    direction = (direction / np.linalg.norm(direction)).astype(np.float32)
    beam = Beam(0.02, 0.01)
    aside = np.cross(direction, direction[:, [1, 2, 0]] + [0.1, 0, 0]).astype(np.float32)
    starts, along = rays_around(np.zeros(3), direction, aside, beam, np.array([turn], np.float32))
    assert starts.shape == along.shape == (AROUND, 3)
    np.testing.assert_allclose(np.linalg.norm(along, axis=1), 1, atol=1e-5)
    # Halves of the diameters, and the root mean square radius of the outer six sevenths of a disc: 0.756.
    np.testing.assert_allclose(np.linalg.norm(starts, axis=1), 0.01 * 0.756, rtol=1e-3)
    np.testing.assert_allclose(np.linalg.norm(along - direction, axis=1), 0.005 * 0.756, rtol=5e-3)
    np.testing.assert_allclose(starts @ direction[0], 0, atol=1e-6)
    np.testing.assert_allclose(along.mean(axis=0), direction[0], atol=1e-4)


def test_flat_beams_are_wide_along_the_row():
    ahead, left = np.array([[1, 0, 0]], np.float32), np.array([[0, 2, 0]], np.float32)
    spreads = []
    for turn in np.linspace(0, 6, 40):
        _, along = rays_around(np.zeros(3), ahead, left, Beam(0.0, 0.01, 0.4), np.array([turn], np.float32))
        spreads.append(along[:, 1:].std(axis=0))
    wide, high = np.mean(spreads, axis=0)
    assert high / wide == pytest.approx(0.4, abs=0.01)


def test_beams_of_a_row_that_coincide_have_some_rays_around_them():
    up, still, turn = np.array([[0, 0, 1]], np.float32), np.zeros((1, 3), np.float32), np.zeros(1, np.float32)
    _, along = rays_around(np.zeros(3), up, still, Beam(0.0, 0.01), turn)
    np.testing.assert_allclose(np.linalg.norm(along - up, axis=1), 0.005 * 0.756, rtol=5e-3)


def test_no_rays_give_no_echoes():
    pytest.importorskip("embreex")
    from laserimg.simulate.cast import Caster
    from laserimg.simulate.echoes import echoes_along
    from laserimg.simulate.mesh import box

    caster = Caster(box((1.0, 1.0, 1.0), "wood"))
    some = echoes_along(caster, np.array([3.0, 0, 0.5]), np.float32([[-1, 0, 0]]))
    none = echoes_along(caster, np.array([3.0, 0, 0.5]), np.empty((0, 3), np.float32))
    assert some.distance == pytest.approx([2.5]) and len(none.ray) == 0
