"""Clusters by radius: equal to brute force, whatever the order of the points."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_array_equal
from scipy.sparse.csgraph import connected_components

from analytic import boxes_and_floor, ray_grid
from laserimg.errors import ConfigError, ScanError
from laserimg.rbnn import numbered, rbnn, rbnn_of_scan
from laserimg.scan import Scan


def slow_rbnn(points, ratio, min_points):
    """The definition: all pairs."""
    points = np.asarray(points, float)
    distance = np.linalg.norm(points[:, None] - points[None], axis=-1)
    length = np.linalg.norm(points, axis=1)
    linked = distance <= ratio * np.maximum(length[:, None], length[None])
    return numbered(connected_components(linked, directed=False)[1], min_points)


def cloud(seed, number=400, spread=0.3):
    """Clumps of many sizes at ranges from 0.5 to 50 m, all around."""
    random = np.random.default_rng(seed)
    middle = random.normal(size=(12, 3))
    middle *= (np.exp(random.uniform(np.log(0.5), np.log(50), 12)) / np.linalg.norm(middle, axis=1))[:, None]
    clump = random.integers(0, 12, number)
    size = spread * np.linalg.norm(middle[clump], axis=1)[:, None] * random.random((12, 1))[clump]
    return middle[clump] + size * random.normal(size=(number, 3))


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10_000), st.sampled_from([0.01, 1 / 30, 0.1, 0.5]), st.integers(1, 12))
def test_equal_to_brute_force(seed, ratio, min_points):
    points = cloud(seed)
    assert_array_equal(rbnn(points, ratio, min_points), slow_rbnn(points, ratio, min_points))


def test_equal_to_brute_force_where_points_are_dense():
    """Cells with many points each: two sheets that come close at one place only."""
    random = np.random.default_rng(3)
    y, z = random.uniform(-1, 1, (2, 1500))
    gap = 0.05 + 0.4 * (y**2 + z**2)
    sheets = [np.stack([5 + side * gap / 2, y, z], axis=-1) for side in (-1, 1)]
    points = np.concatenate(sheets)
    for ratio in (0.008, 0.009, 0.0105, 0.012, 0.02):
        assert_array_equal(rbnn(points, ratio, 5), slow_rbnn(points, ratio, 5))


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10_000), st.sampled_from([0.02, 0.1, 0.3, 0.5]), st.sampled_from(range(6)))
def test_equal_to_brute_force_at_the_zenith_and_the_seam(seed, ratio, side):
    """Around one end of an axis, where azimuths are narrow or jump."""
    random = np.random.default_rng(seed)
    points = 0.25 * random.normal(size=(300, 3)) * random.choice([0.3, 1.0], 300)[:, None]
    points[:, side % 3] += 1 if side < 3 else -1
    points *= np.exp(random.uniform(0, 1, (300, 1)))
    assert_array_equal(rbnn(points, ratio, 2), slow_rbnn(points, ratio, 2))


@pytest.mark.parametrize(("pairs", "large"), [(8, 1 << 16), (1 << 21, 2)])
def test_parts_and_trees_give_the_same(pairs, large, monkeypatch):
    """Few pairs of points at a time, and every pair of cells compared with trees."""
    monkeypatch.setattr("laserimg.linked_points._PAIRS", pairs)
    monkeypatch.setattr("laserimg.linked_points._LARGE", large)
    for seed in range(20):
        points = cloud(seed)
        assert_array_equal(rbnn(points, 0.1, 3), slow_rbnn(points, 0.1, 3))


def test_two_dense_balls_cost_no_memory():
    """30,000 points in each of two cells: 900 million pairs, not compared one by one."""
    random = np.random.default_rng(0)
    ball = 0.01 * random.normal(size=(30_000, 3)).clip(-2, 2)
    for gap, clusters in ((0.5, 1), (0.62, 2)):
        points = np.concatenate([ball + np.array([10, 0, 0]), ball + np.array([10, gap, 0])])
        assert rbnn(points, 0.05).max() == clusters


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10_000))
def test_the_order_of_the_points_does_not_matter(seed):
    points = cloud(seed)
    order = np.random.default_rng(seed).permutation(len(points))
    one, other = rbnn(points, 0.05, 3), rbnn(points[order], 0.05, 3)
    pairs = set(zip(one[order].tolist(), other.tolist(), strict=True))
    assert len(pairs) == len(set(one.tolist())) == len(set(other.tolist()))
    assert ((one[order] == 0) == (other == 0)).all()


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10_000), st.floats(0.01, 100))
def test_twice_as_far_twice_the_radius(seed, scale):
    points = cloud(seed)
    assert_array_equal(rbnn(points, 0.04, 3), rbnn(points * scale, 0.04, 3))


def test_radius_grows_with_range():
    near, far = [[2, 0, 0], [2, 0.2, 0]], [[20, 0, 0], [20, 0.2, 0]]
    assert rbnn([*near, *far], 0.05, 1).tolist() == [1, 2, 3, 3]
    assert rbnn(np.add([*near, *far], [0, 0, 5]), 0.05, 1, origin=(0, 0, 5)).tolist() == [1, 2, 3, 3]


def test_points_without_a_measurement_are_in_no_cluster():
    points = [[0, 0, 0], [np.nan, 1, 1], [3, 0, 0], [3, 0.01, 0], [np.inf, 0, 0]]
    assert rbnn(points, 0.1, 1).tolist() == [0, 0, 1, 1, 0]
    assert rbnn(np.zeros((0, 3))).tolist() == []
    assert rbnn(np.zeros((4, 3))).tolist() == [0] * 4


@pytest.mark.parametrize("ratio", [0, -0.1, 1e-5, 0.6, np.nan])
def test_wrong_ratio(ratio):
    with pytest.raises(ConfigError, match=r"ratio must be from 0\.0001 to 0\.5"):
        rbnn(np.ones((3, 3)), ratio)


def test_wrong_shape():
    with pytest.raises(ScanError, match=r"points must be \(n, 3\), got \(2, 2\)"):
        rbnn(np.ones((2, 2)))


# --- on the lattice


def slow_lattice(scan, takes_part, ratio, min_points, reach):
    points = scan.points().astype(float)
    height, width = scan.shape
    linked = np.eye(height * width, dtype=bool)
    for y, x in np.argwhere(takes_part):
        for dy in range(-reach[0], reach[0] + 1):
            for dx in range(-reach[1], reach[1] + 1):
                v, u = y + dy, x + dx
                if scan.wraps:
                    u %= width
                if 0 <= v < height and 0 <= u < width and takes_part[v, u]:
                    limit = ratio * max(float(scan.range[y, x]), float(scan.range[v, u]))
                    linked[y * width + x, v * width + u] = (
                        np.linalg.norm(points[y, x] - points[v, u]) <= limit
                    )
    component = connected_components(linked, directed=False)[1]
    labels = np.zeros(height * width, np.int32)
    part = takes_part.ravel()
    labels[part] = numbered(component[part], min_points)
    return labels.reshape(height, width)


@pytest.mark.parametrize("wraps", [True, False])
@pytest.mark.parametrize("reach", [(1, 1), (1, 3), (2, 2)])
def test_lattice_equal_to_brute_force(wraps, reach):
    random = np.random.default_rng(5)
    grid = ray_grid(np.arange(170.0, -190, -20), np.arange(60.0, -50, -12), wraps=wraps)
    range_m = random.choice([2.0, 2.3, 3.0], grid.shape) * (random.random(grid.shape) > 0.25)
    scan = Scan(range_m.astype(np.float32), grid.directions, wraps=wraps)
    takes_part = scan.valid & (random.random(grid.shape) > 0.1)
    for ratio in (0.2, 0.35, 0.5):
        found = rbnn_of_scan(scan, takes_part, ratio, 2, reach)
        assert_array_equal(found, slow_lattice(scan, takes_part, ratio, 2, reach))


def test_two_boxes_one_at_the_seam():
    grid = ray_grid(np.arange(179.5, -180, -1.0), np.arange(10.0, -10, -1.0), wraps=True)
    scan = boxes_and_floor(grid, [((-5, -1, -1), (-4, 1, 1)), ((4, -1, -1), (5, 1, 1))], floor_m=-50)
    labels = rbnn_of_scan(scan)
    assert labels.max() == 2
    assert labels[10, 0] == labels[10, -1] == 1
    assert labels[10, 180] == 2
    by_points = rbnn(scan.points()[scan.valid])
    assert_array_equal(by_points, labels[scan.valid])


def test_reach_below_one():
    grid = ray_grid([1.0, 0], [1.0, 0])
    with pytest.raises(ConfigError, match="reach must be at least 1 row and 1 column"):
        rbnn_of_scan(grid, reach=(0, 1))


@pytest.mark.parametrize("wraps", [False, True])
def test_a_grid_of_two_columns(wraps):
    azimuth, elevation = np.radians([0.2, 0.0]), np.radians([0.4, 0.2, 0.0, -20.0, -20.2])
    scan = replace(Scan.from_range_image(np.full((5, 2), 2.0), azimuth, elevation), wraps=wraps)
    labels = rbnn_of_scan(scan, ratio=0.01, min_points=1)
    assert np.array_equal(labels, np.array([[1, 1, 1, 2, 2]] * 2).T)
