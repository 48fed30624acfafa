"""Primitives are closed, outward and of the right size; rays meet them where geometry says."""

import numpy as np
import pytest

from laserimg.simulate.cast import Caster
from laserimg.simulate.mesh import box, cylinder, ellipsoid, joined, prism, sheet, tube

pytest.importorskip("embreex")
L_SHAPE = [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)]


def volume(mesh):
    """By the divergence theorem: positive only if the faces look outwards."""
    a, b, c = mesh.vertices[mesh.faces].transpose(1, 0, 2)
    return np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6


def ring(n):
    """Area of the regular polygon in the unit circle."""
    return n / 2 * np.sin(2 * np.pi / n)


CASES = {
    "box": (box((1, 2, 3), "wood"), 6, (1, 2, 3)),
    "L": (prism(L_SHAPE, 2, "wood"), 6, (2, 2, 2)),
    "L reversed": (prism(L_SHAPE[::-1], 2, "wood"), 6, (2, 2, 2)),
    "cylinder": (cylinder(1, 2, "wood"), 2 * ring(24), (2, 2, 2)),
    "frustum": (cylinder(1, 3, "wood", top_radius_m=2), 7 * ring(24), (4, 4, 3)),
    "rod": (tube([(0, 0, 0), (0, 3, 0)], 1, "wood"), 3 * ring(8), None),
    "mirrored": (box((1, 2, 3), "wood").moved(np.diag([-1, 1, 1, 1])), 6, (1, 2, 3)),
}


@pytest.mark.parametrize("name", CASES)
def test_volume_and_extents(name):
    mesh, expected, extents = CASES[name]
    assert volume(mesh) == pytest.approx(expected)
    if extents:
        np.testing.assert_allclose(mesh.extents, extents)


@pytest.mark.parametrize("name", CASES)
def test_every_edge_is_met_once_each_way(name):
    edges = [tuple(face[[k, (k + 1) % 3]]) for face in _welded(CASES[name][0]) for k in range(3)]
    assert len(set(edges)) == len(edges)
    assert {(b, a) for a, b in edges} == set(edges)


def _welded(mesh):
    _, index = np.unique(mesh.vertices.round(9), axis=0, return_inverse=True)
    return index.reshape(-1)[mesh.faces]


def test_open_cylinder_holds_only_its_wall():
    assert 0 < volume(cylinder(1, 2, "wood", open_top=True)) < 0.1


def test_rays_meet_box_and_cylinder():
    scene = joined([box((1, 1, 1), "wood").at(3, 0, -0.5), cylinder(1, 2, "wood", 256).at(0, 5, -1)])
    hits = Caster(scene)(
        (0, 0, 0), [(1, 0.01, 0.02), (0, 1, 0), (-1, 0, 0)] / np.array([[1.00025], [1], [1]])
    )
    np.testing.assert_allclose(hits.distance, [2.5 * 1.00025, 4, np.inf], atol=1e-3)
    np.testing.assert_allclose(hits.normal, [(-1, 0, 0), (0, -1, 0), (0, 0, 0)], atol=0.02)
    assert hits.face[2] == -1 and hits.face[0] < 12 <= hits.face[1]


def test_rays_from_inside_a_sphere_see_its_radius():
    rays = np.random.default_rng(1).normal(size=(1000, 3))
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    hits = Caster(ellipsoid((2, 2, 2), "wood", 5))((0, 0, 0), rays)
    np.testing.assert_allclose(hits.distance, 2, atol=0.01)
    np.testing.assert_allclose(hits.normal, -rays, atol=0.06)


def test_a_sheet_is_seen_from_behind():
    mesh = sheet([(1, -1, -1), (1, 1, -1), (1, 1, 1), (1, -1, 1)], "paper")
    hits = Caster(mesh)([(0, 0.1, 0), (2, 0.1, 0)], [(1, 0, 0), (-1, 0, 0)])
    np.testing.assert_allclose(hits.normal[:, 0], [-1, 1], atol=1e-6)
