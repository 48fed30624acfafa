"""Crops, descriptions, the second stage and its file, and what it makes of what is proposed."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from analytic import boxes_and_floor, ray_grid
from laserimg.boxes import inside_grid
from laserimg.descriptors.honv import honv
from laserimg.detectors.crops import resampled
from laserimg.detectors.description import IMAGES, LAYOUT, Describer
from laserimg.detectors.lookup import cell_means, honv_of_colours
from laserimg.detectors.pyramid import Pyramid
from laserimg.detectors.ranked import RankedDetector
from laserimg.detectors.second_stage import (
    SAME_IOU,
    SecondStage,
    distinct,
    load_second_stage,
    save_second_stage,
)
from laserimg.detectors.shipped import load_model
from laserimg.errors import ModelError
from laserimg.evidence import Evidence
from laserimg.formats.card import Card, card_path, file_sha256, write_card
from laserimg.images import make_images
from laserimg.pipeline import Pipeline
from laserimg.rules.file import parse_rules
from laserimg.sources import detectors_for

CARD = Card("bin", "svm", "normals_view", (32, 32), "0" * 64)
GRID = ray_grid(np.arange(40.0, -40.0, -0.5), np.arange(5.0, -45.0, -0.5))
TWO_BOXES = boxes_and_floor(GRID, [((2, -0.5, -1.5), (2.3, -0.2, -1.1)), ((2, 0.4, -1.5), (2.3, 0.7, -0.6))])


def evidence_of(scan) -> Evidence:
    seen = Pipeline(parse_rules("format = 1\n")).observe(scan)
    return replace(seen, images=make_images(scan, IMAGES))


def stage(length, **known) -> SecondStage:
    plain = {
        "weights": np.zeros(length, np.float32),
        "bias": 0.0,
        "slope": 1.0,
        "moves": np.zeros((4, length), np.float32),
        "still": np.zeros(4, np.float32),
    }
    return SecondStage("bin", CARD, **(plain | known))


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
    assert np.array_equal(honv_of_colours(colours, LAYOUT), honv(normals, LAYOUT))
    means = colours.reshape(9, 8, 4, 8, 4, 3).mean(axis=(2, 4)).reshape(9, -1) / 255
    np.testing.assert_allclose(cell_means(colours, 8), means, atol=1e-6)


def test_a_description_does_not_depend_on_the_other_boxes_nor_on_where_the_seam_is():
    seen = evidence_of(TWO_BOXES)
    boxes = np.array([[30.0, 20, 12, 20], [80, 30, 31, 17], [100, 3, 9, 9]])
    alone = np.concatenate([Describer.of(seen)(box[None]) for box in boxes])
    assert np.array_equal(Describer.of(seen)(boxes), alone)
    assert Describer.of(seen)(np.empty((0, 4))).shape == (0, alone.shape[1])


def test_the_same_object_farther_away_has_nearly_the_same_description_but_for_its_range():
    near, far = (
        boxes_and_floor(GRID, [((d, -0.3, -1.5), (d + 0.3, 0.3, -0.7))], noise_m=0.0) for d in (2.0, 3.0)
    )
    vectors = []
    for scan in (near, far):
        seen = evidence_of(scan)
        region = max(seen.regions, key=lambda one: len(one.pixels))
        vectors.append(Describer.of(seen)(np.array([region.box]))[0])
    other = Describer.of(evidence_of(near))(np.array([[3.0, 3, 20, 20]]))[0]
    assert np.linalg.norm(vectors[0] - vectors[1]) < 0.6 * np.linalg.norm(vectors[0] - other)


def test_boxes_are_moved_and_resized_as_the_correction_says():
    one = stage(3, still=np.float32([0.5, -0.25, np.log(2), 0]))
    moved = one.corrected(np.array([[10.0, 20, 8, 4]]), np.zeros((1, 3), np.float32))
    assert moved[0] == pytest.approx([10 + 4 + 4 - 4 * np.exp(0.5), 19, 8 * np.exp(0.5), 4])


def test_scores_are_half_on_the_plane_and_grow_with_the_margin():
    one = stage(2, weights=np.float32([1, 0]), bias=-2.0, slope=3.0)
    scores = one.scores(one.margins(np.float32([[2, 9], [3, 9], [-99, 0]])))
    assert scores == pytest.approx([0.5, 1 / (1 + np.exp(-3)), 0], abs=1e-6)


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
    one = stage(
        5, weights=np.float32([0.5, 1, -2, 0, 4]), bias=0.25, moves=np.float32(rng.integers(-3, 3, (4, 5)))
    )
    path = tmp_path / "bin.npz"
    path.write_bytes(save_second_stage(one))
    write_card(card_path(path), replace(CARD, sha256=file_sha256(path)))
    again = load_model(path)
    assert isinstance(again, SecondStage)
    assert np.array_equal(again.weights, one.weights) and np.array_equal(again.moves, one.moves)
    assert (again.bias, again.slope, again.name) == (0.25, 1.0, "bin")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"weights": np.full(5, np.nan)}, "weights is missing or no finite array"),
        ({"moves": np.zeros((4, 6))}, "do not fit each other"),
        ({"layout": np.int32(99)}, "made for other vectors"),
    ],
)
def test_a_wrong_file_is_a_model_error(tmp_path, change, message):
    arrays = {
        "weights": np.zeros(5),
        "bias": 0.0,
        "slope": 1.0,
        "moves": np.zeros((4, 5)),
        "still": np.zeros(4),
    }
    path = tmp_path / "bin.npz"
    np.savez(path, **(arrays | {"layout": np.int32(1), "regions": 1, "passed": 0.5} | change))
    with pytest.raises(ModelError, match=message):
        load_second_stage(path, CARD)


def trained_on(seen, good):
    """A second stage that says yes to one region only."""
    vectors = Describer.of(seen)(np.array([region.box for region in seen.regions]))
    weights = vectors[good] - np.delete(vectors, good, axis=0).mean(axis=0)
    middle = (vectors[good] + np.delete(vectors, good, axis=0).mean(axis=0)) / 2
    return stage(len(weights), weights=weights, bias=-float(weights @ middle), slope=20.0)


def test_regions_that_the_second_stage_is_sure_of_are_candidates():
    seen = evidence_of(TWO_BOXES)
    assert len(seen.regions) == 2
    for good in (0, 1):
        detector = RankedDetector((trained_on(seen, good),))
        best = max(detector(seen), key=lambda one: one.score)
        assert best.region is seen.regions[good] and best.score > 0.9 and best.scored


def test_the_score_rule_rejects_what_the_second_stage_doubts():
    seen = evidence_of(TWO_BOXES)
    rules = parse_rules('format = 1\n[bin]\nfrom = ["cascade", "regions"]\nscore = 0.5\n')
    detectors = detectors_for(rules, [replace(trained_on(seen, 0), slope=1.0)])
    findings = Pipeline(rules, detectors).judge(seen)
    doubted = [one for one in findings if one.score <= 0.5]
    assert len(findings) == 2 and len(doubted) == 1 and not doubted[0].accepted
    assert doubted[0].reason.startswith("score 0.") and "<= 0.50" in doubted[0].reason.replace("< 0", "<= 0")


def test_without_the_second_stage_regions_are_proposed_as_they_are():
    rules = parse_rules('format = 1\n[bin]\nfrom = ["cascade", "regions"]\nscore = 0.99\n')
    seen = evidence_of(TWO_BOXES)
    findings = Pipeline(rules, detectors_for(rules, [])).judge(seen)
    assert len(findings) == 2 and all(one.accepted for one in findings)


@given(st.floats(-50, 150), st.floats(0, 50), st.floats(0.1, 300), st.floats(0.1, 80), st.booleans())
def test_boxes_cut_to_the_grid_lie_in_it(x, y, w, h, wraps):
    box = inside_grid(np.array([[x, y, w, h]]), (40, 100), wraps)[0]
    assert box[1] >= 0 and (box[3] <= 0 or box[1] + box[3] <= 40 + 1e-9)
    assert (0 <= box[0] < 100 and box[2] <= 100) if wraps else box[0] >= 0
