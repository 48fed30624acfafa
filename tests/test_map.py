"""`laserimg map`: ground, clusters, classes, pictures, points, page; what is wrong in one line."""

import json
import re
import shutil
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

import laserimg as package
from command import laserimg
from laserimg.classify import ObjectModel, Recipe, describe_images, save_model
from laserimg.classify.views import crop_of_pixels
from laserimg.formats.npz import write_npz
from laserimg.readers import open_scans
from laserimg.scan import Scan
from laserimg.semantic_map import MapModels, SemanticMap, map_scan
from laserimg.semantic_map.cloud import even_reflectance
from laserimg.semantic_map.colours import COLOURS, palette
from laserimg.semantic_map.fusing import class_of, fused
from laserimg.semantic_map.page import pack, page, thinned
from laserimg.semantic_map.panorama import panorama
from laserimg.semantic_map.reasons import parts_of
from laserimg.semantic_map.segments import described_clusters, segments_of, world_points
from laserimg.semantic_map.top_view import top_view

STREET = Path(package.__file__).parent / "demo" / "street.npz"


@pytest.fixture(scope="module")
def models():
    return MapModels.load()


@pytest.fixture(scope="module")
def street():
    return next(open_scans(STREET))


@pytest.fixture(scope="module")
def mapped(street, models):
    return map_scan(street, models)


@pytest.fixture(scope="module")
def out(tmp_path_factory):
    """Two scans: the demo street, and the same at another pose."""
    folder = tmp_path_factory.mktemp("map")
    scan = next(open_scans(STREET))
    pose = np.eye(4)
    pose[:2, :2] = [[0, -1], [1, 0]]
    pose[:3, 3] = 100, 20, 5
    write_npz(replace(scan, world_from_scan=pose), folder / "b.npz")
    write_npz(scan, folder / "a.npz")
    done = laserimg("map", folder / "a.npz", folder / "b.npz", "-o", folder / "map", "--json")
    assert (done.code, done.err) == (0, "")
    assert json.loads(done.out) == json.loads((folder / "map" / "map.json").read_text())
    return folder / "map"


def told(out: Path) -> dict:
    return json.loads((out / "map.json").read_text(encoding="utf-8"))


def vertices(path: Path) -> np.ndarray:
    data = path.read_bytes()
    header, body = data.split(b"end_header\n", 1)
    types = {"double": "<f8", "uchar": "u1", "int": "<i4"}
    record = [(n, types[t]) for t, n in re.findall(r"property (\w+) (\w+)", header.decode())]
    (count,) = re.findall(rb"element vertex (\d+)", header)
    return np.frombuffer(body, record, count=int(count))


def test_the_colours_are_those_of_the_paper():
    """Brown has more red than green than blue; the others are a primary colour and its neighbours."""
    red, green, blue = COLOURS["building"]
    assert red > green > blue > 0
    assert min(COLOURS["car"][:2]) > 4 * COLOURS["car"][2]
    assert [int(np.argmax(COLOURS[label])) for label in ("pole", "tree", "person")] == [0, 1, 2]
    assert min(COLOURS["ground"]) > 225 and min(COLOURS["undersegmented"]) > 225
    assert list(palette(("Pole", "Human", "Building")))[:3] == ["Building", "Human", "Pole"]
    assert palette(("Pole", "Human"))["Human"] == COLOURS["person"]
    assert len(set(palette(("car", "sheep", "goat")).values())) == len(palette(("car", "sheep", "goat")))


def test_the_demo_street_has_its_cars_and_houses(mapped):
    """Two cars of 4.6 and 4.9 m; what is longer than 6 m is a house, or a row of them."""
    long = [c for c in mapped.clusters if c.points > 1000 and c.size.height_above_floor == 0]
    cars = [c for c in long if 3.5 < c.size.length < 5 and c.size.height < 1.8]
    houses = [c for c in long if c.size.length > 6]
    assert len(cars) == 2 and len(houses) >= 3
    assert {c.label for c in cars} == {"car"} and {c.label for c in houses} == {"building"}
    assert min(c.confidence for c in cars + houses) > 0.5


def test_every_pixel_is_ground_or_cluster_or_loose(mapped):
    numbers = mapped.numbers()
    assert set(np.unique(numbers)) == {-1, 0, *range(1, len(mapped.clusters) + 1)}
    assert (numbers[~mapped.scan.valid] == -1).all()
    assert (np.bincount(numbers[numbers > 0])[1:] == [cluster.points for cluster in mapped.clusters]).all()


def test_clusters_are_described_as_classify_does(street, models):
    recipe = models.of(street).recipe
    clusters = segments_of(street).clusters
    together = described_clusters(street, clusters, recipe)
    for place in (0, len(clusters) // 2, len(clusters) - 1):
        pixels = clusters[place].pixels
        alone = describe_images(crop_of_pixels(street, pixels), world_points(street, pixels), recipe)
        np.testing.assert_allclose(together[place], alone, atol=1e-5)


def test_reasons_add_up_to_the_distance_of_the_two_best(mapped, models):
    assert list(parts_of(models.of(mapped.scan))) == ["shape", "reflectance", "size"]
    for cluster in mapped.clusters:
        best, second = np.sort(cluster.decisions)[::-1][:2]
        parts = [float(value) for value in re.findall(r"[+-]\d+\.\d+", cluster.reason)]
        assert len(parts) == 3
        assert sum(parts) == pytest.approx(best - second, abs=0.02)
        assert f"{best - second:.2f}" in cluster.reason


def test_what_is_below_the_margin_is_unknown(street, models):
    strict = map_scan(street, models, margin=1e6)
    assert {cluster.label for cluster in strict.clusters} == {"unknown"}
    assert all(" or " in cluster.reason for cluster in strict.clusters)


def test_a_scan_without_reflectance_has_its_own_model(street, models):
    bare = replace(street, reflectance=None)
    assert not models.of(bare).recipe.needs_reflectance
    assert models.of(street).recipe.needs_reflectance
    assert sum(cluster.label == "car" for cluster in map_scan(bare, models).clusters) >= 2


def test_positions_and_points_are_in_the_world(out):
    """The second scan is the first one, turned by 90 degrees and shifted."""
    record = told(out)
    assert [scan["clusters"] for scan in record["scans"]] == [len(record["clusters"]) // 2] * 2
    first, second = ([c for c in record["clusters"] if c["scan"] == scan] for scan in (0, 1))
    for a, b in zip(first, second, strict=True):
        x, y, z = a["position"]
        np.testing.assert_allclose(b["position"], [100 - y, 20 + x, 5 + z], atol=2e-3)
        assert (a["points"], a["size"]) == (b["points"], b["size"])
    points = vertices(out / "map.ply")
    for cluster in (first[0], second[0]):
        own = points[points["cluster"] == cluster["id"]]
        assert len(own) == cluster["points"]
        middle = [np.median(own[axis]) for axis in "xyz"]
        np.testing.assert_allclose(middle, cluster["position"], atol=0.6)


def test_the_ply_has_the_colours_of_the_classes(out):
    points, record = vertices(out / "map.ply"), told(out)
    assert len(points) == sum(scan["points"] for scan in record["scans"])
    car = next(cluster for cluster in record["clusters"] if cluster["class"] == "car")
    own = points[points["cluster"] == car["id"]]
    assert len(np.unique(own["class"])) == 1
    assert (own["red"] > 100).all() and (own["blue"] < 20).all()
    assert (points["cluster"] == 0).sum() == sum(scan["ground_points"] for scan in record["scans"])
    header = (out / "map.ply").read_bytes()[:600].decode("latin1")
    assert f"comment class {own['class'][0]} car\n" in header


def test_the_panorama_shows_classes_where_they_are(mapped, models):
    """The demo street is 1000 columns wide and drawn as two strips, one above the other."""
    picture = panorama(mapped, models.labels, "demo").astype(int)
    height, width = mapped.scan.shape
    scale = 2 * picture.shape[1] / width
    top = np.flatnonzero(mapped.scan.valid.any(axis=1))[0]
    lowest = np.flatnonzero((mapped.segments.labels > 0).any(axis=1))[-1]
    strip = (lowest + 1 + height // 20 - top) * scale
    assert 2 * strip < picture.shape[0] < 2 * strip + 100
    for cluster, region in zip(mapped.clusters, mapped.segments.clusters, strict=True):
        if cluster.label != "car" or cluster.points < 1000:
            continue
        row, column = np.divmod(region.pixels[len(region.pixels) * 2 // 3], width)
        second, x = divmod((column + 0.5) * scale, picture.shape[1])
        y = (row - top + 0.5) * scale + second * (strip + 3)
        red, green, blue = picture[int(y), int(x)]
        assert red > 120 and green > 100 and blue < 40


def test_the_top_view_has_north_up_and_a_true_scale(tmp_path, models):
    """A wall 20 m to the north of the scanner, another 10 m to the west."""
    azimuth, elevation = np.radians(np.arange(179.5, -180, -1)), np.radians(np.arange(20, -40, -0.5))
    east, north = np.cos(azimuth), np.sin(azimuth)
    wall = np.minimum(
        np.where(north > 0.1, 20 / np.maximum(north, 0.1), 99),
        np.where(east < -0.1, 10 / np.maximum(-east, 0.1), 99),
    )
    flat = wall[None] / np.cos(elevation)[:, None]
    floor = np.where(elevation < -0.02, 1.5 / np.maximum(-np.sin(elevation), 0.01), 99)[:, None]
    range_m = np.minimum(flat, floor)
    range_m[range_m > 60] = 0
    scan = Scan.from_range_image(range_m, azimuth, elevation, wraps=True)
    whole = SemanticMap([map_scan(scan, models).in_world()], models.labels)
    picture = top_view(whole, whole.cloud())
    bright = picture[:-60].max(axis=2) > 90
    rows, columns = np.flatnonzero(bright.any(axis=1)), np.flatnonzero(bright.any(axis=0))
    rings = np.argwhere((picture == 255).all(axis=2))
    scanner_row, scanner_column = np.median(rings, axis=0)
    up, left = scanner_row - rows[0], scanner_column - columns[0]
    assert up / left == pytest.approx(2, rel=0.1)


def test_the_page_holds_all_it_needs(out):
    text = (out / "map.html").read_text(encoding="utf-8")
    assert not re.search(r"""(src|href)\s*=|https?://|@import|url\(|fetch\(|XMLHttpRequest""", text)
    (facts,) = re.findall(r'<script type="application/json" id="map">(.*?)</script>', text, re.DOTALL)
    facts = json.loads(facts)
    assert len(facts["clusters"]) == len(told(out)["clusters"])
    assert len(facts["scanners"]) == 2
    assert dict(facts["legend"])["car"] == str(sum(c["class"] == "car" for c in told(out)["clusters"]))
    assert {label for label, _ in facts["legend"]} <= set(facts["colours"])


def test_a_page_cannot_be_broken_by_a_name(mapped, models):
    whole = SemanticMap([mapped.in_world()], models.labels)
    text = page(whole, whole.cloud(), "</script><b>street", max_points=1000)
    assert text.count("</script>") == 3 and "<b>street" not in text


def test_packed_points_come_back(mapped):
    cloud = mapped.in_world().cloud
    data, frame = pack(cloud)
    count = frame["count"]
    assert len(data) == 10 * count == 10 * len(cloud.points)
    places = np.frombuffer(data, "<u2", 3 * count).reshape(-1, 3) / 65535
    found = np.array(frame["low"]) + np.array(frame["span"]) * places
    np.testing.assert_allclose(found, cloud.points, atol=max(frame["span"]) / 65535)
    number = np.frombuffer(data, "<u2", count, offset=6 * count).astype(int) - 1
    np.testing.assert_array_equal(number, cloud.cluster)


def test_thinning_keeps_far_points_and_lets_near_ones_go(mapped):
    cloud = mapped.in_world().cloud
    thin = thinned(cloud, 20_000)
    assert len(thin.points) == pytest.approx(20_000, rel=0.05)
    near, far = np.linalg.norm(cloud.points, axis=1) < 4, np.linalg.norm(cloud.points, axis=1) > 20
    near_thin, far_thin = np.linalg.norm(thin.points, axis=1) < 4, np.linalg.norm(thin.points, axis=1) > 20
    assert far_thin.sum() / far.sum() > 3 * near_thin.sum() / near.sum()


def test_even_reflectance_takes_out_the_range():
    """The same stripes, whether a sensor corrects for the range or not."""
    azimuth, elevation = np.radians(np.arange(40, -40, -1.0)), np.radians(np.arange(-5, -45, -1.0))
    range_m = np.repeat((1.5 / np.sin(-elevation))[:, None], 80, axis=1)
    stripes = np.where(np.arange(80) % 8 < 4, 0.2, 0.6) * np.ones((40, 1))
    for power in (0, 2):
        scan = Scan.from_range_image(range_m, azimuth, elevation, reflectance=stripes / range_m**power)
        even = even_reflectance(scan.reflectance, scan)
        assert (
            np.abs(even[:, stripes[0] == 0.2]).max() < 0.1
            and np.abs(even[:, stripes[0] == 0.6] - 1).max() < 0.1
        )


def test_the_table_and_the_files(tmp_path):
    done = laserimg("map", STREET, "-o", tmp_path / "m", "--margin", "0")
    assert (done.code, done.err) == (0, "")
    assert "car" in done.out and "unknown" not in done.out and "map.html" in done.out
    names = sorted(
        str(path.relative_to(tmp_path / "m")) for path in (tmp_path / "m").rglob("*") if path.is_file()
    )
    assert names == ["map.html", "map.json", "map.ply", "panoramas/street.png", "top.png"]
    assert cv2.imread(str(tmp_path / "m" / "top.png")).shape[1] >= 1000


def test_one_bad_file_does_not_stop_the_rest(tmp_path):
    (tmp_path / "bad.npz").write_bytes(b"no scan")
    done = laserimg("map", tmp_path / "bad.npz", STREET, "-o", tmp_path / "m", "--quiet")
    assert done.code == 1 and done.out == ""
    assert done.err.startswith(f"laserimg: {tmp_path / 'bad.npz'}: ") and done.err.count("\n") == 1
    assert (tmp_path / "m" / "map.html").exists()
    alone = laserimg("map", tmp_path / "bad.npz", "-o", tmp_path / "none")
    assert alone.code == 1 and not (tmp_path / "none").exists()


def test_a_map_among_its_scans_is_no_scan_of_the_next_run(tmp_path):
    shutil.copy(STREET, tmp_path / "street.npz")
    for _ in range(2):
        done = laserimg("map", tmp_path, "-o", tmp_path)
        assert (done.code, done.err) == (0, "")
        assert [Path(scan["file"]).name for scan in told(tmp_path)["scans"]] == ["street.npz"]
    assert laserimg("map", tmp_path / "map.ply", "-o", tmp_path / "points").code == 0


def test_a_least_range_above_all_returns_is_one_line(tmp_path):
    done = laserimg("map", STREET, "-o", tmp_path / "m", "--min-range", "500")
    why = "no return between 500 and inf m"
    assert (done.code, done.err) == (1, f"laserimg: {STREET}: {why}\n")
    assert not (tmp_path / "m").exists()


def test_a_model_that_needs_reflectance_says_so(tmp_path, street):
    recipe = Recipe("honv+hog", 1)
    rng = np.random.default_rng(0)
    save_model(
        tmp_path / "m.npz", ObjectModel(("a", "b"), rng.normal(size=(2, recipe.length)), np.zeros(2), recipe)
    )
    write_npz(replace(street, reflectance=None), tmp_path / "bare.npz")
    done = laserimg("map", tmp_path / "bare.npz", "-o", tmp_path / "o", "--model", tmp_path / "m.npz")
    assert done.code == 1
    assert done.err == (
        f"laserimg: {tmp_path / 'bare.npz'}: has no reflectance, which the model's features honv+hog need: "
        "train one with --features honv, or leave out --model\n"
    )
    missing = laserimg("map", STREET, "-o", tmp_path / "o", "--model", tmp_path / "none.npz")
    assert missing.code == 1 and "none.npz" in missing.err
    assert laserimg("map", STREET, "-o", tmp_path / "o", "--up", "w").code == 2


def test_no_ground_is_no_error(models):
    """A room without floor: a wall alone."""
    angles = np.radians(np.arange(20, -20, -0.5))
    wall = 5 / (np.cos(angles)[:, None] * np.cos(angles))
    one = map_scan(Scan.from_range_image(wall, angles, angles), models)
    assert one.segments.ground is None and len(one.clusters) == 1
    assert one.clusters[0].size.height_above_floor is None
    assert "no ground" in page(SemanticMap([one.in_world()], models.labels), one.in_world().cloud, "wall")


def test_shipped_models_are_small_and_of_the_paper(models, street):
    for name in ("map.npz", "map_range.npz"):
        from laserimg.detectors.shipped import shipped_folder

        assert (shipped_folder() / name).stat().st_size < 2_000_000
    assert {"building", "car", "person", "tree", "pole"} <= set(models.labels)


def test_an_object_seen_from_two_places_is_one(models):
    """Two posts, each seen from two sides."""
    scans = [posts(x) for x in (-4.0, 4.0)]
    whole = SemanticMap(fused([map_scan(scan, models).in_world() for scan in scans]), models.labels)
    assert [len(one.clusters) for one in whole.scans] == [2, 2]
    numbers = [cluster.number for cluster in whole.clusters]
    places = [cluster.position[1] for cluster in whole.clusters]
    assert len(set(numbers)) == 2
    for number in set(numbers):
        own = [place for place, each in zip(places, numbers, strict=True) if each == number]
        assert len(own) == 2 and abs(own[0] - own[1]) < 0.5
    text = page(whole, whole.cloud(), "posts")
    assert text.count("in 2 clusters") == 4
    (facts,) = re.findall(r'id="map">(.*?)</script>', text, re.DOTALL)
    assert len(json.loads(facts)["named"]) == 2


def test_the_class_of_an_object_is_that_of_its_surest_views(mapped):
    car = next(c for c in mapped.clusters if c.label == "car")
    views = [("car", 0.9), ("tree", 0.6), ("unknown", 0.4), ("tree", 0.2)]
    members = [replace(car, label=label, confidence=confidence) for label, confidence in views]
    assert class_of(members) == ("car", pytest.approx(0.3))
    assert class_of(members[2:3]) == ("unknown", 0.4)


def posts(x: float) -> Scan:
    """Two posts of 1 m width at x = 0, y = -3 and 3, on flat ground, from 1.5 m above it at (x, 0)."""
    azimuth, elevation = np.radians(np.arange(179.75, -180, -0.5)), np.radians(np.arange(20, -40, -0.5))
    east, north = np.cos(azimuth), np.sin(azimuth)
    flat = np.full(len(azimuth), 1e6)
    for y in (-3.0, 3.0):
        along = -x * east + y * north
        apart2 = x**2 + y**2 - along**2
        hit = (along > 0) & (apart2 < 0.25)
        flat[hit] = np.minimum(flat[hit], (along - np.sqrt(np.maximum(0.25 - apart2, 0)))[hit])
    wall = flat[None] / np.cos(elevation)[:, None]
    wall[np.sin(elevation)[:, None] * wall > 1.0] = 1e6
    ground = np.where(elevation < -0.02, 1.5 / np.maximum(-np.sin(elevation), 0.01), np.inf)[:, None]
    range_m = np.minimum(wall, ground)
    range_m[range_m > 40] = 0
    pose = np.eye(4)
    pose[0, 3] = x
    return Scan.from_range_image(range_m, azimuth, elevation, wraps=True, world_from_scan=pose)


def test_a_map_of_one_place_is_whole_and_scans_without_poses_are_warned_of(tmp_path):
    (tmp_path / "one.xyz").write_text("2 0.5 0.1\n" * 5)
    alone = laserimg("map", tmp_path / "one.xyz", "-o", tmp_path / "one", "--quiet")
    assert alone.code == 0 and alone.err == ""
    names = {path.name for path in (tmp_path / "one").iterdir()}
    assert names == {"map.html", "map.json", "map.ply", "top.png", "panoramas"}
    for name in ("a", "b"):
        shutil.copy(STREET, tmp_path / f"{name}.npz")
    both = laserimg("map", tmp_path / "a.npz", tmp_path / "b.npz", "-o", tmp_path / "m")
    assert both.code == 0 and "all scans have the same pose" in both.err
