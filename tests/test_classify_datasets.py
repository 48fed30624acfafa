"""Objects of public data sets, from small files of the same form and from the real ones."""

import json

import numpy as np
import pytest

from command import laserimg
from laserimg.classify import Recipe
from laserimg.classify.datasets import DATA_SETS, dataset_objects
from laserimg.classify.datasets.point_labels import RELLIS, SEMANTIC_KITTI
from laserimg.classify.datasets.sydney import read_sydney
from laserimg.classify.sources import described, labelled_sources, read_cloud
from laserimg.classify.validation import given_folds, leave_one_out
from laserimg.errors import LabelError, ScanError
from laserimg.projection import directions_from_angles
from laserimg.readers.point_labels import label_file, read_labelled

# --- Sydney Urban Objects ---


HEADER = "t,intensity,id,x,y,z,azimuth,range,pid\n"


def sydney_csv(path, points, seed=0):
    rng = np.random.default_rng(seed)
    lines = [
        f"20110901T071453.{k:06d},{rng.integers(255)},{k % 64},{x:.4f},{y:.4f},{z:.4f},1.5,9.1,{k}"
        for k, (x, y, z) in enumerate(points)
    ]
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\n".join(lines) + "\n")


@pytest.fixture
def sydney(tmp_path):
    """Flat boxes and upright poles in four folds, and a class that is in none."""
    folder = tmp_path / "sydney-urban-objects-dataset"
    names = [[] for _ in range(4)]
    for k in range(8):
        rng = np.random.default_rng(k)
        for kind, size in (("car", (4.0, 1.8, 1.4)), ("pole", (0.2, 0.2, 4.0)), ("4wd", (4.5, 2.0, 1.9))):
            name = f"{kind}.{k}.{100 + k}.csv"
            sydney_csv(folder / "objects" / name, rng.uniform(0, 1, (300, 3)) * size + [9, 0, -1], k)
            if kind != "4wd":
                names[k % 4].append(name)
    (folder / "folds").mkdir()
    for k, of_fold in enumerate(names):
        (folder / "folds" / f"fold{k}.txt").write_text("\n".join(of_fold) + "\n")
    return folder


def test_sydney_columns_are_read_as_they_are_named_and_turned_upright(tmp_path):
    (tmp_path / "car.0.1.csv").write_text(
        "t,intensity,id,x,y,z,azimuth,range,pid\n" + "T1,7,3,1,2,3,4,5,6\n" * 10
    )
    cloud = read_sydney(tmp_path / "car.0.1.csv")
    np.testing.assert_array_equal(cloud.points, np.tile([1.0, -2, -3], (10, 1)))
    np.testing.assert_array_equal(cloud.reflectance, np.full(10, 7.0))


@pytest.mark.parametrize("line", ["T1,7,3,1,2", "T1,7,3,1,2,3,4,5,6,7", "T1,7,3,x,2,3,4,5,6"])
def test_a_sydney_line_that_is_no_point_is_named(line, tmp_path):
    (tmp_path / "car.0.1.csv").write_text("T1,7,3,1,2,3,4,5,6\n" * 10 + line + "\n")
    with pytest.raises(ScanError, match="line 11"):
        read_sydney(tmp_path / "car.0.1.csv")


def test_sydney_objects_have_class_and_fold(sydney):
    found = labelled_sources(sydney)
    assert len(found) == 24
    by_name = {source.name.rsplit("/")[-1]: source for source in found}
    assert by_name["pole.6.106.csv"].label == "pole"
    assert by_name["pole.6.106.csv"].fold == 2
    assert by_name["4wd.6.106.csv"].fold == -1
    assert len(labelled_sources(sydney / "objects")) == 24


def test_sydney_objects_are_predicted_and_trained_in_folders_of_their_class(sydney, tmp_path):
    for file in (sydney / "objects").glob("*.csv"):
        label = file.name.split(".")[0]
        (tmp_path / "own" / label).mkdir(parents=True, exist_ok=True)
        (tmp_path / "own" / label / file.name).write_bytes(file.read_bytes())
    model = tmp_path / "m.npz"
    done = laserimg(
        "classify", "train", tmp_path / "own", "--classes", "car, pole", "--views", 1, "-o", model
    )
    assert (done.code, done.err) == (0, "")
    done = laserimg("classify", "predict", model, sydney / "objects" / "pole.3.103.csv")
    assert (done.code, done.err) == (0, "") and done.out.startswith("pole")


def test_sydney_by_its_own_folds(sydney):
    done = laserimg(
        "classify", "evaluate", "--own-folds", sydney, "--features", "honv", "--views", "1", "--json"
    )
    assert (done.code, done.err) == (0, "")
    table = json.loads(done.out)
    assert table["method"] == "folds of the data set"
    assert {name: one["correct"] for name, one in table["classes"].items()} == {"car": 8, "pole": 8}


def test_an_object_in_two_folds_is_an_error(sydney):
    (sydney / "folds" / "fold1.txt").write_text("car.0.100.csv\n")
    with pytest.raises(LabelError, match=r"fold1\.txt: car\.0\.100 is in another fold too"):
        labelled_sources(sydney)


def test_folds_of_one_object_are_leave_one_out():
    rng = np.random.default_rng(0)
    labels = np.repeat(["a", "b", "c"], 8)
    vectors = rng.normal(0, 1, (24, 40)) + np.repeat(np.eye(3, 40), 8, axis=0)
    ours = given_folds(vectors, labels, np.arange(24))
    np.testing.assert_allclose(ours, leave_one_out(vectors, labels), atol=1e-3)


def test_objects_without_folds_say_so(tmp_path):
    (tmp_path / "car").mkdir()
    (tmp_path / "car" / "1.xyz").write_text("1 2 3\n" * 20)
    done = laserimg("classify", "evaluate", "--own-folds", tmp_path)
    assert done.code == 1
    assert "come without folds" in done.err


def test_an_object_in_a_ply_file_is_a_cloud_like_one_in_a_text_file(tmp_path):
    points = np.random.default_rng(0).uniform(0, 1, (50, 3)).round(3)
    lines = "".join(f"{x:.3f} {y:.3f} {z:.3f}\n" for x, y, z in points)
    names = "".join(f"property float {axis}\n" for axis in "xyz")
    (tmp_path / "a.xyz").write_text(lines)
    (tmp_path / "a.ply").write_text(f"ply\nformat ascii 1.0\nelement vertex 50\n{names}end_header\n{lines}")
    from_text, from_ply = read_cloud(tmp_path / "a.xyz"), read_cloud(tmp_path / "a.ply")
    np.testing.assert_allclose(from_ply.points, from_text.points, atol=1e-6)


# --- scans with labels ---

ROWS, COLUMNS = 32, 720
AZIMUTH = np.radians(179.75 - 0.5 * np.arange(COLUMNS))
ELEVATION = np.radians(np.linspace(8, -7.5, ROWS))


def street(folder):
    """Ring after ring of a sphere of 20 m, with a blob at 10 m ahead and one to the left."""
    range_m = np.full((ROWS, COLUMNS), 20.0)
    kind = np.zeros((ROWS, COLUMNS), np.uint32)
    for column, name in ((360, 10), (180, 30)):
        range_m[8:24, column - 15 : column + 15] = 10
        kind[8:24, column - 15 : column + 15] = name
    points = range_m[..., None] * directions_from_angles(AZIMUTH, ELEVATION)
    # A ring begins at azimuth 0 and turns counter-clockwise.
    order = np.argsort(AZIMUTH % (2 * np.pi))
    table = np.concatenate([points, range_m[..., None] / 20], axis=-1)[:, order].reshape(-1, 4)
    folder.mkdir(parents=True)
    (folder / "000001.bin").write_bytes(table.astype("<f4").tobytes())
    return kind[:, order].ravel()


def test_a_kitti_frame_gives_the_objects_in_its_boxes(tmp_path):
    street(tmp_path / "training" / "velodyne")
    for name in ("label_2", "calib"):
        (tmp_path / "training" / name).mkdir()
    (tmp_path / "training/calib/000001.txt").write_text(
        "P2: 700 0 600 0 0 700 180 0 0 0 1 0\nR0_rect: 1 0 0 0 1 0 0 0 1\n"
        "Tr_velo_to_cam: 0 -1 0 0 0 0 -1 0 1 0 0 0\n"
    )
    # Bottom 2 m below, 4 m high, around the blob ahead; a pedestrian where nothing is.
    (tmp_path / "training/label_2/000001.txt").write_text(
        "Car 0 0 0 1 2 3 4 4 4 4 0 2 10 0\nPedestrian 0 0 0 1 2 3 4 2 1 1 5 1 15 0\n"
    )
    (found,) = labelled_sources(tmp_path)
    assert (found.label, found.fold) == ("car", -1)
    vector = found.describe(Recipe("honv+hog", 1, False, "reflectance"))
    assert np.isfinite(vector).all()


def test_labels_of_points_find_their_pixels_and_objects(tmp_path):
    folder = tmp_path / "sequences" / "00" / "velodyne"
    kind = street(folder)
    (tmp_path / "sequences/00/labels").mkdir()
    # The car has an instance, the person none.
    label = kind | np.where(kind == 10, 5 << 16, 0).astype(np.uint32)
    (tmp_path / "sequences/00/labels/000001.label").write_bytes(label.astype("<u4").tobytes())
    scan, kinds, instances = read_labelled(folder / "000001.bin")
    near = (scan.range > 0) & (scan.range < 15)
    np.testing.assert_array_equal(kinds > 0, near)
    azimuth = np.degrees(np.arctan2(scan.directions[..., 1], scan.directions[..., 0]))
    np.testing.assert_array_equal(kinds == 10, near & (np.abs(azimuth) < 30))
    assert set(np.unique(instances[kinds == 10])) == {5}
    found = dataset_objects(tmp_path)
    assert sorted(source.label for source in found) == ["car", "person"]
    out = described(found, Recipe("honv", 1, False, "reflectance"))
    assert out.errors == []


def test_labels_for_another_number_of_points_are_refused(tmp_path):
    kind = street(tmp_path / "a")
    (tmp_path / "a" / "000001.label").write_bytes(kind[:-1].astype("<u4").tobytes())
    with pytest.raises(LabelError, match=r"000001\.label: holds \d+ bytes, not 4 for each of 23040 points"):
        labelled_sources(tmp_path)


def test_rellis_names_its_labels_by_frame(tmp_path):
    (tmp_path / "000104.label").write_bytes(b"")
    assert label_file(tmp_path / "frame000104-1581624663_170.ply") == tmp_path / "000104.label"
    assert label_file(tmp_path / "frame000105-1581624663_170.ply") is None


def test_what_is_no_data_set_says_where_the_known_ones_are_listed(tmp_path):
    with pytest.raises(LabelError, match="laserimg classify datasets lists"):
        labelled_sources(tmp_path)
    done = laserimg("classify", "datasets")
    assert done.code == 0
    assert all(one.page in done.out and one.licence in done.out for one in DATA_SETS)


def test_classes_are_chosen(sydney):
    done = laserimg(
        "classify", "evaluate", "--folds", "2", sydney, "--classes", "car,bin", "--features", "honv"
    )
    assert done.code == 2
    assert "no object is of class bin; there are 4wd, car, pole" in done.err


# --- real ---


def test_every_labelled_point_of_semantickitti_is_in_its_ring(data):
    path = data("semantickitti/000000.bin")
    scan, kinds, instances = read_labelled(path)
    raw = np.fromfile(path.with_suffix(".label"), "<u4")
    counted, expected = (
        np.bincount(kinds[scan.range > 0], minlength=300),
        np.bincount(raw & 0xFFFF, minlength=300),
    )
    np.testing.assert_allclose(counted, expected, rtol=0.01, atol=8)
    assert (instances == 3).sum() == pytest.approx((raw >> 16 == 3).sum(), abs=6)


@pytest.mark.parametrize(
    ("folder", "least"),
    [
        ("semantickitti", {"car": 2, "trunk": 2, "vegetation": 10}),
        ("rellis", {"person": 1, "tree": 5}),
        ("sustech", {"car": 28, "person": 10, "truck": 3}),
        ("kitti", {"person": 1, "truck": 1}),
        ("argoverse2", {"car": 20, "person": 3}),
    ],
)
def test_objects_of_the_real_data_sets(folder, least, data):
    if folder == "argoverse2":
        pytest.importorskip("pyarrow")
    found = dataset_objects(data(folder))
    labels = [source.label for source in found]
    for label, number in least.items():
        assert labels.count(label) >= number
    names = {*SEMANTIC_KITTI.values(), *RELLIS.values()}
    assert folder not in ("semantickitti", "rellis") or set(labels) <= names


def test_a_fold_that_leaves_one_class_answers_with_it():
    """Trained on a alone, and on b alone."""
    decisions = given_folds(np.eye(4), np.array(["a", "a", "b", "b"]), np.array([0, 0, 1, 1]))
    assert decisions.argmax(axis=1).tolist() == [1, 1, 0, 0]
