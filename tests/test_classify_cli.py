"""`laserimg classify`: train, evaluate, predict; what is wrong in one line."""

import json
import shutil
from dataclasses import replace

import cv2
import numpy as np
import pytest

from command import laserimg
from laserimg.classify.recipe import Recipe
from laserimg.classify.sources import described, labelled_sources
from laserimg.formats.npz import write_npz
from laserimg.formats.ptx import write_ptx
from test_classify import objects, room

ONE_BALL = "laserimg: class ball has only 1 object; at least 2 are needed"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Balls, blocks and rods in millimetres with intensity and time, one folder a class."""
    top = tmp_path_factory.mktemp("objects")
    clouds, labels = objects(6)
    for number, (cloud, label) in enumerate(zip(clouds, labels, strict=True)):
        (top / label).mkdir(exist_ok=True)
        time = np.arange(len(cloud.points))
        table = np.column_stack([cloud.points * 1000, cloud.reflectance, time])
        np.savetxt(top / label / f"{number:02}.csv", table, delimiter=",", fmt="%.3f")
    return top


@pytest.fixture(scope="module")
def model(folder, tmp_path_factory):
    path = tmp_path_factory.mktemp("model") / "m.npz"
    done = laserimg(
        "classify", "train", folder, "--features", "3dhog+hog", "--scale", "0.001", "--size", "-o", path
    )
    assert done.code == 0, done.err
    assert "18 objects" in done.out and "Precision" in done.out and "95 % interval" in done.out
    return path


def test_evaluate_a_model(folder, model, tmp_path):
    done = laserimg(
        "classify", "evaluate", model, folder, "--scale", "0.001", "-o", tmp_path / "c.png", "--json"
    )
    assert done.code == 0, done.err
    result = json.loads(done.out)
    assert result["classes"]["rod"] == {
        "images": 6, "detected": 6, "correct": 6, "precision": 1, "recall": 1
    }  # fmt: skip
    total = result["total"]
    assert total["images"] == total["detected"] == total["correct"] == 18 and total["precision"] == 1
    assert result["recipe"] == {
        "features": "3dhog+hog", "views": 24, "size": True, "appearance": "reflectance"
    }  # fmt: skip
    assert cv2.imread(str(tmp_path / "c.png")).shape[0] > 300


@pytest.mark.parametrize("how", [["--leave-one-out"], ["--folds", "3", "--repeats", "2"]])
def test_evaluate_without_a_model(folder, how):
    done = laserimg("classify", "evaluate", *how, folder, "--scale", "0.001", "--views", "2", "--json")
    assert done.code == 0, done.err
    total = json.loads(done.out)["total"]
    assert total["images"] == 18 and total["accuracy"] > 0.9
    assert total["accuracy_interval"][0] < total["accuracy"] <= total["accuracy_interval"][1]


def test_predict(folder, model):
    files = [folder / "rod" / "02.csv", folder / "ball" / "00.csv"]
    done = laserimg("classify", "predict", model, *files, "--scale", "0.001", "--json")
    assert done.code == 0, done.err
    assert [row["class"] for row in json.loads(done.out)] == ["rod", "ball"]
    assert all(0.34 < row["confidence"] <= 1 for row in json.loads(done.out))
    unknown = laserimg("classify", "predict", model, folder / "rod", "--scale", "0.001", "--margin", "50")
    assert unknown.out.count("unknown") == 6


def test_a_broken_file_is_named_and_the_rest_is_done(folder, model, tmp_path):
    broken = tmp_path / "broken.xyz"
    broken.write_text("1 2 3\n4 5 6\n")
    done = laserimg("classify", "predict", model, broken, folder / "rod" / "02.csv", "--scale", "0.001")
    assert done.code == 1
    assert done.out.startswith("rod")
    assert done.err == f"laserimg: {broken}: an object needs at least 10 points, got 2\n"


def test_no_reflectance_says_which_features_need_it(tmp_path):
    for label, points in (("a", np.random.default_rng(0).random((50, 3))), ("b", np.eye(3).repeat(9, 0))):
        (tmp_path / label).mkdir()
        np.savetxt(tmp_path / label / "0.xyz", points)
    done = laserimg("classify", "train", tmp_path, "--features", "3dhog", "-o", tmp_path / "m.npz")
    assert done.code == 1 and len(done.err.splitlines()) == 1
    assert "has no reflectance, which the features 3dhog need" in done.err
    assert not (tmp_path / "m.npz").exists()


def test_a_class_with_one_object(folder, tmp_path):
    for label, count in (("rod", 2), ("ball", 1)):
        (tmp_path / label).mkdir()
        for file in sorted((folder / label).iterdir())[:count]:
            (tmp_path / label / file.name).write_bytes(file.read_bytes())
    done = laserimg("classify", "train", tmp_path, "--scale", "0.001", "-o", tmp_path / "m.npz")
    assert (done.code, done.err) == (1, f"{ONE_BALL}, or name the other classes with --classes\n")


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["evaluate", "only-one"], 2, "needs MODEL and FOLDER"),
        (["evaluate", "--leave-one-out", "--folds", "3", "x"], 2, "give only one of"),
        (["train", "x", "-o", "m.npz", "--features", "hog"], 2, "features must be one of"),
        (["train", "missing", "-o", "m.npz"], 1, "missing: no such file or folder"),
        (["predict", "missing.npz", "x"], 1, "missing.npz: no such file"),
    ],
)
def test_wrong_usage(arguments, code, message, tmp_path):
    done = laserimg("classify", *arguments, folder=tmp_path)
    assert done.code == code and message in done.err


def test_a_model_says_itself_how_objects_are_described(folder, model):
    done = laserimg("classify", "evaluate", model, folder, "--scale", "0.001", "--views", "4")
    assert done.code == 2 and "--views" in done.err


def test_a_class_cannot_be_called_unknown(folder, model, tmp_path):
    for label, name in (("rod", "rod"), ("ball", "unknown")):
        shutil.copytree(folder / label, tmp_path / "objects" / name)
    done = laserimg("classify", "train", tmp_path / "objects", "--scale", "0.001", "-o", tmp_path / "m.npz")
    assert done.code == 1 and done.err.startswith("laserimg: a class cannot be called unknown")
    assert not (tmp_path / "m.npz").exists()
    done = laserimg("classify", "evaluate", model, tmp_path / "objects", "--scale", "0.001")
    assert done.code == 1 and done.err.startswith("laserimg: a class cannot be called unknown")


def test_millimetres_without_a_scale_are_noticed(folder, model):
    done = laserimg("classify", "predict", model, folder / "rod" / "02.csv")
    assert done.code == 1 and done.out == "" and "--scale 0.001" in done.err


def test_intensity_of_npz_clouds_is_their_reflectance(folder, model, tmp_path):
    x, y, z, intensity = np.loadtxt(folder / "rod" / "02.csv", delimiter=",").T[:4]
    np.savez(tmp_path / "rod.npz", points=np.column_stack([x, y, z]), intensity=intensity)
    done = laserimg("classify", "predict", model, tmp_path / "rod.npz", "--scale", "0.001")
    assert (done.code, done.err) == (0, "") and done.out.startswith("rod")


def test_boxes_in_scans(tmp_path):
    """A COCO file with its scan: two classes, two boxes each."""
    write_npz(room(), tmp_path / "room.npz")
    boxes = [(340, 20, 50, 60), (690, 20, 60, 60), (341, 21, 48, 58), (691, 21, 58, 58)]
    coco = {
        "images": [{"id": 1, "file_name": "room.npz", "width": 719, "height": 100}],
        "categories": [{"id": 1, "name": "box"}, {"id": 2, "name": "block"}],
        "annotations": [
            {"id": n, "image_id": 1, "category_id": 1 + n % 2, "bbox": list(box)}
            for n, box in enumerate(boxes)
        ],
    }
    (tmp_path / "truth.json").write_text(json.dumps(coco))
    done = laserimg(
        "classify", "train", tmp_path / "truth.json", "--features", "honv", "-o", tmp_path / "m.npz"
    )
    assert done.code == 0, done.err
    assert "4 objects" in done.out
    done = laserimg("classify", "evaluate", tmp_path / "m.npz", tmp_path / "truth.json", "--json")
    assert json.loads(done.out)["total"]["accuracy"] == 1


def test_boxes_in_the_scans_of_one_file_in_any_order(tmp_path):
    """Boxes of scans of a file of several give what they give in files of one scan each."""
    scans = [room(), replace(room(), range=room().range * np.float32(1.5))]
    write_ptx(scans, tmp_path / "both.ptx")
    for number, scan in enumerate(scans):
        write_ptx([scan], tmp_path / f"{number}.ptx")
    boxes = [(1, 340), (0, 340), (1, 690), (1, 340), (0, 690)]

    def coco(name, of):
        images = [{"id": n, "width": 719, "height": 100, **of(n)} for n in (0, 1)]
        entries = [
            {"id": n, "image_id": scan, "category_id": 1, "bbox": [x, 20, 60, 60]}
            for n, (scan, x) in enumerate(boxes)
        ]
        labels = {"images": images, "categories": [{"id": 1, "name": "box"}], "annotations": entries}
        (tmp_path / name).write_text(json.dumps(labels))
        return described(labelled_sources(tmp_path / name), Recipe("honv", size=True))

    together = coco("both.json", lambda n: {"file_name": "both.ptx", "scan": n})
    apart = coco("apart.json", lambda n: {"file_name": f"{n}.ptx"})
    assert together.errors == apart.errors == []
    np.testing.assert_array_equal(together.vectors, apart.vectors)
    assert not np.allclose(together.vectors[0], together.vectors[1], atol=0.1)
    none = coco("none.json", lambda n: {"file_name": "both.ptx", "scan": 2 * n})
    assert [error.endswith("has no scan 2") for error in none.errors] == [True] * 3
    np.testing.assert_array_equal(none.vectors, together.vectors[[1, 4]])
