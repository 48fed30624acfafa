"""The ray caster of the benchmark scenes against geometry worked out by hand."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from laserimg.projection import directions_from_angles
from objects import Thing, ball, car, crate, hall, person, table, tree, wastebasket
from scenes import COLUMNS, ROWS, Scene, edges, panorama, room, scan_of, street
from shapes import Ellipsoid, Frustum, Part, box, ground, pose, prism, raycast

FORWARD = np.array([[1.0, 0.0, 0.0]])
SHAPES = [
    box(1.0, 0.6, 0.8),
    prism([(-0.5, 0), (0.5, 0), (0.1, 0.9)], 0.7),
    Frustum(0.4, 0.3, 0.9),
    Frustum(0.2, 0.5, 0.7, open_top=True),
    Ellipsoid((0.5, 0.3, 0.4)),
]


def test_distances_and_normals_straight_ahead():
    near = Part(box(2, 2, 2), pose(5, 0, -1))
    cast = raycast([Part(Ellipsoid((1, 1, 1)), pose(9, 0, 0)), near], FORWARD)
    assert cast.distance[0] == pytest.approx(4)
    assert cast.part[0] == 1
    np.testing.assert_allclose(cast.normal[0], [-1, 0, 0])


def test_one_looks_into_an_open_basket_and_onto_a_closed_one():
    down = np.array([[0.0, 0.0, -1.0]])
    place = pose(0, 0, -2)
    assert raycast([Part(Frustum(0.2, 0.3, 0.5, open_top=True), place)], down).distance[0] == pytest.approx(2)
    assert raycast([Part(Frustum(0.2, 0.3, 0.5), place)], down).distance[0] == pytest.approx(1.5)


def test_a_room_is_seen_from_inside():
    cast = raycast([Part(box(8, 6, 3), pose(0, 0, -1))], np.array([[1.0, 0, 0], [0, -1, 0], [0, 0, 1]]))
    np.testing.assert_allclose(cast.distance, [4, 3, 2])
    np.testing.assert_allclose(cast.normal, [[-1, 0, 0], [0, 1, 0], [0, 0, -1]], atol=1e-12)


@pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: type(shape).__name__)
@given(yaw=st.floats(0, 360), pitch=st.floats(-60, 60), seed=st.integers(0, 1000))
def test_hits_lie_on_the_surface_and_normals_stand_on_it(shape, yaw, pitch, seed):
    """A point hit stays in the surface when the ray moves a little: the normal says which way."""
    part = Part(shape, pose(3, 0.2, -0.3, yaw, pitch))
    middle = part.corners.mean(axis=0)
    rays = middle + np.random.default_rng(seed).normal(0, 0.15, (50, 3))
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    moved = rays + 1e-6 * np.cross(rays, [0.3, 0.5, 0.8])
    moved /= np.linalg.norm(moved, axis=1, keepdims=True)
    first, second = raycast([part], rays), raycast([part], moved)
    both = np.isfinite(first.distance) & np.isfinite(second.distance) & (first.face == second.face)
    assert both.any()
    step = second.distance[both, None] * moved[both] - first.distance[both, None] * rays[both]
    off_plane = np.abs(np.einsum("ij,ij->i", step, first.normal[both]))
    # Open frustums may be hit on the inner wall by one of the two rays: a few jumps are right.
    assert np.median(off_plane) < 1e-9
    np.testing.assert_allclose(np.linalg.norm(first.normal[both], axis=1), 1)
    assert (np.einsum("ij,ij->i", first.normal, rays)[both] <= 0).all()


def test_a_turned_thing_has_the_sizes_of_its_box():
    assert crate(0.4, 0.3, 0.5).size == pytest.approx((0.4, 0.3, 0.5))
    assert crate(0.4, 0.3, 0.5).at(3, 1, yaw=90).size == pytest.approx((0.3, 0.4, 0.5))
    assert wastebasket(0.36, 0.27).size == pytest.approx((0.27, 0.27, 0.36))
    assert car(4.3, 1.75, 1.45).size == pytest.approx((4.3, 1.75, 1.45))
    assert person(1.8).size[2] == pytest.approx(1.8, abs=0.01)
    assert table(1.4, 0.7, 0.74).size == pytest.approx((1.4, 0.7, 0.74))
    assert ball(0.7).size == pytest.approx((0.7, 0.7, 0.7))


def test_a_car_hides_what_is_behind_its_windows():
    directions = directions_from_angles(
        np.radians(np.linspace(4, -4, 81)), np.radians(np.linspace(1, -8, 61))
    )
    far_wall = Thing("wall", (Part(box(0.2, 40, 10), pose(20)),))
    scan, truth = scan_of(Scene((car().at(10, 0, yaw=90), far_wall), (0, 0, 1.3), 60), directions, 0.0)
    assert set(np.unique(truth.thing)) == {-1, 0, 1}
    glass = (truth.thing == -1) & (scan.range == 0)
    on_car = np.argwhere(truth.thing == 0)
    rows, columns = np.argwhere(glass).mean(axis=0)
    assert (on_car.min(axis=0) < (rows, columns)).all()
    assert ((rows, columns) < on_car.max(axis=0)).all()


def test_noise_is_what_was_asked_and_comes_from_the_seed():
    scene = Scene((hall(8, 6, 3),), (0, 0, 1.2), 20)
    rays = panorama(60, 90)
    (first, truth), (same, _), (other, _) = (scan_of(scene, rays, 0.01, seed) for seed in (1, 1, 2))
    assert np.array_equal(first.range, same.range)
    assert not np.array_equal(first.range, other.range)
    assert np.std(first.range - truth.range) == pytest.approx(0.01, rel=0.05)


def test_edges_are_within_two_pixels_also_across_the_seam():
    surface = np.ones((5, 12), np.int32)
    surface[:, :6] = 2
    marked = edges(surface)[2]
    assert marked.tolist() == [True, True, False, False, True, True, True, True, False, False, True, True]


def test_the_benchmark_room_is_as_the_contract_says():
    scan, truth = scan_of(room(), panorama(190, 284))
    assert (ROWS, COLUMNS) == (760, 1135)
    labels = [thing.label for thing in truth.things]
    assert labels.count("box") == 12
    assert {"drum", "ball", "ramp", "room"} <= set(labels)
    seen = {truth.things[index].label for index in np.unique(truth.thing)}
    assert {"box", "drum", "ball", "ramp"} <= seen
    assert scan.wraps
    assert 0.7 <= scan.range.min() < 0.8
    assert 8.5 < scan.range.max() < 9.1
    floor = np.isclose(truth.normals[..., 2], 1) & (truth.thing == 0)
    assert floor[150:].mean() > 0.7


def test_the_street_reaches_to_sixty_metres_and_has_its_things():
    scan, truth = scan_of(street(), panorama(190, 284))
    assert 50 < scan.range.max() <= 60.1
    assert (scan.range[:60] == 0).mean() > 0.5
    seen = {truth.things[index].label for index in np.unique(truth.thing[truth.thing >= 0])}
    assert seen == {"ground", "facade", "car", "pole", "tree", "person"}


def test_sloping_ground_and_seeded_trees():
    slope = Part(ground((np.sin(0.1), 0, np.cos(0.1))), pose(z=-1))
    assert raycast([slope], np.array([[0.0, 0.0, -1.0]])).distance[0] == pytest.approx(1)
    one, same = tree(np.random.default_rng(3)), tree(np.random.default_rng(3))
    assert one.size == same.size
