from dataclasses import replace

import numpy as np
import pytest

from command import laserimg
from laserimg.formats.coco_file import read_coco
from laserimg.formats.masks import mask_of
from laserimg.readers import open_scans
from laserimg.simulate.labels import pixels_alone, thing_size, truth_boxes
from laserimg.simulate.materials import Material
from laserimg.simulate.measure import simulated, staged
from laserimg.simulate.mesh import box, pose_at
from laserimg.simulate.scanner import SCANNERS
from laserimg.simulate.sets import MARK, SetPlan, known, make_scans
from laserimg.simulate.things import Scene, Thing

pytest.importorskip("embreex")
LMS = SCANNERS["lms200_tilt"]


def one_box():
    crate = Thing("crate", box((0.6, 0.4, 0.8), "concrete"), label="crate").at(3, 0, -0.4)
    wall = Thing("wall", box((0.1, 8, 6), "concrete")).at(6, 0, -3)
    return Scene((crate, wall), (np.eye(4),), "box")


def test_a_box_is_around_what_is_seen_and_measures_the_whole():
    scene = one_box()
    (found,) = truth_boxes(scene, simulated(scene, 0, LMS, 0), LMS, {"crate": 4}, image_id=2, first_id=7)
    x, y, w, h = found.bbox
    # 0.4 m wide and 0.8 m high at 2.7 m, in steps of 0.5 and 116.3 / 225 degrees.
    assert w == pytest.approx(2 * np.degrees(np.arctan(0.2 / 2.7)) / 0.5, abs=1.1)
    assert h == pytest.approx(2 * np.degrees(np.arctan(0.4 / 2.7)) * 225 / 116.3, abs=1.1)
    assert (x + w / 2, y + h / 2) == pytest.approx((180.5, 131.3), abs=1)
    assert found.area == pytest.approx(w * h, rel=0.1)
    size = found.size
    assert (size.width, size.depth, size.height) == pytest.approx((0.4, 0.6, 0.8))
    assert (size.length, size.breadth) == pytest.approx((0.6, 0.4), abs=1e-5)
    assert (found.id, found.image_id, found.category_id) == (7, 2, 4)


def test_visibility_is_the_share_that_others_leave_and_the_mask_is_what_is_seen():
    crate, wall = one_box().things
    screen = Thing("screen", box((0.1, 2, 4), "wood")).at(1.5, 1, -2)
    for things, share in (((crate, wall), 1), ((crate, wall, screen), 0.5)):
        scene = Scene(things, (np.eye(4),), "box")
        seen = simulated(scene, 0, LMS, 0)
        (found,) = truth_boxes(scene, seen, LMS, {"crate": 4}, 1, 1)
        assert found.visibility == pytest.approx(share, abs=0.03)
        mask = mask_of(found.segmentation)
        np.testing.assert_array_equal(mask, (seen.thing == 0) & (seen.scan.range > 0))
        assert found.area == mask.sum()


def test_what_is_too_dark_to_be_seen_counts_for_no_visibility():
    """Behind the reach even a thing that stands alone shows nothing: visibility compares like with like."""
    crate = box((0.6, 0.4, 0.8), Material("half", 0.5))
    near, far = (pixels_alone(crate.at(x, 0, -0.4), LMS, np.eye(4)) for x in (3, 23))
    assert near > 500 and far == 0
    seen = simulated(Scene((Thing("crate", crate.at(3, 0, -0.4)),), (np.eye(4),), "box"), 0, LMS, 0)
    assert pixels_alone(crate.at(3, 0, -0.4), LMS, np.eye(4)) == pytest.approx(
        (seen.scan.range > 0).sum(), rel=0.03
    )


def test_a_thing_alone_shows_the_pixels_that_see_its_rim_too():
    """With beams of 15 mrad a small thing alone in the world is seen whole, not more than whole."""
    scanner = SCANNERS["lms151_turn"]
    crate = Thing("crate", box((0.3, 0.3, 0.3), "concrete"), "crate").at(4, 0, -0.15)
    seen = simulated(Scene((crate,), (np.eye(4),), "box"), 0, scanner, 0)
    shown = (seen.thing == 0).sum()
    thin = replace(scanner, beam=scanner.beam._replace(window_m=0.0, divergence_rad=0.0))
    assert pixels_alone(crate.mesh, scanner, np.eye(4)) == pytest.approx(shown, rel=0.03)
    assert shown > 1.15 * pixels_alone(crate.mesh, thin, np.eye(4))


def test_scans_from_one_stage_are_the_same_as_from_their_own():
    scene = replace(one_box(), scanners=(np.eye(4), pose_at(1, 1, 0, -20)))
    stage = staged(scene)
    for place in (0, 1):
        np.testing.assert_array_equal(
            simulated(scene, place, LMS, 0, stage).scan.range, simulated(scene, place, LMS, 0).scan.range
        )


def test_things_that_few_pixels_show_or_without_a_class_have_no_box():
    scene = one_box()
    assert truth_boxes(scene, simulated(scene, 0, LMS, 0), LMS, {"car": 1}, 1, 1) == []
    far = Scene((scene.things[0].at(15, 0), scene.things[1].at(5, 0)), scene.scanners, "far")
    assert truth_boxes(far, simulated(far, 0, LMS, 0), LMS, {"crate": 1}, 1, 1) == []


def test_width_is_across_the_line_of_sight():
    mesh = box((0.6, 0.4, 0.8), "concrete").at(0, 3)
    size = thing_size(mesh.vertices, np.zeros(2))
    assert (size.width, size.depth) == pytest.approx((0.6, 0.4))


def test_a_set_depends_on_seed_and_number_alone_and_grows(tmp_path):
    words = ("simulate", "street", "--scanner", "lms200_tilt")
    laserimg(*words, "--count", 3, "--jobs", 2, "-o", tmp_path / "a")
    laserimg(*words, "--count", 1, "-o", tmp_path / "b")
    first = (tmp_path / "b" / "truth.coco.json").read_text()
    laserimg(*words, "--count", 3, "-o", tmp_path / "b")
    assert first != (tmp_path / "b" / "truth.coco.json").read_text()
    assert (tmp_path / "a/truth.coco.json").read_bytes() == (tmp_path / "b/truth.coco.json").read_bytes()
    for one, other in zip(open_scans(tmp_path / "a"), open_scans(tmp_path / "b"), strict=True):
        np.testing.assert_array_equal(one.range, other.range)
    truth = read_coco(tmp_path / "a/truth.coco.json")
    assert len(truth.images) == 3
    assert {"car", "person", "building"} <= {truth.labels[box.category_id] for box in truth.annotations}
    for scan in open_scans(tmp_path / "a"):
        assert truth.annotations_of(scan)
    for found in truth.annotations:
        mask = mask_of(found.segmentation)
        assert mask.sum() == found.area and 0 < found.visibility <= 1
        rows = np.flatnonzero(mask.any(axis=1))
        assert (found.bbox[1], found.bbox[3]) == (rows[0], rows[-1] + 1 - rows[0])


def test_every_set_has_scenes_of_its_own_that_repeat(tmp_path):
    """Two scanners of one grid, and an extra without a class: only the scenes can differ."""
    sets = [("lms200_tilt", ()), ("lms200_swing", ()), ("lms200_tilt", (known("desk"),)), ("lms200_tilt", ())]
    plans = [SetPlan("street", scanner, 3, tmp_path / f"{k}", more) for k, (scanner, more) in enumerate(sets)]
    for plan in plans:
        assert list(make_scans(plan, 1)) == [0]
    first, swing, desks, _ = (
        {(box.category_id, box.size.width, box.size.height) for box in read_coco(plan.truth(0)).annotations}
        for plan in plans
    )
    assert len(first) > 5 and len(first & swing) < 2 and len(first & desks) < 2
    assert (plans[0].out / plans[0].name(0)).read_bytes() == (plans[3].out / plans[3].name(0)).read_bytes()
    assert plans[0].truth(0).read_bytes() == plans[3].truth(0).read_bytes()


def test_a_set_of_another_version_is_refused_and_not_mixed(tmp_path):
    words = ("simulate", "office", "--scanner", "lms200_tilt", "--count", 1, "-o", tmp_path / "a")
    assert laserimg(*words).code == 0
    before = {path.name for path in (tmp_path / "a").rglob("*")}
    for mark in ("0" * 64, None):
        (tmp_path / "a" / MARK).write_text(mark) if mark else (tmp_path / "a" / MARK).unlink()
        result = laserimg(*words, "--seed", 1)
        assert result.code == 1 and result.err.count("\n") == 1
        assert "another version of the simulator; remove it, or name another folder" in result.err
    assert {path.name for path in (tmp_path / "a").rglob("*")} == before - {MARK}


def test_extras_without_a_class_add_none_to_the_truth(tmp_path):
    plain, more = (SetPlan("office", "lms200_turn", 0, tmp_path, extras) for extras in ((), (known("desk"),)))
    assert more.categories == plain.categories and "" not in more.categories


def test_unknown_names_are_usage_errors(tmp_path):
    result = laserimg("simulate", "moon", "-o", tmp_path / "out")
    assert result.code == 2
    assert "office, park, stairwell, street" in result.err
    assert not (tmp_path / "out").exists()


def test_the_truth_of_a_folder_is_that_of_all_sets_in_it(tmp_path):
    for scene, count, seed in (("office", 2, 0), ("corridor", 1, 0), ("office", 1, 5)):
        done = laserimg(
            "simulate", scene, "--scanner", "lms200_tilt", "--count", count, "--seed", seed, "-o", tmp_path
        )
        assert done.code == 0
    truth = read_coco(tmp_path / "truth.coco.json")
    assert [image.file_name for image in truth.images] == sorted(path.name for path in tmp_path.glob("*.npz"))
    for scan in open_scans(tmp_path):
        for thing in truth.annotations_of(scan):
            seen = scan.range[mask_of(thing.segmentation)]
            assert thing.position.range == pytest.approx(np.median(seen[seen > 0]))
