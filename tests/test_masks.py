"""Masks as COCO run lengths."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from laserimg.errors import LabelError
from laserimg.formats.masks import mask_of, run_lengths


def slow(mask):
    """Lengths of the runs down one column after the other, the first of zeros."""
    counts, last = [0], False
    for value in (bool(mask[row, column]) for column in range(mask.shape[1]) for row in range(mask.shape[0])):
        if value != last:
            counts.append(0)
        counts[-1] += 1
        last = value
    return counts


@settings(deadline=None)
@given(arrays(bool, st.tuples(st.integers(1, 7), st.integers(1, 7))))
def test_run_lengths_like_the_slow_reference_and_back(mask):
    segmentation = run_lengths(mask)
    assert segmentation == {"size": list(mask.shape), "counts": slow(mask)}
    np.testing.assert_array_equal(mask_of(segmentation), mask)


@pytest.mark.parametrize(
    "wrong",
    [
        {"size": [2, 2], "counts": [1, 2]},
        {"size": [2, 2], "counts": "P1h"},
        {"size": [2], "counts": [2]},
        {"size": [2, 2], "counts": [5, -1]},
        [[0, 0, 1, 1]],
    ],
)
def test_what_is_no_run_lengths_is_refused(wrong):
    with pytest.raises(LabelError, match="run lengths"):
        mask_of(wrong)
