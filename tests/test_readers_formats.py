"""What each format says, on files small enough to read here."""

import bz2
import gzip
import json
import lzma

import cv2
import numpy as np
import pytest

from laserimg.errors import ScanError
from laserimg.formats.scans import write_scans
from laserimg.projection import directions_from_angles
from laserimg.readers import find_files, open_scans
from laserimg.scan import Scan

ROWS, COLUMNS = 9, 14


def grid(seed=0, missing=0.1):
    rng = np.random.default_rng(seed)
    range_m = rng.uniform(2, 9, (ROWS, COLUMNS)).astype(np.float32)
    range_m[rng.random(range_m.shape) < missing] = 0
    rays = directions_from_angles(
        np.radians(np.linspace(50, -50, COLUMNS)), np.radians(np.linspace(30, -40, ROWS))
    )
    return Scan(range_m, rays, rng.random(range_m.shape))


def panned(scan):
    """Points and reflectance of the returns, column after column."""
    order = scan.range.T > 0
    return scan.points().transpose(1, 0, 2)[order].astype(float), scan.reflectance.T[order]


def lines_of(rows, between=" "):
    return "".join(between.join(f"{value:.5f}" for value in row) + "\n" for row in rows)


def only(path):
    (scan,) = open_scans(path)
    return scan


def assert_same(read, scan, reflectance=True):
    assert read.shape == scan.shape
    np.testing.assert_allclose(read.range, scan.range, atol=1e-4)
    np.testing.assert_allclose(read.directions[scan.range > 0], scan.directions[scan.range > 0], atol=1e-4)
    if reflectance:
        np.testing.assert_allclose(
            read.reflectance[scan.range > 0], scan.reflectance[scan.range > 0], atol=1e-4
        )
    else:
        assert read.reflectance is None


# --- text ---


@pytest.mark.parametrize(
    ("name", "before", "between"),
    [
        ("a.xyz", "", " "),
        ("a.txt", "# from a scanner\n\n", "\t"),
        ("a.asc", "//X Y Z Intensity\n", " "),
        ("a.csv", "x,y,z,intensity\n", ","),
        ("a.csv", "x;y;z;intensity\n", ";"),
        ("a.pts", "{count}\n", " "),
        ("a.dat", "", " "),
    ],
)
def test_text_with_and_without_header(name, before, between, tmp_path):
    scan = grid()
    points, values = panned(scan)
    body = before.format(count=len(points)) + lines_of(np.c_[points, values], between)
    (tmp_path / name).write_text(body)
    assert_same(only(tmp_path / name), scan)


def test_named_columns_may_stand_in_any_order(tmp_path):
    scan = grid()
    points, values = panned(scan)
    table = np.c_[values, points[:, ::-1], points[:, 0]]
    (tmp_path / "a.csv").write_text("Reflectance,Z,Y,X,time\n" + lines_of(table, ","))
    assert_same(only(tmp_path / "a.csv"), scan)


def test_six_columns_are_a_colour_not_a_reflectance(tmp_path):
    points, _ = panned(grid())
    (tmp_path / "a.xyz").write_text(lines_of(np.c_[points, np.full((len(points), 3), 200)]))
    assert only(tmp_path / "a.xyz").reflectance is None


def test_pts_holds_several_scans(tmp_path):
    first, second = panned(grid(1))[0], panned(grid(2))[0]
    (tmp_path / "a.pts").write_text(f"{len(first)}\n{lines_of(first)}{len(second)}\n{lines_of(second)}")
    read = list(open_scans(tmp_path / "a.pts"))
    assert [scan.index for scan in read] == [0, 1]
    assert_same(read[0], grid(1), reflectance=False)
    assert_same(read[1], grid(2), reflectance=False)


@pytest.mark.parametrize(
    ("suffix", "pack"), [(".bz2", bz2.compress), (".gz", gzip.compress), (".xz", lzma.compress)]
)
def test_compressed_files_are_opened_as_they_are(suffix, pack, tmp_path):
    path = tmp_path / f"a.xyz{suffix}"
    path.write_bytes(pack(lines_of(panned(grid())[0]).encode()))
    assert_same(only(path), grid(), reflectance=False)


def test_points_without_order_are_projected(tmp_path):
    points = np.random.default_rng(0).permutation(panned(grid(missing=0))[0])
    (tmp_path / "a.xyz").write_text(lines_of(points))
    scan = only(tmp_path / "a.xyz")
    assert scan.filled is not None
    assert (scan.range > 0).sum() > 0.7 * len(points)


# --- PTX ---


def test_ptx_transform_is_for_row_vectors(tmp_path):
    scan = grid()
    body = lines_of(scan.points()[::-1].transpose(1, 0, 2).reshape(-1, 3))
    pose = "0 1 0 0\n-1 0 0 0\n0 0 1 0\n10 20 30 1\n"
    (tmp_path / "a.ptx").write_text(f"{COLUMNS}\n{ROWS}\n10 20 30\n0 1 0\n-1 0 0\n0 0 1\n{pose}{body}")
    read = only(tmp_path / "a.ptx")
    assert_same(read, scan, reflectance=False)
    # x of the scanner is y of the world.
    np.testing.assert_allclose(read.world_from_scan @ [1, 0, 0, 1], [10, 21, 30, 1], atol=1e-9)


# --- uos ---


def uos_lines(scan, reflectance=False):
    points, values = panned(scan)
    uos = np.stack([-points[:, 1], points[:, 2], points[:, 0]], axis=1) * 100
    return lines_of(np.c_[uos, values] if reflectance else uos)


@pytest.mark.parametrize("header", ["", "9 x 14\n", "# 9 x 14\n"])
@pytest.mark.parametrize("reflectance", [False, True])
def test_uos_header_and_reflectance(header, reflectance, tmp_path):
    (tmp_path / "scan000.3d").write_text(header + uos_lines(grid(), reflectance))
    read = only(tmp_path / "scan000.3d")
    assert_same(read, grid(), reflectance)
    np.testing.assert_array_equal(read.world_from_scan, np.eye(4))


def test_uos_codes_are_rays_without_return(tmp_path):
    scan = grid(missing=0)
    codes = np.random.default_rng(0).random(scan.shape) < 0.2
    coded = Scan(np.where(codes, 32.763, scan.range), scan.directions, scan.reflectance)
    (tmp_path / "a.3d").write_text(uos_lines(coded))
    read = only(tmp_path / "a.3d")
    np.testing.assert_array_equal(read.range > 0, ~codes)
    np.testing.assert_allclose(read.directions, scan.directions, atol=1e-4)


def test_uos_ranges_beyond_the_codes_are_returns(tmp_path):
    scan = grid(missing=0)
    far = Scan(scan.range + 40, scan.directions, scan.reflectance)
    (tmp_path / "a.3d").write_text(uos_lines(far))
    assert (only(tmp_path / "a.3d").range > 40).all()


def test_uos_pose_is_left_handed_in_centimetres(tmp_path):
    (tmp_path / "a.3d").write_text(uos_lines(grid()))
    # 2 m to the right, 1 m up, 3 m ahead, turned by 90 degrees about the axis that points up.
    (tmp_path / "a.pose").write_text("200 100 300\n0 90 0\n")
    pose = only(tmp_path / "a.3d").world_from_scan
    np.testing.assert_allclose(pose[:3, 3], [3, -2, 1])
    # Left-handed: from z (ahead) to x (right).
    np.testing.assert_allclose(pose[:3, :3] @ [1, 0, 0], [0, -1, 0], atol=1e-9)
    np.testing.assert_allclose(pose[:3, :3] @ [0, 0, 1], [0, 0, 1], atol=1e-9)


# --- PCD ---


def pcd(path, records, fields, width, height, viewpoint="0 0 0 1 0 0 0"):
    kinds = {name: ("U 2" if name == "ring" else "F 4").split() for name in fields}
    header = "\n".join(
        [
            "VERSION 0.7",
            f"FIELDS {' '.join(fields)}",
            f"SIZE {' '.join(kinds[name][1] for name in fields)}",
            f"TYPE {' '.join(kinds[name][0] for name in fields)}",
            f"COUNT {' '.join('1' for _ in fields)}",
            f"WIDTH {width}",
            f"HEIGHT {height}",
            f"VIEWPOINT {viewpoint}",
            f"POINTS {width * height}",
            "DATA binary\n",
        ]
    )
    dtype = [(name, "<u2" if name == "ring" else "<f4") for name in fields]
    table = np.zeros(width * height, dtype)
    for name, values in zip(fields, np.asarray(records).reshape(-1, len(fields)).T, strict=True):
        table[name] = values
    path.write_bytes(header.encode() + table.tobytes())
    return only(path)


def test_pcd_that_writes_firing_after_firing_is_turned(tmp_path):
    scan = grid()
    firings = scan.points().transpose(1, 0, 2)
    assert_same(pcd(tmp_path / "a.pcd", firings, ["x", "y", "z"], ROWS, COLUMNS), scan, reflectance=False)


def test_pcd_viewpoint_is_the_pose(tmp_path):
    scan = grid()
    turn = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    world = np.where(scan.range[..., None] > 0, scan.points() @ turn.T + [5, 6, 7], np.nan)
    half = np.sqrt(0.5)
    read = pcd(tmp_path / "a.pcd", world, ["x", "y", "z"], COLUMNS, ROWS, f"5 6 7 {half} 0 0 {half}")
    assert_same(read, scan, reflectance=False)
    np.testing.assert_allclose(read.world_from_scan[:3, :3], turn, atol=1e-9)
    np.testing.assert_allclose(read.world_from_scan[:3, 3], [5, 6, 7])


def test_pcd_pinhole_grid_comes_from_the_optical_frame(tmp_path):
    v, u = np.mgrid[:10, :16]
    depth = np.random.default_rng(0).uniform(1, 4, v.shape)
    optical = np.stack([(u - 7.5) / 12 * depth, (v - 4.5) / 12 * depth, depth], axis=-1)
    optical[3, 4] = np.nan
    # The turn that camera drivers add to see the picture upright.
    read = pcd(tmp_path / "a.pcd", optical, ["x", "y", "z"], 16, 10, "0 0 0 0 1 0 0")
    expected = np.nan_to_num(np.stack([optical[..., 2], -optical[..., 0], -optical[..., 1]], axis=-1))
    np.testing.assert_allclose(read.points(), expected, atol=1e-5)
    np.testing.assert_array_equal(read.up, [0, 0, 1])


def test_pcd_ring_field_makes_the_rows(tmp_path):
    rng = np.random.default_rng(0)
    elevation, azimuth = np.radians([10.0, 4, -1, -9]), np.radians(179.5 - np.arange(360.0))
    rays = directions_from_angles(azimuth, elevation) * rng.uniform(2, 9, (4, 360, 1))
    ring = np.broadcast_to([[2], [0], [1], [3]], (4, 360))
    # Firing after firing, each in the order of the ring numbers.
    records = np.concatenate([rays, ring[..., None]], axis=-1)[[1, 2, 0, 3]].transpose(1, 0, 2)
    scan = pcd(tmp_path / "a.pcd", records, ["x", "y", "z", "ring"], 4 * 360, 1)
    assert scan.shape == (4, 360)
    assert scan.wraps
    np.testing.assert_allclose(scan.points(), rays, atol=1e-5)


# --- KITTI ---


def test_other_binary_data_is_no_kitti_file(tmp_path):
    (tmp_path / "a.bin").write_bytes(np.random.default_rng(0).bytes(16_000))
    with pytest.raises(ScanError, match="few points within 500 m"):
        only(tmp_path / "a.bin")


# --- E57 ---


def test_e57_gives_every_scan_with_its_pose(tmp_path):
    pye57 = pytest.importorskip("pye57")
    file = pye57.E57(str(tmp_path / "a.e57"), mode="w")
    for seed in (1, 2):
        row, column = np.nonzero(grid(seed).range > 0)
        x, y, z = grid(seed).points()[row, column].astype(float).T
        data = {
            "cartesianX": x,
            "cartesianY": y,
            "cartesianZ": z,
            "intensity": grid(seed).reflectance[row, column],
            # Rows grow upwards.
            "rowIndex": ROWS - 1 - row,
            "columnIndex": column,
        }
        half = np.sqrt(0.5)
        file.write_scan_raw(data, rotation=np.array([half, 0, 0, half]), translation=np.array([1.0, 2, seed]))
    file.close()
    read = list(open_scans(tmp_path / "a.e57"))
    for seed, scan in zip((1, 2), read, strict=True):
        assert_same(scan, grid(seed))
        np.testing.assert_allclose(scan.world_from_scan[:3, 3], [1, 2, seed])
        np.testing.assert_allclose(scan.world_from_scan[:3, 0], [0, 1, 0], atol=1e-9)


def test_e57_without_index_is_recovered_from_its_order(tmp_path):
    pye57 = pytest.importorskip("pye57")
    points, values = panned(grid())
    file = pye57.E57(str(tmp_path / "a.e57"), mode="w")
    x, y, z = points.T
    file.write_scan_raw({"cartesianX": x, "cartesianY": y, "cartesianZ": z, "intensity": values})
    file.close()
    assert_same(only(tmp_path / "a.e57"), grid())


def test_e57_spherical_points_and_invalid_states():
    pytest.importorskip("pye57")
    from laserimg.readers.e57 import _points

    points, returned = _points(
        {
            "sphericalRange": np.array([2.0, 1.0, 5.0]),
            "sphericalAzimuth": np.array([np.pi / 2, 0, 0]),
            "sphericalElevation": np.array([0, np.pi / 2, 0]),
            "sphericalInvalidState": np.array([0, 1, 2], np.int8),
        }
    )
    np.testing.assert_allclose(points, [[0, 2, 0], [0, 0, 1], [0, 0, 0]], atol=1e-12)
    assert returned.tolist() == [True, False, False]


# --- images ---


def test_depth_counts_along_the_axis_of_view(tmp_path):
    depth = np.full((6, 8), 5000, np.uint16)
    depth[2, 3] = 0
    cv2.imwrite(str(tmp_path / "a.png"), depth)
    about = {"kind": "depth", "scale_m": 0.0002, "fx": 10, "fy": 10, "cx": 3.5, "cy": 2.5}
    (tmp_path / "a.json").write_text(json.dumps(about))
    scan = only(tmp_path / "a.png")
    points = scan.points()
    np.testing.assert_allclose(points[..., 0], np.where(depth > 0, 1.0, 0), atol=1e-6)
    np.testing.assert_allclose(points[0, 0], [1, 0.35, 0.25], atol=1e-6)


def test_float_tiff_with_angles_offset_limits_and_pose(tmp_path):
    values = np.random.default_rng(0).uniform(1, 9, (5, 7)).astype(np.float32)
    values[1, 1] = np.nan
    cv2.imwrite(str(tmp_path / "a.tiff"), values)
    pose = np.eye(4)
    pose[:3, 3] = [1, 2, 3]
    about = {
        "kind": "range",
        "offset_m": 0.5,
        "azimuth_deg": [30, -30],
        "elevation_deg": [10, 8, 5, 0, -9],
        "min_range": 0.7,
        "max_range": 8,
        "world_from_scan": pose.tolist(),
    }
    (tmp_path / "a.json").write_text(json.dumps(about))
    scan = only(tmp_path / "a.tiff")
    np.testing.assert_allclose(scan.range, np.nan_to_num(values + 0.5), rtol=1e-6)
    assert (scan.min_range, scan.max_range) == (0.7, 8)
    np.testing.assert_array_equal(scan.world_from_scan, pose)
    np.testing.assert_allclose(np.degrees(np.arcsin(scan.directions[:, 3, 2])), [10, 8, 5, 0, -9], atol=1e-4)


# --- NPZ ---


def test_npz_with_angles_in_degrees(tmp_path):
    range_m = np.array([[1, 2, np.nan], [np.inf, -1, 4]])
    np.savez(tmp_path / "a.npz", range=range_m, azimuth_deg=[10.0, 0, -10], elevation_deg=[5.0, -5])
    scan = only(tmp_path / "a.npz")
    np.testing.assert_array_equal(scan.range, [[1, 2, 0], [0, 0, 4]])
    np.testing.assert_allclose(scan.directions[0, 0, 2], np.sin(np.radians(5)), rtol=1e-6)


# --- folders, globs, limits, other packages ---


def test_a_folder_gives_its_scans_and_nothing_else(tmp_path):
    (tmp_path / "sub").mkdir()
    write_scans([grid()], tmp_path / "b.ptx")
    write_scans([grid()], tmp_path / "sub" / "a.npz")
    write_scans([grid()], tmp_path / "c.png")
    np.savez(tmp_path / "other.npz", weights=np.ones(3))
    (tmp_path / "LICENSE.txt").write_text("Permission is hereby granted, 1 2 3")
    (tmp_path / "labels.json").write_text('{"annotations": []}')
    (tmp_path / "table.csv").write_text("label,score\ncar,1\n")
    cv2.imwrite(str(tmp_path / "photo.png"), np.zeros((4, 4, 3), np.uint8))
    names = [str(path.relative_to(tmp_path)) for path in find_files([tmp_path])]
    assert names == ["b.ptx", "c.png", "sub/a.npz"]
    assert [scan.source for scan in open_scans(tmp_path)] == [str(path) for path in find_files([tmp_path])]


def test_globs_and_files_are_found_once_in_order(tmp_path):
    for name in ("b", "a"):
        write_scans([grid()], tmp_path / f"{name}.npz")
    found = find_files([tmp_path / "b.npz", tmp_path / "*.npz"])
    assert [path.name for path in found] == ["b.npz", "a.npz"]


def test_a_glob_or_folder_without_scans_is_an_error(tmp_path):
    with pytest.raises(ScanError, match="no scan files"):
        list(open_scans(tmp_path / "*.ptx"))
    with pytest.raises(ScanError, match="no scan files"):
        list(open_scans(tmp_path))


def test_limits_of_the_folder_and_of_the_side_file(tmp_path):
    write_scans([grid()], tmp_path / "a.ptx")
    (tmp_path / "laserimg.toml").write_text("format = 1\nmin_range = 3.0\n")
    scan = only(tmp_path / "a.ptx")
    assert (scan.min_range, scan.max_range) == (3.0, np.inf)
    assert (scan.range[~scan.valid] > 0).any()
    (tmp_path / "a.json").write_text('{"min_range": 0.4, "max_range": 8}')
    scan = only(tmp_path / "a.ptx")
    assert (scan.min_range, scan.max_range) == (0.4, 8)


def test_a_coco_file_beside_a_scan_is_not_its_side_file(tmp_path):
    write_scans([grid()], tmp_path / "a.ptx")
    (tmp_path / "a.json").write_text('{"images": [], "annotations": [], "min_range": "none of ours"}')
    assert only(tmp_path / "a.ptx").min_range == 0


def test_another_package_adds_a_reader(tmp_path, monkeypatch):
    from importlib.metadata import EntryPoint

    from laserimg import readers

    entry = EntryPoint("mine", "laserimg.readers.ascii:read_ascii", readers.ENTRY_POINTS)
    monkeypatch.setattr(
        readers, "entry_points", lambda group: [entry] if group == readers.ENTRY_POINTS else []
    )
    readers._plugins.cache_clear()
    try:
        (tmp_path / "a.mine").write_text(lines_of(panned(grid())[0]))
        assert_same(only(tmp_path / "a.mine"), grid(), reflectance=False)
        assert ".mine" in readers.suffixes()
    finally:
        readers._plugins.cache_clear()


def test_an_unknown_suffix_names_the_known_ones(tmp_path):
    (tmp_path / "a.las").write_bytes(b"LASF")
    with pytest.raises(ScanError, match=r"no reader for \.las; known: .*\.ptx"):
        only(tmp_path / "a.las")
