"""Clusters on the lattice, one an object: those of the points, carried to all pixels."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from analytic import boxes_and_floor, ray_grid
from laserimg.clusters import LINK, linked
from laserimg.ground import ground_of_scan
from laserimg.object_clusters import object_clusters
from laserimg.scan import Scan
from laserimg.semantic_map.object_labels import MOST_POINTS, object_labels

# Two people 12 cm apart, a post before a facade, and the facade.
PEOPLE = [((8, -0.5, -1.5), (8.3, -0.06, 0.2)), ((8, 0.06, -1.5), (8.3, 0.5, 0.2))]
POST = ((6, 4, -1.5), (6.04, 4.04, 1.5))
FACADE = ((-20, 12, -1.5), (20, 13, 4))


def seen(step_deg, boxes, turned_deg=0.0):
    azimuth = np.arange(180 - step_deg / 2, -180, -step_deg) + turned_deg
    grid = ray_grid(azimuth, np.arange(25.0, -30, -step_deg), wraps=True)
    scan = boxes_and_floor(grid, boxes, far_m=40.0)
    ground = ground_of_scan(scan)
    assert ground is not None
    return scan, scan.valid & ~ground.mask, ground.height


def of_box(scan, box):
    """Pixels on a box, 5 cm within its sides."""
    points = scan.points()
    low, high = np.array(box[0]) - 0.01, np.array(box[1]) + 0.01
    return scan.valid & (points >= low).all(-1) & (points <= high).all(-1)


def test_few_returns_have_the_labels_of_their_points():
    scan, above, height = seen(1.0, [*PEOPLE, POST, FACADE])
    assert above.sum() < MOST_POINTS
    labels, _ = object_labels(scan, above, height)
    points = object_clusters(scan.points()[above], height[above], scan.up, min_points=1)
    assert_array_equal(labels[above], points)


@pytest.fixture(scope="module")
def dense():
    scan, above, height = seen(0.125, [*PEOPLE, POST, FACADE])
    assert above.sum() > 2 * MOST_POINTS
    return scan, above, object_labels(scan, above, height)[0]


def test_touching_people_are_two_where_plain_neighbours_are_one(dense):
    scan, above, labels = dense
    one, other = (np.unique(labels[of_box(scan, box) & above]).tolist() for box in PEOPLE)
    assert len(one) == len(other) == 1 and one != other and 0 not in (*one, *other)
    plain, _ = linked(scan.range, scan.directions, above, True, LINK)
    assert len(np.unique(plain[np.isin(labels, [*one, *other])])) == 1


def test_thin_things_before_others_and_what_is_behind_them_are_whole(dense):
    scan, above, labels = dense
    post, facade = of_box(scan, POST) & above, of_box(scan, FACADE) & above
    assert 0 < np.ptp(np.flatnonzero(post.any(axis=0))) + 1 <= 4
    (of_post,), (of_facade,) = np.unique(labels[post]), np.unique(labels[facade])
    assert of_post != of_facade and 0 not in (of_post, of_facade)
    assert (labels == of_post).sum() == post.sum()


def test_nothing_above_the_ground_is_left_out_and_nothing_else_taken(dense):
    _, above, labels = dense
    assert (labels[above] > 0).all() and (labels[~above] == 0).all()


def test_the_seam_makes_no_difference():
    step = 0.125
    scan, above, height = seen(step, [*PEOPLE, POST, FACADE])
    labels, _ = object_labels(scan, above, height)
    columns = scan.shape[1] // 2
    turned = Scan(np.roll(scan.range, columns, 1), np.roll(scan.directions, columns, 1), wraps=True)
    other, _ = object_labels(turned, np.roll(above, columns, 1), np.roll(height, columns, 1))
    pairs = np.unique(np.stack([np.roll(labels, columns, 1), other]).reshape(2, -1), axis=1)
    assert pairs.shape[1] == labels.max() + 1 == other.max() + 1


def test_without_any_return_there_is_no_cluster():
    scan, above, height = seen(1.0, PEOPLE)
    labels, range_m = object_labels(scan, np.zeros_like(above), height)
    assert not labels.any()
    assert_array_equal(range_m, scan.range)
