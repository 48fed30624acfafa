"""Records as they lie in memory: PLY of any byte order, PCD with gaps, feather tables."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from laserimg.errors import ScanError
from laserimg.readers import open_scans
from laserimg.readers.pcd_padding import without_padding
from laserimg.readers.ply import read_vertices

PLY_NAMES = {"f4": "float", "f8": "double", "u1": "uchar", "u2": "ushort", "i4": "int"}


@given(
    order=st.sampled_from(["<", ">"]),
    extra=st.lists(st.sampled_from(sorted(PLY_NAMES)), max_size=4),
    count=st.integers(0, 9),
    seed=st.integers(0, 99),
)
def test_every_packed_vertex_record_is_read_back(order, extra, count, seed):
    record = [(axis, f"{order}f4") for axis in "xyz"] + [
        (f"p{k}", order + kind) for k, kind in enumerate(extra)
    ]
    size = np.dtype(record).itemsize
    body = np.random.default_rng(seed).integers(0, 200, count * size, dtype=np.uint8).tobytes()
    name = {"<": "binary_little_endian", ">": "binary_big_endian"}[order]
    lines = [f"property {PLY_NAMES[np.dtype(kind).str[1:]]} {field}" for field, kind in record]
    header = "\n".join(["ply", f"format {name} 1.0", f"element vertex {count}", *lines, "end_header\n"])
    found = read_vertices(header.encode() + body + b"faces, which nobody asked for")
    assert found.tobytes() == body
    assert found.dtype == np.dtype(record)


def test_a_ply_whose_points_are_not_first_says_so():
    header = b"ply\nformat ascii 1.0\nelement face 1\nproperty list uchar int i\nend_header\n"
    with pytest.raises(ScanError, match="first element must be the vertices"):
        read_vertices(header)


def padded(header_fields, counts, records):
    size = {"x": 4, "y": 4, "z": 4, "intensity": 4, "timestamp": 8, "ring": 2, "_": 1}
    kind = {"ring": "U", "_": "U"}
    return (
        f"# .PCD v0.7\nVERSION 0.7\nFIELDS {' '.join(header_fields)}\n"
        f"SIZE {' '.join(str(size[name]) for name in header_fields)}\n"
        f"TYPE {' '.join(kind.get(name, 'F') for name in header_fields)}\n"
        f"COUNT {' '.join(map(str, counts))}\nWIDTH {len(records)}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\n"
        f"POINTS {len(records)}\nDATA binary\n"
    ).encode() + records.tobytes()


TRUE_RECORD = np.dtype(
    {
        "names": ["x", "y", "z", "intensity", "timestamp", "ring"],
        "formats": ["<f4", "<f4", "<f4", "<f4", "<f8", "<u2"],
        "offsets": [0, 4, 8, 16, 24, 32],
        "itemsize": 48,
    }
)
FIELDS = ["x", "y", "z", "_", "intensity", "_", "timestamp", "_", "ring", "_"]


@pytest.mark.parametrize(
    "counts",
    [[1, 1, 1, 4, 1, 0, 1, 6, 1, 12], [1, 1, 1, 4, 1, 4, 1, 0, 1, 14]],
    ids=["as SUSTech has them", "right"],
)
def test_gaps_of_a_pcd_are_left_out_also_where_their_widths_are_wrong(counts):
    rng = np.random.default_rng(0)
    records = np.zeros(20, TRUE_RECORD)
    for name in TRUE_RECORD.names:
        records[name] = rng.integers(0, 40, 20)
    plain = without_padding(padded(FIELDS, counts, records) + b"\0" * 100)
    body = np.frombuffer(
        plain[plain.index(b"DATA binary\n") + 12 :],
        [(name, TRUE_RECORD.fields[name][0]) for name in TRUE_RECORD.names],
    )
    assert len(body) == 20
    for name in TRUE_RECORD.names:
        np.testing.assert_array_equal(body[name], records[name])


def test_a_pcd_with_fewer_records_than_it_says_is_cut_off():
    data = padded(FIELDS, [1, 1, 1, 4, 1, 0, 1, 6, 1, 12], np.zeros(20, TRUE_RECORD))
    with pytest.raises(ScanError, match="cut off: the header says 20 points of 48 bytes"):
        without_padding(data[:-1])


def test_a_sweep_without_its_calibration_names_the_file(tmp_path):
    pa = pytest.importorskip("pyarrow")
    from pyarrow import feather

    folder = tmp_path / "log" / "sensors" / "lidar"
    folder.mkdir(parents=True)
    column = np.ones(50, np.float16)
    other = np.zeros(50, np.uint8)
    table = pa.table({"x": column, "y": column, "z": column, "intensity": other, "laser_number": other})
    feather.write_feather(table, str(folder / "1.feather"))
    with pytest.raises(ScanError, match=r"needs .*log/calibration/egovehicle_SE3_sensor\.feather"):
        list(open_scans(folder / "1.feather"))


def test_without_pyarrow_the_extra_is_named(tmp_path, monkeypatch):
    from laserimg.errors import MissingExtraError

    monkeypatch.setitem(__import__("sys").modules, "pyarrow", None)
    (tmp_path / "1.feather").write_bytes(b"ARROW1 laser_number")
    with pytest.raises(MissingExtraError, match=r'pip install "laserimg\[argoverse\]"'):
        list(open_scans(tmp_path))
