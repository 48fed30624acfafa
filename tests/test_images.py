"""The images of a scan: what their gray values mean, and what must not change them."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from laserimg.errors import ConfigError, ScanError
from laserimg.images import IMAGE_KINDS, make_image, make_images
from laserimg.images.relative_depth import relative_depth
from laserimg.images.stretch import stretch
from laserimg.images.view_frame import upright_frame, view_frame
from laserimg.normals import normals, normals_by_rows
from laserimg.scan import Scan
from objects import chair, hall, wastebasket
from scenes import Scene, panorama, room, scan_of, street


@pytest.fixture(scope="module")
def small_room():
    return scan_of(room(), panorama(90, 158), noise=0.005)[0]


@pytest.fixture(scope="module")
def small_street():
    return scan_of(street(), panorama(90, 158), noise=0.005)[0]


def turned(scan: Scan, columns: int) -> Scan:
    """The same scan begun at another column."""
    return replace(
        scan,
        range=np.roll(scan.range, columns, axis=1),
        directions=np.roll(scan.directions, columns, axis=1),
        reflectance=np.roll(scan.reflectance, columns, axis=1),
    )


def test_kinds_shapes_and_black_where_nothing_is_valid(small_street):
    scan = small_street.with_limits(2.0, 30.0)
    images = make_images(scan)
    assert tuple(images) == IMAGE_KINDS
    for kind, image in images.items():
        assert image.dtype == np.uint8
        assert image.shape == (
            scan.shape if kind in ("range", "reflectance", "depth_relative") else (*scan.shape, 3)
        )
        assert (image[~scan.valid] == 0).all()
        assert (image[scan.valid].reshape(scan.valid.sum(), -1).max(axis=1) > 0).all()


def test_normals_are_red_green_blue(small_room):
    image, found = make_image(small_room, "normals").astype(float), normals(small_room)
    np.testing.assert_allclose(image, (found + 1) * 127.5, atol=0.51)
    np.testing.assert_allclose(make_image(small_room, "normals_abs"), np.abs(found) * 255, atol=0.51)
    floor = image[-10:].reshape(-1, 3)
    np.testing.assert_allclose(np.median(floor, axis=0), [127.5, 127.5, 255], atol=2)


def test_one_plane_is_that_plane_of_the_image(small_room):
    images = make_images(small_room, ["normals_view", "normals_view.r", "normals.g", "normals.b", "normals"])
    np.testing.assert_array_equal(images["normals_view.r"], images["normals_view"][..., 0])
    np.testing.assert_array_equal(images["normals.g"], images["normals"][..., 1])
    np.testing.assert_array_equal(images["normals.b"], images["normals"][..., 2])


def test_normals_are_computed_once(small_room, monkeypatch):
    calls = []
    monkeypatch.setattr(
        "laserimg.images.kinds.normals_by_rows", lambda scan: calls.append(1) or normals_by_rows(scan)
    )
    make_images(small_room)
    assert len(calls) == 1
    make_images(small_room, ["range", "depth_relative"])
    assert len(calls) == 1


@pytest.mark.parametrize(
    ("name", "nearest"),
    [
        ("normal", "normals"),
        ("reflectence", "reflectance"),
        ("normals.x", "normals"),
        ("depth", "depth_relative"),
    ],
)
def test_an_unknown_kind_names_the_nearest(small_room, name, nearest):
    with pytest.raises(ConfigError, match=f"'{name}'; nearest: {nearest}"):
        make_image(small_room, name)


def test_a_kind_like_nothing_names_all(small_room):
    with pytest.raises(ConfigError, match="known: range, reflectance, normals"):
        make_image(small_room, "qqq")


def test_reflectance_needs_reflectance(small_room):
    with pytest.raises(ScanError, match="no reflectance"):
        make_image(replace(small_room, reflectance=None), "reflectance")


def test_turning_the_scanner_by_a_quarter_turns_the_image(small_room):
    """The world stays, the scanner looks 90 degrees to the left: n_x and n_y change places."""
    quarter = Rotation.from_euler("z", -90, degrees=True).as_matrix()
    seen = replace(small_room, directions=(small_room.directions @ quarter.T).astype(np.float32))
    before, after = (make_image(scan, "normals").astype(int) for scan in (small_room, seen))
    close = np.abs(after - np.stack([before[..., 1], 255 - before[..., 0], before[..., 2]], axis=-1)) <= 2
    assert close.all(axis=-1).mean() > 0.99


@settings(max_examples=10, deadline=None)
@given(columns=st.integers(1, 157))
def test_any_first_column_gives_the_same_image(small_room, columns):
    """An object looks the same wherever it stands in a panorama."""
    for kind in ("range", "reflectance", "normals_view", "depth_relative"):
        before, after = make_image(small_room, kind), make_image(turned(small_room, columns), kind)
        off = np.abs(np.roll(after, -columns, axis=1).astype(int) - before)
        assert (off > 3).mean() < 0.01, kind


@settings(max_examples=10, deadline=None)
@given(azimuth=st.floats(0, 360), height=st.floats(-0.3, 0.6))
def test_an_object_has_the_same_view_normals_at_any_azimuth(azimuth, height):
    """Cast anew at another azimuth and with a turned scanner: the same picture."""
    rays = panorama(60, 360)[15:45]
    pictures = []
    for heading in (0.0, azimuth):
        side = np.radians(heading)
        things = [
            thing.at(2.5 * np.cos(side + shift), 2.5 * np.sin(side + shift), yaw=heading)
            for thing, shift in ((wastebasket(open_top=False), 0.0), (chair(), 0.5))
        ]
        scene = Scene((*things, hall(30, 30, 6)), (0, 0, 1 + height), 60)
        scan, truth = scan_of(scene, rays, noise=0.0, yaw_deg=heading)
        pictures.append(
            np.where((truth.thing < 2)[..., None], make_image(scan, "normals_view"), 0).astype(int)
        )
    assert np.abs(pictures[0] - pictures[1]).max() <= 6


@given(st.integers(0, 2**32 - 1))
def test_view_frame_keeps_lengths_and_follows_up(seed):
    rng = np.random.default_rng(seed)
    scan = Scan(np.ones((6, 7), np.float32), unit(rng, (6, 7)), world_from_scan=pose_from(rng))
    vectors = unit(rng, (6, 7))
    turned_vectors = view_frame(scan.directions, vectors, scan.up)
    np.testing.assert_allclose(np.linalg.norm(turned_vectors, axis=-1), 1, atol=1e-5)
    np.testing.assert_allclose(turned_vectors[..., 2], vectors @ scan.up, atol=1e-5)
    facing = view_frame(scan.directions, -scan.directions, scan.up)
    assert (facing[..., 0] >= 0).all()
    np.testing.assert_allclose(facing[..., 1], 0, atol=1e-4)


def unit(rng: np.random.Generator, shape: tuple[int, int]) -> np.ndarray:
    vectors = rng.normal(size=(*shape, 3))
    return (vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)).astype(np.float32)


def pose_from(rng: np.random.Generator) -> np.ndarray:
    pose = np.eye(4)
    pose[:3, :3] = Rotation.random(random_state=int(rng.integers(1 << 30))).as_matrix()
    return pose


def test_right_is_right_as_seen_from_the_scanner():
    scan = Scan.from_range_image(np.ones((2, 2)), np.radians([1, -1]), np.radians([1, -1]))
    to_the_right = np.broadcast_to(np.float32([0, -1, 0]), (2, 2, 3))
    assert view_frame(scan.directions, to_the_right, scan.up)[0, 0, 1] > 0.99


@pytest.mark.parametrize("up", [[0, 0, 1], [0, 0, -1], [1, 0, 0], [0, -0.6, 0.8]])
def test_the_upright_frame_is_a_rotation_that_lifts_up_to_z(up):
    frame = upright_frame(np.array(up, float))
    np.testing.assert_allclose(frame @ frame.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(frame) == pytest.approx(1)
    np.testing.assert_allclose(frame @ up, [0, 0, 1], atol=1e-12)


def test_stretch_is_robust_against_outliers_and_starts_at_one():
    values = np.linspace(1, 5, 1000, dtype=np.float32).reshape(20, 50)
    values[3, 3] = 1e6
    gray = stretch(values, np.ones((20, 50), bool))
    assert gray[3, 3] == 255
    assert gray.min() == 1
    assert abs(int(gray[10, 0]) - 128) < 6
    assert (np.diff(gray.ravel()[200:]) >= 0).all()


@pytest.mark.parametrize("value", [0.0, 3.0, -2.0, 1e9])
def test_a_constant_image_is_middle_gray(value):
    gray = stretch(np.full((4, 5), value, np.float32), np.ones((4, 5), bool))
    assert (gray == 128).all()


def test_without_valid_pixels_the_images_are_black(small_room):
    nothing = small_room.with_limits(50.0, 60.0)
    for kind, image in make_images(nothing).items():
        assert (image == 0).all(), kind


@given(low=st.floats(-1e4, 1e4), span=st.floats(1e-3, 1e5), share=st.floats(0.01, 1), seed=st.integers(0, 99))
def test_gray_values_follow_the_values(low, span, share, seed):
    rng = np.random.default_rng(seed)
    values = (low + span * rng.random((11, 13))).astype(np.float32)
    valid = rng.random((11, 13)) < share
    gray = stretch(values, valid)
    assert (gray[valid] >= 1).all()
    assert (gray[~valid] == 0).all()
    assert (np.diff(gray[valid][np.argsort(values[valid])].astype(int)) >= 0).all()


def slow_relative_depth(scan: Scan) -> np.ndarray:
    """The definition, pixel by pixel."""
    difference = np.zeros(scan.shape)
    v, (height, width) = scan.directions.astype(float), scan.shape
    for i, j in np.argwhere(scan.valid):
        up = np.linalg.norm(v[min(i + 1, height - 1), j] - v[max(i - 1, 0), j]) / 2
        across = np.linalg.norm(v[i, (j + 1) % width] - v[i, j - 1]) / 2
        half = [round(0.45 / (scan.range[i, j] * max(pitch, 1e-6))) for pitch in (up, across)]
        rows = slice(max(i - half[0], 0), i + half[0] + 1)
        side = min(half[1], (width - 1) // 2)
        columns = np.arange(j - side, j + side + 1) % width
        around = scan.range[rows][:, columns][scan.valid[rows][:, columns]]
        difference[i, j] = scan.range[i, j] - around.mean()
    return difference


@pytest.mark.parametrize(("rows", "limit"), [(60, 0.01), (250, 0.05)])
def test_relative_depth_is_the_range_less_its_mean_in_the_surroundings(rows, limit):
    """Coarse scans have it exactly; fine ones between cells, off by more only beside depth jumps."""
    scan, _ = scan_of(room(), panorama(rows, rows * 3 // 2)[rows // 4 : -rows // 4], noise=0.0)
    limited = [np.clip(d, -0.45, 0.45) for d in (relative_depth(scan, scan.valid), slow_relative_depth(scan))]
    off = np.abs(limited[0] - limited[1])
    assert np.percentile(off, 90) < limit


def test_relative_depth_counts_valid_returns_only():
    range_m = np.full((21, 21), 3.0)
    range_m[::2] = 9.0
    angles = np.radians(np.arange(10, -11, -1))
    scan = Scan.from_range_image(range_m, angles, angles, max_range=5.0)
    depth = relative_depth(scan, scan.valid)
    assert np.abs(depth).max() < 1e-5


def test_what_stands_out_is_dark_in_relative_depth():
    scene = Scene((wastebasket(open_top=False).at(2.5, 0), hall(8, 6, 3)), (0, 0, 1), 20)
    scan, truth = scan_of(scene, panorama(180, 360))
    depth = make_image(scan, "depth_relative").astype(int)
    basket = truth.thing == 0
    ring = cv2.dilate(basket.view(np.uint8), np.ones((9, 9))).view(bool) & ~basket
    assert np.median(depth[basket]) < np.median(depth[ring]) - 40


def test_images_do_not_depend_on_the_threads():
    scan, _ = scan_of(room(), panorama(380, 568))
    before = cv2.getNumThreads()
    try:
        cv2.setNumThreads(1)
        alone = make_images(scan)
        cv2.setNumThreads(3)
        for kind, image in make_images(scan).items():
            np.testing.assert_array_equal(image, alone[kind])
    finally:
        cv2.setNumThreads(before)
