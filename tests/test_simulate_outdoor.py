"""Outdoor objects and the street, over many seeds."""

import numpy as np
import pytest

from laserimg.simulate.objects.cars import STYLES, car
from laserimg.simulate.objects.people import person
from laserimg.simulate.objects.poles import bollard, lamp_post, sign_post, traffic_light
from laserimg.simulate.objects.trees import tree
from laserimg.simulate.scenes.park import park
from laserimg.simulate.scenes.street import street

SIZES = {
    car: ((3.6, 1.65, 1.40), (5.4, 2.3, 2.05)),
    person: ((0.2, 0.35, 1.1), (1.7, 1.1, 2.0)),
    tree: ((1.0, 1.0, 2.2), (11.0, 11.0, 14.0)),
    lamp_post: ((0.4, 0.1, 3.5), (2.0, 0.3, 8.3)),
    sign_post: ((0.05, 0.4, 2.4), (0.2, 0.8, 3.2)),
    traffic_light: ((0.2, 0.25, 3.0), (0.4, 0.3, 3.6)),
    bollard: ((0.08, 0.08, 0.8), (0.22, 0.22, 1.1)),
}


@pytest.mark.parametrize("maker", SIZES)
def test_stands_on_the_ground_within_its_sizes_and_repeats(maker):
    low, high = SIZES[maker]
    for seed in range(40):
        mesh, again = (maker(np.random.default_rng(seed)).mesh for _ in range(2))
        assert np.isfinite(mesh.vertices).all()
        assert np.array_equal(mesh.vertices, again.vertices)
        assert abs(mesh.vertices[:, 2].min()) < 0.01
        assert (mesh.extents >= low).all() and (mesh.extents <= high).all(), (seed, mesh.extents)
        assert len(mesh.reflectance) == len(mesh.faces) and mesh.faces.max() < len(mesh.vertices)


def test_cars_have_every_style_and_windows():
    assert len(STYLES) == 5
    for seed in range(10):
        assert (car(np.random.default_rng(seed)).mesh.transmission > 0.5).sum() >= 20


@pytest.mark.parametrize("make", [street, park])
def test_nothing_of_a_scene_is_within_the_scanner(make):
    for seed in range(10):
        scene = make(np.random.default_rng(seed))
        place = scene.scanners[0][:3, 3]
        for thing in scene.things:
            assert np.isfinite(thing.mesh.vertices).all()
            assert np.linalg.norm(thing.mesh.vertices - place, axis=1).min() > 0.3, thing.kind


def test_panes_lie_behind_their_walls_on_both_sides_of_the_street():
    sides = set()
    for seed in range(5):
        for thing in street(np.random.default_rng(seed)).things:
            if thing.kind == "facade":
                y = thing.mesh.vertices[:, 1]
                sides.add(np.sign(y[0]))
                assert np.abs(y).max() > np.abs(y[0]) + 0.2, "the back wall is farther out than the front"
    assert sides == {-1, 1}


def test_crowns_and_cars_stay_off_the_facades():
    for seed in range(10):
        things = street(np.random.default_rng(seed)).things
        walls = [np.abs(t.mesh.vertices[:, 1]) for t in things if t.kind == "facade"]
        nearest = min(wall.min() for wall in walls)
        for thing in things:
            if thing.label in ("tree", "car"):
                assert np.abs(thing.mesh.vertices[:, 1]).max() < nearest + 0.13, (seed, thing.kind)
