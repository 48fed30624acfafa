"""The command line of the trainer."""

import json

import cv2
import numpy as np
import pytest
from typer.testing import CliRunner

from laserimg.boxes import iou
from laserimg.cli.app import app
from laserimg.formats.card import read_card
from laserimg.samples.vec import write_vec


@pytest.fixture
def folder(tmp_path):
    rng = np.random.default_rng(0)
    marks = rng.integers(90, 170, (80, 14, 14))
    marks[:, 5:9, 2:12] -= 70
    write_vec(tmp_path / "marks.vec", marks.astype(np.uint8))
    (tmp_path / "photos").mkdir()
    for number in range(6):
        small = rng.integers(0, 256, (12, 15)).astype(np.uint8)
        image = cv2.resize(small, (150, 120), interpolation=cv2.INTER_CUBIC)
        cv2.imwrite(str(tmp_path / "photos" / f"{number}.png"), image)
    return tmp_path


def train(folder, *more, **changes):
    options = {"positives": "marks.vec", "negatives": "photos", "window": "14x14", "num-neg": 80, "stages": 2}
    words = ["train", "cascade", "-o", str(folder / "out")]
    for name, value in {**options, **changes}.items():
        value = folder / value if name in ("positives", "negatives") else value
        words += [f"--{name}", str(value)]
    return CliRunner().invoke(app, [*words, *more])


def test_training_leaves_a_cascade_with_card_report_and_log(folder):
    done = train(folder, "--class", "mark", "--image", "range")
    assert done.exit_code == 0 and "All 2 stages are trained" in done.output
    names = sorted(path.name for path in (folder / "out").iterdir())
    assert names == ["cascade.toml", "cascade.xml", "log.jsonl", "report.html", "state"]
    card = read_card(folder / "out" / "cascade.toml")
    assert (card.label, card.image, card.kind, card.window, card.stages) == (
        "mark",
        "range",
        "haar",
        (14, 14),
        2,
    )


def test_json_holds_the_stages(folder):
    told = json.loads(train(folder, "--json").stdout)
    assert told["end"] == "stages" and len(told["stages"]) == 2
    assert told["stages"][0]["negatives"] == 80


def test_quiet_is_quiet(folder):
    assert train(folder, "--quiet").stdout == ""


def test_a_dry_run_counts_and_writes_nothing(folder):
    (folder / "photos" / "broken.png").write_text("no image")
    done = train(folder, "--dry-run")
    assert done.exit_code == 0
    assert "80 positives; 6 images with " in done.output
    assert "broken.png cannot be read as an image" in done.output
    assert not (folder / "out").exists()


@pytest.mark.parametrize(
    "wrong",
    [
        {"window": "14"},
        {"window": "8x8"},
        {"features": "haar"},
        {"boost": "soft"},
        {"search": "all"},
        {"max-false-alarm": 2},
        {"memory": "much"},
    ],
)
def test_wrong_options_are_usage_errors(folder, wrong):
    done = train(folder, **wrong)
    assert done.exit_code == 2 and "Traceback" not in done.output
    assert not (folder / "out").exists()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"positives": "gone.vec"}, "gone.vec: no such file"),
        ({"negatives": "gone"}, "gone"),
        ({"window": "15x15"}, "windows of 196 pixels, expected 15x15 = 225"),
    ],
)
def test_bad_samples_are_named(folder, change, message):
    done = train(folder, **change)
    assert done.exit_code == 1 and message in str(done.exception)
    assert not (folder / "out").exists()


def test_chairs_of_a_real_scan_from_images_to_detections(data, tmp_path):
    """Four chairs, varied: shows the path, not a detector of use."""
    scan, labels = data("office_room/room_scan1.pcd"), data("office_room/room_scan1.coco.json")

    def run(*words):
        done = CliRunner().invoke(app, [str(word) for word in words])
        assert done.exit_code == 0, done.output
        return done.stdout

    run("images", scan, "-o", tmp_path / "pictures")
    scans = ["--images", tmp_path / "pictures", "--image", "normals_view", "--class", "office_chair"]
    varied = ["--count", 120, "--turn", "2,5,2", "--noise", 5]
    run("samples", labels, *scans, "--window", "12x18", *varied, "-o", tmp_path / "chairs.vec")
    samples = ["--positives", tmp_path / "chairs.vec", "--negatives", labels, *scans]
    options = ["--window", "12x18", "--num-neg", 60, "--stages", 3, "--turned-negatives", "--quiet"]
    run("train", "cascade", *samples, *options, "-o", tmp_path / "chairs")
    (tmp_path / "rules.toml").write_text('format = 1\n[office_chair]\nfrom = ["cascade"]\n')
    detectors = ["--cascades", tmp_path / "chairs" / "cascade.xml", "--rules", tmp_path / "rules.toml"]
    run("detect", scan, *detectors, "-o", tmp_path / "found")
    found = json.loads((tmp_path / "found" / "detections.json").read_text())
    boxes = [a["bbox"] for a in found["annotations"] if a["source"] == "cascade"]
    chairs = [(270, 101, 28, 38), (167, 97, 14, 22), (45, 99, 13, 20), (100, 86, 12, 22)]
    assert len(boxes) > 0
    hits = [max(iou([chair], boxes)[0]) > 0.3 for chair in chairs]
    assert sum(hits) >= 2
    assert "office_chair" in run("evaluate", tmp_path / "found" / "detections.json", labels)
