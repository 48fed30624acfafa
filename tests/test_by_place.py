"""The tool that says what the detectors report on every kind of place."""

from types import SimpleNamespace

import numpy as np

import by_place
from analytic import boxes_and_floor, ray_grid
from by_place import Place, Seen, distinct, false_positives, kept_scans, looked_at, place_of, precisions
from laserimg.formats.coco import Annotation, Category, CocoFile, CocoImage, Size
from laserimg.formats.coco_file import write_coco
from laserimg.formats.npz import write_npz
from laserimg.recipes.recipe import Recipe, ScanSet

CHAIR, TABLE = (500, 400, 900), (1400, 700, 740)


def seen(scanner, scores, hits, things=(), label="chair", kind="office", number=0):
    place = Place(kind, scanner, f"{kind}-{number}")
    return Seen(place, label, np.array(scores, float), np.array(hits, bool), tuple(things))


def test_a_thing_that_two_scanners_see_is_one_and_two_alike_in_one_scan_are_two():
    turn, swing = seen("turn", [], [], [CHAIR, CHAIR]), seen("swing", [], [], [CHAIR, TABLE])
    assert distinct([turn, swing]) == 3
    assert distinct([turn, seen("turn", [], [], [CHAIR], number=1)]) == 3
    assert distinct([turn, seen("turn", [], [], [CHAIR], label="stool")]) == 3


def test_false_positives_are_counted_by_scene_and_scanner_above_the_score_of_the_class():
    found = [
        seen("turn", [0.9, 0.35, 0.1], [True, False, False], [CHAIR]),
        seen("turn", [0.8, 0.7], [False, False], number=1),
        seen("fast", [0.35], [False], kind="street"),
    ]
    found += [seen(one.place.scanner, [0.35], [False], (), "stool", one.place.kind) for one in found]
    table = [line.split() for line in false_positives(found, {"chair": 0.3, "stool": 0.4}).splitlines()]
    assert table[1:] == [
        ["office,", "turn", "2", "1.50", "0.00", "1.50"],
        ["street,", "fast", "1", "1.00", "0.00", "1.00"],
    ]


def test_precision_is_that_of_each_scanner_and_of_all():
    found = [
        seen("turn", [0.9, 0.8], [True, False], [CHAIR]),
        seen("swing", [0.9, 0.2], [False, True], [CHAIR]),
        seen("fast", [0.5], [False]),
    ]
    table = [line.split() for line in precisions(found, {"chair": 0.3}).splitlines()][1:]
    assert [row[:5] for row in table] == [
        ["chair", "swing", "1", "1", "1"],
        ["chair", "turn", "1", "1", "1"],
        ["chair", "all", "3", "2", "1"],
    ]
    assert [row[6] for row in table] == ["0.000", "1.000", "0.500"]
    assert float(table[0][5]) == 0.5 and float(table[1][5]) == 1.0


def test_a_scan_on_disk_is_looked_at_by_all_classes(tmp_path, monkeypatch):
    folder = tmp_path / "office-lms200_turn-2000000"
    grid = ray_grid(np.arange(40.0, -40.0, -0.5), np.arange(5.0, -45.0, -0.5))
    path = folder / "office-lms200_turn-2000000-desk-00003.npz"
    folder.mkdir()
    write_npz(boxes_and_floor(grid, [((2.0, -0.15, -1.5), (2.3, 0.15, -1.14))], noise_m=0.0), path)
    size = Size(0.3, 0.3, 0.36, 0.31, 0.3)
    boxes = [Annotation(1, 1, 1, (70.0, 60, 20, 25), area=500.0, size=size, visibility=1.0)]
    boxes += [Annotation(2, 1, 1, (0.0, 60, 20, 25), area=10.0, size=size, visibility=1.0)]
    coco = CocoFile((CocoImage(1, path.name, 160, 100),), (Category(1, "wastebasket"),), tuple(boxes))
    write_coco(folder / "truth" / f"{path.name}.json", coco)
    (scan,) = kept_scans(tmp_path, 0, None)
    assert kept_scans(tmp_path, 1, None) == [] and place_of(scan.path).scene == "office-2000000-desk-00003"
    recipes = tuple(Recipe(label, (ScanSet("office", "lms200_turn", 1),)) for label in ("wastebasket", "car"))
    found = [("wastebasket", (71.0, 60, 20, 25), 0.9), ("wastebasket", (1.0, 60, 20, 25), 0.8)]
    found += [("wastebasket", (120.0, 60, 20, 25), 0.1), ("car", (70.0, 60, 20, 25), 0.7)]
    detections = [SimpleNamespace(label=label, box=box, score=score) for label, box, score in found]
    monkeypatch.setattr(
        by_place, "_pipeline", lambda cascades: lambda scan: SimpleNamespace(detections=detections)
    )
    basket, car = looked_at(tmp_path, recipes, scan)
    assert basket.things == ((310, 300, 360),) and car.things == ()
    # What shows too little is neither hit nor false positive.
    assert (basket.scores.tolist(), basket.hits.tolist()) == ([0.9, 0.1], [True, False])
    assert (car.scores.tolist(), car.hits.tolist()) == ([0.7], [False])
