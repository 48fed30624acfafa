"""The demo: the right objects in the shipped scans, the others with their reason; and `laserimg show`."""

import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

import laserimg as package
from command import laserimg
from laserimg.boxes import iou
from laserimg.formats.coco_file import read_coco

ROOT = Path(__file__).parents[1]
SCANS = Path(package.__file__).parent / "demo"

# What stands in the scans, from tools/make_demo.py: label, width and height in metres, azimuth in degrees.
WASTEBASKET = ("wastebasket", 0.27, 0.31, 17.6)
CAR_LEFT = ("car", 4.6, 1.48, 61.0)
CAR_RIGHT = ("car", 4.9, 1.61, -129.0)
# The same in pixels: the rectangle of the rays that hit it.
BASKET_BOX, DRUM_BOX = (315, 140, 22, 25), (649, 98, 22, 35)
CHAIR_BOXES = [(57, 71, 58, 99), (220, 95, 60, 82), (381, 106, 35, 44)]
PERSON_BOXES = [(714, 55, 11, 40), (516, 51, 13, 44)]
CAR_BOXES = [(273, 65, 138, 68), (800, 61, 125, 64)]


@pytest.fixture(scope="module")
def demo(tmp_path_factory):
    folder = tmp_path_factory.mktemp("demo")
    return folder, laserimg("demo", folder=folder)


@pytest.fixture(scope="module")
def annotations(demo):
    coco = read_coco(demo[0] / "laserimg-demo" / "results" / "detections.json")
    names = {image.id: image.file_name for image in coco.images}
    return [(names[a.image_id], coco.labels[a.category_id], a) for a in coco.annotations]


def test_the_right_objects_are_detected_at_their_places(annotations):
    found = [(scan, label, a) for scan, label, a in annotations if a.accepted]
    assert sorted((scan, label) for scan, label, _ in found) == [
        ("office.npz", "wastebasket"),
        ("street.npz", "car"),
        ("street.npz", "car"),
    ]
    truths = {"wastebasket": [WASTEBASKET], "car": [CAR_LEFT, CAR_RIGHT]}
    for _, label, a in found:
        near = min(truths[label], key=lambda truth: abs(truth[3] - a.position.azimuth_deg))
        assert a.position.azimuth_deg == pytest.approx(near[3], abs=8)
        assert a.size.height == pytest.approx(near[2], abs=0.15)
    (basket,) = [a for _, label, a in found if label == "wastebasket"]
    assert basket.size.width == pytest.approx(WASTEBASKET[1], abs=0.03)
    assert basket.size.height == pytest.approx(WASTEBASKET[2], abs=0.03)


@pytest.mark.parametrize(
    "scan, label, value, words",
    [
        ("office.npz", "wastebasket", 0.89, "height {:.2f} m > 0.60 m"),  # the drum
        ("office.npz", "wastebasket", 0.58, "width {:.2f} m > 0.40 m"),  # the boxes
        ("street.npz", "wastebasket", 0.90, "height {:.2f} m > 0.60 m"),  # the litter bin, over the road
        ("street.npz", "car", 2.31, "height {:.2f} m > 2.10 m"),  # what the lamp post leaves of the van
    ],
)
def test_others_are_rejected_with_the_value_and_limit_that_did_it(annotations, scan, label, value, words):
    reasons = [a.reason for name, category, a in annotations if (name, category) == (scan, label)]
    near = [value + step / 100 for step in range(-5, 6)]
    assert {words.format(v) for v in near} & set(reasons), reasons


@pytest.fixture(scope="module")
def shipped():
    """What the shipped detectors make of the scans, which the demo does not use."""
    pipeline = package.Pipeline.from_folder()
    return {path.stem: pipeline(next(iter(package.open_scans(path)))) for path in SCANS.glob("*.npz")}


def overlaps(result, label, truths):
    """The IoU of every detection of a class with each true box."""
    scan = result.evidence.scan
    return iou([found.box for found in result.detections if found.label == label], truths, scan.shape[1])


@pytest.mark.parametrize(
    "scan, label, boxes",
    [
        ("office", "wastebasket", [BASKET_BOX]),
        ("office", "office_chair", CHAIR_BOXES),
        ("street", "person", PERSON_BOXES),
        ("street", "car", CAR_BOXES),
    ],
)
def test_the_shipped_detectors_find_what_stands_there_and_at_most_one_more(shipped, scan, label, boxes):
    found = overlaps(shipped[scan], label, boxes)
    assert len(found) <= len(boxes) + 1
    assert (found.max(axis=0) >= 0.5).all()


def test_the_shipped_detectors_do_not_call_the_drum_a_wastebasket(shipped):
    assert overlaps(shipped["office"], "wastebasket", [DRUM_BOX]).max(initial=0) < 0.1


def test_it_says_what_it_found_and_where_it_wrote(demo):
    folder, done = demo
    assert (done.code, done.err) == (0, "")
    rows = done.out.splitlines()
    assert any("office.npz" in row and "wastebasket" in row and "detected" in row for row in rows)
    assert any("rejected: height" in row for row in rows)
    for name in ("results/overlays", "results/detections.json", "office.npz"):
        assert f"laserimg-demo/{name}" in done.out
        assert (folder / "laserimg-demo" / name).exists()


def test_the_pictures_show_green_and_red_boxes(demo):
    for name in ("office", "street"):
        picture = cv2.imread(str(demo[0] / f"laserimg-demo/results/overlays/{name}.npz.png"))
        assert picture is not None
        assert picture.shape[1] >= 1000
        colours = {tuple(colour) for colour in np.unique(picture[:, :, ::-1].reshape(-1, 3), axis=0).tolist()}
        assert {(60, 220, 60), (235, 70, 70)} <= colours


def test_scans_are_small():
    files = sorted(SCANS.glob("*.npz"))
    assert [file.stem for file in files] == ["office", "street"]
    assert all(file.stat().st_size < 500_000 for file in files)


def test_the_tool_makes_the_shipped_scans_again(tmp_path):
    """Equal but for noise, all of which differs where a ray at an edge falls to the other side."""
    subprocess.run([sys.executable, ROOT / "tools" / "make_demo.py", "-o", tmp_path], check=True, timeout=120)
    for shipped in SCANS.glob("*.npz"):
        old, new = np.load(shipped), np.load(tmp_path / shipped.name)
        assert {key: old[key].dtype for key in old} == {key: new[key].dtype for key in new}
        for key in ("azimuth_deg", "elevation_deg"):
            assert np.allclose(old[key], new[key], rtol=0, atol=1e-4)
        near = np.isclose(old["range"], new["range"], rtol=0, atol=0.06)
        assert near.mean() > 0.98, f"{shipped.name}: run tools/make_demo.py"


def test_show_writes_the_picture_of_a_scan(tmp_path, shipped):
    done = laserimg("show", SCANS / "street.npz", "--no-open", "-o", "street.png", folder=tmp_path)
    assert done == (0, f"{len(shipped['street'].detections)} detections; picture: street.png\n", "")
    assert cv2.imread(str(tmp_path / "street.png")) is not None


def test_show_makes_a_picture_of_any_image(tmp_path):
    """Under the boxes, gray images are gray and the two images differ."""
    pictures = []
    for kind in ("range", "reflectance"):
        laserimg("show", SCANS / "street.npz", "--no-open", "-o", "a.png", "--image", kind, folder=tmp_path)
        pictures.append(cv2.imread(str(tmp_path / "a.png")))
    below = [picture[-40:, :40] for picture in pictures]
    assert all((part == part[..., :1]).all() for part in below)
    assert (below[0] != below[1]).any()


@pytest.mark.parametrize("display, opened", [("", []), (":0", ["street.png"])])
def test_show_opens_a_viewer_only_where_there_is_a_display(tmp_path, monkeypatch, display, opened):
    launched = []
    monkeypatch.setattr("typer.launch", launched.append)
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    monkeypatch.setenv("DISPLAY", display)
    done = laserimg("show", SCANS / "street.npz", "-o", "street.png", folder=tmp_path)
    assert "picture: street.png" in done.out
    assert launched == opened


def test_show_without_a_name_leaves_the_folder_as_it_is(tmp_path):
    done = laserimg("show", SCANS / "street.npz", "--no-open", folder=tmp_path)
    picture = Path(done.out.split("picture: ")[1].strip())
    assert picture.name == "street.png"
    assert picture.exists()
    assert list(tmp_path.iterdir()) == []
    picture.unlink()
    picture.parent.rmdir()
