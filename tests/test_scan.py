import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from laserimg.boxes import as_boxes, iou, split_at_seam
from laserimg.errors import LaserImgError, ScanError
from laserimg.projection import angles_from_directions, directions_from_angles
from laserimg.scan import Scan

AZIMUTH = np.radians([3.0, 1.0, -1.0, -3.0])
ELEVATION = np.radians([2.0, 0.0, -2.0])


def make(range_m=None, **fields):
    return Scan.from_range_image(
        np.full((3, 4), 2.0) if range_m is None else range_m, AZIMUTH, ELEVATION, **fields
    )


def test_points_lie_at_their_range_and_angle():
    points = make().points()
    np.testing.assert_allclose(np.linalg.norm(points, axis=-1), 2.0, rtol=1e-6)
    azimuth, elevation = angles_from_directions(points)
    np.testing.assert_allclose(azimuth, np.broadcast_to(AZIMUTH, (3, 4)), atol=1e-6)
    np.testing.assert_allclose(elevation, np.broadcast_to(ELEVATION[:, None], (3, 4)), atol=1e-6)


def test_arrays_are_read_only_and_the_input_is_unchanged():
    given_range = np.full((3, 4), np.nan)
    given_range[0, 0] = 1
    scan = make(given_range)
    assert np.isnan(given_range[1, 1])
    assert scan.range[1, 1] == 0
    with pytest.raises(ValueError, match="read-only"):
        scan.range[0, 0] = 5


def test_valid_leaves_out_what_is_nearer_than_min_range():
    range_m = np.array([[0, 0.3, 1, 9]] * 3, float)
    scan = make(range_m).with_limits(min_range=0.5, max_range=5)
    assert scan.valid[0].tolist() == [False, False, True, False]
    np.testing.assert_allclose(scan.range[0], range_m[0])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"range_m": np.zeros((3, 4))}, "no ray has a return"),
        ({"range_m": np.full((3, 4), -1.0)}, "no return is written as 0"),
        ({"reflectance": np.ones((2, 2))}, r"reflectance must be \(3, 4\), got \(2, 2\)"),
        ({"reflectance": np.full((3, 4), np.nan)}, "reflectance holds values that are not finite"),
        ({"min_range": 5.0, "max_range": 1.0}, "must be below max_range"),
    ],
)
def test_wrong_values_are_refused(change, message):
    with pytest.raises(ScanError, match=message):
        make(**change)


def test_one_row_is_no_grid():
    with pytest.raises(ScanError, match="at least 2 rows"):
        Scan.from_range_image(np.ones((1, 4)), AZIMUTH, ELEVATION[:1])


@given(st.floats(-np.pi + 1e-6, np.pi), st.floats(-1.57, 1.57))
def test_angles_survive_the_round_trip(azimuth, elevation):
    back = angles_from_directions(directions_from_angles([azimuth], [elevation])[0, 0])
    difference = (back[0] - azimuth + np.pi) % (2 * np.pi) - np.pi
    assert abs(difference) * np.cos(elevation) < 1e-6
    assert abs(back[1] - elevation) < 1e-3 if abs(elevation) > 1.5 else abs(back[1] - elevation) < 1e-5


def pixels(box, width):
    x, y, w, h = (int(v) for v in box)
    return {(row, column % width) for row in range(y, y + h) for column in range(x, x + w)}


BOX = st.tuples(st.integers(0, 19), st.integers(0, 9), st.integers(1, 20), st.integers(1, 9))


@given(BOX, BOX)
def test_iou_counts_pixels_modulo_the_width(a, b):
    first, second = pixels(a, 20), pixels(b, 20)
    expected = len(first & second) / len(first | second)
    assert iou([a], [b], wrap_width=20)[0, 0] == pytest.approx(expected)


@given(BOX)
def test_the_parts_of_a_split_box_are_the_box(box):
    parts = split_at_seam(box, 20)
    assert all(x >= 0 and x + w <= 20 for x, _, w, _ in parts)
    assert set().union(*(pixels(part, 20) for part in parts)) == pixels(box, 20)


def test_a_box_without_area_is_refused():
    with pytest.raises(LaserImgError, match="width and height above 0"):
        as_boxes([[0, 0, 0, 5]])


@pytest.mark.parametrize("rows", [1, -1])
@pytest.mark.parametrize("columns", [1, -1])
def test_range_images_in_any_order_are_one_scan(rows, columns):
    azimuth, elevation = np.radians(np.arange(20.0, -20.0, -1.0)), np.radians(np.arange(10.0, -20.0, -1.0))
    range_m = np.random.default_rng(0).uniform(1, 5, (30, 40)).astype(np.float32)
    wanted = Scan.from_range_image(range_m, azimuth, elevation, reflectance=range_m * 2)
    scan = Scan.from_range_image(
        range_m[::rows, ::columns],
        azimuth[::columns],
        elevation[::rows],
        reflectance=2 * range_m[::rows, ::columns],
    )
    assert np.array_equal(scan.range, range_m)
    assert np.array_equal(scan.reflectance, wanted.reflectance)
    assert np.array_equal(scan.directions, wanted.directions)
