"""The tool that measures on real scans counts what is labelled; how much is found, it prints."""

import pytest

from real_scans import measure, pipeline_of
from real_sets import SETS

BY_NAME = {one.name: one for one in SETS}
# Apart from the rules that ship, which change with the detectors.
RULES = """format = 1
[wastebasket]
from = ["regions"]
height = [0.20, 0.60]
width = [0.20, 0.40]
points = [30, "-"]
[car]
from = ["regions"]
height = [0.95, 2.10]
breadth = [0.70, 2.20]
length = [1.30, 5.60]
"""


def measured(real, folder):
    (folder / "rules.toml").write_text(RULES)
    return measure(real, pipeline_of(real, "none", folder / "rules.toml", folder), folder)


@pytest.mark.parametrize(
    ("name", "labelled", "scans"),
    [
        ("office_room", {"wastebasket": 1, "office_chair": 3}, 1),
        ("corridor", {"wastebasket": 0, "office_chair": 0}, 2),
        ("kitti", {("car", 50): 1, ("car", 200): 0, ("person", 200): 1}, 3),
    ],
)
def test_labelled_objects_are_counted_and_pictures_written(name, labelled, scans, data, tmp_path):
    real = BY_NAME[name]
    data(real.files)
    rows, missed = measured(real, tmp_path)
    counts = {(row.label, row.min_points): row for row in rows if row.is_labelled}
    for key, number in labelled.items():
        row = counts[key if isinstance(key, tuple) else (key, 1)]
        assert row.labelled == number
        assert row.found <= number
        assert row.scans == scans
    unfound = sum(
        row.labelled - row.found for row in counts.values() if row.min_points == real.min_points[-1]
    )
    assert len(missed) == unfound
    assert len(list(tmp_path.glob("*.png"))) == scans


def test_the_regions_find_the_cars_of_the_terrestrial_scan(data, tmp_path):
    real = BY_NAME["leica_ptx"]
    data(real.files)
    rows, missed = measured(real, tmp_path)
    (cars,) = (row for row in rows if row.is_labelled)
    assert (cars.labelled, cars.found, cars.false_all) == (2, 2, 0)
    assert missed == []


def test_the_crossing_allows_a_wastebasket_of_a_litter_bins_height(data, tmp_path):
    real = BY_NAME["ouster_crossing"]
    (tmp_path / "rules.toml").write_text(RULES)
    pipeline = pipeline_of(real, "none", tmp_path / "rules.toml", tmp_path)
    assert pipeline.rules["wastebasket"].limits["height"].high == 1.2
