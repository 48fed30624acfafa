import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from scipy.sparse.csgraph import connected_components

from laserimg.errors import LaserImgError
from laserimg.lattice import connected, step_links
from laserimg.regions import MIN_PIXELS, bounding_box, reference_regions, regions_of
from laserimg.scan import Scan

OFFSETS = [(0, 1), (1, 0), (1, 1), (1, -1), (0, 2), (2, 0), (0, 4), (4, 0)]
GRIDS = hnp.arrays(np.int8, st.tuples(st.integers(5, 12), st.integers(6, 12)), elements=st.integers(-3, 6))


def values_of(grid):
    """Steps of 4 cm; below 0 a pixel takes no part."""
    return np.where(grid < 0, np.nan, grid * np.float32(0.04)).astype(np.float32)


def slow_partition(values, limits, wraps):
    """Every pair of pixels looked at on its own."""
    height, width = values.shape
    graph = np.zeros((height * width, height * width), bool)
    for (rows, columns), limit in limits.items():
        for y in range(height - rows):
            for x in range(width):
                other = x + columns
                if wraps:
                    other %= width
                if 0 <= other < width and abs(values[y, x] - values[y + rows, other]) <= limit:
                    graph[y * width + x, (y + rows) * width + other] = True
    return connected_components(graph, directed=False)[1].reshape(values.shape)


def same_partition(a, b):
    pairs = set(zip(a.ravel().tolist(), b.ravel().tolist(), strict=True))
    return len(pairs) == len({p for p, _ in pairs}) == len({q for _, q in pairs})


@settings(max_examples=60, deadline=None)
@given(GRIDS, st.booleans())
def test_components_are_those_of_the_pairwise_graph(grid, wraps):
    values = values_of(grid)
    limits = dict.fromkeys(OFFSETS, 0.05)
    takes_part = np.isfinite(values)
    labels = connected(takes_part, step_links(values, takes_part, limits, wraps), 1)
    assert ((labels > 0) == takes_part).all()
    expected = slow_partition(values, limits, wraps)
    assert same_partition(labels[takes_part], expected[takes_part])


@given(GRIDS)
def test_small_components_are_left_out_and_numbers_follow_the_raster(grid):
    values = values_of(grid)
    links = step_links(values, np.isfinite(values), {(0, 1): 0.05, (1, 0): 0.05}, wraps=False)
    every = connected(np.isfinite(values), links, 1)
    large = connected(np.isfinite(values), links, 4)
    sizes = np.bincount(every.ravel())
    assert ((large > 0) == ((sizes[every] >= 4) & (every > 0))).all()
    _, first = np.unique(large[large > 0], return_index=True)
    assert (np.diff(first) > 0).all()
    assert large.max() == len(first)


def test_limits_may_differ_from_pixel_to_pixel():
    values = np.array([[0.0, 0.1, 0.2]], np.float32)
    limits = np.array([[0.2, 0.05, 0.2]], np.float32)
    everywhere = np.ones((1, 3), bool)
    assert step_links(values, everywhere, {(0, 1): limits}, wraps=False)[0, 1].tolist() == [
        [True, False, False]
    ]


def test_links_without_the_row_neighbour_are_refused():
    values = np.zeros((3, 3), np.float32)
    with pytest.raises(LaserImgError, match=r"must hold the offset \(0, 1\)"):
        connected(values == 0, step_links(values, values == 0, {(1, 0): 1.0}, wraps=False), 1)


def flood_fill(range_m, step):
    """Paper 2, section 4, with cv2.floodFill from every pixel in raster order."""
    height, width = range_m.shape
    labels, number = np.zeros((height, width), np.int32), 0
    mask = np.zeros((height + 2, width + 2), np.uint8)
    mask[1:-1, 1:-1] = range_m <= 0
    for y in range(height):
        for x in range(width):
            if mask[y + 1, x + 1]:
                continue
            before = mask[1:-1, 1:-1].copy()
            cv2.floodFill(range_m.copy(), mask, (x, y), 0, step, step, 4 | cv2.FLOODFILL_MASK_ONLY | (1 << 8))
            filled = mask[1:-1, 1:-1] != before
            if filled.sum() >= MIN_PIXELS:
                number += 1
                labels[filled] = number
    return labels


def scan_of(range_m, **fields):
    height, width = range_m.shape
    azimuth, elevation = np.radians(np.arange(width)[::-1] * 0.5), np.radians(np.arange(height)[::-1] * 0.5)
    return Scan.from_range_image(range_m, azimuth, elevation, **fields)


@settings(max_examples=40, deadline=None)
@given(hnp.arrays(np.int8, (14, 17), elements=st.integers(-1, 5)))
def test_reference_regions_equal_flood_fill(grid):
    range_m = np.where(grid < 0, 0, 1 + grid * 0.04).astype(np.float32)
    range_m[0, 0] = 1
    np.testing.assert_array_equal(reference_regions(scan_of(range_m)).labels, flood_fill(range_m, 0.05))


def test_reference_regions_equal_flood_fill_on_a_real_scan(data):
    truth = np.load(data("leica_ptx/leica_ptx_cars_91x199.npz"))
    range_m = truth["range"]
    labels = reference_regions(scan_of(range_m)).labels
    np.testing.assert_array_equal(labels, flood_fill(range_m, 0.05))
    assert labels.max() > 5


@given(st.sets(st.integers(0, 59), min_size=1))
def test_the_bounding_box_holds_every_pixel_and_touches_all_sides(chosen):
    pixels = np.array(sorted(chosen))
    for wraps in (False, True):
        x, y, w, h = (int(v) for v in bounding_box(pixels, 10, wraps))
        rows, columns = pixels // 10, pixels % 10
        assert (rows.min(), rows.max()) == (y, y + h - 1)
        assert set(columns.tolist()) <= {c % 10 for c in range(x, x + w)}
        assert {x, (x + w - 1) % 10} <= set(columns.tolist())
        assert 0 <= x < 10
    # No interval of the circle that holds all columns is shorter.
    shortest = min(max((c - start) % 10 for c in columns.tolist()) + 1 for start in set(columns.tolist()))
    assert w == shortest


def test_regions_carry_their_pixels_in_order():
    range_m = np.ones((8, 8), np.float32)
    range_m[:, 4:] = 3
    partition = reference_regions(scan_of(range_m))
    near, far = regions_of(partition, wraps=False)
    assert (partition.labels.ravel()[near.pixels] == 1).all()
    assert len(near.pixels) == len(far.pixels) == 32
    np.testing.assert_allclose(far.ranges, 3)
    assert far.box == (4, 0, 4, 8)
