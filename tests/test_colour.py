"""RGB-D: the grey of a registered colour image, or of coloured points, in place of reflectance."""

import json

import cv2
import numpy as np
import pytest

from command import laserimg
from laserimg.errors import ConfigError, ScanError
from laserimg.readers import find_files, read_file
from laserimg.readers.colour import grey_of_points

CAMERA = {"kind": "depth", "scale_m": 0.001, "fx": 60, "fy": 60, "cx": 23.5, "cy": 23.5}
LUMA = (0.299, 0.587, 0.114)


def write_pair(folder, name, depth_m, picture, **keys):
    """A depth image of metres and a colour image (red, green, blue) beside it."""
    folder.mkdir(exist_ok=True)
    cv2.imwrite(str(folder / f"{name}.png"), np.rint(depth_m * 1000).astype(np.uint16))
    cv2.imwrite(str(folder / f"{name}_colour.png"), picture[..., ::-1])
    about = CAMERA | {"colour": f"{name}_colour.png"} | keys
    (folder / f"{name}.json").write_text(json.dumps(about))
    return folder / f"{name}.png"


def ball(random, vertical=True):
    """A ball with stripes before nothing."""
    y, x = np.mgrid[:48, :48] - 23.5 + random.uniform(-2, 2, (2, 1, 1))
    radius = random.uniform(16, 20)
    off = np.hypot(x, y)
    depth = 2 - 0.4 * np.sqrt(np.maximum(1 - (off / radius) ** 2, 0)) + 0.002 * random.normal(size=x.shape)
    along = x if vertical else y
    stripes = np.where(np.sin(along / 2 + random.uniform(0, 6)) > 0, 220, 60)
    colour = stripes[..., None] * np.array([1.0, 0.8, 0.3]) + random.normal(0, 4, (48, 48, 3))
    return np.where(off < radius, depth, 0), colour.clip(0, 255).astype(np.uint8)


def packed_pcd(path, colours, kind, height=1):
    """x y z with colours in one field of 4 bytes, binary."""
    r, g, b = np.asarray(colours, np.uint32).T
    records = np.zeros(len(r), [("xyz", "<f4", 3), ("rgb", "<u4")])
    row, column = np.divmod(np.arange(len(r)), len(r) // height)
    z = 2 + 0.01 * row
    records["xyz"] = np.stack([z * (column - 2) / 20, z * (row - 2) / 20, z], axis=-1)
    records["rgb"] = r << 16 | g << 8 | b
    name = "rgba" if kind == "U" else "rgb"
    header = (
        f"VERSION 0.7\nFIELDS x y z {name}\nSIZE 4 4 4 4\nTYPE F F F {kind}\nCOUNT 1 1 1 1\n"
        f"WIDTH {len(r) // height}\nHEIGHT {height}\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {len(r)}\nDATA binary\n"
    )
    path.write_bytes(header.encode() + records.tobytes())


def test_the_grey_of_the_colour_image_is_the_reflectance(tmp_path):
    random = np.random.default_rng(0)
    colour = random.integers(0, 256, (48, 48, 3)).astype(np.uint8)
    depth = np.full((48, 48), 2.0)
    depth[3:5, 7] = 0
    (scan,) = read_file(write_pair(tmp_path, "a", depth, colour))
    np.testing.assert_allclose(scan.reflectance[depth > 0], (colour @ LUMA)[depth > 0], atol=0.51)
    assert (scan.reflectance[depth == 0] == 0).all()
    assert find_files([tmp_path]) == [tmp_path / "a.png"]


def test_without_the_key_there_is_no_reflectance(tmp_path):
    file = write_pair(tmp_path, "a", np.full((48, 48), 2.0), np.zeros((48, 48, 3), np.uint8))
    (tmp_path / "a.json").write_text(json.dumps(CAMERA))
    (scan,) = read_file(file)
    assert scan.reflectance is None


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"colour": "wide.png"}, "wide.png has 48 x 50 pixels, the scan 48 x 48: register it to the scan"),
        ({"colour": "none.png"}, "colour image none.png: no such file"),
        ({"colour": "a.json"}, "colour image a.json: not a readable image"),
        ({"colour": 3}, "colour must be the name of an image beside it, got 3"),
        ({"colour": True}, "colour must be the name of an image beside it, got true"),
    ],
)
def test_a_colour_image_that_does_not_fit(keys, message, tmp_path):
    file = write_pair(tmp_path, "a", np.full((48, 48), 2.0), np.zeros((48, 48, 3), np.uint8), **keys)
    cv2.imwrite(str(tmp_path / "wide.png"), np.zeros((48, 50, 3), np.uint8))
    with pytest.raises(ScanError, match=message):
        list(read_file(file))


def test_images_with_a_colour_image_given(tmp_path):
    depth, colour = ball(np.random.default_rng(0))
    file = write_pair(tmp_path, "a", depth, colour)
    (tmp_path / "a.json").write_text(json.dumps(CAMERA))
    arguments = ("images", file, "-o", tmp_path / "out", "--kinds", "reflectance")
    assert laserimg(*arguments).code == 1
    assert laserimg(*arguments, "--colour", tmp_path / "a_colour.png").code == 0
    picture = cv2.imread(str(tmp_path / "out" / "a.reflectance.png"), 0)
    stripes = np.corrcoef(picture[depth > 0], (colour @ LUMA)[depth > 0])[0, 1]
    assert stripes > 0.99
    cv2.imwrite(str(tmp_path / "small.png"), np.zeros((24, 24, 3), np.uint8))
    done = laserimg(*arguments, "--colour", tmp_path / "small.png")
    assert done.code == 1 and len(done.err.splitlines()) == 1 and "small.png has 24 x 24 pixels" in done.err
    two = laserimg("images", file, write_pair(tmp_path, "b", depth, colour), *arguments[2:], "--colour", file)
    assert two.code == 2 and "goes with one scan" in two.err


@pytest.mark.parametrize("kind", ["F", "U"])
@pytest.mark.parametrize("height", [1, 5])
def test_colours_of_points(kind, height, tmp_path):
    colours = np.random.default_rng(1).integers(0, 256, (25, 3))
    packed_pcd(tmp_path / "a.pcd", colours, kind, height)
    (scan,) = read_file(tmp_path / "a.pcd")
    assert scan.reflectance is None
    (tmp_path / "laserimg.toml").write_text("format = 1\ncolour = true\n")
    (scan,) = read_file(tmp_path / "a.pcd")
    if height > 1:
        np.testing.assert_allclose(scan.reflectance.ravel(), colours @ LUMA, atol=1e-3)
    else:
        assert set(scan.reflectance[scan.range > 0].round(2)) <= set((colours @ LUMA).astype("f4").round(2))
    (tmp_path / "a.json").write_text('{"colour": false}')
    assert next(read_file(tmp_path / "a.pcd")).reflectance is None


def test_three_fields_of_colour():
    record = np.array([(10, 20, 30)], [("r", "u1"), ("g", "u1"), ("b", "u1")])
    assert grey_of_points(record) == pytest.approx(np.dot((10, 20, 30), LUMA))
    with pytest.raises(ScanError, match="has no colours"):
        grey_of_points(np.zeros(1, [("x", "f4")]))
    with pytest.raises(ScanError, match="has 8 bytes a point, not 4"):
        grey_of_points(np.zeros(1, [("rgb", "f8")]))


def test_colour_is_true_or_false(tmp_path):
    packed_pcd(tmp_path / "a.pcd", np.ones((25, 3)), "F", 5)
    (tmp_path / "laserimg.toml").write_text('colour = "a.png"\n')
    with pytest.raises(ConfigError, match=r"laserimg\.toml: colour must be true or false, got a\.png"):
        list(read_file(tmp_path / "a.pcd"))


def test_objects_that_only_their_colours_tell_apart(tmp_path):
    random = np.random.default_rng(2)
    for number in range(8):
        for label in ("across", "upright"):
            write_pair(tmp_path / label, f"{number}", *ball(random, label == "upright"))
    correct = {}
    for features in ("honv", "honv+hog", "3dhog"):
        done = laserimg("classify", "evaluate", "--leave-one-out", tmp_path, "--features", features, "--json")
        assert done.code == 0, done.err
        correct[features] = json.loads(done.out)["total"]["correct"]
    assert correct["honv+hog"] == correct["3dhog"] == 16
    assert correct["honv"] < 14


# --- real images


@pytest.mark.parametrize(
    ("name", "colour", "scale_m"), [("TUM", "TUM_color.png", 1 / 5000), ("SUN", "SUN_color.jpg", 1 / 8000)]
)
def test_edges_of_depth_are_edges_of_colour(data, name, colour, scale_m, tmp_path):
    """Registered: at steps of depth the grey changes more than a hundred pixels beside them."""
    top = "depth_png/RGBD_other_formats_"
    (tmp_path / "a.png").write_bytes(data(f"{top}{name}_depth.png").read_bytes())
    (tmp_path / "c").write_bytes(data(f"{top}{colour}").read_bytes())
    about = {"kind": "depth", "scale_m": scale_m, "fx": 525, "fy": 525, "cx": 319.5, "cy": 239.5}
    (tmp_path / "a.json").write_text(json.dumps(about | {"colour": "c"}))
    (scan,) = read_file(tmp_path / "a.png")
    seen = scan.range > 0
    both = seen[:, 1:] & seen[:, :-1]
    step = both & (np.abs(np.diff(scan.range, axis=1)) > 0.1 * scan.range[:, 1:])
    change = np.abs(np.diff(cv2.GaussianBlur(scan.reflectance, (0, 0), 2), axis=1))
    beside = np.roll(step, 100, axis=1) & both
    assert change[step].mean() > 1.3 * change[beside].mean()


@pytest.mark.parametrize("name", ["five_people", "office1"])
def test_kinect_points_have_colours(data, name, tmp_path):
    from pypcd4.pypcd4 import PointCloud

    path = data(f"kinect/{name}.pcd")
    (tmp_path / "a.pcd").write_bytes(path.read_bytes())
    (tmp_path / "laserimg.toml").write_text("colour = true\n")
    (scan,) = read_file(tmp_path / "a.pcd")
    records = PointCloud.from_path(path).pc_data
    packed = records["rgba" if name == "five_people" else "rgb"].tobytes()
    blue, green, red, _ = np.frombuffer(packed, np.uint8).reshape(-1, 4).astype(float).T
    grey = (0.299 * red + 0.587 * green + 0.114 * blue).reshape(480, 640)
    np.testing.assert_allclose(scan.reflectance, np.where(scan.range > 0, grey, 0), atol=0.01)
