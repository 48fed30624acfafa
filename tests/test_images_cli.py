"""`laserimg images`: files that hold what they should, or one clear line and nothing."""

import cv2
import numpy as np
import pytest

from command import laserimg
from laserimg.errors import LaserImgError
from laserimg.images import make_image, write_png
from laserimg.readers import open_scans
from scenes import panorama, room, scan_of


@pytest.fixture(scope="module")
def scan_file(tmp_path_factory):
    scan, _ = scan_of(room(), panorama(40, 60))
    path = tmp_path_factory.mktemp("scans") / "office.npz"
    np.savez(path, range=scan.range, directions=scan.directions, reflectance=scan.reflectance)
    return path


def test_every_kind_is_written(scan_file, tmp_path):
    done = laserimg("images", scan_file, "-o", tmp_path)
    assert done.code == 0
    assert str(tmp_path) in done.out
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "office.depth_relative.png",
        "office.normals.png",
        "office.normals_abs.png",
        "office.normals_view.png",
        "office.range.png",
        "office.reflectance.png",
    ]


def test_colours_are_right_in_the_file(scan_file, tmp_path):
    laserimg("images", scan_file, "-o", tmp_path, "--kinds", "normals,normals.b", "--quiet")
    scan = next(open_scans(scan_file))
    expected = make_image(scan, "normals")
    in_file = cv2.cvtColor(cv2.imread(str(tmp_path / "office.normals.png")), cv2.COLOR_BGR2RGB)
    np.testing.assert_array_equal(in_file, expected)
    blue = cv2.imread(str(tmp_path / "office.normals.b.png"), cv2.IMREAD_UNCHANGED)
    np.testing.assert_array_equal(blue, expected[..., 2])


def test_equal_names_in_two_folders_do_not_meet(scan_file, tmp_path):
    for folder in ("a", "b"):
        (tmp_path / "in" / folder).mkdir(parents=True)
        (tmp_path / "in" / folder / "office.npz").write_bytes(scan_file.read_bytes())
    done = laserimg("images", tmp_path / "in", "-o", tmp_path / "out", "--kinds", "range")
    assert done.code == 0
    assert sorted(str(path.relative_to(tmp_path / "out")) for path in (tmp_path / "out").rglob("*.png")) == [
        "a/office.range.png",
        "b/office.range.png",
    ]


def test_a_wrong_kind_is_wrong_usage(scan_file, tmp_path):
    done = laserimg("images", scan_file, "-o", tmp_path / "out", "--kinds", "normal")
    assert done.code == 2
    assert "nearest: normals" in done.err
    assert not (tmp_path / "out").exists()


def test_bad_files_are_named_and_good_ones_are_done(scan_file, tmp_path):
    broken = tmp_path / "broken.npz"
    broken.write_bytes(scan_file.read_bytes()[:200])
    done = laserimg(
        "images", broken, tmp_path / "none.npz", scan_file, "-o", tmp_path / "out", "--kinds", "range"
    )
    assert done.code == 1
    assert "broken.npz" in done.err
    assert "none.npz" in done.err
    assert done.err.count("\n") == 2
    assert len(list((tmp_path / "out").rglob("*.png"))) == 1


def test_reflectance_that_is_not_there_is_an_error_only_if_asked_for(tmp_path):
    scan, _ = scan_of(room(), panorama(20, 30))
    np.savez(tmp_path / "plain.npz", range=scan.range, directions=scan.directions)
    assert laserimg("images", tmp_path / "plain.npz", "-o", tmp_path / "all").code == 0
    assert not list((tmp_path / "all").glob("*reflectance*"))
    done = laserimg("images", tmp_path / "plain.npz", "-o", tmp_path / "one", "--kinds", "reflectance")
    assert done.code == 1
    assert "plain.npz: the scan has no reflectance" in done.err


def test_a_folder_that_cannot_be_written_is_one_line(tmp_path):
    (tmp_path / "file").write_text("not a folder")
    with pytest.raises(LaserImgError, match="cannot write"):
        write_png(tmp_path / "file" / "a.png", np.zeros((2, 2), np.uint8))
