"""From labels in metres to boxes in pixels."""

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from command import laserimg
from laserimg.errors import LabelError
from laserimg.formats.boxes3d import Box3D, CameraView, Labels3D, labels_beside
from laserimg.formats.boxes3d.kitti import read_kitti_labels
from laserimg.formats.boxes3d.sustech import read_sustech_labels
from laserimg.formats.coco import CocoImage
from laserimg.formats.coco_file import read_coco
from laserimg.readers import open_scans
from laserimg.scan import Scan
from laserimg.truth import truth_of

# One pixel a degree, all round, column 0 at +179.5 degrees.
AZIMUTH = np.radians(179.5 - np.arange(360))
ELEVATION = np.radians(10 - np.arange(21.0))
IMAGE = CocoImage(1, "a.npz", 360, 21)


def sphere(range_m=10.0, **fields):
    return Scan.from_range_image(np.full((21, 360), range_m), AZIMUTH, ELEVATION, wraps=True, **fields)


def box_at(azimuth_deg, kind="car", range_m=10.0, side=2.0):
    at = range_m * np.array([np.cos(np.radians(azimuth_deg)), np.sin(np.radians(azimuth_deg)), 0])
    return Box3D(kind, at, np.eye(3), np.full(3, side))


@given(
    turn=st.tuples(*[st.floats(-3, 3)] * 3),
    size=st.tuples(*[st.floats(0.1, 5)] * 3),
    seed=st.integers(0, 50),
)
@settings(deadline=None)
def test_a_box_holds_what_its_eight_corners_enclose(turn, size, seed):
    """Slow reference: inside means on the inner side of all six faces."""
    axes, centre = Rotation.from_euler("XYZ", turn).as_matrix(), np.array([1.0, 2, 3])
    points = np.random.default_rng(seed).uniform(-2, 6, (40, 3))
    box = Box3D("car", centre, axes, np.array(size))
    for point, held in zip(points, box.holds(points), strict=True):
        faces = [
            side * (point - (centre + side * axes[:, k] * size[k] / 2)) @ axes[:, k] <= 0
            for k in range(3)
            for side in (-1, 1)
        ]
        assert held == all(faces)


def test_the_rectangle_is_that_of_the_pixels_in_the_box():
    scan = sphere()
    (found,) = truth_of(scan, Labels3D((box_at(0),)), IMAGE)
    held = box_at(0).holds(scan.points())
    rows, columns = np.nonzero(held)
    expected = (columns.min(), rows.min(), np.ptp(columns) + 1, np.ptp(rows) + 1)
    assert found.bbox == expected
    assert found.area == held.sum()
    assert (found.category_id, found.iscrowd) == (1, 0)


def test_a_box_behind_crosses_the_seam():
    (found,) = truth_of(sphere(), Labels3D((box_at(180),)), IMAGE)
    x, _, w, _ = found.bbox
    assert 0 <= x < 360 < x + w
    assert 8 < w < 15
    (ahead,) = truth_of(sphere(), Labels3D((box_at(0),)), IMAGE)
    assert w == ahead.bbox[2]


def test_boxes_are_in_the_frame_of_the_file_not_of_the_scanner():
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_euler("z", 90, degrees=True).as_matrix()
    pose[:3, 3] = (100, 0, 0)
    scan = sphere(world_from_scan=pose)
    moved = Box3D("car", np.array([100.0, 10, 0]), np.eye(3), np.full(3, 2.0))
    (found,) = truth_of(scan, Labels3D((moved,)), IMAGE)
    (ahead,) = truth_of(sphere(), Labels3D((box_at(0),)), IMAGE)
    assert found.bbox == ahead.bbox


def test_what_counts_and_what_is_to_be_ignored():
    kinds = ["car", "bus", "pedestrian", "rider", "bollard"]
    labels = Labels3D(tuple(box_at(30 * k, kind) for k, kind in enumerate(kinds)))
    found = truth_of(sphere(), labels, IMAGE)
    assert [(entry.category_id, entry.iscrowd) for entry in found] == [(1, 0), (1, 1), (2, 0), (2, 1)]
    few = truth_of(sphere(), labels, IMAGE, min_points=10_000)
    assert all(entry.iscrowd for entry in few)


def test_an_object_labelled_twice_counts_once():
    twice = Labels3D((box_at(0), box_at(0), box_at(40)))
    assert len(truth_of(sphere(), twice, IMAGE)) == 2


def test_a_box_without_a_return_is_left_out():
    assert truth_of(sphere(range_m=3.0), Labels3D((box_at(0),)), IMAGE) == []


@pytest.mark.parametrize("wraps", [True, False])
def test_outside_the_cameras_view_nothing_is_asked(wraps):
    # Looks along x, 90 degrees wide: u = 50 - 50 y / x, v = 50 - 50 z / x.
    view = CameraView(np.array([[50.0, -50, 0, 0], [50, 0, -50, 0], [1, 0, 0, 0]]), 100, 100)
    scan = Scan.from_range_image(np.full((21, 360), 10.0), AZIMUTH, ELEVATION, wraps=wraps)
    parts = np.array([[20.0, 40, 30, 60]])
    found = truth_of(scan, Labels3D((), view, parts), IMAGE)
    cars = [entry for entry in found if entry.category_id == 1]
    assert all(entry.iscrowd for entry in found)
    assert len(found) == 2 * len(cars)
    covered = np.zeros(360, bool)
    for entry in cars[1:]:
        x, y, w, h = entry.bbox
        assert (y, h) == (0, 21)
        covered[np.arange(int(x), int(x + w)) % 360] = True
    np.testing.assert_array_equal(covered, np.abs(np.degrees(AZIMUTH)) > 45)
    assert len(cars) == (2 if wraps else 3)
    # u from 20 to 30 is azimuth +21.8 to +31 degrees.
    x, _, w, _ = cars[0].bbox
    azimuth = np.degrees(AZIMUTH[[int(x), int(x + w) - 1]])
    np.testing.assert_allclose(azimuth, [31, 21.8], atol=1.2)


KITTI_CALIB = """P2: 700 0 600 0 0 700 180 0 0 0 1 0
R0_rect: 1 0 0 0 1 0 0 0 1
Tr_velo_to_cam: 0 -1 0 0 0 0 -1 0 1 0 0 0
"""


def test_kitti_boxes_stand_on_their_foot_turned_about_the_camera(tmp_path):
    (tmp_path / "c.txt").write_text(KITTI_CALIB)
    # 20 m ahead, 3 m to the right, foot 1.7 m below the camera; turn 0: length along the camera's x.
    (tmp_path / "l.txt").write_text("Car 0 0 0 1 2 3 4 1.5 1.8 4.2 3 1.7 20 0.0\n")
    labels = read_kitti_labels(tmp_path / "l.txt", tmp_path / "c.txt")
    (box,) = labels.boxes
    np.testing.assert_allclose(box.centre, [20, -3, -1.7 + 0.75])
    np.testing.assert_allclose(box.size, [4.2, 1.8, 1.5])
    assert np.linalg.det(box.axes) == pytest.approx(1)
    np.testing.assert_allclose(np.abs(box.axes[:, 0]), [0, 1, 0], atol=1e-9)
    np.testing.assert_allclose(box.axes[:, 2], [0, 0, 1], atol=1e-9)


@pytest.mark.parametrize(
    ("line", "message"),
    [("Car 0 0 0", "l.txt:1: needs a class and 14 numbers"), ("Car " + "x " * 14, "needs a class")],
)
def test_kitti_lines_that_are_wrong_are_named(line, message, tmp_path):
    (tmp_path / "c.txt").write_text(KITTI_CALIB)
    (tmp_path / "l.txt").write_text(line)
    with pytest.raises(LabelError, match=message):
        read_kitti_labels(tmp_path / "l.txt", tmp_path / "c.txt")
    (tmp_path / "c.txt").write_text("P2: 1 2 3\n")
    with pytest.raises(LabelError, match=r"c\.txt: needs P2"):
        read_kitti_labels(tmp_path / "l.txt", tmp_path / "c.txt")


@pytest.mark.parametrize("content", ["{}", "[{}]", "[1]", "nothing", '[{"obj_type": "Car", "psr": {}}]'])
def test_sustech_labels_that_are_wrong_are_named(content, tmp_path):
    (tmp_path / "a.json").write_text(content)
    with pytest.raises(LabelError, match=r"a\.json"):
        read_sustech_labels(tmp_path / "a.json")


def test_a_scan_without_labels_says_where_they_should_be(tmp_path):
    scan = tmp_path / "velodyne" / "000001.bin"
    with pytest.raises(LabelError, match=r"000001\.bin: no such file"):
        labels_beside(scan)
    scan.parent.mkdir()
    scan.write_bytes(bytes(16))
    with pytest.raises(LabelError, match=r"no labels beside it: needs .*label_2.* \(KITTI\)"):
        labels_beside(scan)


@pytest.mark.parametrize(
    ("folder", "cars"), [("kitti/training/velodyne", 0), ("sustech/data/example/lidar", 11)]
)
def test_cars_with_200_points_of_the_data_sets(folder, cars, data, tmp_path):
    done = laserimg("truth", data(folder), "--min-points", "200", "-o", "t.json", folder=tmp_path)
    assert (done.code, done.err) == (0, "")
    truth = read_coco(tmp_path / "t.json")
    assert len(truth.images) == len(list(data(folder).iterdir()))
    assert sum(truth.labels[e.category_id] == "car" and not e.iscrowd for e in truth.annotations) == cars


def test_argoverse_boxes_hold_as_many_points_as_the_data_set_counts(data):
    """`num_interior_pts` counts both lidars' points before they are put on grids."""
    pytest.importorskip("pyarrow")
    from pyarrow import feather

    log = data("argoverse2/7fab2350-7eaf-3b7e-a39d-6937a4c1bede")
    file = log / "sensors/lidar/315966265259836000.feather"
    table = feather.read_table(log / "annotations.feather")
    own = table["timestamp_ns"].to_numpy() == int(file.stem)
    counted = table["num_interior_pts"].to_numpy()[own]
    boxes = labels_beside(file).boxes
    assert len(boxes) == own.sum()
    ours = np.zeros(len(boxes))
    for scan in open_scans(file):
        pose = scan.world_from_scan
        points = scan.points()[scan.range > 0] @ pose[:3, :3].T + pose[:3, 3]
        ours += [box.holds(points).sum() for box in boxes]
    np.testing.assert_allclose(ours, counted, atol=3, rtol=0.05)


def test_truth_of_a_scan_without_labels_ends_in_one_line(tmp_path):
    np.savez(
        tmp_path / "a.npz", range=np.ones((3, 4)), azimuth_deg=np.arange(4.0), elevation_deg=np.arange(3.0)
    )
    done = laserimg("truth", "a.npz", "-o", "t.json", folder=tmp_path)
    assert done.code == 1
    assert done.err.count("\n") == 1
    assert "no labels beside it" in done.err
    assert not (tmp_path / "t.json").exists()


def test_truth_of_a_missing_file_says_so_and_writes_nothing(tmp_path):
    done = laserimg("truth", "a.npz", "-o", "t.json", folder=tmp_path)
    assert (done.code, done.err) == (1, "laserimg: a.npz: no such file or folder\n")
    assert not (tmp_path / "t.json").exists()


def test_sustech_json_is_in_the_scanners_frame(tmp_path):
    place = {"x": 10, "y": 0, "z": 0}
    size, turn = {"x": 4, "y": 2, "z": 1}, {"x": 0, "y": 0, "z": np.pi / 2}
    entry = {"obj_type": "Car", "psr": {"position": place, "scale": size, "rotation": turn}}
    (tmp_path / "a.json").write_text(json.dumps([entry]))
    (box,) = read_sustech_labels(tmp_path / "a.json").boxes
    assert box.kind == "car"
    assert box.holds([[10, 1.9, 0.4], [11.5, 0, 0]]).tolist() == [True, False]
