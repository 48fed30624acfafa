"""Crops, descriptions, the second stage and its file, and what it makes of what is proposed."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from sklearn.ensemble import HistGradientBoostingClassifier

from analytic import boxes_and_floor, ray_grid
from laserimg.boxes import inside_grid
from laserimg.descriptors.honv import honv
from laserimg.detectors.boosted_trees import BoostedTrees
from laserimg.detectors.crops import resampled
from laserimg.detectors.description import IMAGES, LAYOUT, VECTOR_LENGTH, Describer, plain_part
from laserimg.detectors.look import Look
from laserimg.detectors.lookup import cell_means, honv_of_colours
from laserimg.detectors.metric_cells import METRIC_NUMBERS
from laserimg.detectors.pyramid import Pyramid
from laserimg.detectors.ranked import RankedDetector
from laserimg.detectors.second_stage import (
    MOST,
    SAME_IOU,
    SecondStage,
    distinct,
    load_second_stage,
    save_second_stage,
    seen,
)
from laserimg.detectors.shipped import load_model
from laserimg.errors import ModelError
from laserimg.evidence import Evidence
from laserimg.formats.card import Card, card_path, file_sha256, write_card
from laserimg.images import make_images
from laserimg.pipeline import Pipeline
from laserimg.recipes.boosting import DEPTH, STEP, fit_trees
from laserimg.rules.file import parse_rules
from laserimg.sources import detectors_for

CARD = Card("bin", "svm", "normals_view", (32, 32), "0" * 64)
GRID = ray_grid(np.arange(40.0, -40.0, -0.5), np.arange(5.0, -45.0, -0.5))
TWO_BOXES = boxes_and_floor(GRID, [((2, -0.5, -1.5), (2.3, -0.2, -1.1)), ((2, 0.4, -1.5), (2.3, 0.7, -0.6))])


# Numbers that the judge sees.
SEEN = plain_part(np.empty((0, VECTOR_LENGTH))).shape[1] + METRIC_NUMBERS


def evidence_of(scan) -> Evidence:
    seen = Pipeline(parse_rules("format = 1\n")).observe(scan)
    return replace(seen, images=make_images(scan, IMAGES))


def look(length, **known) -> Look:
    plain = {
        "weights": np.zeros(length, np.float32),
        "bias": 0.0,
        "moves": np.zeros((4, length), np.float32),
        "still": np.zeros(4, np.float32),
    }
    return Look(**(plain | known))


def random_trees(rng, depth, numbers) -> BoostedTrees:
    nodes = 5, 2**depth - 1
    return BoostedTrees(
        rng.integers(0, numbers, nodes).astype(np.int32),
        rng.integers(-2, 3, nodes).astype(np.float32),
        rng.normal(size=(5, 2**depth)).astype(np.float32),
    )


def stage(*looks, **known) -> SecondStage:
    """A second stage whose score is that of the mean margin, with trees that say nothing."""
    silent = BoostedTrees(
        np.zeros((1, 1), np.int32), np.zeros((1, 1), np.float32), np.zeros((1, 2), np.float32)
    )
    return SecondStage("bin", CARD, looks, **({"judge": silent, "lean": 1.0} | known))


def test_a_crop_of_its_own_size_is_the_part_of_the_image():
    image = np.random.default_rng(0).integers(0, 255, (40, 60), np.uint8)
    assert np.array_equal(
        resampled(Pyramid.of(image, False), np.array([[7.0, 5, 16, 16]]), 16)[0], image[5:21, 7:23]
    )


def test_a_crop_across_the_seam_is_that_of_the_turned_image():
    image = np.random.default_rng(1).integers(0, 255, (40, 60, 4), np.uint8)
    across = resampled(Pyramid.of(image, True), np.array([[52.0, 5, 16, 16], [-8.0, 5, 16, 16]]), 16)
    turned = np.roll(image, 20, axis=1)[5:21, 12:28]
    assert np.array_equal(across[0], turned) and np.array_equal(across[1], turned)


@given(st.integers(1, 4), st.integers(0, 20), st.integers(0, 20))
def test_crops_of_large_boxes_are_means_of_their_pixels(power, x, y):
    """The slow obvious way: the mean of each pixel of the crop over the image's pixels in it."""
    side, times = 8, 2**power
    image = cv2.GaussianBlur(np.random.default_rng(2).normal(128, 400, (160, 160)), None, 6)
    image = np.clip(image, 0, 255).astype(np.uint8)
    corner = np.array([x, y]) // times * times  # where the halved images have their pixels
    box = np.array([[*corner, side * times, side * times]], float)
    crop = resampled(Pyramid.of(image, False), box, side)[0]
    part = image[corner[1] : corner[1] + side * times, corner[0] : corner[0] + side * times]
    means = part.reshape(side, times, side, times).mean(axis=(1, 3))
    assert np.abs(crop - means).max() <= 2 + power


def test_what_is_looked_up_of_normals_is_what_is_calculated():
    rng = np.random.default_rng(3)
    colours = rng.integers(0, 256, (9, 32, 32, 3)).astype(np.uint8)
    colours[rng.uniform(size=colours.shape[:3]) < 0.1] = 0
    colours[7, ..., 2] = 255 - colours[7, ..., 1]  # phi between two bins
    towards, right, up = np.moveaxis(colours.astype(np.float32) / np.float32(127.5) - 1, -1, 0)
    normals = np.stack([right, -up, -np.maximum(towards, np.float32(1e-3))], axis=-1)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    normals[~colours.any(axis=-1)] = 0
    found, wanted = honv_of_colours(colours, LAYOUT), honv(normals, LAYOUT)
    ties = np.arange(9) == 7  # which of the two bins it is depends on how a processor rounds
    assert np.array_equal(found[~ties], wanted[~ties])
    assert np.abs(found[ties] - wanted[ties]).mean() < 0.01
    means = colours.reshape(9, 8, 4, 8, 4, 3).mean(axis=(2, 4)).reshape(9, -1) / 255
    np.testing.assert_allclose(cell_means(colours, 8), means, atol=1e-6)


def test_a_description_does_not_depend_on_the_other_boxes():
    evidence = evidence_of(TWO_BOXES)
    boxes = np.array([[30.0, 20, 12, 20], [80, 30, 31, 17], [100, 3, 9, 9]])
    alone = np.concatenate([Describer.of(evidence)(box[None]) for box in boxes])
    assert np.array_equal(Describer.of(evidence)(boxes), alone)
    assert Describer.of(evidence)(np.empty((0, 4))).shape == (0, alone.shape[1])


def test_a_description_does_not_depend_on_where_the_seam_is():
    """Of a scan of a full turn, and of the same one that begins 40 columns later."""
    grid = ray_grid(np.arange(180.0, -180.0, -1.0), np.arange(5.0, -45.0, -1.0))
    scan = replace(boxes_and_floor(grid, [((2, -0.5, -1.5), (2.3, 0.4, -0.6))], noise_m=0.0), wraps=True)
    later = replace(
        scan, range=np.roll(scan.range, -170, axis=1), directions=np.roll(scan.directions, -170, axis=1)
    )
    boxes = np.array([[165.0, 15, 30, 20], [172, 20, 12, 20]])
    first = Describer.of(evidence_of(scan))(boxes)
    second = Describer.of(evidence_of(later))(boxes - [170, 0, 0, 0])
    assert np.abs(first - second).max() < 0.02 and np.ptp(first) > 0.1


def test_the_same_object_farther_away_has_nearly_the_same_description_but_for_its_range():
    near, far = (
        boxes_and_floor(GRID, [((d, -0.3, -1.5), (d + 0.3, 0.3, -0.7))], noise_m=0.0) for d in (2.0, 3.0)
    )
    vectors = []
    for scan in (near, far):
        evidence = evidence_of(scan)
        region = max(evidence.regions, key=lambda one: len(one.pixels))
        vectors.append(Describer.of(evidence)(np.array([region.box]))[0])
    other = Describer.of(evidence_of(near))(np.array([[3.0, 3, 20, 20]]))[0]
    assert np.linalg.norm(vectors[0] - vectors[1]) < 0.6 * np.linalg.norm(vectors[0] - other)


def test_boxes_are_moved_and_resized_as_the_correction_says():
    one = look(3, still=np.float32([0.5, -0.25, np.log(2), 0]))
    moved = one.corrected(np.array([[10.0, 20, 8, 4]]), np.zeros((1, 3), np.float32))
    assert moved[0] == pytest.approx([10 + 4 + 4 - 4 * np.exp(0.5), 19, 8 * np.exp(0.5), 4])


def test_scores_are_half_where_the_weights_say_and_grow_with_sum_and_mean():
    one = stage(look(2), slope=3.0, lean=0.5, shift=-6.0)
    sums, means = np.array([2.0, 1, 3, -99]), np.array([0.0, 6, 0, 0])
    assert one.scores(sums, means) == pytest.approx([0.5, 0.5, 1 / (1 + np.exp(-3)), 0], abs=1e-6)


def test_passing_all_checks_adds_to_the_logarithm_of_the_odds():
    one = stage(look(2), passed=2.0)
    scores = np.array([0.001, 0.3, 0.9])
    odds = np.log(scores / (1 - scores)) + 2
    assert one.if_passed(scores) == pytest.approx(1 / (1 + np.exp(-odds)))


def test_what_only_passed_checks_make_likely_is_a_candidate():
    evidence = evidence_of(TWO_BOXES)
    length = Describer.of(evidence)(np.array([[3.0, 3, 20, 20]])).shape[1]
    unlikely = stage(look(length), shift=-10.0)
    assert RankedDetector((unlikely,))(evidence) == []
    assert len(RankedDetector((replace(unlikely, passed=10.0),))(evidence)) == len(evidence.regions)


def test_each_look_sees_the_boxes_where_the_one_before_has_put_them():
    """The slow obvious way: one box, look by look."""
    evidence = evidence_of(TWO_BOXES)
    describe, rng = Describer.of(evidence), np.random.default_rng(5)
    boxes = np.array([[30.0, 20, 12, 20], [80, 30, 31, 17], [100, 3, 9, 9]])
    length = describe(boxes).shape[1]
    looks = tuple(
        look(
            length,
            weights=rng.normal(0, 0.1, length).astype(np.float32),
            moves=rng.normal(0, 0.02, (4, length)).astype(np.float32),
        )
        for _ in range(3)
    )
    judge = random_trees(rng, 2, seen(describe, boxes, describe(boxes)).shape[1])
    found = stage(*looks, judge=judge).looked_at(describe, boxes, describe(boxes))
    for place, box, total, mean in zip(*found, strict=True):
        one, margins = boxes[place][None], []
        for each in looks:
            vector = describe(one)
            said = judge(seen(describe, one, vector))[0]
            margins.append(each.margins(vector)[0])
            one = each.corrected(one, vector)
        assert box == pytest.approx(one[0], abs=1e-3)
        assert total == pytest.approx(said, abs=1e-5) and mean == pytest.approx(np.mean(margins), abs=1e-4)
    assert sorted(found[0]) == [0, 1, 2]


def test_only_the_most_promising_boxes_are_looked_at_again():
    evidence = evidence_of(TWO_BOXES)
    describe = Describer.of(evidence)
    boxes = np.array([[5.0, 5, 5 + i / 4, 20] for i in range(MOST + 9)])
    vectors = describe(boxes)
    weights = np.random.default_rng(6).normal(size=vectors.shape[1]).astype(np.float32)
    places, *_ = stage(look(len(weights), weights=weights)).looked_at(describe, boxes, vectors)
    assert len(places) == MOST
    margins = vectors @ weights
    assert margins[places].min() >= np.delete(margins, places).max()


@given(st.integers(0, 1000), st.integers(1, 4))
def test_boosted_trees_answer_as_their_questions_asked_one_by_one(seed, depth):
    rng = np.random.default_rng(seed)
    trees = random_trees(rng, depth, 4)
    vectors = rng.integers(-2, 3, (7, 4)).astype(np.float32)
    for vector, found in zip(vectors, trees(vectors), strict=True):
        total = 0.0
        for feature, threshold, answer in zip(trees.features, trees.thresholds, trees.answers, strict=True):
            first, among = 0, len(answer)
            node = 0
            while among > 1:
                among //= 2
                right = int(vector[feature[node]] >= threshold[node])
                first += among * right
                node = 2 * node + 1 + right
            total += answer[first]
        assert found == pytest.approx(total, abs=1e-5)


def test_the_trees_kept_say_what_those_of_scikit_learn_say():
    rng = np.random.default_rng(9)
    vectors = rng.integers(-3, 4, (3000, 5)).astype(np.float32) / np.float32(3)
    positive = (vectors[:, 0] * vectors[:, 1] > vectors[:, 2]) ^ (rng.uniform(size=3000) < 0.1)
    machine = HistGradientBoostingClassifier(
        learning_rate=STEP, max_iter=40, max_depth=DEPTH, max_leaf_nodes=2**DEPTH, l2_regularization=1.0,
        early_stopping=False,
    ).fit(vectors, positive)  # fmt: skip
    constant = machine.decision_function(vectors) - fit_trees(vectors, positive, rounds=40)(vectors)
    assert np.ptp(constant) < 1e-4


def test_trees_learn_what_no_plane_can_and_the_same_again():
    rng = np.random.default_rng(7)
    vectors = rng.uniform(-1, 1, (3000, 5)).astype(np.float32)
    positive = (vectors[:, 1] > 0) ^ (vectors[:, 3] > 0.2)
    trees = fit_trees(vectors, positive, rounds=100)
    others = rng.uniform(-1, 1, (1000, 5)).astype(np.float32)
    right = (trees(others) > 0) == ((others[:, 1] > 0) ^ (others[:, 3] > 0.2))
    assert right.mean() > 0.95
    again = fit_trees(vectors, positive, rounds=100)
    assert np.array_equal(again.answers, trees.answers) and np.array_equal(again.features, trees.features)


def test_trees_add_up_to_what_no_single_one_says():
    rng = np.random.default_rng(8)
    vectors, others = (rng.uniform(-1, 1, (count, 6)).astype(np.float32) for count in (3000, 1000))
    shares = []
    for rounds in (1, 150):
        trees = fit_trees(vectors, vectors.sum(axis=1) > 0, rounds)
        shares.append(np.mean((trees(others) > 0) == (others.sum(axis=1) > 0)))
    assert shares[0] < 0.8 and shares[1] > 0.9


def test_a_tree_whose_sides_ask_no_second_question_answers_on_both():
    vectors = np.float32([[0], [1]]).repeat(30, axis=0)
    low, high = fit_trees(vectors, vectors[:, 0] == 1, rounds=1)(np.float32([[0], [1]]))
    assert low < 0 < high and low == pytest.approx(-high)


def test_trees_say_the_same_of_all_where_no_number_tells_samples_apart():
    trees = fit_trees(np.ones((50, 2), np.float32), np.arange(50) < 20, rounds=3)
    assert np.ptp(trees(np.random.default_rng(0).normal(size=(9, 2)).astype(np.float32))) == 0


@given(st.integers(0, 1000))
def test_of_overlapping_boxes_the_best_is_kept(seed):
    rng = np.random.default_rng(seed)
    boxes = np.concatenate([rng.uniform(0, 40, (12, 2)), rng.uniform(5, 20, (12, 2))], axis=1)
    scores = rng.uniform(size=12)
    kept = distinct(boxes, scores, None)
    assert list(scores[kept]) == sorted(scores[kept], reverse=True)
    from laserimg.boxes import iou

    overlap = iou(boxes, boxes)
    for i in range(12):
        better = [j for j in kept if scores[j] > scores[i] and overlap[i, j] > SAME_IOU]
        assert (i in kept) == (not better)


def test_a_file_gives_back_its_second_stage(tmp_path):
    rng = np.random.default_rng(0)
    looks = [
        look(
            VECTOR_LENGTH,
            weights=np.float32(rng.integers(-3, 3, VECTOR_LENGTH)),
            moves=np.float32(rng.integers(-3, 3, (4, VECTOR_LENGTH))),
            bias=i / 4,
        )
        for i in range(3)
    ]
    one = stage(*looks, slope=1.5, lean=0.75, shift=-0.25, passed=0.75, regions=False)
    path = tmp_path / "bin.npz"
    path.write_bytes(save_second_stage(one))
    write_card(card_path(path), replace(CARD, sha256=file_sha256(path)))
    again = load_model(path)
    assert isinstance(again, SecondStage)
    for old, new in zip(looks, again.looks, strict=True):
        assert np.array_equal(new.weights, old.weights) and np.array_equal(new.moves, old.moves)
        assert new.bias == old.bias
    assert np.array_equal(again.judge.features, one.judge.features)
    assert np.array_equal(again.judge.thresholds, one.judge.thresholds)
    assert (again.slope, again.lean, again.shift, again.passed, again.regions, again.name) == (
        1.5,
        0.75,
        -0.25,
        0.75,
        False,
        "bin",
    )


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"weights": np.full((2, VECTOR_LENGTH), np.nan)}, "weights is missing or no finite array"),
        ({"weights": np.zeros(5)}, "weights is missing or no finite array of 2 dimensions"),
        ({"moves": np.zeros((2, 4, 6))}, "do not fit each other"),
        ({"bias": np.zeros(1)}, "do not fit each other"),
        ({"weights": np.zeros((2, 5)), "moves": np.zeros((2, 4, 5))}, "is for vectors of 5 numbers"),
        ({"layout": np.int32(1)}, "made for other vectors"),
        ({"features": np.full((1, 3), SEEN)}, f"its trees ask for other numbers than the {SEEN} there"),
        ({"features": np.full((1, 3), -1)}, "its trees ask for other numbers"),
        ({"thresholds": np.zeros((2, 3))}, "trees have 2[*][*]depth - 1 questions"),
        ({"thresholds": np.full((1, 3), np.nan)}, "thresholds is missing or no finite array"),
        ({"still": np.full((2, 4), np.inf)}, "still is missing or no finite array"),
    ],
)
def test_a_wrong_file_is_a_model_error(tmp_path, change, message):
    arrays = {
        "weights": np.zeros((2, VECTOR_LENGTH)),
        "bias": np.zeros(2),
        "moves": np.zeros((2, 4, VECTOR_LENGTH)),
        "still": np.zeros((2, 4)),
        "features": np.zeros((1, 3), np.int32),
        "thresholds": np.zeros((1, 3)),
        "answers": np.zeros((1, 4)),
        "slope": 1.0,
        "lean": 0.0,
        "shift": 0.0,
    }
    path = tmp_path / "bin.npz"
    np.savez(path, **(arrays | {"layout": np.int32(3), "regions": 1, "passed": 0.5} | change))
    with pytest.raises(ModelError, match=message):
        load_second_stage(path, CARD)


def trained_on(evidence, good):
    """A second stage that says yes to one region only."""
    vectors = Describer.of(evidence)(np.array([region.box for region in evidence.regions]))
    weights = vectors[good] - np.delete(vectors, good, axis=0).mean(axis=0)
    middle = (vectors[good] + np.delete(vectors, good, axis=0).mean(axis=0)) / 2
    return stage(look(len(weights), weights=weights, bias=-float(weights @ middle)), lean=20.0)


def test_regions_that_the_second_stage_is_sure_of_are_candidates():
    evidence = evidence_of(TWO_BOXES)
    assert len(evidence.regions) == 2
    for good in (0, 1):
        detector = RankedDetector((trained_on(evidence, good),))
        best = max(detector(evidence), key=lambda one: one.score)
        assert best.region is evidence.regions[good] and best.score > 0.9 and best.scored


def test_the_score_rule_rejects_what_the_second_stage_doubts():
    evidence = evidence_of(TWO_BOXES)
    rules = parse_rules('format = 1\n[bin]\nfrom = ["cascade", "regions"]\nscore = 0.5\n')
    detectors = detectors_for(rules, [replace(trained_on(evidence, 0), lean=1.0)])
    findings = Pipeline(rules, detectors).judge(evidence)
    doubted = [one for one in findings if one.score <= 0.5]
    assert len(findings) == 2 and len(doubted) == 1 and not doubted[0].accepted
    assert doubted[0].reason.startswith("score 0.") and "<= 0.50" in doubted[0].reason.replace("< 0", "<= 0")


def test_an_override_without_regions_proposes_none_to_the_second_stage():
    rules = parse_rules('format = 1\n[bin]\nfrom = ["cascade"]\n')
    evidence, models = evidence_of(TWO_BOXES), [trained_on(evidence_of(TWO_BOXES), 0)]
    found = {
        override: len(Pipeline(rules, detectors_for(rules, models, override)).judge(evidence))
        for override in ((), ("cascade",), ("cascade", "regions"))
    }
    assert found == {(): 1, ("cascade",): 0, ("cascade", "regions"): 1}


def test_without_the_second_stage_regions_are_proposed_as_they_are():
    rules = parse_rules('format = 1\n[bin]\nfrom = ["cascade", "regions"]\nscore = 0.99\n')
    evidence = evidence_of(TWO_BOXES)
    findings = Pipeline(rules, detectors_for(rules, [])).judge(evidence)
    assert len(findings) == 2 and all(one.accepted for one in findings)


@given(st.floats(-50, 150), st.floats(0, 50), st.floats(0.1, 300), st.floats(0.1, 80), st.booleans())
def test_boxes_cut_to_the_grid_lie_in_it(x, y, w, h, wraps):
    box = inside_grid(np.array([[x, y, w, h]]), (40, 100), wraps)[0]
    assert box[1] >= 0 and (box[3] <= 0 or box[1] + box[3] <= 40 + 1e-9)
    assert (0 <= box[0] < 100 and box[2] <= 100) if wraps else box[0] >= 0
