"""Boosting, stages and rates."""

import math

import numpy as np
import pytest

from laserimg.cascade.boosting import KINDS, grow_tree, leaf_answers, trimmed, working_sample
from laserimg.cascade.features import Pool
from laserimg.cascade.measures import measures
from laserimg.cascade.model import Stage
from laserimg.cascade.rates import Rate
from laserimg.cascade.search import ExhaustiveSearch
from laserimg.cascade.stage import StageGoal, train_stage
from laserimg.cascade.windows import Windows
from laserimg.errors import ConfigError


def problem(count=240, seed=0, mode="basic"):
    """Windows with a bright bar, plain or crossed, against windows of noise."""
    rng = np.random.default_rng(seed)
    pixels = rng.integers(80, 170, (count, 12, 12))
    positive = np.arange(count) < count // 2
    pixels[positive, 3:6, 2:10] += 25
    pixels[: count // 4, 8:11, 2:10] += 30
    pixels = pixels.clip(0, 255).astype(np.uint8)
    windows = Windows.of(pixels, mode)
    return measures(Pool(mode, 12, 12), windows, positive), windows, positive


@pytest.mark.parametrize("mode", ["basic", "lbp"])
@pytest.mark.parametrize("depth", [1, 3])
@pytest.mark.parametrize("boost", KINDS)
def test_a_stage_reaches_its_goal_and_does_what_it_says(boost, depth, mode):
    samples, windows, positive = problem(mode=mode)
    goal = StageGoal(0.98, 0.1, boost, depth)
    told = []
    stage, end = train_stage(ExhaustiveSearch(samples), positive, goal, told.append)
    assert told[-1] == end and end.trees == len(stage.trees) == len(told) < 40
    assert max(len(tree.features) for tree in stage.trees) <= 2**depth - 1
    assert depth == 1 or max(len(tree.features) for tree in stage.trees) > 1
    passed = stage.passed(stage.sums(samples.pool, windows))
    assert (passed[positive].mean(), passed[~positive].mean()) == (end.hit_rate, end.false_alarm)
    assert end.hit_rate >= 0.98 and end.false_alarm <= 0.1


@pytest.mark.parametrize("boost", KINDS)
def test_the_loss_falls_with_each_tree(boost):
    samples, _, positive = problem()
    labels = np.where(positive, 1.0, -1.0)
    scores, losses = np.zeros(len(labels)), []
    for _ in range(8):
        weights, targets = working_sample(boost, labels, scores)
        assert weights.sum() == pytest.approx(1)
        tree, leaf_of = grow_tree(boost, ExhaustiveSearch(samples), weights, targets, 1)
        scores += tree.leaves[leaf_of]
        loss = np.log1p(np.exp(-2 * labels * scores)) if boost == "logit" else np.exp(-labels * scores)
        losses.append(loss.mean())
    assert (np.diff(losses) < 0).all()


def test_answers_of_the_four_kinds():
    # A leaf with 3/4 of its weight on positives, one with 1/4.
    weights, targets = np.array([3, 1, 1, 3]) / 8, np.array([1.0, -1, 1, -1])
    leaf_of = np.array([0, 0, 1, 1])
    half_log_3 = math.log(3) / 2
    expected = {"gentle": 0.5, "real": half_log_3, "discrete": half_log_3, "logit": 0.25}
    for kind, answer in expected.items():
        got = leaf_answers(kind, weights, targets, leaf_of, 2)
        np.testing.assert_allclose(got, [answer, -answer], rtol=1e-6)


def test_trimming_drops_the_least_weights_and_no_more_than_asked():
    weights = np.array([0.5, 0.01, 0.3, 0.02, 0.17])
    assert trimmed(weights, 0.95).tolist() == [0.5, 0, 0.3, 0, 0.17]
    assert trimmed(weights, 1.0).tolist() == weights.tolist()


def test_samples_without_weight_do_not_count():
    samples, _, positive = problem()
    labels = np.where(positive, 1.0, -1.0)
    weights = np.where(np.arange(len(labels)) % 2, 1 / 120, 0.0)
    confused = np.where(weights > 0, labels, -labels)
    first, second = (
        grow_tree("gentle", ExhaustiveSearch(samples), weights, t, 1)[0] for t in (labels, confused)
    )
    assert first.features.tolist() == second.features.tolist()
    assert first.leaves.tolist() == second.leaves.tolist()


def test_the_same_images_on_both_sides_are_refused():
    pixels = np.full((20, 12, 12), 90, np.uint8)
    positive = np.arange(20) < 10
    samples = measures(Pool("basic", 12, 12), Windows.of(pixels, "basic"), positive)
    with pytest.raises(ConfigError, match="no feature tells the positives"):
        train_stage(ExhaustiveSearch(samples), positive, StageGoal())


@pytest.mark.parametrize("wrong", [{"min_hit_rate": 0}, {"max_false_alarm": 1.5}, {"trim": -1}, {"depth": 0}])
def test_goals_have_limits(wrong):
    with pytest.raises(ConfigError, match="must be"):
        StageGoal(**wrong)


def test_threshold_margin_is_the_loaders():
    stage = Stage((), np.float32(0.5))
    assert stage.passed(np.array([0.5, 0.499995, 0.49998])).tolist() == [True, True, False]


def test_rate_of_independent_images_is_wilsons():
    # Wilson's interval for 10 of 1000: 0.00545 to 0.01831.
    rate = Rate.of([(1, 100)] * 10)
    assert (rate.value, rate.low, rate.high) == pytest.approx((0.01, 0.00545, 0.01831), abs=1e-5)


def test_rate_knows_clusters():
    spread = Rate.of([(1, 1000)] * 100)
    clustered = Rate.of([(20, 1000)] * 5 + [(0, 1000)] * 95)
    assert spread.value == clustered.value
    assert clustered.high - clustered.low > 3 * (spread.high - spread.low)


def test_bounds_hold_for_clusters():
    rng = np.random.default_rng(0)
    inside = 0
    for _ in range(300):
        bursts = rng.random(400) < 0.05
        rate = Rate.of(np.stack([bursts * rng.integers(1, 21, 400), np.full(400, 1000)], axis=1))
        inside += rate.low <= 0.05 * 10.5 / 1000 <= rate.high
    assert inside > 0.9 * 300


def test_nothing_seen_says_nothing():
    rate = Rate.of([(0, 0)])
    assert (rate.low, rate.high) == (0.0, 1.0)
    assert Rate.of([(0, 10_000)]).high == pytest.approx(1.96**2 / 10_000, rel=0.01)
