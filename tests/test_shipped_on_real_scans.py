"""The shipped detectors with the shipped rules on real scans: what is found today stays found."""

import pytest

from real_scans import measure, pipeline_of
from real_sets import SETS

BY_NAME = {one.name: one for one in SETS}


@pytest.mark.parametrize(
    ("name", "found", "false_near"),
    [
        ("office_room", {"wastebasket": 1, "office_chair": 3}, 2),
        ("corridor", {"wastebasket": 0, "office_chair": 0}, 0),
        ("staircase", {"stairs": 1}, 1),
        ("leica_ptx", {"car": 2}, 1),
    ],
)
def test_every_labelled_object_is_found_with_few_false_positives(name, found, false_near, data, tmp_path):
    """`found` objects of each class, and at most so many false positives a scan and class."""
    real = BY_NAME[name]
    data(real.files)
    rows, missed = measure(real, pipeline_of(real, None, None, tmp_path), tmp_path)
    labelled = {row.label: row for row in rows if row.is_labelled}
    assert {label: row.found for label, row in labelled.items()} == found, missed
    assert all(row.labelled == row.found for row in labelled.values())
    assert all(row.false_near <= false_near * row.scans for row in labelled.values())
