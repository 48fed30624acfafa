"""Indoor objects and scenes, over many seeds."""

import numpy as np
import pytest

from laserimg.simulate.objects import OBJECTS
from laserimg.simulate.scenes import SCENES
from laserimg.simulate.scenes.placing import part_boxes, penetration, placed

SIZES = {
    "wastebasket": ((0.11, 0.20, 0.22), (0.40, 0.40, 0.60)),
    "office_chair": ((0.5, 0.5, 0.75), (1.0, 0.8, 1.5)),
    "chair": ((0.38, 0.38, 0.75), (0.6, 0.5, 0.98)),
    "door": ((0.10, 0.7, 2.0), (1.5, 2.6, 2.3)),
    "window": ((0.05, 0.55, 0.65), (0.8, 2.3, 1.8)),
    "desk": ((0.6, 1.15, 0.66), (1.8, 2.3, 1.6)),
    "table": ((0.4, 0.55, 0.4), (1.3, 1.85, 1.1)),
    "shelf": ((0.24, 0.4, 0.8), (0.45, 1.25, 2.25)),
    "cabinet": ((0.33, 0.4, 0.7), (0.75, 1.25, 2.0)),
    "drum": ((0.32, 0.32, 0.38), (0.63, 0.63, 0.95)),
    "bucket": ((0.09, 0.09, 0.10), (0.3, 0.3, 0.18)),
    "plant": ((0.15, 0.15, 0.5), (1.6, 1.6, 2.2)),
    "radiator": ((0.05, 0.4, 0.3), (0.2, 1.9, 1.1)),
    "computer": ((0.36, 0.16, 0.36), (0.5, 0.22, 0.48)),
    "robot": ((0.35, 0.35, 0.2), (0.9, 0.7, 1.5)),
    "suitcase": ((0.14, 0.36, 0.3), (0.3, 0.5, 1.2)),
    "coat_rack": ((0.3, 0.3, 1.58), (0.7, 0.7, 1.9)),
}
LABELLED = {"wastebasket", "office_chair", "door", "window", "stairs"}
FIXED = {"wall", "floor", "ceiling", "door", "window", "glazing", "furniture", "outdoors", "carrier"}
INDOOR = ("office",)


@pytest.mark.parametrize("name", SIZES)
def test_objects_stand_on_the_floor_within_their_sizes_and_repeat(name):
    low, high = SIZES[name]
    for seed in range(60):
        thing, again = (OBJECTS[name](np.random.default_rng(seed)) for _ in range(2))
        assert np.array_equal(thing.mesh.vertices, again.mesh.vertices)
        assert np.isfinite(thing.mesh.vertices).all()
        assert abs(thing.mesh.vertices[:, 2].min()) < 0.01
        assert (thing.mesh.extents >= low).all() and (thing.mesh.extents <= high).all(), thing.mesh.extents
        assert thing.label == (name if name in LABELLED else "")


@pytest.mark.parametrize("name", ["wastebasket", "bucket", "drum", "office_chair", "computer", "cabinet"])
def test_closed_objects_face_outwards(name):
    """Every part is closed: its edges cancel, and it encloses a positive volume."""
    for seed in range(10):
        mesh = OBJECTS[name](np.random.default_rng(seed)).mesh
        edges = np.concatenate([mesh.faces[:, [a, b]] for a, b in ((0, 1), (1, 2), (2, 0))])
        # Rings of radius 0 repeat a point: compare points, not numbers of vertices.
        points = np.unique(mesh.vertices.round(9), axis=0, return_inverse=True)[1].ravel()
        edges = points[edges]
        edges = edges[edges[:, 0] != edges[:, 1]]
        size = points.max() + 1
        there = np.bincount(edges @ [size, 1], minlength=1)
        back = np.bincount(edges[:, ::-1] @ [size, 1], minlength=1)
        assert np.array_equal(there, back)
        corners = mesh.vertices[mesh.faces]
        assert np.einsum("ij,ij->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) > 0


@pytest.mark.parametrize("name", INDOOR)
def test_same_seed_same_scene(name):
    first, second = (SCENES[name](np.random.default_rng(3)) for _ in range(2))
    assert [thing.kind for thing in first.things] == [thing.kind for thing in second.things]
    assert np.array_equal(first.scanners[0], second.scanners[0])


@pytest.mark.parametrize("name", INDOOR)
def test_nothing_stands_in_another_thing_or_at_the_scanner(name):
    """Measured anew in the world: parts as boxes around their corners seen from above."""
    for seed in range(20):
        scene = SCENES[name](np.random.default_rng(seed))
        place = scene.scanners[0][:3, 3]
        loose = [thing for thing in scene.things if thing.kind not in FIXED]
        for thing in loose:
            assert np.isfinite(thing.mesh.vertices).all()
            assert np.linalg.norm(thing.mesh.vertices - place, axis=1).min() > 0.3, (seed, thing.kind)
        boxes = [rectangles(thing.mesh) for thing in loose]
        for i, first in enumerate(boxes):
            for j in range(i):
                if deepest(first, boxes[j]) > 0.05:
                    pytest.fail(f"seed {seed}: {loose[i].kind} in {loose[j].kind}")


def rectangles(mesh):
    """Smallest upright boxes around the parts of a mesh that stands somewhere, as (centre, half, yaw)."""
    import cv2

    depth = np.zeros(len(mesh.vertices) + 1, int)
    np.add.at(depth, mesh.faces.min(axis=1) + 1, 1)
    np.subtract.at(depth, mesh.faces.max(axis=1) + 1, 1)
    runs = np.split(mesh.vertices, np.flatnonzero(np.cumsum(depth)[1:-1] == 0) + 1)
    found = []
    for points in runs if len(runs) <= 60 else [mesh.vertices]:
        (x, y), (a, b), turn = cv2.minAreaRect(points[:, :2].astype(np.float32))
        low, high = points[:, 2].min(), points[:, 2].max()
        found.append(((x, y, (low + high) / 2), (a / 2, b / 2, (high - low) / 2), turn))
    return found


def deepest(first, second):
    """Penetration of the deepest pair, box by box."""
    worst = 0.0
    for a in first:
        for b in second:
            if np.hypot(a[0][0] - b[0][0], a[0][1] - b[0][1]) < np.hypot(*a[1][:2]) + np.hypot(*b[1][:2]):
                one, other = (
                    placed(np.array([[np.negative(c[1]), c[1]]], float), c[0][0], c[0][1], c[0][2], c[2])
                    for c in (a, b)
                )
                worst = max(worst, penetration(one, other))
    return worst


def test_penetration_of_boxes_side_by_side_crossed_and_above():
    cube = np.array([[(-0.5, -0.5, 0.0), (0.5, 0.5, 1.0)]])
    at = placed(cube, 0, 0)
    assert penetration(at, placed(cube, 0.9, 0)) == pytest.approx(0.1)
    assert penetration(at, placed(cube, 1.1, 0)) == pytest.approx(-0.1)
    assert penetration(at, placed(cube, 0.5 + np.sqrt(0.5) - 0.05, 0, 0, 45)) == pytest.approx(0.05)
    assert penetration(at, placed(cube, 0, 0, 1.2)) == pytest.approx(-0.2)
    long = np.array([[(-2, -0.1, 0.0), (2, 0.1, 1.0)]])
    assert penetration(placed(long, 0, 0, 0, 30), placed(long, 0, 0, 0, -40)) > 0.15
    assert penetration(placed(long, 0, 0, 0, 30), placed(long, 0, 0.5, 0, 30)) < 0


def test_parts_of_a_joined_mesh():
    from laserimg.simulate.mesh import box, cylinder, joined

    mesh = joined(
        [box((1, 1, 1), "wood"), cylinder(0.2, 0.5, "wood").at(3, 0), box((1, 1, 1), "wood").at(0, 5)]
    )
    boxes = part_boxes(mesh)
    assert boxes.shape == (3, 2, 3)
    np.testing.assert_allclose(boxes[1], [(2.8, -0.2, 0), (3.2, 0.2, 0.5)], atol=1e-9)


def test_offices_have_baskets_chairs_doors_and_windows_and_some_have_none():
    scenes = [SCENES["office"](np.random.default_rng(seed)) for seed in range(60)]
    counts = [{label: sum(t.label == label for t in s.things) for label in LABELLED} for s in scenes]
    assert sum(not any(count.values()) for count in counts) >= 2
    for label in ("wastebasket", "office_chair", "door", "window"):
        assert np.mean([count[label] for count in counts]) > 0.8, label
    assert max(count["office_chair"] for count in counts) <= 6
