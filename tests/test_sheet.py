"""Pictures of grids: where boxes lie in them, and that what is drawn there is what the box holds."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from laserimg.projection import directions_from_angles
from laserimg.scan import Scan
from laserimg.sheet import GAP_PX, Sheet


def grid(rows, columns, up_deg, wraps=True):
    azimuth = np.radians(180 - 360 * (np.arange(columns) + 0.5) / columns)
    elevation = np.radians(10 - up_deg * np.arange(rows))
    return Scan(np.ones((rows, columns), np.float32), directions_from_angles(azimuth, elevation), wraps=wraps)


@pytest.mark.parametrize(
    "rows, columns, up_deg, strips",
    [(181, 360, 0.5, 1), (201, 720, 0.5, 1), (128, 1024, 0.35, 2), (64, 2000, 0.4, 3), (40, 1800, 0.33, 4)],
)
def test_wide_scans_are_cut_into_strips(rows, columns, up_deg, strips):
    sheet = Sheet.of(grid(rows, columns, up_deg))
    assert sheet.strips == strips
    picture = sheet.picture(np.zeros((rows, columns, 3), np.uint8))
    assert picture.shape[1] >= 1400 and picture.shape[1] / picture.shape[0] < 4
    assert sheet.gap_px == (GAP_PX if strips > 1 else 0)


def test_there_is_room_for_captions_above_each_strip():
    sheet = Sheet.of(grid(64, 2000, 0.4))
    filled = (sheet.picture(np.full((64, 2000, 3), 255, np.uint8))[:, 0, 0] == 255).reshape(sheet.strips, -1)
    assert not filled[:, :GAP_PX].any() and filled[:, GAP_PX:].all()


def test_pixels_are_square():
    sheet = Sheet.of(grid(64, 1800, 0.4))
    assert sheet.up / sheet.across == pytest.approx(2.0, rel=0.01)


@given(
    st.integers(2, 60),
    st.integers(8, 400),
    st.floats(0.1, 1.0),
    st.booleans(),
    st.randoms(use_true_random=False),
)
def test_the_places_of_a_box_show_what_the_box_holds(rows, columns, up_deg, wraps, random):
    """A box painted into the image fills its places in the picture, and nothing else."""
    x, y = random.randrange(columns), random.randrange(rows)
    w = random.randint(1, columns if wraps else columns - x)
    h = random.randint(1, rows - y)
    image = np.zeros((rows, columns, 3), np.uint8)
    image[y : y + h, np.arange(x, x + w) % columns] = 255
    sheet = Sheet.of(grid(rows, columns, up_deg, wraps))
    picture = sheet.picture(image)[..., 0] == 255
    drawn = np.zeros_like(picture)
    for left, top, width, height in sheet.places((x, y, w, h)):
        drawn[round(top) : round(top + height), round(left) : round(left + width)] = True
    # Rounding moves an edge by a pixel: compared is what lies a pixel inside and outside.
    inside = np.zeros_like(picture)
    for left, top, width, height in sheet.places((x, y, w, h)):
        inside[round(top) + 2 : round(top + height) - 2, round(left) + 2 : round(left + width) - 2] = True
    assert picture[inside].all()
    assert (picture & ~drawn).mean() < 0.02
