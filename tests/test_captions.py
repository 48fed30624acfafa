"""Captions in pictures."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from laserimg.captions import caption_places

SIZE = (60, 12)


@given(st.integers(0, 9999), st.integers(1, 6))
def test_captions_lie_in_the_picture_and_hide_none_of_each_other(seed, count):
    rng = np.random.default_rng(seed)
    boxes = np.concatenate([rng.uniform(0, 250, (count, 2)), rng.uniform(5, 40, (count, 2))], axis=1).tolist()
    places = caption_places([tuple(box) for box in boxes], [SIZE] * count, (300, 300))
    painted = np.zeros((300, 300), int)
    for left, top, width, height in places:
        assert (width, height) == SIZE and left >= 0 and top >= 0
        painted[top : top + height, left : left + width] += 1
    assert painted.sum() == count * SIZE[0] * SIZE[1] and painted.max() == 1


def test_a_caption_stands_over_its_box_or_under_it_at_the_upper_edge():
    assert caption_places([(10, 50, 20, 20)], [SIZE], (100, 100)) == [(10, 38, 60, 12)]
    places = caption_places([(10, 5, 20, 20), (12, 4, 20, 30)], [SIZE] * 2, (100, 100))
    assert places == [(10, 0, 60, 12), (12, 34, 60, 12)]


def test_where_there_is_no_room_captions_are_still_written():
    assert len(caption_places([(0, 0, 9, 9)] * 30, [SIZE] * 30, (40, 50))) == 30
