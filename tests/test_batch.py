import json

import numpy as np
import pytest

from analytic import boxes_and_floor, ray_grid
from laserimg import batch
from laserimg.errors import ConfigError, LaserImgError
from laserimg.formats.coco_file import read_coco
from laserimg.settings import Settings

GRID = ray_grid(np.arange(40.0, -40.0, -0.8), np.arange(5.0, -50.0, -0.8))
RULES = 'format = 1\n[bin]\nfrom = ["regions"]\nheight = [0.2, 0.6]\nwidth = [0.2, 0.5]\n'


def save(path, seed=0, boxes=(((2, -0.5, -1.5), (2.3, -0.2, -1.1)),)):
    scan = boxes_and_floor(GRID, boxes, noise_m=0.002, seed=seed)
    path.parent.mkdir(parents=True, exist_ok=True)
    np.savez(path, range=scan.range, directions=scan.directions)
    return path


@pytest.fixture
def folder(tmp_path):
    for number in range(3):
        save(tmp_path / "in" / ("a" if number else "b") / f"{number}.npz", number)
    (tmp_path / "rules.toml").write_text(RULES)
    return tmp_path


def run(folder, jobs=1, force=False, overlays=False, out="out", files=None, **changes):
    settings = Settings(rules=str(folder / "rules.toml"), overlays=overlays, **changes)
    tasks = batch.tasks_of(files or sorted((folder / "in").rglob("*.npz")), settings)
    done = list(batch.run(tasks, settings, folder / out, jobs, force))
    coco = batch.assemble(tasks, done, settings, folder / out)
    return {entry.name: entry for entry in done}, coco


def test_every_scan_of_a_set_gets_its_detections_in_order(folder):
    done, coco = run(folder)
    assert [image.file_name for image in coco.images] == ["a/1.npz", "a/2.npz", "b/0.npz"]
    assert [entry.accepted for entry in coco.annotations] == [True] * 3
    assert [entry.id for entry in coco.annotations] == [1, 2, 3]
    assert [entry.image_id for entry in coco.annotations] == [1, 2, 3]
    assert all(entry.scans == 1 and not entry.error for entry in done.values())
    written = read_coco(folder / "out" / "detections.json")
    assert written.annotations == coco.annotations
    assert len((folder / "out" / "detections.csv").read_text().splitlines()) == 4
    assert json.loads((folder / "out" / "errors.json").read_text()) == []
    assert len(json.loads((folder / "out" / "config.json").read_text())["rules"]["sha256"]) == 64


def test_jobs_change_nothing(folder):
    run(folder, jobs=1, out="one")
    run(folder, jobs=2, out="two")
    assert (folder / "one/detections.json").read_bytes() == (folder / "two/detections.json").read_bytes()


def test_an_earlier_result_is_kept_until_something_it_depends_on_changes(folder):
    run(folder)
    done, coco = run(folder)
    assert all(entry.resumed for entry in done.values())
    assert len(coco.annotations) == 3
    done, _ = run(folder, force=True)
    assert not any(entry.resumed for entry in done.values())
    (folder / "rules.toml").write_text(RULES.replace("0.5]", "0.55]"))
    done, _ = run(folder)
    assert not any(entry.resumed for entry in done.values())


def test_only_the_changed_file_is_done_again(folder):
    run(folder)
    save(folder / "in/b/0.npz", seed=9)
    done, _ = run(folder)
    assert {name: entry.resumed for name, entry in done.items()} == {
        "a/1.npz": True, "a/2.npz": True, "b/0.npz": False,
    }  # fmt: skip


def test_a_missing_result_is_made_again(folder):
    run(folder)
    (folder / "out/scans/a/1.npz.json").unlink()
    done, _ = run(folder)
    assert not done["a/1.npz"].resumed


def test_a_bad_file_is_named_and_the_rest_goes_on(folder):
    (folder / "in/a/broken.npz").write_bytes(b"PK\x03\x04 nonsense")
    done, coco = run(folder)
    assert "broken.npz" in done["a/broken.npz"].error
    assert len(coco.annotations) == 3
    (error,) = json.loads((folder / "out/errors.json").read_text())
    assert error["file_name"] == "a/broken.npz"
    assert not list((folder / "out").rglob("*broken*"))


def test_wrong_rules_end_the_run_before_anything_is_written(folder):
    (folder / "rules.toml").write_text(RULES.replace("height", "heigth"))
    with pytest.raises(ConfigError, match="did you mean 'height'"):
        run(folder)
    assert not (folder / "out").exists()


def test_overlays_are_pictures_that_show_the_detection(folder):
    cv2 = pytest.importorskip("cv2")
    run(folder, overlays=True)
    picture = cv2.imread(str(folder / "out/overlays/a/1.npz.png"))
    assert picture.shape[1] >= 1400
    green = (picture == (60, 220, 60)).all(axis=2).sum()
    assert green > 200


def test_a_candidate_file_of_one_image_is_of_the_only_scan(folder):
    truth = {
        "images": [{"id": 1, "file_name": "other name.pcd", "width": 100, "height": 69}],
        "categories": [{"id": 1, "name": "bin"}],
        "annotations": [{"id": 1, "image_id": 1, "category_id": 1, "bbox": [52, 40, 14, 16]}],
    }
    (folder / "c.json").write_text(json.dumps(truth))
    _, coco = run(folder, files=[folder / "in/a/1.npz"], candidates=str(folder / "c.json"))
    assert [entry.source for entry in coco.annotations] == ["given"]
    with pytest.raises(LaserImgError, match=r"no rules for class 'bin' of .*c\.json; add them"):
        (folder / "rules.toml").write_text(RULES.replace("[bin]", "[tub]"))
        run(folder, files=[folder / "in/a/1.npz"], candidates=str(folder / "c.json"))


def test_boxes_across_the_seam_are_split_when_asked(tmp_path):
    grid = ray_grid(np.arange(180.0, -180.0, -0.8) - 0.4, np.arange(5.0, -50.0, -0.8), wraps=True)
    scan = boxes_and_floor(grid, [((-2.3, -0.15, -1.5), (-2, 0.15, -1.1))], noise_m=0.002)
    (tmp_path / "in").mkdir()
    np.savez(tmp_path / "in/seam.npz", range=scan.range, directions=scan.directions, wraps=True)
    (tmp_path / "rules.toml").write_text(RULES)
    _, whole = run(tmp_path, out="whole")
    _, parts = run(tmp_path, out="parts", split_seam=True)
    (box,) = [entry.bbox for entry in whole.annotations if entry.accepted]
    assert box[0] < 450 < box[0] + box[2]
    assert sorted(e.bbox[0] for e in parts.annotations if e.accepted) == [0.0, box[0]]
    assert sum(e.bbox[2] for e in parts.annotations if e.accepted) == box[2]


def test_up_is_taken_from_the_settings(folder):
    below = [entry.position.height_above_floor for entry in run(folder)[1].annotations]
    assert below == [0, 0, 0]
    upside_down = run(folder, up="-z", out="down")[1].annotations
    assert [entry.position.height_above_floor for entry in upside_down if entry.accepted] == [None] * 3
    with pytest.raises(ConfigError, match="up or rotate"):
        Settings(up="x", rotate=(0, 0, 0))


def test_a_fault_in_one_file_does_not_stop_the_rest(folder, monkeypatch):
    real = batch.scan_record

    def fails(result, name, *others):
        return 1 / 0 if name == "a/1.npz" else real(result, name, *others)

    monkeypatch.setattr(batch, "scan_record", fails)
    done, coco = run(folder)
    assert [image.file_name for image in coco.images] == ["a/2.npz", "b/0.npz"]
    assert "a fault of laserimg, please report it: ZeroDivisionError" in done["a/1.npz"].error
    assert "1.npz" in done["a/1.npz"].error


def test_damaged_results_and_missing_pictures_are_made_again(folder):
    run(folder, overlays=True)
    (folder / "out" / "scans" / "a" / "1.npz.json").write_text("")
    (folder / "out" / "overlays" / "a" / "2.npz.png").unlink()
    done, coco = run(folder, overlays=True)
    assert {name for name, entry in done.items() if not entry.resumed} == {"a/1.npz", "a/2.npz"}
    assert len(coco.images) == 3 and (folder / "out" / "overlays" / "a" / "2.npz.png").exists()


@pytest.mark.parametrize(
    "wrong",
    [
        {"up": "sideways"},
        {"min_range": -1.0},
        {"min_range": 5.0, "max_range": 2.0},
        {"max_range": float("nan")},
        {"rotate": (0.0, 0.0, float("nan"))},
    ],
)
def test_settings_that_no_scan_can_have_end_the_run_before_it_begins(wrong):
    with pytest.raises(ConfigError, match=r"up must be|ranges"):
        Settings(**wrong)
