"""What the judge sees of boxes in metres."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from analytic import boxes_and_floor
from laserimg.detectors.box_samples import near_range, quantiles
from laserimg.detectors.description import Describer
from laserimg.detectors.metric_cells import METRIC_NUMBERS, UNKNOWN, metric_cells
from test_second_stage import GRID, TWO_BOXES, evidence_of

CELLS = 64
DEPTH, HEIGHT, KNOWN = (slice(start, start + CELLS) for start in (0, CELLS, 2 * CELLS))
SIZES = slice(6 * CELLS, METRIC_NUMBERS)


def numbers_of(evidence, boxes):
    return metric_cells(evidence, Describer.of(evidence).ranges, np.asarray(boxes, float))


@given(st.integers(0, 10_000))
def test_quantiles_are_values_counted_in_their_order(seed):
    rng = np.random.default_rng(seed)
    values, counted = rng.normal(size=(3, 9)), rng.uniform(size=(3, 9)) < 0.6
    found = quantiles(values, counted, (0.0, 0.5, 1.0))
    for row, (some, mask) in enumerate(zip(values, counted, strict=True)):
        ordered = sorted(some[mask])
        wanted = [ordered[0], ordered[(len(ordered) - 1) // 2], ordered[-1]] if ordered else [np.nan] * 3
        assert np.array_equal([quantile[row] for quantile in found], wanted, equal_nan=True)


def test_cells_are_means_of_depth_and_height_in_them():
    """The slow obvious way, pixel by pixel."""
    evidence = evidence_of(TWO_BOXES)
    scan, box = evidence.scan, np.array([84.0, 20, 12, 30])
    numbers = numbers_of(evidence, [box])[0]
    near = near_range(evidence, Describer.of(evidence).ranges, box[None])[0]
    places = (np.arange(16) + 0.5) / 16
    sums = np.zeros((3, 8, 8))
    for i, down in enumerate(places):
        for j, across in enumerate(places):
            row = int(np.clip(box[1] + box[3] * (1.4 * down - 0.2), 0, scan.shape[0] - 1))
            column = int(np.clip(box[0] + box[2] * (1.4 * across - 0.2), 0, scan.shape[1] - 1))
            if scan.valid[row, column]:
                point = scan.range[row, column] * scan.directions[row, column]
                depth = np.clip(scan.range[row, column] - near, -0.6, 1.2)
                height = np.clip(evidence.floor.height_of(point[None])[0], -0.5, 3)
                sums[:, i // 2, j // 2] += depth, height, 1
    count = sums[2]
    for part, total in ((DEPTH, sums[0]), (HEIGHT, sums[1])):
        wanted = np.where(count > 0, total / np.maximum(count, 1), UNKNOWN)
        np.testing.assert_allclose(numbers[part].reshape(8, 8), wanted, atol=1e-4)
    np.testing.assert_allclose(numbers[KNOWN].reshape(8, 8), count / 4, atol=1e-6)


def test_sizes_of_a_box_are_those_it_was_built_with():
    scan = boxes_and_floor(GRID, [((2.5, -0.3, -1.5), (2.8, 0.3, -0.7))], noise_m=0.0)
    evidence = evidence_of(scan)
    region = max(evidence.regions, key=lambda one: len(one.pixels))
    sizes = numbers_of(evidence, [region.box])[0][SIZES]
    near, _, width, height, foot = sizes[:5]
    assert near == pytest.approx(2.6, abs=0.2)
    assert width == pytest.approx(0.6, abs=0.08) and height == pytest.approx(0.8, abs=0.12)
    assert foot == pytest.approx(0, abs=0.2)
    share, low, _, top, reach, sideways = sizes[18:24]
    assert share > 0.8 and low < 0.12 and top == pytest.approx(0.8, abs=0.1) and reach > 0.6
    assert sideways == pytest.approx(0.6, abs=0.1)


def test_a_scanner_that_hangs_upside_down_sees_the_same_numbers():
    turned = np.diag([1.0, -1, -1, 1])
    scan = replace(
        TWO_BOXES,
        directions=TWO_BOXES.directions * np.float32([1, -1, -1]),
        world_from_scan=TWO_BOXES.world_from_scan @ turned,
    )
    boxes = [[84.0, 20, 12, 30], [3.0, 60, 20, 20]]
    upright, hanging = (numbers_of(evidence_of(one), boxes) for one in (TWO_BOXES, scan))
    np.testing.assert_allclose(hanging, upright, atol=1e-3)


def test_boxes_that_see_nothing_and_scans_without_a_floor_have_numbers_too():
    evidence = evidence_of(TWO_BOXES)
    scan = evidence.scan
    nearly_blind = np.zeros_like(scan.range)
    nearly_blind[-1, -1] = 1
    blind = replace(evidence, scan=replace(scan, range=nearly_blind), floor=None)
    numbers = numbers_of(blind, [[3.0, 3, 20, 20]])
    assert numbers.shape == (1, METRIC_NUMBERS) and np.isfinite(numbers).all()
    assert (numbers[0, HEIGHT] == UNKNOWN).all() and (numbers[0, KNOWN] == 0).all()
    assert numbers_of(evidence, np.empty((0, 4))).shape == (0, METRIC_NUMBERS)


def test_numbers_do_not_depend_on_the_other_boxes():
    evidence = evidence_of(TWO_BOXES)
    boxes = np.array([[30.0, 20, 12, 20], [80, 30, 31, 17], [100, 3, 9, 9]])
    alone = np.concatenate([numbers_of(evidence, box[None]) for box in boxes])
    assert np.array_equal(numbers_of(evidence, boxes), alone)
