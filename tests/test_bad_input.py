"""Whatever the bytes: scans, or one error of the family with one clear line."""

import bz2
import json
import sys
import tracemalloc
import zipfile
import zlib

import cv2
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from laserimg.errors import ConfigError, LaserImgError, MissingExtraError, ScanError
from laserimg.formats.scans import write_scans
from laserimg.projection import directions_from_angles
from laserimg.readers import open_scans
from laserimg.scan import Scan

ROWS, COLUMNS = 8, 12
AZIMUTH = np.radians(np.linspace(50, -50, COLUMNS))
ELEVATION = np.radians(np.linspace(30, -40, ROWS))


def grid():
    rng = np.random.default_rng(1)
    range_m = rng.uniform(2, 9, (ROWS, COLUMNS)).astype(np.float32)
    range_m[2, 3] = 0
    return Scan(range_m, directions_from_angles(AZIMUTH, ELEVATION), rng.random(range_m.shape))


def columns_of_points(scan):
    """Returns column by column, as a panning fan writes them."""
    return scan.points().transpose(1, 0, 2)[scan.range.T > 0].astype(np.float64)


def text(points, before="", between=" "):
    return (before + "\n".join(between.join(f"{v:.4f}" for v in p) for p in points) + "\n").encode()


def make_npz(folder):
    return write_scans([grid()], folder / "a.npz")[0]


def make_ptx(folder):
    return write_scans([grid(), grid()], folder / "a.ptx")[0]


def make_organised_pcd(folder):
    return write_scans([grid()], folder / "a.pcd")[0]


def make_compressed_pcd(folder):
    points = columns_of_points(grid()).astype("<f4")
    plain = points.T.tobytes()
    # LZF without any back reference: runs of up to 32 bytes as they are.
    runs = [plain[k : k + 32] for k in range(0, len(plain), 32)]
    packed = b"".join(bytes([len(run) - 1]) + run for run in runs)
    header = (
        f"VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {len(points)}\nHEIGHT 1\n"
        f"VIEWPOINT 0 0 0 1 0 0 0\nPOINTS {len(points)}\nDATA binary_compressed\n"
    )
    sizes = len(packed).to_bytes(4, "little") + len(plain).to_bytes(4, "little")
    (folder / "a.pcd").write_bytes(header.encode() + sizes + packed)
    return folder / "a.pcd"


def make_ascii_pcd(folder):
    from pypcd4.pypcd4 import Encoding, PointCloud

    cloud = PointCloud.from_xyz_points(columns_of_points(grid()).astype(np.float32))
    cloud.save(folder / "a.pcd", encoding=Encoding.ASCII)
    return folder / "a.pcd"


def make_uos(folder):
    x, y, z = columns_of_points(grid()).T
    (folder / "a.3d").write_bytes(text(np.stack([-y, z, x], axis=1) * 100, "8 x 12\n"))
    (folder / "a.pose").write_text("1 2 3\n10 20 30\n")
    return folder / "a.3d"


def make_kitti(folder):
    points = np.c_[columns_of_points(grid()), np.ones((grid().range > 0).sum())]
    (folder / "a.bin").write_bytes(points.astype("<f4").tobytes())
    return folder / "a.bin"


def make_xyz(folder):
    (folder / "a.xyz.bz2").write_bytes(bz2.compress(text(columns_of_points(grid()))))
    return folder / "a.xyz.bz2"


def make_csv(folder):
    (folder / "a.csv").write_bytes(text(columns_of_points(grid()), "x,y,z\n", ","))
    return folder / "a.csv"


def make_pts(folder):
    points = columns_of_points(grid())
    (folder / "a.pts").write_bytes(text(points, f"{len(points)}\n") * 2)
    return folder / "a.pts"


def make_png(folder):
    return write_scans([grid()], folder / "a.png")[0]


def make_tiff(folder):
    assert cv2.imwrite(str(folder / "a.tiff"), grid().range)
    about = {"kind": "depth", "fx": 12.0, "fy": 12.0, "cx": 6.0, "cy": 4.0}
    (folder / "a.json").write_text(json.dumps(about))
    return folder / "a.tiff"


def make_e57(folder):
    pye57 = pytest.importorskip("pye57")
    scan = grid()
    row, column = np.nonzero(scan.range > 0)
    x, y, z = scan.points()[row, column].astype(np.float64).T
    data = {
        "cartesianX": x,
        "cartesianY": y,
        "cartesianZ": z,
        "intensity": scan.reflectance[row, column],
        "rowIndex": ROWS - 1 - row,
        "columnIndex": column,
    }
    file = pye57.E57(str(folder / "a.e57"), mode="w")
    file.write_scan_raw(data, rotation=np.array([1.0, 0, 0, 0]), translation=np.array([1.0, 2, 3]))
    file.close()
    return folder / "a.e57"


OUSTER_ANGLES = {
    "beam_altitude_deg": np.degrees(ELEVATION),
    "beam_azimuth_deg": np.tile([4.2, -4.2], ROWS // 2),
    "pixel_shift": np.tile([24, 0], ROWS // 2),
}


def make_ouster(folder):
    np.savez(folder / "a.npz", range_mm=(grid().range * 1000).astype(np.uint32), **OUSTER_ANGLES)
    return folder / "a.npz"


PLY = "ply\nformat {} 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n"


def make_ply(folder):
    points = columns_of_points(grid())
    header = PLY.format("binary_little_endian", len(points)) + "end_header\n"
    (folder / "a.ply").write_bytes(header.encode() + points.astype("<f4").tobytes())
    return folder / "a.ply"


def make_ascii_ply(folder):
    points = columns_of_points(grid())
    (folder / "a.ply").write_bytes(text(points, PLY.format("ascii", len(points)) + "end_header\n"))
    return folder / "a.ply"


def padded_pcd(points):
    """As PCL writes its structs; SUSTech POINTS does the same with gaps of wrong widths."""
    header = (
        "VERSION 0.7\nFIELDS x y z _ intensity _\nSIZE 4 4 4 1 4 1\nTYPE F F F U F U\nCOUNT 1 1 1 4 1 12\n"
        f"WIDTH {len(points)}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {len(points)}\nDATA binary\n"
    )
    records = np.zeros((len(points), 8), "<f4")
    records[:, :3], records[:, 4] = points, 7.0
    return header.encode() + records.tobytes()


def make_padded_pcd(folder):
    (folder / "a.pcd").write_bytes(padded_pcd(columns_of_points(grid())))
    return folder / "a.pcd"


def write_sweep(path, points):
    pa = pytest.importorskip("pyarrow")
    from pyarrow import feather

    with np.errstate(over="ignore"):
        columns = {axis: points[:, k].astype(np.float16) for k, axis in enumerate("xyz")}
    other = np.zeros(len(points), np.uint8)
    feather.write_feather(pa.table(columns | {"intensity": other, "laser_number": other}), str(path))


def make_argoverse(folder):
    pa = pytest.importorskip("pyarrow")
    from pyarrow import feather

    for name in ("sensors/lidar", "calibration"):
        (folder / name).mkdir(parents=True, exist_ok=True)
    names = ("qw", "qx", "qy", "qz", "tx_m", "ty_m", "tz_m")
    upright, hanging = (1.0, 0, 0, 0, 1, 0, 1.6), (0.0, 1, 0, 0, 1, 0, 1.5)
    poses = {name: pair for name, *pair in zip(names, upright, hanging, strict=True)}
    table = pa.table({"sensor_name": ["up_lidar", "down_lidar"]} | poses)
    feather.write_feather(table, str(folder / "calibration/egovehicle_SE3_sensor.feather"))
    row, column = np.nonzero(grid().range > 0)
    write_sweep(folder / "sensors/lidar/a.feather", grid().points()[row, column] + [1, 0, 1.6])
    return folder / "sensors/lidar/a.feather"


MAKERS = [
    make_npz,
    make_ptx,
    make_organised_pcd,
    make_compressed_pcd,
    make_ascii_pcd,
    make_uos,
    make_kitti,
    make_xyz,
    make_csv,
    make_pts,
    make_png,
    make_tiff,
    make_e57,
    make_ouster,
    make_ply,
    make_ascii_ply,
    make_padded_pcd,
    make_argoverse,
]
FORMATS = pytest.mark.parametrize("make", MAKERS, ids=lambda make: make.__name__.removeprefix("make_"))


def error_of(path):
    """The one line that reading ends in."""
    with pytest.raises(ScanError) as caught:
        list(open_scans(path))
    line = str(caught.value)
    assert line.startswith(str(path)), line
    assert "\n" not in line
    return line


@FORMATS
def test_the_valid_file_is_read(make, tmp_path):
    scan = next(open_scans(make(tmp_path)))
    assert (scan.range > 0).sum() == ROWS * COLUMNS - 1


@FORMATS
def test_an_empty_file_is_refused(make, tmp_path):
    path = make(tmp_path)
    path.write_bytes(b"")
    error_of(path)


@FORMATS
def test_a_missing_file_is_named(make, tmp_path):
    path = make(tmp_path)
    path.unlink()
    assert "no such file" in error_of(path) or path.suffix in (".png", ".tiff")


@FORMATS
@pytest.mark.parametrize("share", [0.02, 0.3, 0.6, 0.97])
def test_a_cut_off_file_gives_scans_or_one_line(make, share, tmp_path):
    path = make(tmp_path)
    data = path.read_bytes()
    path.write_bytes(data[: int(share * len(data))])
    reads_or_refuses(path)


@FORMATS
@pytest.mark.parametrize("other", MAKERS, ids=lambda make: make.__name__.removeprefix("make_"))
def test_another_format_under_the_suffix_gives_scans_or_one_line(make, other, tmp_path):
    path = make(tmp_path)
    (tmp_path / "other").mkdir()
    data = other(tmp_path / "other").read_bytes()
    path.write_bytes(data)
    reads_or_refuses(path)


def reads_or_refuses(path):
    try:
        for scan in open_scans(path):
            assert np.isfinite(scan.range).all()
    except LaserImgError as error:
        assert str(path) in str(error)
        assert "\n" not in str(error)


@FORMATS
@settings(deadline=None, max_examples=30, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    edits=st.lists(
        st.tuples(
            st.sampled_from(["flip", "set", "cut", "double", "insert", "digits"]),
            st.floats(0, 1),
            st.binary(max_size=9),
        ),
        min_size=1,
        max_size=4,
    )
)
def test_a_mutated_file_gives_scans_or_one_line(make, edits, tmp_path):
    path = make(tmp_path)
    path.write_bytes(mutated(path.read_bytes(), edits))
    reads_or_refuses(path)


def mutated(data, edits):
    for kind, share, extra in edits:
        at = int(share * len(data))
        if kind == "flip" and data:
            at = min(at, len(data) - 1)
            data = data[:at] + bytes([data[at] ^ (extra[0] if extra else 1)]) + data[at + 1 :]
        elif kind == "set":
            data = data[:at] + extra + data[at + len(extra) :]
        elif kind == "cut":
            data = data[:at] + data[at + 40 :]
        elif kind == "double":
            data = data[:at] + data[max(at - 60, 0) :]
        elif kind == "insert":
            data = data[:at] + extra + data[at:]
        elif kind == "digits":
            data = data[:at] + b"9999999999" + data[at:]
    return data


def with_points(make, path, value):
    """Overwrite every point of the valid file with `value`."""
    scan = grid()
    count = int((scan.range > 0).sum())
    points = np.full((count, 3), value)
    if make is make_npz:
        np.savez(path, range=np.full(scan.shape, value), directions=scan.directions)
    elif make is make_ouster:
        np.savez(path, range_mm=np.full(scan.shape, value), **OUSTER_ANGLES)
    elif make is make_ply:
        data = path.read_bytes()
        start = data.index(b"end_header\n") + 11
        path.write_bytes(data[:start] + points.astype("<f4").tobytes())
    elif make is make_ascii_ply:
        path.write_bytes(text(points, PLY.format("ascii", count) + "end_header\n"))
    elif make is make_padded_pcd:
        path.write_bytes(padded_pcd(points))
    elif make is make_argoverse:
        write_sweep(path, np.full((count, 3), value) if value else np.tile([1.0, 0, 1.6], (count, 1)))
    elif make is make_ptx:
        header = b"\n".join(path.read_bytes().split(b"\n")[:10]) + b"\n"
        path.write_bytes(header + text(np.full((ROWS * COLUMNS, 4), value)))
    elif make is make_organised_pcd:
        data = path.read_bytes()
        start = data.index(b"DATA binary\n") + 12
        path.write_bytes(data[:start] + np.full((len(data) - start) // 4, value, "<f4").tobytes())
    elif make in (make_compressed_pcd, make_ascii_pcd):
        from pypcd4.pypcd4 import PointCloud

        PointCloud.from_xyz_points(points.astype(np.float32)).save(path)
    elif make is make_kitti:
        path.write_bytes(np.full((count, 4), value, "<f4").tobytes())
    elif make is make_xyz:
        path.write_bytes(bz2.compress(text(points)))
    elif make is make_csv:
        path.write_bytes(text(points, "x,y,z\n", ","))
    elif make is make_pts:
        path.write_bytes(text(points, f"{count}\n"))
    elif make is make_uos:
        path.write_bytes(text(points))
    elif make is make_png:
        cv2.imwrite(str(path), np.zeros(scan.shape, np.uint16))
    elif make is make_tiff:
        cv2.imwrite(str(path), np.full(scan.shape, value, np.float32))
    elif np.isnan(value):
        pytest.skip("pye57 writes no NaN")
    else:
        pye57 = pytest.importorskip("pye57")
        axis = np.full(count, float(value))
        path.unlink()
        file = pye57.E57(str(path), mode="w")
        file.write_scan_raw({"cartesianX": axis, "cartesianY": axis, "cartesianZ": axis})
        file.close()


@FORMATS
@pytest.mark.parametrize("value", [np.nan, 0.0, 1e30], ids=["nan", "zero", "absurd"])
def test_a_file_without_a_single_return_is_refused(make, value, tmp_path):
    path = make(tmp_path)
    with_points(make, path, value)
    error_of(path)


def huge_header(make, path):
    """Let the header announce about 1e9 points."""
    data = path.read_bytes()
    if make in (make_npz, make_ouster):
        with zipfile.ZipFile(path, "w") as archive:
            shape = b"{'descr': '<f4', 'fortran_order': False, 'shape': (31622, 31622), }".ljust(117) + b"\n"
            for name in ("range", "directions"):
                archive.writestr(f"{name}.npy", b"\x93NUMPY\x01\x00v\x00" + shape + b"0" * 64)
    elif make is make_ptx:
        path.write_bytes(data.replace(b"12\n8\n", b"31622\n31622\n", 1))
    elif make in (make_ply, make_ascii_ply):
        path.write_bytes(data.replace(b"vertex 95", b"vertex 1000000000"))
    elif make in (make_organised_pcd, make_compressed_pcd, make_ascii_pcd, make_padded_pcd):
        for field, value in ((b"WIDTH", 10**9), (b"HEIGHT", 1), (b"POINTS", 10**9)):
            start = data.index(field)
            data = data[:start] + b"%s %d" % (field, value) + data[data.index(b"\n", start) :]
        path.write_bytes(data)
    elif make is make_pts:
        path.write_bytes(b"1000000000" + data[data.index(b"\n") :])
    elif make is make_png:
        header = (31622).to_bytes(4, "big") * 2
        body = b"IHDR" + header + data[24:29]
        path.write_bytes(data[:12] + body + zlib.crc32(body).to_bytes(4, "big") + data[33:])
    elif make is make_tiff:
        start = int.from_bytes(data[4:8], "little") + 2
        for entry in range(start, start + 12 * int.from_bytes(data[start - 2 : start], "little"), 12):
            if data[entry] in (0, 1) and data[entry + 1] == 1:
                data = (
                    data[: entry + 2] + b"\x04\0\1\0\0\0" + (31622).to_bytes(4, "little") + data[entry + 12 :]
                )
        path.write_bytes(data)
    else:
        pytest.skip("has no header that announces a size")


@FORMATS
def test_a_header_of_1e9_points_is_refused_before_anything_is_allocated(make, tmp_path):
    path = make(tmp_path)
    huge_header(make, path)
    tracemalloc.start()
    line = error_of(path)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert "cut off" in line or "does not fit" in line or "announced" in line, line
    assert peak < 50e6


def test_a_compressed_pcd_cannot_ask_for_more_than_its_bytes_can_hold(tmp_path):
    path = make_compressed_pcd(tmp_path)
    huge_header(make_compressed_pcd, path)
    points = 3 * 10**8
    data = path.read_bytes().replace(b"1000000000", str(points).encode())
    start = data.index(b"DATA binary_compressed\n") + 23
    path.write_bytes(data[: start + 4] + (12 * points).to_bytes(4, "little") + data[start + 8 :])
    assert "the header says 300000000 points" in error_of(path)


@pytest.mark.parametrize("at", [0.4, 0.6, 0.8])
@pytest.mark.parametrize("make", [make_png, make_tiff])
def test_decoders_print_nothing(make, at, tmp_path, capfd):
    path = make(tmp_path)
    data = path.read_bytes()
    reads_or_refuses(path)
    for broken in (data[: int(at * len(data))], mutated(data, [("set", at, b"\xff" * 8)])):
        path.write_bytes(broken)
        reads_or_refuses(path)
    assert capfd.readouterr() == ("", "")


def test_an_e57_that_announces_more_points_than_bytes_is_refused(tmp_path):
    pytest.importorskip("pye57")
    from laserimg.readers.e57 import _read_columns

    class Header:
        point_fields = ("cartesianX", "cartesianY", "cartesianZ")
        point_count = 10**9

    with pytest.raises(ScanError, match="announces 1000000000 points in 6144 bytes"):
        _read_columns(None, Header, 6144)


@pytest.mark.parametrize(
    ("name", "content"),
    [
        (
            "a.ptx",
            "12\n1\n"
            + "0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n"
            + "1 2 3 .5\n" * 12,
        ),
        (
            "a.pcd",
            "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 1\nHEIGHT 12\n"
            "VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 12\nDATA ascii\n" + "1 2 3\n" * 12,
        ),
    ],
)
def test_a_grid_of_one_row_is_refused(name, content, tmp_path):
    (tmp_path / name).write_text(content)
    assert "at least 2 rows" in error_of(tmp_path / name)


def test_one_row_arrays_and_images_are_refused(tmp_path):
    np.savez(tmp_path / "a.npz", range=np.ones((1, 5)), azimuth_deg=np.arange(5.0), elevation_deg=[0.0])
    assert "at least 2 rows" in error_of(tmp_path / "a.npz")
    cv2.imwrite(str(tmp_path / "b.png"), np.ones((1, 5), np.uint16))
    (tmp_path / "b.json").write_text('{"kind": "depth", "fx": 5, "fy": 5, "cx": 2, "cy": 0}')
    assert "at least 2 rows" in error_of(tmp_path / "b.png")


def test_arrays_of_objects_are_never_unpickled(tmp_path):
    np.savez(tmp_path / "a.npz", range=np.array([["a", {}]], object))
    assert "holds object" in error_of(tmp_path / "a.npz")


def test_a_bomb_is_not_unpacked(tmp_path, monkeypatch):
    monkeypatch.setattr("laserimg.files.read_bytes.__defaults__", (1 << 20,))
    (tmp_path / "a.xyz.bz2").write_bytes(bz2.compress(b"1 2 3\n" * 500_000))
    assert "holds more than 1 MB" in error_of(tmp_path / "a.xyz.bz2")


@pytest.mark.parametrize(
    ("about", "message"),
    [
        ({"kind": "colour"}, 'kind must be "range" or "depth"'),
        ({"kind": "range"}, "needs azimuth_deg and elevation_deg, or fx fy cx cy"),
        ({"kind": "range", "azimuth_deg": [1, 2, 3], "elevation_deg": [1, 0]}, r"angles must be"),
        ({"kind": "range", "azimuth_deg": "wide", "elevation_deg": [1, 0]}, "a.json"),
        ({"kind": "depth", "fx": "long", "fy": 1, "cx": 1, "cy": 1}, "fx must be a number"),
        ({"kind": "depth", "fx": 0, "fy": 1, "cx": 1, "cy": 1}, "fx and fy must be above 0"),
        ({"kind": "depth", "scale_m": None, "fx": 1, "fy": 1, "cx": 1, "cy": 1}, "scale_m must be a number"),
        ({"kind": "depth", "fx": 1, "fy": 1, "cx": 1, "cy": 1, "world_from_scan": [[1]]}, "a.json"),
        ({"kind": "depth", "fx": 1, "fy": 1, "cx": 1, "cy": 1, "scale_m": 1e300}, "no ray has a return"),
        ({"min_range": "near"}, "min_range must be a number of metres"),
        ([1, 2], "a JSON object"),
    ],
)
def test_a_wrong_side_file_is_one_line(about, message, tmp_path):
    cv2.imwrite(str(tmp_path / "a.png"), np.ones((4, 6), np.uint16))
    (tmp_path / "a.json").write_text(json.dumps(about))
    with pytest.raises(LaserImgError, match=message):
        list(open_scans(tmp_path / "a.png"))


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("format = 2", "format must be 1"),
        ("min_range = -1", "min_range must be a number of metres"),
        ("min_rang = 1", "toml:1: unknown key 'min_rang', did you mean 'min_range'"),
        ("\n= 1", "laserimg.toml:2: "),
    ],
)
def test_a_wrong_laserimg_toml_is_one_line_that_names_it(content, message, tmp_path):
    path = make_ptx(tmp_path)
    (tmp_path / "laserimg.toml").write_text(content)
    with pytest.raises(ConfigError, match=message) as caught:
        list(open_scans(path))
    assert str(tmp_path / "laserimg.toml") in str(caught.value)


def test_a_missing_extra_gives_the_pip_line(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pye57", None)
    (tmp_path / "a.e57").write_bytes(b"ASTM-E57")
    with pytest.raises(MissingExtraError, match=r'pip install "laserimg\[io\]"'):
        list(open_scans(tmp_path / "a.e57"))
