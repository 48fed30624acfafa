"""Outdoor objects and the street, over many seeds."""

from collections import Counter
from itertools import combinations

import cv2
import numpy as np
import pytest

from laserimg.simulate.materials import MATERIALS
from laserimg.simulate.objects import OBJECTS
from laserimg.simulate.objects.bicycles import bicycle
from laserimg.simulate.objects.cars import STYLES, car
from laserimg.simulate.objects.facades import front
from laserimg.simulate.objects.hedges import hedge
from laserimg.simulate.objects.lorries import lorry
from laserimg.simulate.objects.outdoor import (
    bench,
    fence,
    litter_bin,
    low_wall,
    planter,
    shrub,
    utility_box,
    wheelie_bin,
)  # fmt: skip
from laserimg.simulate.objects.people import person
from laserimg.simulate.objects.poles import bollard, lamp_post, sign_post, traffic_light
from laserimg.simulate.objects.trees import tree
from laserimg.simulate.scenes.park import park
from laserimg.simulate.scenes.street import street
from laserimg.simulate.things import Thing

SIZES = {
    car: ((3.6, 1.65, 1.40), (5.4, 2.3, 2.05)),
    person: ((0.2, 0.35, 1.1), (1.7, 1.1, 2.0)),
    tree: ((0.7, 0.7, 2.2), (13.0, 13.0, 14.0)),
    lamp_post: ((0.4, 0.1, 3.5), (2.0, 0.3, 8.3)),
    sign_post: ((0.05, 0.4, 2.4), (0.2, 0.8, 3.2)),
    traffic_light: ((0.2, 0.25, 3.0), (0.4, 0.3, 3.6)),
    bollard: ((0.08, 0.08, 0.8), (0.22, 0.22, 1.1)),
    bicycle: ((1.45, 0.5, 0.85), (1.95, 0.75, 1.3)),
    lorry: ((4.9, 1.95, 2.3), (12.0, 2.6, 3.75)),
    bench: ((0.4, 1.2, 0.35), (0.75, 2.2, 0.95)),
    litter_bin: ((0.15, 0.25, 0.6), (0.56, 0.56, 1.25)),
    wheelie_bin: ((0.5, 0.4, 0.93), (0.85, 0.65, 1.10)),
    utility_box: ((0.3, 0.4, 0.8), (0.55, 1.65, 1.6)),
    planter: ((0.4, 0.5, 0.5), (1.0, 1.7, 1.5)),
    shrub: ((0.4, 0.4, 0.4), (5.0, 5.0, 2.6)),
    fence: ((0.01, 1.9, 0.75), (0.15, 6.1, 1.95)),
    low_wall: ((0.15, 2.0, 0.4), (0.55, 6.0, 1.8)),
    hedge: ((0.45, 1.9, 0.75), (1.2, 6.3, 1.8)),
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


def test_house_doors_have_handles_and_are_shut_ajar_or_open_inwards():
    doors = [
        t.mesh for seed in range(60) for t in front(np.random.default_rng(seed), 9.0) if t.label == "door"
    ]
    assert len(doors) == 60
    inwards = np.array([-mesh.vertices[:, 0].min() for mesh in doors])
    assert max(mesh.vertices[:, 0].max() for mesh in doors) < 0.12
    assert 0.45 < (inwards < 0.33).mean() < 0.8 and 0.08 < (inwards > 0.7).mean() < 0.35
    metal = np.float32(MATERIALS["metal_bare"].specular)
    for mesh in doors:
        handle = mesh.vertices[mesh.faces[mesh.specular == metal]][..., 2]
        assert handle.min() > 0.85 and handle.max() < 1.2


def test_house_windows_have_frames_that_fill_their_holes_and_panes_behind_the_wall():
    for seed in range(10):
        windows = [t.mesh for t in front(np.random.default_rng(seed)) if t.label == "window"]
        assert len(windows) >= 3 and len({len(mesh.faces) for mesh in windows}) <= 2
        for mesh in windows:
            panes = mesh.vertices[mesh.faces[mesh.transmission > 0.5]]
            assert panes[..., 0].max() < 0 and len(mesh.faces) > 100
            assert (np.ptp(panes[..., 1:], axis=(0, 1)) < mesh.extents[1:] - 0.15).all()


def test_some_signs_retroreflect():
    bright = np.float32(MATERIALS["retroreflector"].reflectance)
    shares = [(sign_post(np.random.default_rng(s)).mesh.reflectance == bright).any() for s in range(60)]
    assert 0.5 < np.mean(shares) < 0.85


def test_crowns_and_cars_stay_off_the_facades():
    for seed in range(10):
        things = street(np.random.default_rng(seed)).things
        # The first corner of a facade is one of its wall; balconies and awnings may be nearer.
        nearest = min(abs(t.mesh.vertices[0, 1]) for t in things if t.kind == "facade")
        for thing in things:
            if thing.label in ("tree", "car"):
                assert np.abs(thing.mesh.vertices[:, 1]).max() < nearest + 0.13, (seed, thing.kind)


BUILT = {"ground", "facade", "door", "window"}


def feet(thing):
    """The hull, seen from above, of what is below 2.2 m of its foot; bicycles lean on each other."""
    points = thing.mesh.vertices
    low = points[points[:, 2] < points[:, 2].min() + 2.0][:, :2]
    return cv2.convexHull(low.astype(np.float32))


@pytest.mark.parametrize("make", [street, park])
def test_nothing_stands_in_another_thing(make):
    for seed in range(8):
        loose = [t for t in make(np.random.default_rng(seed)).things if t.kind not in BUILT]
        hulls = [feet(thing) for thing in loose]
        for i, j in combinations(range(len(loose)), 2):
            pair = {loose[i].kind, loose[j].kind}
            if pair == {"bicycle"} or pair == {"bench", "person"}:
                continue
            area, _ = cv2.intersectConvexConvex(hulls[i], hulls[j])
            assert area < 0.01, (seed, pair)


@pytest.mark.parametrize("make", [street, park])
def test_things_stand_on_the_ground_which_falls_in_most_streets(make):
    pytest.importorskip("embreex")
    from laserimg.simulate.cast import Caster

    falls = []
    for seed in range(8):
        ground, *things = make(np.random.default_rng(seed)).things
        falls.append(np.ptp(ground.mesh.vertices[:, 2]))
        loose = [t.mesh.vertices for t in things if t.kind not in BUILT]
        sits = [v[:, 2].min() for v in loose]
        lows = [v[v[:, 2] < foot + 2, :2] for v, foot in zip(loose, sits, strict=True)]
        over = np.array([[*(low.min(axis=0) + low.max(axis=0)) / 2, 20.0] for low in lows])
        below = 20 - Caster(ground.mesh)(over, np.tile([0.0, 0.0, -1.0], (len(over), 1))).distance
        assert np.abs(below - sits).max() < 0.25, seed
        assert np.median(np.abs(below - sits)) < 0.03
    assert np.mean(np.array(falls) > 0.5) > 0.4


def test_streets_have_every_class_and_cars_in_rows():
    scenes = [street(np.random.default_rng(seed)) for seed in range(15)]
    counts = Counter(thing.label for scene in scenes for thing in scene.things)
    for label in ("car", "person", "tree", "pole", "building", "door", "window", "bicycle", "lorry",
                  "bench", "litter_bin", "bollard", "hedge", "fence", "low_wall"):  # fmt: skip
        assert counts[label] >= 3, label
    assert counts["wastebasket"] == 0
    assert counts["car"] / len(scenes) > 8


def test_makers_of_objects_return_one_thing():
    for name, make in OBJECTS.items():
        assert isinstance(make(np.random.default_rng(0)), Thing), name
    assert OBJECTS["facade"](np.random.default_rng(0)).label == "building"


def test_one_sees_wheels_in_their_arches():
    """A ray from the side, 3 cm over a wheel's top, goes at least 20 cm under the body."""
    pytest.importorskip("embreex")
    from laserimg.simulate.cast import Caster

    for seed in range(20):
        mesh = car(np.random.default_rng(seed)).mesh
        rubber = mesh.reflectance == np.float32(MATERIALS["rubber"].reflectance)
        wheels = mesh.vertices[mesh.faces[rubber]].reshape(-1, 3)
        assert wheels[:, 2].min() == pytest.approx(0, abs=0.01)
        top, outer = wheels[:, 2].max(), wheels[:, 1].max()
        front = wheels[wheels[:, 0] > 0, 0]
        start = [(front.min() + front.max()) / 2, 5.0, top + 0.03]
        assert Caster(mesh)(start, [(0.0, -1.0, 0.0)]).distance[0] > 5 - outer + 0.2, seed
