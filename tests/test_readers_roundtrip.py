"""Write, read, equal: the same mask, orientation, pose and wrap, values within the format's resolution."""

import json

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from laserimg.errors import ScanError
from laserimg.formats.scans import write_scans
from laserimg.projection import directions_from_angles
from laserimg.readers import open_scans
from laserimg.scan import Scan

FIXTURE = settings(
    deadline=None, max_examples=25, suppress_health_check=[HealthCheck.function_scoped_fixture]
)


def rays(kind, rows, columns):
    if kind == "turn":
        azimuth = np.pi - (np.arange(columns) + 0.5) * 2 * np.pi / columns
        return directions_from_angles(azimuth, np.radians(np.linspace(30, -40, rows)))
    if kind == "panorama":
        azimuth = np.radians(np.linspace(150, -100, columns))
        return directions_from_angles(azimuth, np.radians(np.linspace(60, -60, rows)))
    if kind == "tilt":
        beam, tilt = np.radians(np.linspace(85, -85, columns)), np.radians(np.linspace(40, -60, rows))
        level = np.cos(beam)[None, :]
        x, z = level * np.cos(tilt)[:, None], level * np.sin(tilt)[:, None]
        return np.stack([x, np.broadcast_to(np.sin(beam), x.shape), z], axis=-1).astype(np.float32)
    v, u = np.mgrid[:rows, :columns]
    vectors = np.stack([np.ones(v.shape), (columns / 2 - u) / columns, (rows / 2 - v) / columns], axis=-1)
    return (vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)).astype(np.float32)


@st.composite
def scans(draw, kinds=("turn", "panorama", "tilt", "pinhole")):
    rows, columns = draw(st.integers(3, 12)), draw(st.integers(12, 40))
    rng = np.random.default_rng(draw(st.integers(0, 2**16)))
    kind = draw(st.sampled_from(kinds))
    range_m = rng.uniform(0.5, 60, (rows, columns)).astype(np.float32)
    range_m[rng.random(range_m.shape) < draw(st.sampled_from([0, 0.1, 0.4]))] = 0
    pose = np.eye(4)
    if draw(st.booleans()):
        pose[:3, :3] = Rotation.random(random_state=int(rng.integers(1 << 30))).as_matrix()
        pose[:3, 3] = rng.uniform(-50, 50, 3)
    reflectance = rng.random(range_m.shape).astype(np.float32) if draw(st.booleans()) else None
    return Scan(range_m, rays(kind, rows, columns), reflectance, pose, wraps=kind == "turn")


def back(scan, path):
    (read,) = open_scans(write_scans([scan], path)[0])
    np.testing.assert_array_equal(read.range > 0, scan.range > 0)
    np.testing.assert_allclose(read.world_from_scan, scan.world_from_scan, atol=1e-5)
    assert read.wraps == scan.wraps
    return read


@FIXTURE
@given(scan=scans())
def test_npz_keeps_everything(scan, tmp_path):
    read = back(scan.with_limits(0.7, 50), tmp_path / "a.npz")
    np.testing.assert_array_equal(read.range, scan.range)
    np.testing.assert_array_equal(read.directions, scan.directions)
    np.testing.assert_array_equal(read.world_from_scan, scan.world_from_scan)
    assert (read.min_range, read.max_range) == (0.7, 50)
    assert (read.reflectance is None) == (scan.reflectance is None)
    if scan.reflectance is not None:
        np.testing.assert_array_equal(read.reflectance, scan.reflectance)


@FIXTURE
@given(scan=scans(), suffix=st.sampled_from([".ptx", ".pcd"]))
def test_ptx_and_pcd_keep_points_mask_pose_and_wrap(scan, suffix, tmp_path):
    read = back(scan, tmp_path / f"a{suffix}")
    np.testing.assert_allclose(read.points(), scan.points(), atol=2e-4)
    # Rays without return come back from the grid of the others.
    np.testing.assert_allclose(read.directions, scan.directions, atol=2e-3)
    assert (read.reflectance is None) == (scan.reflectance is None)
    if scan.reflectance is not None:
        returned = scan.range > 0
        np.testing.assert_allclose(read.reflectance[returned], scan.reflectance[returned], atol=1e-6)


@FIXTURE
@given(scan=scans(kinds=("turn", "panorama")))
def test_png_keeps_millimetres(scan, tmp_path):
    read = back(scan.with_limits(0.7, 50), tmp_path / "a.png")
    np.testing.assert_allclose(read.range, scan.range, atol=0.00051)
    np.testing.assert_allclose(read.directions, scan.directions, atol=1e-5)
    assert (read.min_range, read.max_range) == (0.7, 50)


def test_a_far_range_gets_coarser_steps_not_clipped(tmp_path):
    scan = Scan(np.full((3, 12), 131.0, np.float32), rays("turn", 3, 12), wraps=True)
    np.testing.assert_allclose(back(scan, tmp_path / "a.png").range, 131, atol=0.001)
    assert 0.001 < json.loads((tmp_path / "a.json").read_text())["scale_m"] < 0.003


def test_a_png_of_rays_off_the_grid_is_refused_and_nothing_is_left(tmp_path):
    scan = Scan(np.ones((5, 12), np.float32), rays("tilt", 5, 12))
    with pytest.raises(ScanError, match=r"a\.png: rays lie up to .* degrees beside a grid"):
        write_scans([scan], tmp_path / "a.png")
    assert list(tmp_path.iterdir()) == []


def test_ptx_begins_at_the_lower_left_and_goes_up(tmp_path):
    scan = Scan(np.full((3, 12), 2, np.float32), rays("panorama", 3, 12))
    write_scans([scan], tmp_path / "a.ptx")
    written = np.loadtxt(tmp_path / "a.ptx", skiprows=10)
    np.testing.assert_allclose(written[0, :3], scan.points()[2, 0], atol=1e-5)
    np.testing.assert_allclose(written[2, :3], scan.points()[0, 0], atol=1e-5)
    np.testing.assert_allclose(written[3, :3], scan.points()[2, 1], atol=1e-5)


def test_ptx_holds_several_scans_and_other_formats_number_their_files(tmp_path):
    first = Scan(np.ones((3, 12), np.float32), rays("turn", 3, 12), wraps=True)
    second = Scan(np.full((4, 13), 2, np.float32), rays("panorama", 4, 13))
    write_scans([first, second], tmp_path / "a.ptx")
    read = list(open_scans(tmp_path / "a.ptx"))
    assert [scan.shape for scan in read] == [(3, 12), (4, 13)]
    assert [scan.index for scan in read] == [0, 1]
    files = write_scans([first, second], tmp_path / "b.npz")
    assert [file.name for file in files] == ["b_1.npz", "b_2.npz"]
    assert [scan.shape for scan in open_scans(tmp_path / "b_*.npz")] == [(3, 12), (4, 13)]


def test_an_unknown_suffix_is_refused(tmp_path):
    scan = Scan(np.ones((3, 12), np.float32), rays("turn", 3, 12), wraps=True)
    with pytest.raises(ScanError, match=r"cannot write \.las; known: \.npz \.ptx \.pcd \.png"):
        write_scans([scan], tmp_path / "a.las")
