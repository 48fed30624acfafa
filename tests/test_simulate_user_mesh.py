"""The user's own meshes: read, scaled, put into scenes, labelled."""

import os

import numpy as np
import pytest

from command import laserimg
from laserimg.errors import ConfigError
from laserimg.formats.coco_file import read_coco
from laserimg.simulate.scenes import SCENES
from laserimg.simulate.user_mesh import SUFFIXES, standing, user_thing

trimesh = pytest.importorskip("trimesh")


def wedge(path, y_up=False):
    """A solid 0.4 m long, 0.2 m wide and 0.3 m high, lower towards its front at +x, far from the origin."""
    points = np.array([(x, y, z) for x in (0, 0.4) for y in (0, 0.2) for z in (0, 0.3)], float)
    points[points[:, 0] > 0.2, 2] *= 0.5
    solid = trimesh.convex.convex_hull(points + np.array([5, 7, -2]))
    if y_up:
        solid.vertices = solid.vertices[:, [1, 2, 0]]
    solid.export(path)
    return path


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize("y_up", [False, True])
def test_every_format_stands_centred_front_ahead_and_within_the_heights(tmp_path, suffix, y_up):
    make = user_thing(wedge(tmp_path / f"bin{suffix}", y_up), "bin", (0.2, 0.6), "y" if y_up else "z")
    heights = []
    for seed in range(20):
        thing = make(np.random.default_rng(seed))
        low, high = thing.mesh.vertices.min(axis=0), thing.mesh.vertices.max(axis=0)
        np.testing.assert_allclose(low + high, [0, 0, high[2]], atol=1e-6)
        np.testing.assert_allclose(thing.mesh.extents / high[2], [4 / 3, 2 / 3, 1], rtol=1e-5)
        front = thing.mesh.vertices[thing.mesh.vertices[:, 0] > 0]
        assert front[:, 2].max() == pytest.approx(high[2] / 2, rel=1e-5)
        heights.append(high[2])
        assert thing.label == "bin"
        again = make(np.random.default_rng(seed)).mesh
        assert np.array_equal(again.vertices, thing.mesh.vertices)
        assert np.array_equal(again.reflectance, thing.mesh.reflectance)
    assert 0.2 <= min(heights) < 0.3 and 0.5 < max(heights) <= 0.6


def test_y_is_up_in_glb_files_and_z_in_others(tmp_path):
    glb, obj = wedge(tmp_path / "a.glb", y_up=True), wedge(tmp_path / "a.obj")
    for path in (glb, obj):
        mesh = user_thing(path, "bin", (0.3, 0.3))(np.random.default_rng(0)).mesh
        np.testing.assert_allclose(mesh.extents, [0.4, 0.2, 0.3], rtol=1e-5)


def bad_files(folder):
    texts = {"a.obj": "not a mesh", "b.stl": "", "c.ply": "ply?", "d.glb": "glTF", "e.step": "ISO"}
    for name, text in texts.items():
        (folder / name).write_text(text)
        yield folder / name
    trimesh.PointCloud([[0, 0, 0], [1, 1, 1], [1, 0, 1]]).export(folder / "cloud.ply")
    yield folder / "cloud.ply"
    (folder / "nan.obj").write_text("v 0 0 0\nv 1 0 nan\nv 0 1 1\nf 1 2 3\n")
    yield folder / "nan.obj"
    (folder / "flat.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    yield folder / "flat.obj"
    yield folder / "missing.obj"


def test_bad_files_are_one_clear_line_and_nothing_is_written(tmp_path):
    for path in bad_files(tmp_path):
        with pytest.raises(ConfigError, match=path.name):
            user_thing(path, "bin", (0.2, 0.6))
        words = ("simulate", "office", "--mesh", path, "--class", "bin", "--height", "0.2:0.6")
        result = laserimg(*words, "-o", tmp_path / "out")
        assert result.code == 1
        assert len(result.err.strip().splitlines()) == 1 and path.name in result.err
        assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("height", ["0.6:0.2", "-1:2", "0:1", "tall", "nan", "20:60", "inf"])
def test_bad_heights(tmp_path, height):
    path = wedge(tmp_path / "bin.obj")
    result = laserimg(
        "simulate", "office", "--mesh", path, "--class", "bin", f"--height={height}", "-o", tmp_path / "out"
    )
    assert result.code in (1, 2) and height.split(":")[0] in result.err
    assert not (tmp_path / "out").exists()


def test_a_mesh_needs_class_and_height(tmp_path):
    path = wedge(tmp_path / "bin.obj")
    assert laserimg("simulate", "office", "--mesh", path, "-o", tmp_path / "out").code == 2
    assert laserimg("simulate", "office", "--class", "bin", "-o", tmp_path / "out").code == 2


@pytest.mark.parametrize("name", SCENES)
def test_scenes_have_one_to_four_of_it_on_the_ground_and_are_the_same_without(tmp_path, name):
    make = user_thing(wedge(tmp_path / "bin.obj"), "bin", (0.2, 0.6))
    counts = []
    for seed in range(8):
        scene = SCENES[name](np.random.default_rng(seed), (make,))
        found = [thing.mesh.vertices for thing in scene.things if thing.label == "bin"]
        counts.append(len(found))
        place = scene.scanners[0][:3, 3]
        for points in found:
            assert np.linalg.norm(points - place, axis=1).min() > 0.3
            if name in ("office", "corridor", "stairwell"):
                assert abs(points[:, 2].min()) < 1e-9
    assert max(counts) > 1 and max(counts) <= 4 and np.mean(np.array(counts) > 0) > 0.8


def test_a_set_with_a_mesh_has_its_class_and_sizes(tmp_path):
    pytest.importorskip("embreex")
    path = wedge(tmp_path / "bin.obj")
    words = ("simulate", "corridor", "--scanner", "lms200_tilt", "--count", 4)
    more = ("--mesh", path, "--class", "bin", "--height", "0.3:0.5", "--jobs", 2)
    assert laserimg(*words, *more, "-o", tmp_path / "out").code == 0
    assert laserimg(*words, "-o", tmp_path / "out").code == 0
    assert len(list((tmp_path / "out").glob("*.npz"))) == 8, "names tell sets with and without it apart"
    assert laserimg(*words, *more, "-o", tmp_path / "out").code == 0
    truth = read_coco(tmp_path / "out/truth.coco.json")
    found = [box for box in truth.annotations if truth.labels[box.category_id] == "bin"]
    assert found
    for box in found:
        assert box.size is not None and 0.3 <= box.size.height <= 0.5
        assert box.size.length == pytest.approx(box.size.height * 4 / 3, rel=1e-3)


def test_a_mesh_that_fits_nowhere_is_told_in_one_line(tmp_path):
    pytest.importorskip("embreex")
    path = wedge(tmp_path / "bin.obj")
    words = ("simulate", "corridor", "--scanner", "lms200_turn", "--count", 2, "--quiet")
    small, large = (
        laserimg(*words, "--mesh", path, "--class", "bin", "--height", height, "-o", tmp_path / "out")
        for height in ("0.4:0.5", "4:5")
    )
    assert small.code == 0 and small.err == ""
    assert large.code == 0 and large.err.count("\n") == 1 and "no scan shows 'bin'" in large.err


def test_what_is_read_does_not_depend_on_unit_or_place(tmp_path):
    path = wedge(tmp_path / "bin.stl")
    points, faces = standing(path, "z")
    solid = trimesh.load(path, force="mesh", process=False)
    solid.vertices = solid.vertices * 1000
    solid.export(tmp_path / "mm.stl")
    again, same = standing(tmp_path / "mm.stl", "z")
    np.testing.assert_allclose(again, points, atol=1e-4)
    assert np.array_equal(faces, same)


def test_a_mesh_file_that_changes_is_read_again(tmp_path):
    trimesh.creation.box((1, 1, 1)).export(tmp_path / "a.obj")
    before = user_thing(tmp_path / "a.obj", "bin", (1, 1))(np.random.default_rng(0)).mesh.extents
    trimesh.creation.box((3, 1, 1)).export(tmp_path / "a.obj")
    os.utime(tmp_path / "a.obj", ns=(0, 1))  # clocks of file systems are coarse
    after = user_thing(tmp_path / "a.obj", "bin", (1, 1))(np.random.default_rng(0)).mesh.extents
    assert sorted(before) == pytest.approx([1, 1, 1]) and sorted(after) == pytest.approx([1, 1, 3])
