"""Ground removal: tilted, uneven and absent ground; real scans against their labels."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from analytic import ray_grid
from laserimg.errors import ScanError
from laserimg.ground import ground_of_points, ground_of_scan
from laserimg.projection import directions_from_angles
from laserimg.scan import Scan


def field(slope_deg=(0.0, 0.0), bumps_m=0.0, noise_m=0.02, seed=0):
    """Points of a field 1.7 m below the scanner, with boxes on it; and which are the field."""
    random = np.random.default_rng(seed)
    radius, angle = 25 * np.sqrt(random.random(20_000)) + 1, random.random(20_000) * 2 * np.pi
    x, y = radius * np.cos(angle), radius * np.sin(angle)
    z = -1.7 + np.tan(np.radians(slope_deg[0])) * x + np.tan(np.radians(slope_deg[1])) * y
    z += bumps_m * np.sin(x / 8) * np.cos(y / 9)
    ground = np.stack([x, y, z + random.normal(0, noise_m, len(x))], axis=-1)
    lifted = ground[::4] + np.stack([0 * x, 0 * x, random.uniform(0.35, 3, len(x))], axis=-1)[::4]
    return np.concatenate([ground, lifted]), np.arange(25_000) < 20_000


def share_right(mask, truth):
    return float((mask == truth).mean())


@pytest.mark.parametrize("slope", [(0, 0), (8, 0), (-5, 12)])
def test_tilted_ground(slope):
    points, truth = field(slope)
    found = ground_of_points(points)
    assert found is not None
    assert share_right(found.mask, truth) > 0.998
    normal = np.array([-np.tan(np.radians(slope[0])), -np.tan(np.radians(slope[1])), 1])
    assert found.plane.normal @ normal / np.linalg.norm(normal) > np.cos(np.radians(0.5))


def test_uneven_ground_is_followed_where_a_plane_is_not_enough():
    points, truth = field(bumps_m=0.35)
    found = ground_of_points(points)
    assert found is not None
    flat = found.plane.distance(points) <= 0.2
    assert share_right(flat, truth) < 0.92
    assert share_right(found.mask, truth) > 0.99


def test_heights_are_over_the_ground():
    points, truth = field((4, 0))
    found = ground_of_points(points)
    assert found is not None
    assert abs(float(np.median(found.height[truth]))) < 0.01
    assert float(found.height[~truth].min()) > 0.3


@pytest.mark.parametrize("kind", ["wall", "ceiling", "few", "cloud"])
def test_no_ground(kind):
    random = np.random.default_rng(1)
    points = random.uniform(-5, 5, (3000, 3))
    if kind == "wall":
        points[:, 0] = 4
    elif kind == "ceiling":
        points[:, 2] = 2
    elif kind == "few":
        points = points[:2]
    assert ground_of_points(points) is None


def test_points_must_be_three_columns():
    with pytest.raises(ScanError, match=r"points must be \(n, 3\), got \(4, 2\)"):
        ground_of_points(np.zeros((4, 2)))


def sloped_scan(slope_deg=5.0):
    """A ring of beams over tilted ground, with a wall 1 m thick on one side."""
    grid = ray_grid(np.arange(179.5, -180, -1.0), np.arange(5.0, -25, -1.0), wraps=True)
    rays = grid.directions.astype(np.float64)
    normal = np.array([-np.sin(np.radians(slope_deg)), 0, np.cos(np.radians(slope_deg))])
    along = rays @ normal
    ground = np.where(along < -1e-3, -1.7 / np.minimum(along, -1e-3), 1e9)
    wall = np.where(rays[..., 0] > 0.1, 8 / np.maximum(rays[..., 0], 0.1), 1e9)
    range_m = np.minimum(ground, wall)
    range_m[range_m > 60] = 0
    return Scan(range_m.astype(np.float32), grid.directions, wraps=True), (ground < wall) & (range_m > 0)


def test_scan_and_points_agree():
    scan, truth = sloped_scan()
    image = ground_of_scan(scan)
    points = ground_of_points(scan.points()[scan.valid])
    assert image is not None and points is not None
    assert share_right(image.mask[scan.valid], truth[scan.valid]) > 0.97
    assert share_right(points.mask, truth[scan.valid]) > 0.97
    assert not image.mask[~scan.valid].any()


def test_the_seam_makes_no_difference():
    scan, _ = sloped_scan()
    turned = Scan(np.roll(scan.range, 90, 1), np.roll(scan.directions, 90, 1), wraps=True)
    one, other = ground_of_scan(scan), ground_of_scan(turned)
    assert one is not None and other is not None
    assert_array_equal(np.roll(one.mask, 90, 1), other.mask)


@pytest.mark.parametrize("distance_m", [2, 5])
def test_ground_does_not_climb_up_what_stands_near(distance_m):
    """A board 1 m high and 4 m wide: windows of the image took 0.8 m of it."""
    grid = ray_grid(np.arange(179.75, -180, -0.5), np.arange(30.0, -60, -0.25), wraps=True)
    with np.errstate(divide="ignore", invalid="ignore"):
        ground = np.where(grid.directions[..., 2] < 0, -1.5 / grid.directions[..., 2], np.inf)
        board = np.where(grid.directions[..., 0] > 0, distance_m / grid.directions[..., 0], np.inf)
        hit = board[..., None] * grid.directions
    board[(np.abs(hit[..., 1]) > 2) | (hit[..., 2] > -0.5)] = np.inf
    range_m = np.minimum(ground, board)
    scan = Scan(np.where(range_m < 40, range_m, 0).astype(np.float32), grid.directions, wraps=True)
    found = ground_of_scan(scan)
    assert found is not None
    on_board = (board < ground) & scan.valid
    assert hit[..., 2][on_board & found.mask].max() < -1.5 + 0.25
    assert found.mask[(ground < board) & scan.valid].mean() > 0.99


def test_a_scan_that_looks_up_has_no_ground():
    rays = directions_from_angles(np.radians(np.arange(20.0, -20, -1)), np.radians(np.arange(30.0, 5, -1)))
    assert ground_of_scan(Scan(np.full(rays.shape[:2], 5, np.float32), rays)) is None


def test_semantickitti(data):
    """Road, sidewalk, parking and terrain against the rest within 30 m: IoU 0.980 measured."""
    points = np.fromfile(data("semantickitti/000000.bin"), "<f4").reshape(-1, 4)[:, :3]
    label = np.fromfile(data("semantickitti/000000.label"), "<u4") & 0xFFFF
    found = ground_of_points(points)
    assert found is not None
    counted = (label > 0) & (np.linalg.norm(points, axis=1) < 30)
    truth, mask = np.isin(label, (40, 44, 48, 49, 72))[counted], found.mask[counted]
    assert (truth & mask).sum() / (truth | mask).sum() > 0.97


def test_a_level_slice_through_facades_is_no_ground():
    """Far facades hold more in any 0.2 m of height than the little ground seen between cars."""
    random = np.random.default_rng(4)
    floor = np.column_stack([random.uniform(-3, 3, (2500, 2)), random.normal(-1.9, 0.02, 2500)])
    facades = np.column_stack(
        [np.full(7500, 40.0), random.uniform(-20, 20, 7500), random.uniform(-1.9, 0.5, 7500)]
    )
    ground = ground_of_points(np.concatenate([floor, facades]))
    assert ground is not None
    assert ground.plane.offset_m == pytest.approx(-1.9, abs=0.05)
    assert ground.mask[:2500].all()
    assert ground.mask[2500:].mean() < 0.2


def test_points_without_a_place_and_one_far_away_leave_the_ground_as_it_is():
    rng = np.random.default_rng(0)
    level = np.column_stack([rng.uniform(-20, 20, (4000, 2)), rng.normal(-1.5, 0.02, 4000)])
    alone = ground_of_points(level)
    more = ground_of_points(np.concatenate([level, [[np.nan, 0, 0], [np.inf, 0, 0], [1e6, 0, 0]]]))
    assert alone.mask.all() and np.array_equal(more.mask[:4000], alone.mask)
    assert not more.mask[4000:4002].any() and np.isnan(more.height[4000:4002]).all()
