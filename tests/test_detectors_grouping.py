"""Grouping of hits, beside the definition written as a loop."""

import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from laserimg.boxes import iou
from laserimg.detectors import grouping
from laserimg.detectors.grouping import SAME_IOU, grouped

WIDTH = 360


def one_by_one(boxes, margins, least, wrap_width):
    """The best hit takes all that overlap it, then the best of those left, ..."""
    overlap = iou(boxes, boxes, wrap_width)
    left = sorted(range(len(boxes)), key=lambda i: -margins[i])
    means, scores = [], []
    while left:
        members = [i for i in left if overlap[left[0], i] > SAME_IOU]
        left = [i for i in left if i not in members]
        if len(members) >= least:
            x = boxes[members, 0]
            if wrap_width:
                x = x + wrap_width * np.round((boxes[members[0], 0] - x) / wrap_width)
            means.append([x.mean(), *boxes[members, 1:].mean(axis=0)])
            scores.append(sum(1 + margins[i] for i in members))
    return np.array(means).reshape(-1, 4), np.array(scores)


@st.composite
def hits(draw, most=60):
    """Boxes in clumps of about one place and size, as a detector's are, and some anywhere."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    count, clumps = draw(st.integers(0, most)), draw(st.integers(1, 6))
    centre = rng.uniform([0, 20], [WIDTH, 150], (clumps, 2))
    side = np.exp(rng.uniform(np.log(8), np.log(90), (clumps, 1))) * rng.uniform(0.6, 1.5, (clumps, 2))
    of = rng.integers(clumps, size=count)
    size = side[of] * 1.2 ** rng.integers(-2, 3, (count, 1))
    corner = centre[of] + rng.normal(0, 0.3, (count, 2)) * side[of] - size / 2
    return np.concatenate([corner, size], axis=1), rng.integers(0, 4, count) / 2


@settings(deadline=None)
@given(hits(), st.integers(1, 3), st.sampled_from([None, WIDTH]), st.booleans())
def test_groups_are_those_of_the_definition(found, least, wrap_width, with_tree):
    boxes, margins = found
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(grouping, "_FEW", 0 if with_tree else 1000)
        means, scores = grouped(boxes, margins, least, wrap_width)
    expected, expected_scores = one_by_one(boxes, margins, least, wrap_width)
    if wrap_width:  # columns of full turns are the same
        means[:, 0] += wrap_width * np.round((expected[:, 0] - means[:, 0]) / wrap_width)
    np.testing.assert_allclose(means, expected, atol=1e-9)
    np.testing.assert_allclose(scores, expected_scores)


@settings(deadline=None)
@given(hits(), st.integers(0, WIDTH - 1))
def test_a_turn_of_the_scanner_turns_the_groups(found, turn):
    boxes, margins = found
    means, scores = grouped(boxes, margins, 1, WIDTH)
    turned = boxes.copy()
    turned[:, 0] = (boxes[:, 0] + turn + WIDTH / 2) % WIDTH - WIDTH / 2
    turned_means, turned_scores = grouped(turned, margins, 1, WIDTH)
    means[:, 0] = (means[:, 0] + turn) % WIDTH
    turned_means[:, 0] %= WIDTH
    np.testing.assert_allclose(turned_scores, scores)
    if len(means):
        assert iou(means, turned_means, WIDTH).diagonal() == pytest.approx(1)


def test_hits_on_both_sides_of_the_seam_are_one_object():
    boxes = np.array([[350, 10, 20, 20], [-9, 10, 20, 20], [352, 10, 20, 20], [40, 10, 20, 20.0]])
    means, scores = grouped(boxes, np.array([0.5, 0, 0, 0]), 2, 360)
    assert means.tolist() == [[351, 10, 20, 20]]
    assert scores.tolist() == [3.5]
    assert grouped(boxes, np.zeros(4), 2)[0].tolist() == [[351, 10, 20, 20]]
    assert len(grouped(boxes, np.zeros(4), 1)[0]) == 3


def test_a_row_of_things_side_by_side_is_not_one():
    """Each overlaps the next, but no chain of overlaps joins the first to the last."""
    boxes = np.array([[x, 0, 20, 20] for x in range(0, 100, 9)], float)
    means, _ = grouped(boxes, np.zeros(len(boxes)), 1)
    assert len(means) >= 4
    assert (means[:, 2] == 20).all()


@pytest.mark.parametrize("spread", ["everywhere", "one place", "large and small"])
def test_very_many_hits_take_a_few_seconds(spread):
    """The full matrix of overlaps would have 2.5 thousand million entries."""
    rng, count = np.random.default_rng(0), 50_000
    if spread == "one place":
        corner, size = rng.normal(300, 2, (count, 2)), np.full((count, 2), 40.0)
    else:
        corner = rng.uniform(0, [1135, 760], (count, 2))
        size = rng.choice(
            [12.0, 200.0] if spread == "large and small" else [20.0, 24.0, 29.0], (count, 1)
        ).repeat(2, 1)
    start = time.process_time()
    means, scores = grouped(np.concatenate([corner, size], axis=1), rng.uniform(0, 2, count), 1, 1135)
    assert time.process_time() - start < 20
    assert len(means) < 10_000
    assert scores.sum() == pytest.approx(2 * count, rel=0.01)


@pytest.mark.parametrize("axis", [0, 1])
def test_a_box_three_times_as_long_still_overlaps_enough(axis):
    boxes = np.array([[0, 0, 10, 10], [0, 0, 10, 10]], float)
    boxes[1, 2 + axis] = 31
    assert len(grouped(boxes, np.array([1.0, 0.0]), 1)[0]) == 1
    boxes[1, 2 + axis] = 35
    assert len(grouped(boxes, np.array([1.0, 0.0]), 1)[0]) == 2


def test_no_hits_no_groups():
    means, scores = grouped(np.empty((0, 4)), np.empty(0), 1, 360)
    assert means.shape == (0, 4)
    assert scores.shape == (0,)
