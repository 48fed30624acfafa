"""A simulated scan is the scene's geometry plus what the scanner does to it."""

from dataclasses import replace

import numpy as np
import pytest

from laserimg.simulate.materials import Material
from laserimg.simulate.measure import simulated
from laserimg.simulate.mesh import box, cylinder, mesh_of, pose_at, sheet
from laserimg.simulate.scanner import SCANNERS
from laserimg.simulate.scanner.head import beams_shot
from laserimg.simulate.things import Scene, Thing

pytest.importorskip("embreex")
LMS = SCANNERS["lms200_tilt"]


def upright(x, width, height, material="plaster", y=0.0):
    """A sheet across x that faces the scanner at the origin."""
    y0, y1, z = y - width / 2, y + width / 2, height / 2
    return sheet([(x, y1, -z), (x, y0, -z), (x, y0, z), (x, y1, z)], material)


def scanned(*things, scanner=LMS, seed=0):
    return simulated(Scene(things, (np.eye(4),), "test"), 0, scanner, seed)


@pytest.mark.parametrize("name", SCANNERS)
def test_noise_rounding_and_truth_in_a_room(name):
    scanner = SCANNERS[name]
    noise = scanner.noise._replace(weakest_m=scanner.noise.white_m)
    scanner = replace(scanner, noise=noise, min_range_m=0.3, head=None)
    room = Thing("room", box((6, 4, 3), "plaster"))
    scene = Scene((room,), (pose_at(1, 0.5, 1, 90),), "room")
    result = simulated(scene, 0, scanner, 7)
    points = result.truth_range[..., None] * scanner.directions
    world = points @ pose_at(0, 0, 0, 90)[:3, :3].T + (1, 0.5, 1)
    x, y, z = np.moveaxis(world, -1, 0)
    walls = np.abs([np.abs(x) - 3, np.abs(y) - 2, z * (z - 3)])
    assert walls.min(axis=0).max() < 1e-3
    assert (result.scan.range > 0).all()
    error = result.scan.range - result.truth_range
    expected = np.sqrt(scanner.noise.white_m**2 + scanner.noise.ring_m**2 + scanner.step_m**2 / 12)
    # Corners round off the ranges of wide beams.
    assert error[np.abs(error) < 5 * expected].std() == pytest.approx(expected, rel=0.05)
    steps = result.scan.range / scanner.step_m
    assert np.abs(steps - steps.round()).max() < 1e-2
    assert (np.einsum("ijk,ijk->ij", result.truth_normals, scanner.directions) < 0).all()
    assert (result.thing == 0).all()
    again = simulated(scene, 0, scanner, 7)
    np.testing.assert_array_equal(again.scan.range, result.scan.range)
    np.testing.assert_array_equal(again.scan.reflectance, result.scan.reflectance)


def test_range_noise_is_the_same_at_the_same_range_and_white_beside():
    """Rings: the mean error of beams at one range is not 0 and repeats one period later."""
    noise = LMS.noise._replace(ring_m=0.01, ring_period_m=0.1, weakest_m=LMS.noise.white_m)
    wall = Thing("wall", upright(2.0, 8, 8))
    seen = scanned(wall, scanner=replace(LMS, noise=noise))
    hit = seen.scan.range > 0
    error, truth = (seen.scan.range - seen.truth_range)[hit], seen.truth_range[hit]
    bins = np.arange(2.0, 2.6, 0.01)
    means = np.array([error[(truth >= low) & (truth < low + 0.01)].mean() for low in bins])
    assert means.std() == pytest.approx(0.01, rel=0.3)
    fit = np.column_stack([f(2 * np.pi * bins / 0.1) for f in (np.sin, np.cos)])
    left = means - fit @ np.linalg.lstsq(fit, means, rcond=None)[0]
    assert left.std() < 0.002


def test_range_noise_grows_to_that_of_the_weakest_pulse():
    dark = Material("dark", 0.2)
    noise = LMS.noise._replace(white_m=0.002, weakest_m=0.02, ring_m=0.0)
    seen = scanned(Thing("wall", upright(9, 12, 8, dark)), scanner=replace(LMS, noise=noise))
    hit = (seen.scan.range > 0) & (seen.scan.directions[..., 0] > 0.95)
    error = (seen.scan.range - seen.truth_range)[hit]
    weakness = LMS.receiver.weakest / (0.2 * 0.97 / (9 / 0.97) ** 2)
    assert error.std() == pytest.approx(np.sqrt(0.002**2 + (0.02**2 - 0.002**2) * weakness), rel=0.05)


def test_edges_have_mixed_pixels_when_the_gap_is_within_a_pulse_and_none_when_it_is_not():
    post = Thing("post", upright(3.0, 1.0, 1.0))
    for gap, mixes in ((0.6, True), (2.5, False)):
        seen = scanned(post, Thing("wall", upright(3.0 + gap, 20, 20)))
        x = seen.scan.points()[..., 0]
        between = (x > 3.05) & (x < 2.95 + gap)
        # The outline is 4 m of edge, under 300 beams; a beam 4.4 mrad wide every 8.7 mrad.
        assert (30 < between.sum() < 300) if mixes else not between.any()
        assert np.isin(seen.thing[between], (0, 1)).all()


@pytest.mark.parametrize("name", ["lms151_turn", "lms200_tilt"])
def test_a_pixel_belongs_to_what_is_nearest_to_its_range_also_at_the_rim_of_the_beam(name):
    """A board before a wall: pixels on the near side of the half way are the board's, those of rims too."""
    noise = SCANNERS[name].noise._replace(white_m=1e-3, weakest_m=1e-3, ring_m=0.0)
    scanner = replace(SCANNERS[name], noise=noise, step_m=1e-4)
    board, wall = Thing("board", upright(3.0, 0.4, 0.4)), Thing("wall", upright(3.5, 20, 20))
    seen = scanned(board, wall, scanner=scanner)
    ahead = (seen.scan.directions[..., 0] > 0.98) & (seen.scan.range > 0)
    x = seen.scan.points()[..., 0]
    sure = ahead & (np.abs(x - 3.25) > 0.03)
    np.testing.assert_array_equal(seen.thing[sure], (x[sure] > 3.25).astype(int))
    y, z = np.moveaxis(seen.scan.directions[..., 1:] / seen.scan.directions[..., :1] * 3.0, -1, 0)
    by_middle = ahead & (np.abs(y) < 0.2) & (np.abs(z) < 0.2)
    by_rim = (seen.thing == 0) & ~by_middle
    assert by_rim.sum() > (0.05 * by_middle.sum() if name == "lms151_turn" else -1)
    assert np.abs(seen.truth_range - 3 / seen.scan.directions[..., 0])[by_rim].max(initial=0) < 0.02


def test_noise_stays_where_it_was_when_an_edge_comes():
    """A board in one corner changes nothing far from it."""
    wall, board = Thing("wall", upright(3, 20, 20)), Thing("board", upright(2, 0.3, 0.3, y=1.5))
    plain, more = scanned(wall).scan, scanned(wall, board).scan
    far = plain.directions[..., 1] < 0.2
    np.testing.assert_array_equal(more.range[far], plain.range[far])
    np.testing.assert_array_equal(more.reflectance[far], plain.reflectance[far])
    assert (more.range != plain.range).sum() > 200


def test_the_seam_of_a_full_turn_mixes_as_any_other_column():
    """Boards all around before a wall, one of which ends at the seam: 8.5 degrees off its middle."""
    boards = [Thing("board", upright(2.0, 0.6, 2.0).at(0, 0, 0, yaw)) for yaw in range(0, 360, 36)]
    wall = Thing("wall", cylinder(2.5, 8, "plaster", 720).at(0, 0, -4))
    scene = Scene((*boards, wall), (pose_at(0, 0, 0, 8.5),), "ring")
    seen = simulated(scene, 0, SCANNERS["lms151_turn"], 0)
    away = np.linalg.norm(seen.scan.points()[350:410, :, :2], axis=-1)
    mixed = ((away > 2.15) & (away < 2.4)).mean(axis=0)
    elsewhere = mixed[5:-5][mixed[5:-5] > 0.05]
    assert 19 <= len(elsewhere) < 60
    assert mixed[[-2, -1, 0, 1]].max() > 0.7 * np.median(elsewhere)


def test_thin_beams_do_not_mix():
    thin = replace(LMS, beam=LMS.beam._replace(window_m=0.0, divergence_rad=0.0))
    seen = scanned(Thing("post", upright(3, 1, 1)), Thing("wall", upright(3.6, 20, 20)), scanner=thin)
    x = seen.scan.points()[..., 0]
    assert not ((x > 3.05) & (x < 3.5)).any()


def test_dark_things_and_glancing_floors_end_where_the_reach_says():
    black = Material("black", 0.1)
    for distance, returns in ((9.0, True), (11.5, False)):
        row = scanned(Thing("near", upright(1, 0.2, 0.2, y=2)), Thing("wall", upright(distance, 1, 1, black)))
        assert ((row.thing == 1).sum() > 20) == returns
        assert (row.thing[row.scan.range == 0] == -1).all() and (row.scan.range[row.thing >= 0] > 0).all()
    floor = mesh_of([(0, -20, 0), (40, -20, 0), (40, 20, 0), (0, 20, 0)], [(0, 1, 2), (0, 2, 3)], black).at(
        0, 0, -0.5
    )
    farthest = scanned(Thing("floor", floor)).scan.range.max()
    # 0.1 * (0.5 / r) / r**2 = 0.1 / 10**2
    assert farthest == pytest.approx(50 ** (1 / 3), rel=0.08)


def test_a_pane_is_seen_straight_on_and_through_elsewhere():
    pane, wall = Thing("pane", upright(2, 6, 4, "glass")), Thing("wall", upright(4, 12, 8))
    seen = scanned(pane, wall)
    angle = np.degrees(np.arccos(seen.scan.directions[..., 0]))
    x = seen.scan.points()[..., 0]
    assert np.abs(x[angle < 1.5] - 2).max() < 0.03 and (seen.thing[angle < 1.5] == 0).all()
    aside = (angle > 8) & (angle < 40)
    assert np.abs(x[aside] - 4).max() < 0.04 and (seen.thing[aside] == 1).all()
    np.testing.assert_allclose(seen.truth_range[aside], 4 / seen.scan.directions[aside][:, 0], rtol=1e-4)


def test_a_mirror_shows_what_stands_before_it_as_far_behind():
    """A mirror at 45 degrees, 2 m ahead, shows a wall 3 m to the right of it."""
    polished = Material("polished", 0.0005, 0.9)
    mirror = Thing("mirror", upright(0, 0.5, 0.5, polished).at(2, 0, 0, 45))
    wall = Thing("wall", upright(0, 4, 4).at(2, -3, 0, -90))
    seen = scanned(mirror, wall)
    row, column = np.unravel_index(np.argmax(seen.scan.directions[..., 0]), seen.thing.shape)
    assert seen.scan.range[row, column] == pytest.approx(5, abs=0.03)
    assert seen.thing[row, column] == 0
    assert seen.truth_range[row, column] == pytest.approx(2, abs=0.03)


def test_reflectance_is_whole_numbers_that_fall_with_range_and_incidence_as_the_model_says():
    seen = scanned(Thing("wall", upright(4, 20, 20)))
    value, cosine = seen.scan.reflectance, seen.scan.directions[..., 0]
    hit = (seen.scan.range > 0) & (cosine > 0.3)
    assert (value == value.round()).all() and value.max() <= LMS.intensity.top
    power = 0.8 * cosine**3 / 4**2
    expected = LMS.intensity.scale * power**LMS.intensity.exponent
    ratio = value[hit] / expected[hit]
    assert np.median(ratio) == pytest.approx(1, abs=0.01)
    assert ratio.std() == pytest.approx(LMS.noise.power * LMS.intensity.exponent, rel=0.1)


def test_an_interlaced_fan_on_a_swinging_head_is_late_as_the_protocol_times_it():
    """Odd beams are a mirror turn, half a row, later than even ones; a turn starts at the right."""
    swing = SCANNERS["lms200_swing"]
    even = swing.head._replace(wave_deg=0.0)
    shot = beams_shot(swing.directions, even, np.random.default_rng(0))
    tilts = [np.degrees(np.arctan2(d[..., 2], d[..., 0]))[:, 1:-1] for d in (swing.directions, shot)]
    late = (tilts[0] - tilts[1]) / (tilts[0][0, 0] - tilts[0][1, 0])
    # Column 180, the 179th of these, is straight ahead: 90 degrees from the right, an even beam.
    np.testing.assert_allclose(late[:, 179], 0.25 / 2, atol=1e-3)
    np.testing.assert_allclose(late[:, 178], (1 + 90.5 / 360) / 2, atol=1e-3)
    np.testing.assert_allclose(late[:, -1], (1 + 0.5 / 360) / 2, atol=1e-3)


@pytest.mark.parametrize(("name", "columns"), [("lms200_turn", 360), ("lms151_turn", 1135)])
def test_a_turning_head_goes_on_by_half_a_column_while_the_mirror_looks_down(name, columns):
    """A profile is half a mirror turn, and the head turns by a column in a whole one."""
    scanner, step = SCANNERS[name], 360 / columns
    x, y, z = np.moveaxis(scanner.directions[2:-2].astype(np.float64), -1, 0)
    azimuth, elevation = np.degrees(np.arctan2(y, x)), np.degrees(np.arcsin(z))
    assert (np.diff(azimuth, axis=1) < 0).all()
    late = (180 - step * (np.arange(columns) + 0.5) - azimuth) / step
    np.testing.assert_allclose(late, (90 - elevation) / 360 - 0.25, atol=2e-3)
    # A column of what it reports is a slanted line on a wall: what it measures lies on that wall.
    noise = scanner.noise._replace(white_m=1e-4, weakest_m=1e-4, ring_m=0.0)
    seen = scanned(Thing("wall", upright(3, 4, 4)), scanner=replace(scanner, noise=noise))
    middle = seen.scan.range > 0
    middle &= (np.abs(seen.scan.directions[..., 1:]) < 0.4).all(axis=-1)
    assert np.abs(seen.scan.points()[middle][:, 0] - 3).max() < 0.01


def test_ranges_in_centimetres_are_whole_and_reach_farther():
    things = (
        Thing("far", upright(40, 90, 40, Material("reflector", 20.0))),
        Thing("near", upright(2, 0.5, 0.5)),
    )
    fine, coarse = (
        scanned(*things, scanner=SCANNERS[name]).scan for name in ("lms200_tilt", "lms200_tilt_cm")
    )
    seen = coarse.range[coarse.range > 0]
    assert np.abs(seen * 100 - (seen * 100).round()).max() < 1e-2
    assert (seen > 39).sum() > 100 and fine.range.max() < 3


def test_a_wave_of_the_tilt_is_the_same_for_a_row_and_within_half_and_double():
    swing = SCANNERS["lms200_swing"]
    still = swing.head._replace(late_deg=np.zeros(361))
    for seed in range(20):
        shot = beams_shot(swing.directions, still, np.random.default_rng(seed))
        tilts = [np.degrees(np.arctan2(d[..., 2], d[..., 0]))[:, 1:-1] for d in (swing.directions, shot)]
        error = tilts[1] - tilts[0]
        assert np.ptp(error, axis=1).max() < 1e-3
        assert 0.45 * still.wave_deg < error[:, 0].std() < 2.1 * still.wave_deg
        crossings = (np.diff(np.sign(error[:, 0])) != 0).sum()
        assert 226 / (2 * still.wave_rows) - 2 < crossings / 2 < 226 / (still.wave_rows / 2) + 2


def test_what_a_swinging_head_sees_is_reported_where_it_did_not_look():
    wall = Thing("wall", upright(4, 20, 20))
    errors = [
        np.abs(seen.scan.points()[..., 0] - 4)[(seen.scan.range > 0) & (seen.scan.directions[..., 2] > 0.6)]
        for seen in (scanned(wall, scanner=SCANNERS[name]) for name in ("lms200_tilt", "lms200_swing"))
    ]
    assert np.median(errors[1]) > 3 * np.median(errors[0])


SPINNING = [
    ("spinning32", (32, 1800), (15, -25)),
    ("spinning40", (40, 1800), (7, -16)),
    ("spinning64", (64, 2083), (2, -24.33)),
    ("spinning128", (128, 1024), (21, -21.8)),
]


@pytest.mark.parametrize(("name", "shape", "ends_deg"), SPINNING)
def test_spinning_scanners_close_the_turn_and_take_the_strongest(name, shape, ends_deg):
    scanner = SCANNERS[name]
    assert scanner.directions.shape == (*shape, 3) and scanner.wraps
    azimuth = np.arctan2(scanner.directions[0, :, 1], scanner.directions[0, :, 0])
    assert (np.diff(azimuth) < 0).all() and azimuth[0] > 3.13
    elevation = np.degrees(np.arcsin(scanner.directions[:, 0, 2]))
    assert (np.diff(elevation) < 0).all()
    assert elevation[[0, -1]] == pytest.approx(ends_deg, abs=0.01)
    # A thin post before a far white wall: whole beams beside it, no pixel between them.
    post = Thing("post", upright(5, 0.05, 1, Material("dark", 0.05)))
    seen = scanned(post, Thing("wall", upright(10, 20, 20)), scanner=scanner)
    x = seen.scan.points()[..., 0]
    assert not ((x > 6.7) & (x < 9)).any()
    assert ((x > 4) & (x < 6)).any()
