"""Samples from every kind of file, varied, pasted and written."""

import json

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from typer.testing import CliRunner

from laserimg.cli.app import app
from laserimg.errors import ConfigError, LabelError
from laserimg.samples.augment import Variation, paste, vary
from laserimg.samples.labels import read_labels
from laserimg.samples.negatives import read_negatives
from laserimg.samples.positives import read_positives
from laserimg.samples.sheet import contact_sheet
from laserimg.samples.vec import read_vec, write_vec

BOX = [12, 8, 20, 24]


def scene(path, seed=0, size=(60, 80)):
    path.parent.mkdir(parents=True, exist_ok=True)
    image = np.random.default_rng(seed).integers(0, 256, size).astype(np.uint8)
    cv2.imwrite(str(path), image)
    return image


@given(arrays(np.uint8, st.tuples(st.integers(0, 5), st.integers(1, 9), st.integers(1, 9))))
@settings(max_examples=30, deadline=None)
def test_vec_round_trip(tmp_path_factory, windows):
    path = tmp_path_factory.mktemp("vec") / "a.vec"
    write_vec(path, windows)
    _, height, width = windows.shape
    assert (read_vec(path, (width, height)) == windows).all()


def test_vec_layout_is_that_of_createsamples(tmp_path):
    write_vec(tmp_path / "a.vec", np.array([[[1, 2], [3, 255]]], np.uint8))
    expected = b"\x01\0\0\0" + b"\x04\0\0\0" + b"\0" * 4 + b"\0" + b"\x01\0\x02\0\x03\0\xff\0"
    assert (tmp_path / "a.vec").read_bytes() == expected


@pytest.mark.parametrize(
    ("data", "window", "message"),
    [
        (b"\1\0\0\0", (2, 2), "too short for a vec file"),
        (b"\1\0\0\0\4\0\0\0" + b"\0" * 4, (2, 2), "says 1 windows but ends before"),
        (b"\1\0\0\0\4\0\0\0" + b"\0" * 13, (3, 3), r"windows of 4 pixels, expected 3x3 = 9"),
        (b"\1\0\0\0\5\0\0\0" + b"\0" * 15, None, "windows of 5 pixels, expected a square number"),
        (b"\xff\xff\xff\xff\4\0\0\0" + b"\0" * 13, (2, 2), "windows of 4 pixels"),
    ],
)
def test_wrong_vec_files_are_named(tmp_path, data, window, message):
    (tmp_path / "a.vec").write_bytes(data)
    with pytest.raises(LabelError, match=rf"a\.vec: .*{message}"):
        read_vec(tmp_path / "a.vec", window)


def as_info(folder, image):
    (folder / "info.dat").write_text(f"my scene.png 1 {' '.join(map(str, BOX))}\r\n\r\nmy scene.png 0\r\n")
    return folder / "info.dat"


def as_coco(folder, image):
    boxes = [(1, BOX), (2, [50, 40, 20, 15])]
    coco = {
        "images": [{"id": 1, "file_name": "my scene.png", "width": 80, "height": 60}],
        "categories": [{"id": 1, "name": "chair"}, {"id": 2, "name": "bin"}],
        "annotations": [
            {"id": i, "image_id": 1, "category_id": c, "bbox": box, "area": 1, "iscrowd": 0}
            for i, (c, box) in enumerate(boxes, 1)
        ],
    }
    (folder / "labels.json").write_text(json.dumps(coco))
    return folder / "labels.json"


def as_voc(folder, image):
    x, y, w, h = BOX
    box = "<bndbox><xmin>{}</xmin><ymin>{}</ymin><xmax>{}</xmax><ymax>{}</ymax></bndbox>"
    objects = (
        f"<object><name>chair</name>{box.format(x + 1, y + 1, x + w, y + h)}</object>"
        f"<object><name>bin</name>{box.format(51, 41, 70, 55)}</object>"
    )
    text = f"<annotation><filename>my scene.png</filename>{objects}</annotation>"
    (folder / "my scene.xml").write_text(text)
    return folder


def as_imglab(folder, image):
    x, y, w, h = BOX
    box = "<box top='{}' left='{}' width='{}' height='{}'{}><label>{}</label></box>"
    boxes = box.format(y, x, w, h, "", "chair") + box.format(40, 50, 20, 15, " ignore='1'", "chair")
    text = f"<dataset><images><image file='my scene.png'>{boxes}</image></images></dataset>"
    (folder / "labels.xml").write_text(text)
    return folder / "labels.xml"


def as_yolo(folder, image):
    x, y, w, h = BOX
    lines = ["1 0.75 0.79 0.25 0.25", f"0 {(x + w / 2) / 80} {(y + h / 2) / 60} {w / 80} {h / 60}"]
    (folder / "my scene.txt").write_text("\n".join(lines))
    (folder / "classes.txt").write_text("chair\nbin\n")
    return folder


@pytest.mark.parametrize("make", [as_info, as_coco, as_voc, as_imglab, as_yolo])
def test_labels_of_every_kind(tmp_path, make):
    image = scene(tmp_path / "my scene.png")
    path = make(tmp_path, image)
    for name in ("._my scene.png", "._my scene.xml", "._my scene.txt"):
        (tmp_path / name).write_text("what a file manager leaves")
    label = None if make is as_info else "chair"
    labelled = [entry for entry in read_labels(path, label) if len(entry.objects)]
    assert len(labelled) == 1
    np.testing.assert_allclose(labelled[0].objects, [BOX], atol=1e-9)
    assert len(labelled[0].ignored) == (0 if make is as_info else 1)
    x, y, w, h = BOX
    found = read_positives(path, (w, h), label=label)
    assert (found.windows[0] == image[y : y + h, x : x + w]).all() and len(found.windows) == 1
    negatives = read_negatives(path).images
    assert len(np.concatenate([entry.boxes for entry in negatives])) == (1 if make is as_info else 2)


def test_a_folder_of_crops_is_scaled(tmp_path):
    image = scene(tmp_path / "crops" / "a.png", size=(48, 40))
    for name in ("broken.png", "._a.png"):
        (tmp_path / "crops" / name).write_text("nothing")
    scene(tmp_path / "crops" / "small.png", size=(5, 5))
    found = read_positives(tmp_path / "crops", (20, 24))
    assert (found.windows == cv2.resize(image, (20, 24), interpolation=cv2.INTER_AREA)).all()
    assert [line.split("crops/")[-1] for line in found.skipped] == [
        "broken.png cannot be read as an image",
        "small.png: 5x5 is smaller than the window",
    ]


def test_a_margin_reaches_over_the_box_and_the_border(tmp_path):
    image = scene(tmp_path / "a.png", size=(40, 40))
    (tmp_path / "info.dat").write_text("a.png 2 10 10 20 20 0 0 20 20")
    inner, corner = read_positives(tmp_path / "info.dat", (24, 24), margin=0.1).windows
    assert (inner == image[8:32, 8:32]).all()
    assert (corner == np.pad(image, 2, mode="edge")[:24, :24]).all()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a.png 1 50 10 40 20", r"info\.dat, line 1: box 50 10 40 20 is outside a\.png \(80x60\)"),
        ("\na.png 2 1 2 3", r"info\.dat, line 2: expected 'image count x y w h"),
        ("a.png 1 1 2 0 5", r"info\.dat, line 1: boxes need a width and height above 0"),
        ("a.png 1 1 2 x 5", r"info\.dat, line 1: a box is not four numbers"),
        ("gone.png 1 1 2 30 30", r"no positives\n.*line 1: .*gone\.png cannot be read"),
        ("a.png 1 1 2 10 10", r"no positives\n.*line 1: 10x10 is smaller than the window"),
        ("", "no positives"),
    ],
)
def test_wrong_info_files_are_named_by_line(tmp_path, text, message):
    scene(tmp_path / "a.png")
    (tmp_path / "info.dat").write_text(text)
    with pytest.raises(LabelError, match=message):
        read_positives(tmp_path / "info.dat", (20, 20))


def test_an_unknown_class_is_answered_with_those_there_are(tmp_path):
    scene(tmp_path / "my scene.png")
    with pytest.raises(LabelError, match="no category 'desk'; there are bin, chair"):
        read_positives(as_coco(tmp_path, None), (20, 20), label="desk")


def test_negatives_by_list_and_folder(tmp_path):
    for name in ("a b.png", "sub/c.jpg"):
        scene(tmp_path / "photos" / name)
    (tmp_path / "photos" / "bg.txt").write_text("﻿a b.png\r\n\r\nsub/c.jpg\r\ngone.png\r\n", encoding="utf-8")
    listed = read_negatives(tmp_path / "photos" / "bg.txt")
    assert [image.path.name for image in listed.images] == ["a b.png", "c.jpg"]
    assert len(listed.skipped) == 1 and "bg.txt, line 4: " in listed.skipped[0]
    (tmp_path / "photos" / "bg.txt").unlink()
    assert [image.path.name for image in read_negatives(tmp_path / "photos").images] == ["a b.png", "c.jpg"]


def test_a_list_of_missing_images_says_where_it_looked(tmp_path):
    (tmp_path / "bg.txt").write_text("photos/1.jpg\n")
    with pytest.raises(LabelError, match=r"bg\.txt: no images; .*photos/1\.jpg does not exist"):
        read_negatives(tmp_path / "bg.txt")


def bar():
    image = np.full((1, 20, 20), 100, np.uint8)
    image[0, 4:8, 3:12] = 220
    return image


def vary_bar(count=40, seed=0, **options):
    return vary(bar(), count, Variation(**options), np.random.default_rng(seed))


def test_without_variation_samples_stay():
    assert (vary_bar() == bar()).all()


def test_mirrors_are_half_and_exact():
    made = vary_bar(400, mirror=True)
    mirrored = (made == bar()[:, :, ::-1]).all(axis=(1, 2))
    assert (mirrored | (made == bar()).all(axis=(1, 2))).all()
    assert 140 < mirrored.sum() < 260


def middle_of(image):
    y, x = np.nonzero(image > 160)
    return np.array([x.mean(), y.mean()])


def test_turns_go_about_the_middle_by_no_more_than_asked():
    start = middle_of(bar()[0]) - 9.5
    angles = []
    for image in vary_bar(60, turn_deg=(0, 0, 30)):
        place = middle_of(image) - 9.5
        assert np.hypot(*place) == pytest.approx(np.hypot(*start), abs=0.5)
        angles.append(np.degrees(np.angle(complex(*place) / complex(*start))))
    assert -33 < min(angles) < -20 and 20 < max(angles) < 33


def test_turning_away_narrows_one_way_only():
    widths, heights = [], []
    for image in vary_bar(60, turn_deg=(0, 50, 0)):
        mask = image > 160
        widths.append(mask.any(axis=0).sum())
        heights.append(mask.any(axis=1).sum())
    assert min(widths) <= 7 and max(widths) <= 11
    assert set(heights) <= {3, 4, 5}


def test_shift_scale_and_dropped_returns():
    moved = np.array([middle_of(image) - middle_of(bar()[0]) for image in vary_bar(80, shift=0.1)])
    assert 1 < np.abs(moved).max() <= 2.5
    sizes = [(image > 160).sum() / 36 for image in vary_bar(80, scale=0.3)]
    assert min(sizes) < 0.75 and 1.3 < max(sizes) < 2.2
    assert (vary_bar(50, dropped=0.2) == 0).mean() == pytest.approx(0.2, abs=0.02)
    assert (vary_bar(50, noise=8).astype(int) - bar()).std() == pytest.approx(8, rel=0.1)


def test_every_sample_is_used_as_often():
    samples = np.stack([np.full((12, 12), value, np.uint8) for value in (10, 20, 30)])
    made = vary(samples, 100, Variation(), np.random.default_rng(0))
    _, counts = np.unique(made[:, 0, 0], return_counts=True)
    assert sorted(counts) == [33, 33, 34]


@pytest.mark.parametrize(
    "wrong",
    [{"turn_deg": (90, 0, 0)}, {"scale": 0.9}, {"dropped": 1.0}, {"noise": -1}, {"noise": float("nan")}],
)
def test_variations_have_limits(wrong):
    with pytest.raises(ConfigError, match="must be"):
        Variation(**wrong)


def test_grounds_show_through_one_grey():
    grounds = np.full((1, 20, 20), 7, np.uint8)
    made = paste(bar(), grounds, 101, 2, np.random.default_rng(0))
    assert (made == np.where(bar() == 100, 7, bar())).all()


def test_the_contact_sheet_holds_every_sample():
    samples = np.random.default_rng(0).integers(0, 256, (7, 5, 9)).astype(np.uint8)
    sheet = contact_sheet(samples, columns=3)
    for number, sample in enumerate(samples):
        row, column = divmod(number, 3)
        top, left = 2 + row * 7, 2 + column * 11
        assert (sheet[top : top + 5, left : left + 9] == sample).all()


def run(*words):
    return CliRunner().invoke(app, ["samples", *map(str, words)])


def test_the_command_makes_a_vec_a_sheet_and_a_folder(tmp_path):
    for number in range(4):
        scene(tmp_path / "crops" / f"{number}.png", number, (30, 30))
    options = ["--count", 10, "--mirror", "--turn", "5,5,10", "--window", "20x20"]
    done = run(tmp_path / "crops", *options, "-o", tmp_path / "a.vec")
    assert done.exit_code == 0 and "10 samples of 20x20" in done.output
    assert read_vec(tmp_path / "a.vec").shape == (10, 20, 20)
    run(tmp_path / "crops", *options, "-o", tmp_path / "b.vec")
    assert (tmp_path / "a.vec").read_bytes() == (tmp_path / "b.vec").read_bytes()
    run(tmp_path / "a.vec", "--window", "20x20", "-o", tmp_path / "sheet.png")
    assert cv2.imread(str(tmp_path / "sheet.png"), 0).shape == (3 * 22 + 2, 4 * 22 + 2)
    run(tmp_path / "a.vec", "--window", "20x20", "-o", tmp_path / "folder")
    back = read_positives(tmp_path / "folder", (20, 20)).windows
    assert (back == read_vec(tmp_path / "a.vec")).all()


def test_an_image_that_cannot_hold_samples_is_no_folder(tmp_path):
    scene(tmp_path / "crops" / "a.png", 0, (30, 30))
    done = run(tmp_path / "crops", "-o", tmp_path / "sheet.jpg")
    assert done.exit_code == 1 and not (tmp_path / "sheet.jpg").exists()


@pytest.mark.parametrize("wrong", [["--window", "20"], ["--turn", "5"], ["--scale", "2"]])
def test_wrong_options_are_usage_errors(tmp_path, wrong):
    scene(tmp_path / "crops" / "a.png")
    assert run(tmp_path / "crops", "-o", tmp_path / "a.vec", *wrong).exit_code == 2
    assert not (tmp_path / "a.vec").exists()


def test_what_checks_rejected_is_neither_learnt_nor_background(tmp_path):
    scene(tmp_path / "my scene.png")
    path = as_coco(tmp_path, None)
    coco = json.loads(path.read_text())
    coco["annotations"] = [
        {**coco["annotations"][0], "id": number, "bbox": [10 * number, 5, 8, 9], "accepted": number == 1}
        for number in (1, 2)
    ]
    path.write_text(json.dumps(coco))
    (image,) = read_labels(path, "chair")
    assert image.objects.tolist() == [[10, 5, 8, 9]] and image.ignored.tolist() == [[20, 5, 8, 9]]
