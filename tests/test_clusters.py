import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from analytic import boxes_and_floor, ray_grid
from laserimg.boxes import iou
from laserimg.clusters import find_clusters, standing_objects
from laserimg.geometry.floor import find_floor
from laserimg.geometry.mounting import rotated, with_up
from laserimg.geometry.planes import Plane, fit_plane
from laserimg.measure import metric_box
from laserimg.readers import open_scans
from laserimg.regions import Region, reference_regions, regions_of
from laserimg.scan import Scan

FINE = np.arange(60.0, -60.0, -0.3), np.arange(20.0, -50.0, -0.3)


def best_region(scan, partition, box):
    regions = regions_of(partition, scan.wraps)
    overlap = iou([box], [region.box for region in regions], scan.shape[1])[0]
    return regions[int(np.argmax(overlap))], float(overlap.max())


def test_a_fitted_plane_holds_its_points():
    random = np.random.default_rng(0)
    normal = np.array([0.2, -0.3, 1.0]) / np.linalg.norm([0.2, -0.3, 1.0])
    points = random.normal(size=(200, 3))
    points -= (points @ normal - 0.7)[:, None] * normal
    plane = fit_plane(points).towards(normal)
    np.testing.assert_allclose(plane.normal, normal, atol=1e-9)
    assert plane.offset_m == pytest.approx(0.7)
    np.testing.assert_allclose(plane.distance(points + 0.1 * normal), 0.1)


def test_the_floor_is_found_under_boxes_and_noise():
    scan = boxes_and_floor(ray_grid(*FINE), [((3, -1, -1.5), (4, 1, 0))], noise_m=0.01)
    floor = find_floor(scan)
    assert floor.height_below_m == pytest.approx(1.5, abs=0.005)
    assert floor.tilt_deg < 0.2
    assert floor.rms_m == pytest.approx(0.01, abs=0.003)


def test_a_table_with_few_returns_below_is_no_floor_but_a_wall_never_is():
    grid = ray_grid(np.arange(20.0, -20.0, -0.5), np.arange(10.0, -10.0, -0.5))
    wall = boxes_and_floor(grid, [((3, -5, -5), (3.1, 5, 5))], floor_m=-9)
    assert find_floor(wall) is None


def test_up_decides_what_a_floor_is():
    scan = boxes_and_floor(ray_grid(*FINE), [])
    assert find_floor(with_up(scan, "x")) is None
    assert find_floor(rotated(scan, 0, 0, 90)).height_below_m == pytest.approx(1.5, abs=1e-3)


@pytest.mark.parametrize("wraps_at", [0.0, 170.0])
def test_objects_come_apart_where_the_reference_runs_together(wraps_at):
    azimuth = np.arange(180.0, -180.0, -0.5) if wraps_at else np.arange(60.0, -60.0, -0.5)
    grid = ray_grid(azimuth, np.arange(20.0, -50.0, -0.5), wraps=bool(wraps_at))
    turn = np.radians(wraps_at)
    rotation = np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
    at_x = boxes_and_floor(
        Scan(grid.range, grid.directions @ rotation.astype(np.float32)),  # rays seen from the turned frame
        [((2, -0.4, -1.5), (2.3, -0.1, -1.1)), ((2, 0.3, -1.5), (2.3, 0.6, -1.1))],
    )
    scan = Scan(at_x.range, grid.directions, wraps=grid.wraps)
    partition = find_clusters(scan, find_floor(scan))
    regions = regions_of(partition, scan.wraps)
    assert len(regions) == 2
    for region in regions:
        box = metric_box(scan, region, find_floor(scan))
        assert (box.length, box.breadth, box.height) == pytest.approx((0.3, 0.3, 0.4), abs=0.04)
        assert box.height_above_floor == 0
    reference = reference_regions(scan).labels
    floor_label = np.bincount(reference.ravel())[1:].argmax() + 1
    feet = [reference.ravel()[region.pixels] for region in regions]
    assert all((labels == floor_label).any() for labels in feet)


def test_a_gap_without_returns_is_bridged():
    scan = boxes_and_floor(ray_grid(*FINE), [((6, -1, -1.5), (6.2, 1, 0))])
    range_m = scan.range.copy()
    range_m[np.abs(np.degrees(np.arcsin(scan.directions[..., 2])) + 5) < 0.7] = 0
    scan = Scan(range_m, scan.directions)
    assert len(regions_of(find_clusters(scan, find_floor(scan)), wraps=False)) == 1
    assert len(regions_of(reference_regions(scan), wraps=False)) > 1


def test_a_large_wall_is_taken_out_and_what_stands_before_it_stays():
    scan = boxes_and_floor(
        ray_grid(*FINE), [((3, -4, -1.5), (3.2, 4, 2)), ((2.9, -0.2, -1.5), (3, 0.2, -1.0))]
    )
    partition = find_clusters(scan, find_floor(scan))
    (region,) = regions_of(partition, wraps=False)
    box = metric_box(scan, region, find_floor(scan))
    assert (box.width, box.height) == pytest.approx((0.4, 0.5), abs=0.05)


# A board of 2 x 2 m behind the scanner, where the turn begins and ends, and a bin before it.
BEHIND = boxes_and_floor(
    ray_grid(np.linspace(180.0, -180.0, 715, endpoint=False), np.arange(35.0, -50.0, -0.5), wraps=True),
    [((-3.1, -1, -0.5), (-3, 1, 1.5)), ((-2.2, -0.15, -1.5), (-1.9, 0.15, -1.1))],
    noise_m=0.0,
)
COLUMNS = BEHIND.shape[1]


def on_board(scan):
    """The returns of the board, a mask."""
    points = scan.points()
    return (np.abs(points[..., 0] + 3) < 0.01) & (points[..., 2] > -1)


@given(st.integers(0, COLUMNS - 1))
def test_a_board_across_the_seam_is_taken_out_wherever_the_turn_begins(shift):
    range_m, directions = (np.roll(values, shift, axis=1) for values in (BEHIND.range, BEHIND.directions))
    scan = Scan(range_m, directions, wraps=True)
    objects = standing_objects(scan, find_floor(scan))
    (region,) = regions_of(find_clusters(scan, find_floor(scan)), wraps=True)
    middle = scan.points().reshape(-1, 3)[region.pixels].mean(axis=0)
    assert middle == pytest.approx((-1.95, 0, -1.3), abs=0.1)
    # The same returns, not one of them of the board.
    board = on_board(scan)
    assert board.sum() > 2000 and not (objects & board).any()


def test_without_a_full_turn_the_edges_of_a_scan_are_no_neighbours():
    objects = standing_objects(Scan(BEHIND.range, BEHIND.directions), find_floor(BEHIND))
    assert objects[on_board(BEHIND)].all()


@pytest.mark.parametrize("elevation", [0.0, -45.0])
def test_a_ball_measures_the_same_level_and_far_below(elevation):
    grid = ray_grid(np.arange(30.0, -30.0, -0.3), elevation + np.arange(15.0, -15.0, -0.3))
    tilt = np.radians(elevation)
    centre = 2.0 * np.array([np.cos(tilt), 0, np.sin(tilt)])
    along = grid.directions.astype(float) @ centre
    inside = along**2 - (centre @ centre - 0.2**2)
    range_m = np.where(inside > 0, along - np.sqrt(np.maximum(inside, 0)), 0)
    scan = Scan(range_m.astype(np.float32), grid.directions)
    (region,) = regions_of(find_clusters(scan, None), wraps=False)
    box = metric_box(scan, region, None)
    # The outermost 1 % on both sides of a ball of 0.4 m make 0.027 m.
    assert box.width == pytest.approx(0.373, abs=0.01)
    assert box.elevation_deg == pytest.approx(elevation, abs=0.5)
    assert box.height_above_floor is None
    assert box.range == pytest.approx(1.85, abs=0.05)


@given(st.integers(20, 140), st.integers(20, 520))
def test_a_rectangle_of_any_number_of_pixels_has_its_size(columns, rows):
    """A square of 1 m straight ahead, 3 m away; an edge lies half a pixel beyond the last ray."""
    across, up = ((np.arange(n) + 0.5) / n - 0.5 for n in (columns, rows))
    points = np.stack([np.full((rows, columns), 3.0), *np.meshgrid(-across, -up)], axis=-1)
    range_m = np.linalg.norm(points, axis=-1)
    scan = Scan(range_m.astype(np.float32), (points / range_m[..., None]).astype(np.float32))
    pixels = np.arange(rows * columns)
    region = Region(pixels, scan.range.ravel(), (0.0, 0.0, float(columns), float(rows)))
    box = metric_box(scan, region, None)
    assert (box.width, box.height) == pytest.approx((1.0, 1.0), abs=0.045)


CARS = [(33, 31, 61, 35), (123, 26, 48, 42)]


def test_both_real_cars_are_one_cluster_each(data):
    (scan,) = open_scans(data("leica_ptx/1.ptx"))
    floor = find_floor(scan)
    partition = find_clusters(scan, floor)
    for car in CARS:
        region, overlap = best_region(scan, partition, car)
        box = metric_box(scan, region, floor)
        assert overlap >= 0.85
        assert 1.6 <= box.breadth <= 2.0
        assert 1.3 <= box.height <= 1.8


def test_the_real_wastebasket_is_a_cluster_of_its_own(data):
    (scan,) = open_scans(data("office_room/room_scan1.pcd"))
    floor = find_floor(scan)
    assert 0.5 < floor.tilt_deg < 1.5
    region, overlap = best_region(scan, find_clusters(scan, floor), (231, 129, 12, 12))
    box = metric_box(scan, region, floor)
    assert overlap >= 0.8
    assert box.width == pytest.approx(0.25, abs=0.03)
    assert box.height == pytest.approx(0.36, abs=0.02)


def test_the_plane_of_a_floor_measures_heights():
    plane = Plane(np.array([0.0, 0.0, 1.0]), -1.2)
    assert plane.distance(np.array([[5.0, 0.0, -0.2]], np.float32))[0] == pytest.approx(1.0)


@pytest.mark.parametrize("axis", [0, 1])
def test_rays_that_coincide_are_no_reason_to_fail(axis):
    """A scan whose columns, or rows, all look the same way."""
    angles = [np.radians(np.arange(10.0, -10.0, -1.0)), np.radians(np.arange(5.0, -15.0, -1.0))]
    angles[axis] = np.zeros(20)
    scan = Scan.from_range_image(np.full((20, 20), 2.0), *angles)
    assert find_clusters(scan, find_floor(scan)).labels.shape == (20, 20)
