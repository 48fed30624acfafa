"""The feature pool against OpenCV's loops, and the split search against looking at everything."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from laserimg.cascade.features import Pool
from laserimg.cascade.histograms import HAAR, LBP, Binned, gains
from laserimg.cascade.measures import measures
from laserimg.cascade.search import ExhaustiveSearch, ScreenedSearch
from laserimg.cascade.splits import best_subset, best_threshold
from laserimg.cascade.windows import Windows
from laserimg.errors import ConfigError


@pytest.mark.parametrize(
    ("mode", "size", "count"),
    [
        # Printed by opencv_traincascade 3.4.18.
        ("basic", (20, 20), 78460),
        ("core", (20, 20), 101329),
        ("all", (20, 20), 125199),
        ("basic", (24, 24), 162336),
        ("all", (24, 24), 261600),
        ("lbp", (20, 20), 3969),
    ],
)
def test_counts_are_those_of_opencv(mode, size, count):
    assert len(Pool(mode, *size)) == count


@pytest.mark.parametrize("size", [(11, 20), (20, 65)])
def test_window_sizes_have_limits(size):
    with pytest.raises(ConfigError, match="sides must be 12 to 64"):
        Pool("basic", *size)


def inside(rect, tilted, width, height):
    x, y, w, h = rect
    if tilted:
        return x - h >= 0 and x + w <= width and y >= 0 and y + w + h <= height
    return x >= 0 and y >= 0 and x + w <= width and y + h <= height


@given(st.integers(12, 40), st.integers(12, 40), st.sampled_from(["basic", "core", "all", "lbp"]), st.data())
@settings(max_examples=40, deadline=None)
def test_every_number_is_a_feature_inside_the_window(width, height, mode, data):
    pool = Pool(mode, width, height)
    numbers = np.array(data.draw(st.lists(st.integers(0, len(pool) - 1), min_size=1, max_size=20)))
    assert pool.numbers(pool.places(numbers)).tolist() == numbers.tolist()
    features = pool[numbers]
    for rects, weights, tilted in zip(features.rects, features.weights, features.tilted, strict=True):
        assert all(inside(r, tilted, width, height) for r, w in zip(rects, weights, strict=True) if w)
    near = pool.neighbours(numbers)
    assert (np.diff(near) > 0).all()
    steps = np.abs(pool.places(near)[:, None] - pool.places(numbers)[None])
    assert (steps[..., 0].min(axis=1) == 0).all()
    assert (steps.max(axis=2).min(axis=1) <= 1).all()


def test_features_are_all_different():
    pool = Pool("all", 12, 12)
    features = pool[np.arange(len(pool))]
    keys = np.concatenate(
        [features.rects.reshape(-1, 12), features.weights, features.tilted[:, None]], axis=1
    )
    assert len(np.unique(keys, axis=0)) == len(pool)


def slow_best_threshold(values, weights, targets):
    """Every threshold of every feature, one after the other."""
    best = -1.0
    for row in values:
        for threshold in np.unique(row)[1:]:
            sides = [row < threshold, row >= threshold]
            masses = [weights[side].sum() for side in sides]
            if min(masses) > 1e-6 * weights.sum():
                moments = [(weights * targets)[side].sum() for side in sides]
                best = max(best, sum(m * m / w for m, w in zip(moments, masses, strict=True)))
    return best


def sample(rng, features, count, levels):
    values = rng.integers(levels, size=(features, count)).astype(np.float32)
    weights = rng.random(count) * (rng.random(count) > 0.3)
    return values, weights, rng.normal(size=count)


def explained(split, weights, targets):
    sides = [split.left & (weights > 0), ~split.left & (weights > 0)]
    return sum((weights * targets)[side].sum() ** 2 / weights[side].sum() for side in sides)


@pytest.mark.parametrize("seed", range(20))
def test_best_threshold_is_the_best(seed):
    values, weights, targets = sample(np.random.default_rng(seed), 5, 30, levels=8)
    split = best_threshold(np.arange(5), values, weights, targets)
    active = weights > 0
    assert split.gain == pytest.approx(
        slow_best_threshold(values[:, active], weights[active], targets[active])
    )
    assert split.gain == pytest.approx(explained(split, weights, targets))
    assert (split.left == (values[split.feature] < np.float32(split.threshold))).all()


def test_neighbouring_floats_are_told_apart():
    low = np.float32(0.1)
    high = np.nextafter(low, np.float32(1))
    split = best_threshold(
        np.array([3]), np.array([[high, low]]), np.array([0.5, 0.5]), np.array([1.0, -1.0])
    )
    assert split.left.tolist() == [False, True]


def test_no_split_where_nothing_differs():
    ones = np.ones(4)
    assert (
        best_threshold(np.array([0]), np.ones((1, 4), np.float32), ones, np.array([1, -1, 1, -1.0])) is None
    )
    assert best_subset(np.array([0]), np.ones((1, 4), np.uint8), ones, np.array([1, -1, 1, -1.0])) is None


@pytest.mark.parametrize("seed", range(10))
def test_best_subset_is_the_best_of_all_subsets(seed):
    rng = np.random.default_rng(seed)
    codes = rng.choice([3, 40, 77, 200, 255], size=(2, 25)).astype(np.uint8)
    weights, targets = rng.random(25), rng.normal(size=25)
    split = best_subset(np.arange(2), codes, weights, targets)
    best = 0.0
    for row in codes:
        kinds = np.unique(row)
        for choice in range(1, 2 ** len(kinds) - 1):
            left = np.isin(row, kinds[[choice >> i & 1 == 1 for i in range(len(kinds))]])
            sides = [(weights * targets)[s].sum() ** 2 / weights[s].sum() for s in (left, ~left)]
            best = max(best, sum(sides))
    assert split.gain == pytest.approx(best)
    assert split.gain == pytest.approx(explained(split, weights, targets))
    bits = np.unpackbits(split.subset.view(np.uint8), bitorder="little")
    assert (bits[codes[split.feature]] == split.left).all()


@pytest.mark.parametrize("scale", [HAAR, LBP])
@pytest.mark.parametrize("of_class", [True, False])
def test_tables_and_histograms_agree(scale, of_class):
    rng = np.random.default_rng(0)
    positive = rng.random(200) < 0.4
    codes = (rng.integers(scale.bins, size=(7, 200)) + positive * scale.bins).astype(np.uint16)
    weights = rng.random(200)
    targets = np.where(positive, 1.0, -1.0) if of_class else rng.normal(size=200)
    expected = gains(codes, scale, weights, targets)
    np.testing.assert_allclose(Binned.of(codes, scale).gains(weights, targets), expected, rtol=1e-4)
    if not scale.ordered:
        rows = (codes % scale.bins).astype(np.uint8)[:, None]
        exact = [best_subset(np.array([0]), row, weights, targets).gain for row in rows]
        np.testing.assert_allclose(expected, exact, rtol=1e-6)
    if scale.ordered:
        plain = (codes % scale.bins).astype(np.float32)
        slow = [slow_best_threshold(row[None], weights, targets) for row in plain]
        np.testing.assert_allclose(expected, slow, rtol=1e-6)


def textures(count, seed, stripes):
    rng = np.random.default_rng(seed)
    pixels = rng.integers(60, 190, (count, 14, 14))
    pixels[:, 4:7, 3:11] += stripes
    return pixels.clip(0, 255).astype(np.uint8)


@pytest.mark.parametrize("mode", ["basic", "all", "lbp"])
def test_screening_comes_close_to_looking_at_all(mode):
    pixels = np.concatenate([textures(150, 1, 45), textures(200, 2, 0)])
    positive = np.arange(350) < 150
    samples = measures(Pool(mode, 14, 14), Windows.of(pixels, mode), positive)
    weights, targets = np.full(350, 1 / 350), np.where(positive, 1.0, -1.0)
    best = ExhaustiveSearch(samples).best(weights, targets)
    for memory in (0, 350 * 500):
        anew = ExhaustiveSearch(samples, memory=memory).best(weights, targets)
        assert (anew.feature, anew.gain) == (best.feature, best.gain)
    found = [
        ScreenedSearch(samples, np.random.default_rng(s), features=300).best(weights, targets)
        for s in range(5)
    ]
    assert min(split.gain for split in found) > 0.85 * best.gain
    assert max(split.gain for split in found) <= best.gain + 0.02
