import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from analytic import boxes_and_floor, ray_grid
from laserimg.boxes import iou
from laserimg.clusters import linked
from laserimg.detectors.candidate import Candidate
from laserimg.detectors.given import GivenCandidates
from laserimg.detectors.regions import RegionDetector
from laserimg.draw import overlay
from laserimg.errors import ConfigError
from laserimg.evidence import Window
from laserimg.formats.coco import Annotation, Category, CocoFile, CocoImage
from laserimg.formats.coco_file import read_coco
from laserimg.geometry.floor import find_floor
from laserimg.matching import TIGHT_LINK, matching_region, shares
from laserimg.measure import metric_box
from laserimg.pipeline import Pipeline, Result
from laserimg.projection import angles_from_directions
from laserimg.readers import open_scans
from laserimg.records import written_findings
from laserimg.rules.checks import Check, continuity, demoted_score, near_miss, size_rules
from laserimg.rules.file import load_rules, parse_rules
from laserimg.rules.model import ClassRules, Interval, Rules
from laserimg.rules.suppression import Claim, suppressed_by
from laserimg.scan import Scan
from laserimg.sources import detectors_for

BIN = ClassRules("bin", ("regions",), {"height": Interval(0.2, 0.6), "width": Interval(0.2, 0.4)})
GRID = ray_grid(np.arange(40.0, -40.0, -0.4), np.arange(5.0, -50.0, -0.4))
TWO_BOXES = boxes_and_floor(
    GRID, [((2, -0.5, -1.5), (2.3, -0.2, -1.1)), ((2, 0.3, -1.5), (2.3, 0.6, -0.6))], noise_m=0.003
)


class Fixed:
    """A detector that proposes the same rectangles always."""

    images = frozenset()

    def __init__(self, *candidates):
        self.candidates = [Candidate(*candidate) for candidate in candidates]

    def __call__(self, evidence):
        return self.candidates


def from_regions(*rules):
    return Pipeline(Rules(rules), (RegionDetector(tuple(rule.label for rule in rules)),))


def test_a_box_of_the_right_size_is_detected_and_one_too_high_is_rejected_with_its_length():
    result = from_regions(BIN)(TWO_BOXES)
    (detection,), (rejected,) = result.detections, result.rejected
    assert detection.size.height == pytest.approx(0.4, abs=0.03)
    assert detection.size.height_above_floor == 0
    assert rejected.reason == f"height {rejected.size.height:.2f} m > 0.60 m"
    assert rejected.size.height == pytest.approx(0.9, abs=0.03)
    names = [check.name for check in detection.checks]
    assert names == ["region_inside", "region_fills", "height", "width", "suppression"]
    assert [check.passed for check in detection.checks] == [True] * 5


def test_every_candidate_carries_all_checks_also_after_one_failed():
    rules = ClassRules("bin", ("regions",), {"height": Interval(5, 6), "width": Interval(7, 8)})
    for finding in from_regions(rules)(TWO_BOXES).rejected:
        assert [c.name for c in finding.checks if not c.passed] == ["height", "width"]
        assert finding.reason.startswith("height")


def test_several_candidates_of_one_object_are_one_detection():
    box = from_regions(BIN)(TWO_BOXES).detections[0].box
    x, y, w, h = box
    fixed = Fixed(
        ("bin", box, 0.5, "cascade", "a"), ("bin", (x - 1, y - 1, w + 2, h + 2), 0.9, "cascade", "a")
    )
    result = Pipeline(Rules((BIN,)), (fixed,))(TWO_BOXES)
    assert [f.score for f in result.detections] == [0.9]
    assert [f.reason for f in result.rejected] == ["same object as bin with score 0.90"]


def test_a_class_from_regions_yields_to_a_detector_of_another_class():
    detected = ClassRules("cask", ("cascade",), {})
    box = from_regions(BIN)(TWO_BOXES).detections[0].box
    fixed = Fixed(("cask", box, 0.1, "cascade", "a"))
    result = Pipeline(Rules((BIN, detected)), (RegionDetector(("bin",)), fixed))(TWO_BOXES)
    assert [f.label for f in result.detections] == ["cask"]


def test_a_candidate_where_nothing_is_has_no_size_and_says_so():
    fixed = Fixed(("bin", (3.0, 3.0, 8.0, 5.0), 0.9, "cascade", "a"))
    (finding,) = Pipeline(Rules((BIN,)), (fixed,))(TWO_BOXES).rejected
    assert finding.size is None
    assert finding.reason == "no object in the candidate"


def test_demotion_lowers_the_score_and_keeps_the_candidate():
    rules = ClassRules("bin", ("regions",), BIN.limits, on_fail="demote")
    result = from_regions(rules)(TWO_BOXES)
    assert len(result.detections) == 2
    high = min(result.detections, key=lambda f: f.score)
    assert high.score == pytest.approx(high.candidate.score / 2)
    assert high.reason == ""


def pixel_box(low, high):
    """Rectangle of an axis-parallel box in the pixels of `GRID`."""
    corners = np.array(np.meshgrid(*zip(low, high, strict=True))).reshape(3, -1).T
    azimuth, elevation = (np.degrees(angle) for angle in angles_from_directions(corners))
    columns, rows = (40 - azimuth) / 0.4 + 0.5, (5 - elevation) / 0.4 + 0.5
    return columns.min(), rows.min(), np.ptp(columns), np.ptp(rows)


def test_a_candidate_that_flows_into_what_is_behind_gets_a_region_grown_in_its_surroundings():
    # 0.065 m before a board: 1/30 of the range (0.073 m) links the two, 1/37 does not.
    low, high = (1.9, -0.15, -1.45), (2.0, 0.15, -1.0)
    scan = boxes_and_floor(GRID, [(low, high), ((2.065, -0.6, -1.5), (2.08, 0.6, -0.9))])
    evidence = Pipeline(Rules((BIN,))).observe(scan)
    box = pixel_box(low, high)
    window = Window.of(box, scan.shape, False)
    assert len(evidence.regions) == 1
    assert shares(evidence.regions[0], window, scan.shape, window.cut(scan.valid))[0] < 0.5
    region = matching_region(evidence, box, 0.9, 0.5)
    assert shares(region, window, scan.shape, window.cut(scan.valid))[0] > 0.9
    assert metric_box(scan, region, evidence.floor).width == pytest.approx(0.3, abs=0.04)


def test_the_walls_of_an_open_basket_and_the_parts_of_a_chair_are_taken_together():
    near, far = ((1.9, -0.15, -1.45), (1.91, 0.15, -1.22)), ((2.15, -0.15, -1.45), (2.16, 0.15, -1.0))
    behind = ((3.5, -0.2, -1.5), (3.6, 0.2, -0.75))  # seen through the candidate, but not of it
    scan = boxes_and_floor(GRID, [near, far, behind])
    evidence = Pipeline(Rules((BIN,))).observe(scan)
    assert len(evidence.regions) == 3
    region = matching_region(evidence, pixel_box(near[0], far[1]), 0.9, 0.6)
    box = metric_box(scan, region, evidence.floor)
    assert box.height == pytest.approx(0.5, abs=0.03)
    assert box.depth == pytest.approx(0.25, abs=0.05)


def one_by_one(evidence, box, region_inside, region_fills):
    """`matching_region` as it is defined: every region made, its pixels counted one by one."""
    scan = evidence.scan
    window, around = (
        Window.of(one, scan.shape, scan.wraps)
        for one in (box, (box[0] - box[2] / 2, box[1] - box[3] / 2, 2 * box[2], 2 * box[3]))
    )
    returns = scan.counts(window.cut(scan.range))
    of_box = set(window.pixels(scan.shape[1]).ravel().tolist())
    cuts = [around.cut(one) for one in (scan.range, scan.directions, evidence.partition.objects)]
    grown, ranges = linked(*cuts, False, TIGHT_LINK)
    pixels = around.pixels(scan.shape[1])
    partition = evidence.partition

    def parts(labels, ranges, pixels):
        found = []
        for number in range(1, labels.max() + 1):
            mine = labels == number
            region = set(pixels[mine].tolist())
            if region & of_box:
                found.append((region, ranges[mine]))
        return sorted(found, key=lambda part: -len(part[0] & of_box))

    def both(region):
        return len(region & of_box) / len(region), len(region & of_box) / max(returns.sum(), 1)

    best, agreement = None, (False, 0.0)
    every = np.arange(scan.range.size).reshape(scan.shape)
    partitions = [parts(partition.labels, partition.range, every), parts(grown, ranges, pixels)]
    tried = [region for one in partitions for region, _ in one]
    for one in partitions:
        inside = [part for part in one if both(part[0])[0] > region_inside]
        if len(inside) > 1:
            main, depths = max(inside, key=lambda part: len(part[0])), [np.median(r) for _, r in inside]
            middle, depth = sorted(main[0])[len(main[0]) // 2], np.median(main[1])
            across, up = (pitch.ravel()[middle] for pitch in evidence.pitch)
            rows = window.rows.stop - window.rows.start
            reach = depth * max(across * len(window.columns), up * rows)
            near = [p for (p, _), d in zip(inside, depths, strict=True) if abs(d - depth) <= reach]
            tried.append(set().union(*near))
    for region in tried:
        inside, fills = both(region)
        if (inside > region_inside, inside * fills) > agreement:
            best, agreement = region, (inside > region_inside, inside * fills)
        if inside > region_inside and fills > region_fills:
            return region
    return best


@pytest.mark.parametrize("seed", range(4))
def test_the_region_of_a_candidate_is_that_of_the_definition(seed):
    things = [((1.9, -0.15, -1.45), (1.91, 0.15, -1.22)), ((2.15, -0.15, -1.45), (2.16, 0.15, -1.0))]
    things += [((2.2, 0.4, -1.5), (2.5, 0.7, -0.6)), ((1.9, -0.8, -1.45), (2.0, -0.5, -1.0))]
    scan = boxes_and_floor(GRID, things, noise_m=0.003)
    evidence = Pipeline(Rules((BIN,))).observe(scan)
    rng, found = np.random.default_rng(seed), []
    for _ in range(40):
        x, y, w, h = pixel_box(*things[rng.integers(4)])
        grow = np.exp(rng.normal(0, 0.3, 2))
        middle = x + w * (0.5 + rng.normal(0, 0.2)), y + h * (0.5 + rng.normal(0, 0.2))
        box = (middle[0] - w * grow[0] / 2, middle[1] - h * grow[1] / 2, w * grow[0], h * grow[1])
        region, expected = matching_region(evidence, box, 0.9, 0.5), one_by_one(evidence, box, 0.9, 0.5)
        assert (None if region is None else set(region.pixels.tolist())) == expected
        found.append(expected is not None)
    assert sum(found) > 20


def test_shares_count_pixels_across_the_seam():
    labels_box = (8.0, 1.0, 4.0, 2.0)
    window = Window.of(labels_box, (5, 10), wraps=True)
    assert window.columns.tolist() == [8, 9, 0, 1]
    pixels = np.array([18, 19, 10, 11, 12])  # row 1: columns 8, 9, 0, 1 in, 2 out
    assert window.holds(pixels, (5, 10)).tolist() == [True, True, True, True, False]
    assert window.pixels(10)[0].tolist() == [18, 19, 10, 11]


def test_limits_of_range_hide_what_is_too_near():
    assert len(from_regions(BIN)(TWO_BOXES).findings) == 2
    hidden = Pipeline(Rules((BIN,)), (RegionDetector(("bin",)),), min_range=5.0)(TWO_BOXES)
    assert hidden.findings == ()


def test_checks_are_strict_for_shares_and_closed_for_limits():
    inside, fills = continuity(0.9, 0.51, BIN)
    assert (inside.passed, fills.passed) == (False, True)
    assert inside.reason == "region_inside 0.90 <= 0.90"
    assert Interval(0.2, 0.6).contains(0.6)


def test_a_limit_that_cannot_be_measured_is_not_checked():
    scan = Scan(TWO_BOXES.range * (TWO_BOXES.points()[..., 2] > -1.45), TWO_BOXES.directions)
    rules = ClassRules("bin", ("regions",), {"height_above_floor": Interval(None, 0.25)})
    assert find_floor(scan) is None
    finding = from_regions(rules)(scan).findings[0]
    assert size_rules(finding.size, rules) == ()


def test_near_misses_fail_by_size_alone_within_twice_the_limits():
    def check(value):
        return Check("height", value, Interval(0.2, 0.6), False, "")

    assert near_miss((check(1.1),))
    assert not near_miss((check(1.3),))
    assert not near_miss((check(0.05),))
    assert not near_miss((check(1.1), Check("region_fills", 0.1, Interval(0.5, None), False, "")))
    assert not near_miss((Check("height", 0.3, Interval(0.2, 0.6), True),))
    assert demoted_score(0.8, (check(1.0), check(1.0))) == pytest.approx(0.2)


DOUBTED = ClassRules("bin", ("cascade",), score=0.3, on_fail="doubt")


@given(st.floats(-9, 9), st.floats(0, 9), st.floats(1, 4))
def test_a_widened_interval_holds_the_interval_whatever_its_signs(low, length, factor):
    narrow = Interval(low, low + length)
    wide = narrow.widened(factor)
    assert wide.low <= narrow.low and wide.high >= narrow.high


@pytest.mark.parametrize("low, reason", [(0.7, ""), (1.2, "box height {:.2f} m < 0.60 m")])
def test_a_box_less_than_half_as_high_as_its_class_is_rejected_whatever_its_score(low, reason):
    """The box is 0.4 m high: too low for both, but far too low for the second alone."""
    box = from_regions(BIN)(TWO_BOXES).detections[0].box
    rules = replace(DOUBTED, limits={"height": Interval(low, 2.0), "width": Interval(0.2, 0.5)})
    (finding,) = Pipeline(Rules((rules,)), (Fixed(("bin", box, 0.9, "cascade", "bin", None, 0.0)),))(
        TWO_BOXES
    ).findings
    checks = {check.name: check for check in finding.checks}
    assert not checks["height"].passed and checks["box_width"].passed
    assert checks["box_height"].value == pytest.approx(0.4, abs=0.05)
    assert checks["box_width"].value == pytest.approx(0.3, abs=0.05)
    assert finding.accepted == (not reason)
    assert finding.reason == reason.format(checks["box_height"].value)


@pytest.mark.parametrize("least, reason", [(0.5, ""), (0.8, "far off: width 0.34 m < 0.40 m")])
def test_what_measures_less_than_half_as_wide_is_rejected_whatever_its_score(least, reason):
    """The box is 0.6 m wide and fits both rules; what stands in it measures 0.34 m."""
    x, y, w, h = from_regions(BIN)(TWO_BOXES).detections[0].box
    rules = replace(DOUBTED, limits={"width": Interval(least, 2.0)}, region_fills=0.1)
    fixed = Fixed(("bin", (x - w / 2, y, 2 * w, h), 0.9, "cascade", "bin", None, 0.0))
    (finding,) = Pipeline(Rules((rules,)), (fixed,))(TWO_BOXES).findings
    checks = {check.name: check for check in finding.checks}
    assert checks["box_width"].passed and not checks["width"].passed
    assert checks["far_width"].limit == Interval(least / 2, None)
    assert (finding.accepted, finding.reason) == (not reason, reason)


@pytest.mark.parametrize("rows, accepted", [(200, False), (60, True)])
def test_a_box_that_the_border_of_the_grid_cuts_may_be_smaller_than_its_class(rows, accepted):
    """A wall 4 m away, a box of 0.1 m by 0.14 m: at the lower border its object may go on."""
    azimuth, elevation = np.radians(np.arange(20.0, -20.0, -0.2)), np.radians(np.arange(6.0, -34.0, -0.2))
    scan = Scan.from_range_image(np.full((rows, 200), 4.0), azimuth, elevation[:rows])
    rules = replace(DOUBTED, limits={"height": Interval(0.6, 2.0)})
    fixed = Fixed(("bin", (100.0, 50.0, 7.0, 10.0), 0.9, "cascade", "bin", None, 0.0))
    (finding,) = Pipeline(Rules((rules,)), (fixed,))(scan).findings
    (check,) = (check for check in finding.checks if check.name == "box_height")
    assert check.value == pytest.approx(10 * np.radians(0.2) * 4, abs=0.01)
    assert check.passed == accepted and check.limit == Interval(None if accepted else 0.3, 4.0)


def test_a_wedge_at_the_end_of_a_fan_is_no_rectangle():
    """From 1 to 7 degrees off the axis of a tilting fan sides are as 1 to 7, from 30 to 36 nearly alike."""
    fan, tilt = np.radians(np.arange(90.0, -91.0, -1.0)), np.radians(np.arange(20.0, -60.0, -1.0))
    level = np.stack([np.cos(fan), np.sin(fan), 0 * fan], axis=-1)
    turn = np.stack([np.cos(tilt), 0 * tilt, np.sin(tilt)], axis=-1)
    directions = (level[None, :, :1] * turn[:, None] + level[None] * [0.0, 1.0, 0.0]).astype(np.float32)
    scan = Scan(np.full(directions.shape[:2], 2.0, np.float32), directions)
    boxes = [(1.0, 20.0, 7.0, 40.0), (30.0, 20.0, 7.0, 40.0)]
    fixed = Fixed(*(("bin", box, 0.9, "cascade", "bin", None, 0.0) for box in boxes))
    wedge, other = Pipeline(Rules((DOUBTED,)), (fixed,))(scan).findings
    ratios = [next(c.value for c in one.checks if c.name == "box_sides") for one in (wedge, other)]
    expected = [np.sin(np.radians(a)) / np.sin(np.radians(b)) for a, b in ((1, 7), (30, 36))]
    assert ratios == pytest.approx(expected, abs=0.03)
    assert not wedge.accepted and "box_sides 0.1" in wedge.reason
    assert not any(check.name == "box_sides" and not check.passed for check in other.checks)


def scored_at(scores, source="cascade", rules=DOUBTED):
    """A second stage's candidates side by side on bare floor, and one of 0.9 that is detected."""
    sure = ("bin", from_regions(BIN)(TWO_BOXES).detections[0].box, 0.9, "regions", "bin", None, 0.0)
    boxes = [(10.0 * place, 100.0, 8.0, 20.0) for place in range(len(scores))]
    others = [("bin", box, s, source, "bin", None, 0.0) for box, s in zip(boxes, scores, strict=True)]
    return Pipeline(Rules((rules,)), (Fixed(sure, *others),))(TWO_BOXES)


@pytest.mark.parametrize("source", ["cascade", "regions"])
@pytest.mark.parametrize(
    "rejected, scores", [("all", [0.29, 0.15, 0.149, 0.01]), ("near", [0.29, 0.15]), ("none", [])]
)
def test_of_what_the_score_rejects_near_keeps_half_the_limit_and_more(rejected, scores, source):
    result = scored_at([0.29, 0.15, 0.149, 0.01], source)
    written = written_findings(result, rejected)
    assert [(f.score, f.accepted) for f in written] == [(0.9, True), *((score, False) for score in scores)]
    assert all(f.reason.startswith("score ") for f in written[1:])


@pytest.mark.parametrize("odds", [0.0, 2.0])
def test_what_no_check_could_bring_near_the_limit_is_measured_only_if_asked_for(odds):
    """Two candidates of one box: with the odds of passing every check 0.1 is 0.45, without them still 0.1."""
    box = from_regions(BIN)(TWO_BOXES).detections[0].box
    found = Fixed(*(("bin", box, score, "regions", "bin", None, odds) for score in (0.02, 0.1, 0.9)))
    pipeline = Pipeline(Rules((replace(DOUBTED, score=0.5),)), (found,))
    some, every = (replace(pipeline, measures_all=asked)(TWO_BOXES).findings for asked in (False, True))
    assert [f.size is not None for f in every] == [True] * 3
    assert [f.size is not None for f in some] == [False, odds > 0, True]
    for brief, whole in zip(some, every, strict=True):
        assert (brief.accepted, brief.is_near) == (whole.accepted, whole.is_near)
        assert brief.checks[-1].limit == whole.checks[-1].limit
        if brief.size is not None or odds == 0:
            assert (brief.score, brief.reason) == (whole.score, whole.reason)
    assert [check.name for check in some[0].checks] == ["score"] and some[0].reason == "score 0.02 < 0.50"


def test_half_the_limit_is_that_of_the_class():
    result = scored_at([0.29, 0.24], rules=replace(DOUBTED, score=0.5))
    assert [f.score for f in written_findings(result, "near") if not f.accepted] == [0.29]


def test_the_picture_shows_of_rejected_candidates_what_near_keeps():
    result = scored_at([0.29, 0.15, 0.149, 0.01])
    near = Result(result.evidence, result.findings[:3])
    assert (overlay(result) == overlay(near)).all()
    assert (overlay(result) != overlay(Result(result.evidence, result.findings[:2]))).any()


def test_a_candidate_outside_the_grid_is_not_in_the_picture():
    outside = Fixed(("bin", (TWO_BOXES.shape[1] + 5.0, 10.0, 8.0, 20.0), 0.9, "given", "given"))
    result = Pipeline(Rules((BIN,)), (outside,))(TWO_BOXES)
    assert [f.is_near for f in result.rejected] == [True] and not TWO_BOXES.wraps
    assert (overlay(result) == overlay(Result(result.evidence, ()))).all()


def test_bare_regions_are_near_by_size_beside_candidates_with_scores():
    far = ClassRules("far", ("regions",), {"height": Interval(5.0, 6.0)})
    fixed = Fixed(("cask", (100.0, 100.0, 8.0, 20.0), 0.2, "cascade", "cask", None, 0.0))
    rules = Rules((BIN, far, replace(DOUBTED, label="cask")))
    result = Pipeline(rules, (RegionDetector(("bin", "far")), fixed))(TWO_BOXES)
    assert {f.label for f in result.rejected} == {"bin", "far", "cask"}
    near = [f for f in written_findings(result, "near") if not f.accepted]
    assert [f.reason[:9] for f in near] == ["height 0.", "score 0.2"]


def claim(label, score, detector, first, last):
    from laserimg.regions import Region

    pixels = np.arange(first, last)
    box = (float(first), 0.0, float(last - first), 1.0)
    return Claim(label, score, detector, Region(pixels, np.ones(len(pixels), np.float32), box))


@pytest.mark.parametrize("name", ["regions", "given", "bin"])
def test_the_score_is_asked_for_whatever_the_name_of_the_file(name):
    box = from_regions(BIN)(TWO_BOXES).detections[0].box
    rules = replace(BIN, sources=("cascade",), score=0.5)
    fixed = Fixed(("bin", box, 0.4, "cascade", name))
    (finding,) = Pipeline(Rules((rules,)), (fixed,))(TWO_BOXES).findings
    assert finding.reason == "score 0.40 < 0.50"


def test_suppression_settles_best_first():
    claims = [claim("a", 0.3, False, 0, 10), claim("a", 0.9, False, 1, 11), claim("b", 0.1, True, 0, 10)]
    verdicts = suppressed_by(claims, 100, False)
    assert [winner for winner, _ in verdicts] == [2, 2, -1]
    assert suppressed_by([claim("a", 1, True, 0, 10), claim("a", 2, True, 8, 20)], 100, False)[0][0] == -1


def test_pipeline_from_folder_uses_the_shipped_rules_and_names_unknown_files(tmp_path):
    assert Pipeline.from_folder().rules.labels == load_rules().labels
    with pytest.raises(ConfigError, match=r"nothing\.toml"):
        Pipeline.from_folder(rules=str(tmp_path / "nothing.toml"))


def test_a_class_without_detector_is_refused(tmp_path):
    rules = tmp_path / "rules.toml"
    rules.write_text('format = 1\n[chair]\nfrom = ["cascade"]\nheight = [0.5, 1.2]\n')
    with pytest.raises(ConfigError, match=r"rules\.toml:2: class 'chair' has no detector"):
        Pipeline.from_folder(rules=str(rules))


def given(path, coco_path, label):
    (scan,) = open_scans(path)
    detector = GivenCandidates(read_coco(coco_path), label)
    return scan, Pipeline(load_rules(), (detector,))(scan)


def test_the_hand_drawn_boxes_of_the_office_as_wastebaskets(data):
    """Paper 2's example: one wastebasket, the drum and the chairs are none."""
    path = data("office_room/room_scan1.pcd")
    scan, result = given(path, data("office_room/room_scan1.coco.json"), "wastebasket")
    (basket,) = result.detections
    assert iou([basket.box], [[231, 129, 12, 12]], scan.shape[1])[0, 0] == 1
    assert basket.size.width == pytest.approx(0.25, abs=0.03)
    assert basket.size.height == pytest.approx(0.36, abs=0.02)
    assert len(result.rejected) == 5
    assert all(finding.reason for finding in result.rejected)
    drum = next(f for f in result.rejected if f.box[0] == 184)
    assert any(c.name == "height" and not c.passed and c.value > 0.7 for c in drum.checks)


@pytest.mark.parametrize("boxes", [True, False])
def test_both_cars_are_found_from_boxes_and_from_regions(data, boxes):
    truth = data("leica_ptx/1.coco.json")
    drawn = [a["bbox"] for a in json.loads(truth.read_text())["annotations"]]
    if boxes:
        _, result = given(data("leica_ptx/1.ptx"), truth, None)
    else:
        (scan,) = open_scans(data("leica_ptx/1.ptx"))
        result = Pipeline(load_rules(), (RegionDetector(("car", "wastebasket")),))(scan)
    assert [f.label for f in result.detections] == ["car", "car"]
    overlap = iou(drawn, [f.region.box for f in result.detections]).max(axis=1)
    assert (overlap >= 0.85).all()
    for finding in result.detections:
        assert 1.6 <= finding.size.breadth <= 2.0
        assert 1.3 <= finding.size.height <= 1.8


def test_the_office_from_regions_gives_the_wastebasket_alone(data):
    (scan,) = open_scans(data("office_room/room_scan1.pcd"))
    rules = load_rules()
    result = Pipeline(rules, detectors_for(rules, []))(scan)
    assert [(f.label, f.box) for f in result.detections] == [("wastebasket", (231, 130, 12, 12))]
    (drum,) = [f for f in result.rejected if (f.label, f.box) == ("wastebasket", (184, 102, 18, 26))]
    assert drum.reason == "height 0.90 m > 0.60 m"


def test_given_boxes_of_another_size_of_grid_are_refused():
    from laserimg.errors import LabelError

    coco = CocoFile(
        (CocoImage(1, "a.npz", 10, 10),), (Category(1, "bin"),), (Annotation(1, 1, 1, (1.0, 1.0, 3.0, 3.0)),)
    )
    with pytest.raises(LabelError, match="10 columns"):
        Pipeline(Rules((BIN,)), (GivenCandidates(coco, only=True),))(TWO_BOXES)


def test_rules_of_a_text():
    rules = parse_rules('format = 1\n[bin]\nfrom = ["regions"]\nheight = [0.2, 0.6]\n')
    assert len(Pipeline(rules, (RegionDetector(("bin",)),))(TWO_BOXES).detections) == 1
