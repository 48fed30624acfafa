"""Feature values and decisions against OpenCV's own detector, bit by bit."""

import cv2
import numpy as np
import pytest

from laserimg.cascade.features import Pool
from laserimg.cascade.mining import detector_of
from laserimg.cascade.model import Cascade, Stage, Tree
from laserimg.cascade.stage import StageGoal
from laserimg.cascade.windows import Windows
from laserimg.cascade.writer import cascade_xml

STUMP = np.array([[0, -1]])
NO_SUBSET = np.zeros((1, 8), np.int32)
AT_ONCE = 12  # features a file: the sum of their base-4 digits stays exact


def picture(width, height, seed):
    rng = np.random.default_rng(seed)
    small = rng.integers(0, 256, (5, 5)).astype(np.uint8)
    smooth = cv2.resize(small, (width, height), interpolation=cv2.INTER_CUBIC).astype(int)
    return np.clip(smooth + rng.integers(-20, 21, (height, width)), 0, 255).astype(np.uint8)


def stump(number, threshold, right, subset=NO_SUBSET):
    leaves = np.array([0, right], np.float32)
    return Tree(np.array([number]), np.array([threshold], np.float32), subset, STUMP, leaves)


def level_weight(cascade, image):
    detector = detector_of(cascade_xml(cascade, StageGoal()))
    size = image.shape[::-1]
    found = detector.detectMultiScale3(image, 1.1, 0, 0, size, size, outputRejectLevels=True)
    return float(found[2][0])


def comparisons(pool, numbers, image):
    """Digits 1 where OpenCV's value equals ours, 0 where it is smaller, 3 where it is larger."""
    values = Windows.of(image[None], pool.mode).measure(pool[numbers])[:, 0]
    trees = []
    for place, (number, value) in enumerate(zip(numbers, values, strict=True)):
        trees.append(stump(number, value, 4.0**place))
        trees.append(stump(number, np.nextafter(value, np.float32(np.inf)), 2 * 4.0**place))
    weight = level_weight(Cascade(pool, (Stage(tuple(trees), np.float32(-1e9)),)), image)
    return [int(weight // 4**place) % 4 for place in range(len(numbers))]


@pytest.mark.parametrize("zero_mean", [False, True])
@pytest.mark.parametrize("size", [(20, 20), (24, 24), (64, 12), (12, 33), (64, 64)])
def test_haar_values_are_those_of_opencv(size, zero_mean):
    pool = Pool("all", *size, zero_mean)
    rng = np.random.default_rng(sum(size))
    # Two thirds of the numbers from the last kinds, which are tilted.
    numbers = np.concatenate(
        [rng.integers(len(pool), size=600), len(pool) - 1 - rng.integers(len(pool) // 4, size=600)]
    )
    image = picture(*size, seed=1)
    digits = [
        d
        for start in range(0, 1200, AT_ONCE)
        for d in comparisons(pool, numbers[start : start + AT_ONCE], image)
    ]
    assert digits == [1] * 1200


def test_lbp_codes_are_those_of_opencv():
    pool = Pool("lbp", 20, 18)
    image = picture(20, 18, seed=2)
    codes = Windows.of(image[None], "lbp").measure(pool[np.arange(len(pool))])[:, 0]
    rng = np.random.default_rng(0)
    for numbers in rng.integers(len(pool), size=(40, 10)):
        # Only the set of exactly the right code sends the window left, to leaf 0.
        trees = []
        for place, number in enumerate(numbers):
            subset = np.zeros((1, 8), np.uint32)
            subset[0, codes[number] >> 5] = np.uint32(1) << np.uint32(codes[number] & 31)
            trees.append(stump(number, 0, 2.0**place, subset.view(np.int32)))
        trees.append(stump(numbers[0], 0, 1024.0))
        assert level_weight(Cascade(pool, (Stage(tuple(trees), np.float32(-1e9)),)), image) == 1024.0


def random_tree(pool, values, rng, nodes):
    """A tree that splits a random leaf again and again."""
    children, numbers, thresholds = [[0, -1]], [], []
    leaves = [(0, 0), (0, 1)]
    for node in range(nodes):
        number = int(rng.integers(len(values)))
        numbers.append(number)
        thresholds.append(rng.choice(values[number]))
        if node:
            parent, side = leaves.pop(int(rng.integers(len(leaves))))
            children[parent][side] = node
            children.append([0, 0])
            leaves += [(node, 0), (node, 1)]
    for leaf, (parent, side) in enumerate(leaves):
        children[parent][side] = -leaf
    answers = rng.normal(size=nodes + 1).astype(np.float32)
    subsets = rng.integers(-(2**31), 2**31, (nodes, 8)).astype(np.int32)
    return Tree(np.array(numbers), np.array(thresholds, np.float32), subsets, np.array(children), answers)


@pytest.mark.parametrize("mode", ["basic", "all", "lbp"])
@pytest.mark.parametrize("nodes", [1, 4])
def test_decisions_are_those_of_opencv(mode, nodes):
    rng = np.random.default_rng(nodes)
    pool = Pool(mode, 18, 20)
    pixels = np.stack([picture(18, 20, seed) for seed in range(300)])
    # Some windows with contrast below, near and above the detector's limit.
    pixels[::3] = (pixels[::3] * rng.uniform(0.05, 0.4, (100, 1, 1))).astype(np.uint8)
    pixels[1] = 90
    values = Windows.of(pixels, mode).measure(pool[np.arange(500)])
    stages = []
    for _ in range(2):
        trees = tuple(random_tree(pool, values, rng, nodes) for _ in range(6))
        stage = Stage(trees, np.float32(0))
        sums = stage.sums(pool, Windows.of(pixels, mode))
        stages.append(Stage(trees, np.float32(np.quantile(sums, 0.3))))
    cascade = Cascade(pool, tuple(stages))
    detector = detector_of(cascade_xml(cascade, StageGoal()))
    seen = [len(detector.detectMultiScale(image, 1.1, 0, 0, (18, 20), (18, 20))) > 0 for image in pixels]
    assert 0.2 < np.mean(seen) < 0.9
    assert cascade.passes(pixels).tolist() == seen
