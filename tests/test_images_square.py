"""Square pixels: which size they have, and boxes there and back."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from laserimg.boxes import iou
from laserimg.errors import LaserImgError
from laserimg.images import SquareGrid
from laserimg.scan import Scan
from objects import ball
from scenes import Scene, panorama, scan_of


def scan_with_pitch(across_deg: float, up_deg: float) -> Scan:
    """20 x 30 rays of a fan that turns about the y axis: nearly the same pitch everywhere."""
    side = np.radians(across_deg * (np.arange(30)[::-1] - 14.5))
    tilt = np.radians(up_deg * (np.arange(20)[::-1] - 9.5))[:, None]
    parts = np.broadcast_arrays(np.cos(tilt) * np.cos(side), np.sin(side), np.sin(tilt) * np.cos(side))
    return Scan(np.ones((20, 30), np.float32), np.stack(parts, axis=-1).astype(np.float32))


@pytest.mark.parametrize(
    ("across", "up", "shape"),
    [
        (1.0, 1.0, (20, 30)),
        (0.95, 0.5, (20, 57)),  # the finer pitch, nearly twice the pixels
        (0.5, 0.95, (38, 30)),
        (1.0, 0.25, (5, 30)),  # four times would be too many: the coarser
        (0.2, 1.0, (20, 6)),
    ],
)
def test_the_finer_pitch_unless_it_doubles_more_than_the_pixels(across, up, shape):
    grid = SquareGrid.of(scan_with_pitch(across, up))
    assert grid.shape == pytest.approx(shape, abs=1)


def test_pixels_are_square_after_resampling():
    scan, _ = scan_of(Scene((ball(0.5).at(3, 0, -0.25),), (0, 0, 0), 9), panorama(90, 240)[30:60])
    grid = SquareGrid.of(scan)
    ball_pixels = grid.resample((scan.range > 0).astype(np.uint8) * 255) > 127
    rows, columns = np.nonzero(ball_pixels)
    assert np.ptp(rows) == pytest.approx(np.ptp(columns), abs=1)


boxes = st.lists(
    st.tuples(st.floats(0, 99), st.floats(0, 40), st.floats(0.5, 90), st.floats(0.5, 40)),
    min_size=1,
    max_size=5,
)


@given(
    boxes=boxes,
    shape=st.tuples(st.integers(30, 300), st.integers(60, 700)),
    pad=st.integers(0, 50),
    wraps=st.booleans(),
)
def test_boxes_go_there_and_back(boxes, shape, pad, wraps):
    grid = SquareGrid((50, 100), shape, pad, wraps)
    there = grid.from_scan(boxes)
    back = grid.to_scan(there)
    np.testing.assert_allclose(back, boxes, rtol=1e-9, atol=1e-9)
    up, across = grid.scale
    np.testing.assert_allclose(
        there[:, 2] * there[:, 3], np.prod(np.array(boxes)[:, 2:], axis=1) * up * across
    )


@given(
    x=st.floats(0, 650), y=st.floats(0, 100), w=st.floats(1, 140), h=st.floats(1, 50), scale=st.floats(0.5, 2)
)
def test_boxes_from_the_padded_image_begin_inside_the_scan(x, y, w, h, scale):
    """What a detector finds in the pad is the object at the left end."""
    width = round(300 * scale)
    grid = SquareGrid((200, 300), (round(200 * scale), width), pad=150, wraps=True)
    found = np.array([[x % (width + 10), y, w, h]])
    back = grid.to_scan(found)
    assert 0 <= back[0, 0] < 300
    again = grid.from_scan(back)
    assert iou(again, found, wrap_width=width)[0, 0] == pytest.approx(1, abs=1e-6)


def test_an_object_across_the_seam_is_whole_in_the_pad():
    scan, truth = scan_of(Scene((ball(0.8).at(-3, 0, -0.4),), (0, 0, 0), 9), panorama(90, 180)[30:60])
    grid = SquareGrid.of(scan, enlarge=2.0, pad=60)
    seen = grid.resample(((truth.thing == 0) * 255).astype(np.uint8)) > 127
    assert seen.shape == (grid.shape[0], grid.shape[1] + 60)
    columns = np.nonzero(seen.any(axis=0))[0]
    columns = columns[columns > grid.shape[1] // 2]
    assert np.diff(columns).max() == 1
    rows = np.nonzero(seen.any(axis=1))[0]
    box = [columns[0], rows[0], np.ptp(columns) + 1, np.ptp(rows) + 1]
    back = grid.to_scan([box])[0]
    hit = np.nonzero((truth.thing == 0).any(axis=0))[0]
    left = hit[hit > 90].min()
    assert back[0] == pytest.approx(left, abs=1)
    assert back[0] + back[2] > 180
    assert back[2] == pytest.approx(len(hit), abs=1.5)


def test_enlarging_keeps_what_is_where():
    scan = scan_with_pitch(1.0, 2.0)
    image = np.zeros(scan.shape, np.uint8)
    image[5:9, 10:16] = 200
    grid = SquareGrid.of(scan, enlarge=2.5)
    rows, columns = np.nonzero(grid.resample(image) > 100)
    box = [columns.min(), rows.min(), np.ptp(columns) + 1, np.ptp(rows) + 1]
    np.testing.assert_allclose(grid.to_scan([box])[0], [10, 5, 6, 4], atol=0.5)


def test_colour_images_and_open_scans():
    scan = scan_with_pitch(1.0, 2.0)
    grid = SquareGrid.of(scan, pad=9)
    assert grid.pad == 0
    assert grid.resample(np.zeros((20, 30, 3), np.uint8)).shape == (*grid.shape, 3)


def test_wrong_use_says_what_is_wrong():
    scan = scan_with_pitch(1.0, 2.0)
    with pytest.raises(LaserImgError, match=r"enlarge must be above 0"):
        SquareGrid.of(scan, enlarge=0.0)
    with pytest.raises(LaserImgError, match=r"image must be \(20, 30\), got \(4, 4\)"):
        SquareGrid.of(scan).resample(np.zeros((4, 4), np.uint8))
