"""Every format against the decoded truth of a real file."""

import numpy as np
import pytest

from laserimg.readers import open_scans


def only(path):
    (scan,) = open_scans(path)
    return scan


def test_office_is_recovered_exactly(data):
    scan = only(data("office_room/room_scan1.pcd"))
    truth = np.load(data("office_room/room_scan1_grid.npz"))
    expected = np.nan_to_num(truth["range_first"])
    np.testing.assert_array_equal(scan.range, expected)
    assert scan.wraps
    assert scan.min_range == 0.5
    np.testing.assert_allclose(scan.points()[90], truth["xyz"][90], atol=2e-2)


def test_ptx_stands_upright_and_loses_nothing(data):
    scan = only(data("leica_ptx/1.ptx"))
    truth = np.load(data("leica_ptx/leica_ptx_cars_91x199.npz"))
    assert scan.shape == (91, 199)
    assert not scan.wraps
    np.testing.assert_array_equal(scan.range > 0, truth["range"] > 0)
    np.testing.assert_allclose(scan.points(), truth["xyz"], atol=1e-5)
    np.testing.assert_array_equal(scan.reflectance[scan.range > 0], truth["intensity"][scan.range > 0])
    assert round(float((scan.range == 0).mean()), 3) == 0.053


@pytest.mark.parametrize("name", ["scan000", "scan001"])
def test_corridor_equals_the_raw_ranges(data, name):
    scan = only(data(f"corridor_lms200/{name}.3d"))
    truth = np.load(data(f"sick/lms200_tilt_kurt3d/{name}_range.npz"))["range_mm"][::-1, ::-1]
    expected = np.where(truth >= 32759, 0, truth / 1000)
    np.testing.assert_array_equal(scan.range > 0, expected > 0)
    np.testing.assert_allclose(scan.range, expected, atol=1e-3)
    assert not scan.wraps
    assert scan.min_range == 0.5


def test_the_pose_of_the_second_corridor_scan_lays_it_on_the_first(data):
    from scipy.spatial import cKDTree

    first, second = (only(data(f"corridor_lms200/scan00{k}.3d")) for k in (0, 1))
    tree = cKDTree(first.points()[first.valid])
    points = second.points()[second.valid][::20]
    pose = second.world_from_scan
    there = tree.query(points @ pose[:3, :3].T + pose[:3, 3])[0]
    unmoved = tree.query(points)[0]
    assert np.percentile(there, 75) < 0.06
    assert np.percentile(unmoved, 75) > 0.15


@pytest.mark.parametrize(
    "name",
    [
        "kitti/training/velodyne/000000.bin",
        "kitti/training/velodyne/000001.bin",
        "kitti/training/velodyne/000002.bin",
        "semantickitti/000000.bin",
    ],
)
def test_kitti_has_64_rings(data, name):
    path = data(name)
    scan = only(path)
    points = np.fromfile(path, np.float32).reshape(-1, 4)
    turn = np.mod(np.arctan2(points[:, 1], points[:, 0]).astype(np.float64), 2 * np.pi)
    ring = np.r_[0, np.cumsum(np.diff(turn) < -np.pi)]
    assert scan.shape[0] == 64 == ring.max() + 1
    assert scan.wraps
    # About 2150 firings a turn, as the fullest rings show; the usual step of 0.18 degrees gives 2000.
    assert 2130 < scan.shape[1] < 2190
    returns = scan.range > 0
    assert returns.sum() > 0.997 * len(points)
    # Every row holds the points of its ring.
    np.testing.assert_allclose(returns.sum(axis=1), np.bincount(ring), atol=40)
    # Neighbours in a row are neighbours in azimuth: no tearing.
    azimuth = np.arctan2(scan.directions[..., 1], scan.directions[..., 0])
    expected = np.pi - (np.arange(scan.shape[1]) + 0.5) * 2 * np.pi / scan.shape[1]
    off = np.degrees((azimuth - expected + np.pi) % (2 * np.pi) - np.pi)[returns]
    assert np.percentile(np.abs(off - np.median(off)), 90) < 0.8
    assert np.abs(np.median(off)) < 0.5


def test_staircase_keeps_every_return_and_finds_its_laser(data):
    scan = only(data("staircase/scan.dat.bz2"))
    assert scan.shape == (491, 182)
    assert (scan.range > 0).sum() == 88206
    # The file's origin lies on the floor; the laser, 0.16 m beside a tilt axis 0.34 m high, does not.
    np.testing.assert_allclose(scan.world_from_scan[:3, 3], [0.03, 0, 0.48], atol=0.01)
    world = scan.points()[scan.range > 0] + scan.world_from_scan[:3, 3]
    written = np.loadtxt(data("staircase/scan.dat.bz2"))
    np.testing.assert_allclose(np.sort(world, axis=0), np.sort(written, axis=0), atol=1e-4)


def test_e57_stands_on_its_index(data):
    pytest.importorskip("pye57")
    scan = only(data("e57/pumpARowColumnIndexNoInvalidPoints.e57"))
    assert scan.shape == (1074, 345)
    assert (scan.range > 0).sum() == 155_201
    assert not scan.wraps
    assert scan.directions[0, :, 2].mean() > 0.4 > -0.4 > scan.directions[-1, :, 2].mean()
    returned = scan.reflectance[scan.range > 0]
    assert 0.38 < returned.min() < returned.max() < 0.7


@pytest.mark.parametrize(
    "name", ["capture0001", "five_people", "office1", "person", "region_growing_rgb_tutorial"]
)
def test_kinect_is_a_pinhole_grid_turned_from_the_optical_frame(data, name):
    path = data(f"kinect/{name}.pcd")
    scan = only(path)
    from pypcd4.pypcd4 import PointCloud

    optical = np.stack([PointCloud.from_path(path).pc_data[axis] for axis in "xyz"], axis=-1)
    optical = np.nan_to_num(optical.reshape(480, 640, 3))
    np.testing.assert_allclose(
        scan.points(), np.stack([optical[..., 2], -optical[..., 0], -optical[..., 1]], axis=-1), atol=1e-5
    )
    across, up = (
        scan.directions[..., 1:2] / scan.directions[..., :1],
        scan.directions[..., 2:] / scan.directions[..., :1],
    )
    np.testing.assert_allclose(np.diff(across[..., 0], axis=1), -1 / 525, atol=1e-4)
    np.testing.assert_allclose(np.diff(up[..., 0], axis=0), -1 / 525, atol=1e-4)
    np.testing.assert_array_equal(scan.world_from_scan, np.eye(4))


@pytest.mark.parametrize(
    ("name", "shape", "kept"),
    [
        ("qt64_1673401196087570870", (64, 600), 0.95),
        ("xt32_1673400678101968885", (32, 2000), 0.96),
        ("vlp16_1673400472138016708", (15, None), 0.9),
    ],
)
def test_spinning_scanners_in_pcd_files_come_out_as_rings(data, name, shape, kept):
    path = data(f"hesai/{name}.pcd")
    scan = only(path)
    assert scan.shape[0] == shape[0]
    assert shape[1] in (None, scan.shape[1])
    assert scan.wraps
    points = int(path.read_bytes()[:1000].split(b"POINTS ")[1].split()[0])
    assert (scan.range > 0).sum() > kept * points
    elevation = np.arcsin(scan.directions[..., 2])
    assert (np.diff(elevation.mean(axis=1)) < 0).all()
    assert ((scan.range > 0).any(axis=0)).mean() > 0.97
    # One beam, one elevation.
    assert np.degrees(elevation.std(axis=1)).max() < 0.2


def test_ouster_keeps_every_point_in_the_columns_of_its_sensor(data):
    from laserimg.readers.ouster import beam_directions

    path = data("ouster/ouster_os1_128_crossing.npz")
    scan, truth = only(path), np.load(path)
    returned = truth["range_mm"] > 0
    np.testing.assert_array_equal(scan.range > 0, returned)
    np.testing.assert_allclose(scan.points()[returned], truth["xyz_m"][returned], atol=1e-4)
    np.testing.assert_array_equal(scan.reflectance[returned], truth["reflectivity"][returned])
    assert scan.wraps
    # The beam model, which aims the rays without return, agrees with the points.
    aim = beam_directions(
        truth["beam_altitude_deg"], truth["beam_azimuth_deg"], truth["pixel_shift"], scan.shape[1]
    )
    far = scan.range > 5
    off = np.degrees(np.arccos(np.clip((aim * scan.directions).sum(axis=-1)[far], -1, 1)))
    assert off.max() < 0.5


def test_an_ouster_frame_without_points_is_read_by_its_angles(data, tmp_path):
    path = data("ouster/ouster_os1_128_crossing.npz")
    truth = np.load(path)
    np.savez(tmp_path / "a.npz", **{key: truth[key] for key in truth if key not in ("xyz_m", "reflectivity")})
    scan = only(tmp_path / "a.npz")
    np.testing.assert_allclose(scan.range, truth["range_mm"] / 1000, rtol=1e-6)
    # The beams start beside the sensor's origin: 16 mm out and 36 mm up.
    off = np.linalg.norm(scan.points() - truth["xyz_m"], axis=-1)[truth["range_mm"] > 0]
    assert off.max() < 0.06
    assert scan.reflectance is None


def test_rellis_is_destaggered_and_keeps_every_return(data):
    path = data("rellis/frame000104-1581624663_170.ply")
    scan = only(path)
    record = [(k, "<f4") for k in ("x", "y", "z", "intensity")]
    record += [("t", "<u4"), ("reflectivity", "<u2"), ("ring", "u1"), ("noise", "<u2"), ("range", "<u4")]
    raw = path.read_bytes()
    written = np.frombuffer(raw, record, offset=raw.index(b"end_header\n") + 11).reshape(2048, 64).T
    assert scan.shape == (64, 2048)
    assert scan.wraps
    np.testing.assert_array_equal((scan.range > 0).sum(axis=1), (written["range"] > 0).sum(axis=1))
    np.testing.assert_allclose(
        np.sort(scan.range[scan.range > 0]), np.sort(written["range"][written["range"] > 0]) / 1000, atol=2e-3
    )
    # A column is one azimuth, whatever the stagger of its ring.
    azimuth = np.arctan2(scan.directions[..., 1], scan.directions[..., 0])
    columns = np.pi - (np.arange(2048) + 0.5) * 2 * np.pi / 2048
    off = np.degrees((azimuth - columns + np.pi) % (2 * np.pi) - np.pi)[scan.range > 0]
    assert np.abs(off - np.median(off)).max() < 0.12


@pytest.mark.parametrize(("name", "returns"), [("000950", 68242), ("000975", 67153)])
def test_sustech_records_are_read_as_they_are_not_as_the_header_says(data, name, returns):
    path = data(f"sustech/data/example/lidar/{name}.pcd")
    scan = only(path)
    assert scan.shape[0] == 40
    assert 1750 < scan.shape[1] < 1850
    assert scan.wraps
    assert (scan.range > 0).sum() > 0.999 * returns
    elevation = np.degrees(np.arcsin(scan.directions[..., 2]))
    assert (np.diff(elevation.mean(axis=1)) < 0).all()
    assert elevation.std(axis=1).max() < 0.1
    assert 0 <= scan.reflectance.min() < scan.reflectance.max() <= 255


def test_an_argoverse_sweep_is_two_upright_scans_in_their_sensors_frames(data):
    pytest.importorskip("pyarrow")
    from pyarrow import feather
    from scipy.spatial.transform import Rotation

    log = data("argoverse2/7fab2350-7eaf-3b7e-a39d-6937a4c1bede")
    path = log / "sensors/lidar/315966265259836000.feather"
    scans = list(open_scans(path))
    table = feather.read_table(path)
    laser = table["laser_number"].to_numpy()
    assert [scan.index for scan in scans] == [0, 1]
    for scan, own in zip(scans, (laser < 32, laser >= 32), strict=True):
        assert scan.shape[0] == 32
        assert scan.wraps
        assert (scan.range > 0).sum() > 0.995 * own.sum()
        pose = scan.world_from_scan
        height = (scan.directions @ scan.up).mean(axis=1)
        assert (np.diff(height) < 0).all()
        points = scan.points()[scan.range > 0].astype(np.float64) @ pose[:3, :3].T + pose[:3, 3]
        written = np.stack([table[axis].to_numpy()[own] for axis in "xyz"], axis=1).astype(np.float64)
        from scipy.spatial import cKDTree

        assert cKDTree(written).query(points)[0].max() < 1e-4
    table = feather.read_table(log / "calibration/egovehicle_SE3_sensor.feather").to_pylist()
    for scan, name, up in zip(scans, ("up_lidar", "down_lidar"), (1, -1), strict=True):
        (row,) = (row for row in table if row["sensor_name"] == name)
        turn = Rotation.from_quat([row[k] for k in ("qx", "qy", "qz", "qw")]).as_matrix()
        np.testing.assert_allclose(scan.world_from_scan[:3, :3], turn, atol=1e-6)
        np.testing.assert_allclose(scan.world_from_scan[:3, 3], [row[k] for k in ("tx_m", "ty_m", "tz_m")])
        assert up * scan.up[2] > 0.99
        # Left to right as seen with the world's up: clockwise from above.
        x, y, _ = np.moveaxis(scan.directions @ scan.world_from_scan[:3, :3].T, -1, 0)
        azimuth = np.unwrap(np.arctan2(y, x)[16])
        assert azimuth[-1] - azimuth[0] < -6


def test_a_folder_with_other_tables_gives_the_sweeps_alone(data):
    pytest.importorskip("pyarrow")
    from laserimg.readers import find_files

    files = find_files([data("argoverse2")])
    assert [file.parent.name for file in files] == ["lidar", "lidar"]
