import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from laserimg.evaluate import Counts, Curve, confusion, evaluate
from laserimg.evaluate.matching import match
from laserimg.formats.coco import Annotation, Category, CocoFile, CocoImage, Position


def coco(boxes, labels=("bin", "chair"), images=1):
    """`boxes`: (image, label, box, changes)."""
    return CocoFile(
        tuple(CocoImage(n, f"{n}.npz", 100, 50) for n in range(images)),
        tuple(Category(n, label) for n, label in enumerate(labels)),
        tuple(
            Annotation(n, image, labels.index(label), tuple(map(float, box)), **changes)
            for n, (image, label, box, changes) in enumerate(boxes)
        ),
    )


def at(range_m):
    return Position(range_m, 0, 0, range_m, 0, 0)


TRUTH = coco([(0, "bin", (10, 10, 10, 10), {}), (1, "bin", (50, 10, 10, 10), {})], images=2)


def test_perfect_detections_score_one():
    found = coco([(n, "bin", (x, 10, 10, 10), {"score": 0.5}) for n, x in ((0, 10), (1, 50))], images=2)
    result = evaluate(found, TRUTH)
    for iou in (0.3, 0.5, 0.75):
        curve = result.curves["bin", iou, None]
        assert curve.average_precision == 1
        assert curve.counts == Counts(2, 0, 0)
    assert np.isnan(result.curves["chair", 0.5, None].average_precision)
    assert result.mean_average_precision(0.5) == 1


def test_the_overlap_decides_what_a_hit_is():
    found = coco([(0, "bin", (14, 10, 10, 10), {"score": 1.0})], images=2)  # IoU 6 / 14
    result = evaluate(found, TRUTH)
    assert result.curves["bin", 0.3, None].counts == Counts(1, 0, 1)
    assert result.curves["bin", 0.5, None].counts == Counts(0, 1, 2)


def test_average_precision_by_hand():
    # Scores .9 hit, .8 false, .7 hit of 2 objects: 1/2 x 1 + 1/2 x 2/3.
    boxes = [(0, (10, 10, 10, 10), 0.9), (0, (80, 10, 10, 10), 0.8), (1, (50, 10, 10, 10), 0.7)]
    found = coco([(n, "bin", box, {"score": score}) for n, box, score in boxes], images=2)
    curve = evaluate(found, TRUTH).curves["bin", 0.5, None]
    assert curve.average_precision == pytest.approx(1 / 2 + 1 / 3)
    assert curve.false_positives_per_image.tolist() == [0, 0.5, 0.5]
    assert (curve.recall_at(0), curve.recall_at(0.5)) == (0.5, 1)


def test_an_object_is_found_once():
    boxes = [((10, 10, 10, 10), 0.6), ((11, 10, 10, 10), 0.9)]
    found = coco([(0, "bin", box, {"score": score}) for box, score in boxes], images=2)
    assert evaluate(found, TRUTH).curves["bin", 0.3, None].counts == Counts(1, 1, 1)


def test_boxes_to_be_ignored_are_neither_hits_nor_misses():
    truth = coco([(0, "bin", (10, 10, 40, 20), {"iscrowd": 1}), (0, "bin", (80, 10, 10, 10), {})])
    found = coco([(0, "bin", (x, 12, 10, 10), {"score": 0.9}) for x in (12, 30, 80)])
    assert evaluate(found, truth).curves["bin", 0.5, None].counts == Counts(1, 0, 0)


def test_rejected_candidates_do_not_count_unless_asked():
    boxes = [(0, "bin", (10, 10, 10, 10), {"score": 0.9, "accepted": False})]
    found = coco(boxes, images=2)
    assert evaluate(found, TRUTH).curves["bin", 0.5, None].counts == Counts(0, 0, 2)
    every = evaluate(found, TRUTH, accept=lambda _: True)
    assert every.curves["bin", 0.5, None].counts == Counts(1, 0, 1)


def test_range_bands_leave_out_what_is_beyond():
    truth = coco(
        [(0, "bin", (10, 10, 10, 10), {"position": at(3)}), (0, "bin", (50, 10, 10, 10), {"position": at(7)})]
    )
    found = coco(
        [
            (0, "bin", (10, 10, 10, 10), {"score": 0.9, "position": at(3.1)}),
            (0, "bin", (80, 10, 10, 10), {"score": 0.8, "position": at(8)}),
        ]
    )
    curves = evaluate(found, truth).curves
    assert curves["bin", 0.5, (0.0, 5.0)].counts == Counts(1, 0, 0)
    assert curves["bin", 0.5, (5.0, 10.0)].counts == Counts(0, 1, 1)
    assert curves["bin", 0.5, (10.0, 20.0)].counts == Counts(0, 0, 0)


def test_boxes_across_the_seam_match():
    truth = coco([(0, "bin", (95, 10, 10, 10), {})])
    found = coco([(0, "bin", (0, 10, 5, 10), {"score": 0.9})])
    assert evaluate(found, truth).curves["bin", 0.5, None].counts == Counts(1, 0, 0)


def test_scans_without_detections_file_are_named_and_left_out():
    found = coco([(0, "bin", (10, 10, 10, 10), {"score": 0.9})], images=1)
    truth = coco([(0, "bin", (10, 10, 10, 10), {}), (1, "bin", (1, 1, 5, 5), {})], images=2)
    result = evaluate(found, truth)
    assert result.missing == ("1.npz",)
    assert result.curves["bin", 0.5, None].counts == Counts(1, 0, 0)


def test_confusion_counts_classes_and_nothing():
    truth = coco([(0, "bin", (10, 10, 10, 10), {}), (0, "chair", (50, 10, 10, 10), {})])
    found = coco(
        [(0, "chair", (10, 10, 10, 10), {"score": 0.9}), (0, "bin", (80, 30, 10, 10), {"score": 0.5})]
    )
    table = confusion(found, truth)
    assert table.labels == ("bin", "chair", "nothing")
    assert table.counts.tolist() == [[0, 1, 0], [0, 0, 1], [1, 0, 0]]


def slow_average_precision(scores, hits, objects):
    """Best precision at a recall of at least r, added over every step of recall."""
    total = 0.0
    for step in range(1, objects + 1):
        best = 0.0
        for limit in set(scores):
            chosen = [hit for score, hit in zip(scores, hits, strict=True) if score >= limit]
            if sum(chosen) >= step:
                best = max(best, sum(chosen) / len(chosen))
        total += best / objects
    return total


@given(st.lists(st.tuples(st.integers(0, 5), st.booleans()), max_size=12), st.integers(0, 3))
def test_average_precision_is_that_of_the_definition(entries, more):
    scores = np.array([score for score, _ in entries], float)
    hits = np.array([hit for _, hit in entries], bool)
    objects = int(hits.sum()) + more
    curve = Curve.of(scores, hits, objects, 1)
    if objects == 0:
        assert np.isnan(curve.average_precision)
    else:
        expected = slow_average_precision(scores.tolist(), hits.tolist(), objects)
        assert curve.average_precision == pytest.approx(expected)


BOX = st.tuples(st.integers(0, 30), st.integers(0, 5), st.integers(1, 9), st.integers(1, 9))


@given(st.lists(BOX, max_size=6), st.lists(BOX, max_size=6))
def test_no_object_is_matched_twice_and_every_match_overlaps(found, wanted):
    from laserimg.boxes import iou

    detected, truth = np.array(found, float).reshape(-1, 4), np.array(wanted, float).reshape(-1, 4)
    scores = np.arange(len(detected), dtype=float)
    owner = match(detected, scores, truth, np.zeros(len(truth), bool), 0.4).truth
    taken = owner[owner >= 0]
    assert len(set(taken.tolist())) == len(taken)
    for index, other in enumerate(owner):
        if other >= 0:
            assert iou(detected[index : index + 1], truth[other : other + 1])[0, 0] >= 0.4


def test_the_command_prints_scores_and_writes_a_page(tmp_path):
    import json

    from typer.testing import CliRunner

    from laserimg.cli.app import app
    from laserimg.formats.coco_file import write_coco

    found = coco([(0, "bin", (10, 10, 10, 10), {"score": 0.9})], images=2)
    write_coco(tmp_path / "found.json", found)
    write_coco(tmp_path / "truth.json", TRUTH)
    arguments = ["evaluate", str(tmp_path / "found.json"), str(tmp_path / "truth.json")]
    printed = CliRunner().invoke(app, [*arguments, "--json"])
    assert printed.exit_code == 0
    curves = {(c["class"], c["iou"]): c for c in json.loads(printed.stdout)["curves"] if not c["band_m"]}
    assert curves["bin", 0.5]["average_precision"] == 0.5
    shown = CliRunner().invoke(app, [*arguments, "-o", str(tmp_path / "page.html")])
    assert "0.500" in shown.stdout
    page = (tmp_path / "page.html").read_text()
    assert page.count("<polyline") == 4
    assert "http" not in page


def test_what_is_nearly_hidden_or_was_rejected_need_not_be_found():
    boxes = [(0.0, 0.0, 10.0, 10.0), (20.0, 0.0, 10.0, 10.0), (40.0, 0.0, 10.0, 10.0)]
    images, categories = (CocoImage(1, "a.npz", 100, 50),), (Category(1, "bin"),)
    found = CocoFile(images, categories, (Annotation(1, 1, 1, boxes[0], score=0.9),))
    wanted = (
        Annotation(1, 1, 1, boxes[0]),
        Annotation(2, 1, 1, boxes[1], visibility=0.2),
        Annotation(3, 1, 1, boxes[2], accepted=False),
    )
    truth = CocoFile(images, categories, wanted)
    seen = evaluate(found, truth, asked=lambda entry: entry.visibility is None or entry.visibility > 0.5)
    assert seen.curves["bin", 0.5, None].objects == 1
    assert evaluate(found, truth).curves["bin", 0.5, None].objects == 2
    counts = confusion(found, truth, asked=lambda entry: entry.visibility is None).counts
    assert counts.tolist() == [[1, 0], [0, 0]]
