"""HOG, HONV, 3DHOG: against loops that follow the paper, and what must hold for any input."""

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from laserimg.descriptors import Layout, gradient_normals, hog, hog3d, honv, surface_normals
from laserimg.descriptors.cells import EPSILON, cell_of_pixels
from laserimg.descriptors.hog import hog_cells
from laserimg.descriptors.hog3d import hog3d_cells, line_angles, projection_table, rotation_to
from laserimg.descriptors.honv import honv_cells
from laserimg.errors import ConfigError
from slow_descriptors import slow_blocks, slow_cells, slow_rotation

angles = st.floats(0, 2 * np.pi)
DEFAULT = Layout()


def sphere(size=64):
    """Normals of a ball seen from afar, and what is the ball."""
    y, x = np.mgrid[-1 : 1 : size * 1j, -1 : 1 : size * 1j]
    squared = x * x + y * y
    normals = np.stack([x, y, -np.sqrt(np.maximum(0, 1 - squared))], axis=-1).astype(np.float32)
    normals[squared >= 1] = 0
    return normals, squared < 1


def random_images(seed, number=2, shape=(20, 28)):
    random = np.random.default_rng(seed)
    images = random.random((number, *shape)).astype(np.float32)
    normals = random.normal(size=(number, *shape, 3)).astype(np.float32)
    normals[..., 2] = -np.abs(normals[..., 2])
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    normals[random.random((number, *shape)) < 0.3] = 0
    return images, normals


@pytest.mark.parametrize(
    "layout", [DEFAULT, Layout(3, 2, 7, 4, 5), Layout(signed=False)], ids=["paper", "odd", "unsigned"]
)
def test_equal_to_the_loops_of_the_paper(layout):
    images, normals = random_images(1, number=1)
    slow = slow_cells(images[0], normals[0], layout)
    gradients, directions = hog_cells(images, None, layout), honv_cells(normals, layout)
    assert_allclose(gradients[0], slow[0], rtol=1e-4, atol=1e-4)
    assert_array_equal(directions[0], slow[1])
    assert_allclose(hog3d_cells(gradients, directions, layout)[0], slow[2], rtol=1e-4, atol=1e-3)
    whole = [hog(images, layout=layout), honv(normals, layout), hog3d(images, normals, layout)]
    for fast, histograms in zip(whole, slow, strict=True):
        assert_allclose(fast[0], slow_blocks(histograms, layout, EPSILON), atol=1e-5)


def test_dimensions_of_the_paper():
    images, normals = random_images(2, number=3, shape=(64, 64))
    lengths = [part.shape[1] for part in (hog(images), honv(normals), hog3d(images, normals))]
    assert lengths == [3528, 15876, 15876]
    assert lengths[0] + lengths[1] == 19404


@pytest.mark.parametrize("shape", [(1, 1), (1, 30), (7, 3), (64, 64), (101, 67)])
def test_the_dimensions_hold_for_every_size(shape):
    images, normals = random_images(3, number=2, shape=shape)
    for values in (hog(images), honv(normals), hog3d(images, normals)):
        assert values.shape[0] == 2 and values.shape[1] in (3528, 15876)
        assert np.isfinite(values).all()


def test_many_objects_are_each_as_alone():
    images, normals = random_images(4, number=70, shape=(16, 16))
    together = hog3d(images, normals)
    for index in (0, 31, 32, 69):
        part = slice(index, index + 1)
        assert_allclose(together[part], hog3d(images[part], normals[part]), atol=1e-6)


def test_no_object_no_descriptor():
    assert hog(np.zeros((0, 64, 64), np.float32)).shape == (0, 3528)
    assert honv(np.zeros((0, 64, 64, 3), np.float32)).shape == (0, 15876)
    assert not hog(np.zeros((1, 64, 64), np.float32)).any()


def test_a_ramp_votes_for_its_direction_only():
    columns = np.arange(64, dtype=np.float32)
    layout = Layout(cells=1, block=1)
    across = hog_cells(columns[None, None].repeat(64, 1), None, layout)[0, 0]
    down = hog_cells(columns[None, :, None].repeat(64, 2), None, layout)[0, 0]
    assert np.flatnonzero(across).tolist() == [0]
    assert np.flatnonzero(down).tolist() == [9]
    falling = hog_cells(-columns[None, None].repeat(64, 1), None, layout)[0, 0]
    assert_allclose(falling, across)


def test_hog_does_not_depend_on_the_scale_of_reflectance():
    images, _ = random_images(5)
    assert_allclose(hog(images), hog(images * 40_000), atol=1e-5)


def test_hog_is_like_that_of_opencv():
    """OpenCV weighs and interpolates its votes: alike, not equal; its blocks and cells run down first."""
    y, x = np.mgrid[:64, :64]
    image = (127 + 120 * np.sin(x / 5.0) * np.cos(y / 7.0)).astype(np.uint8)
    descriptor = cv2.HOGDescriptor((64, 64), (16, 16), (8, 8), (8, 8), 18)
    theirs = np.asarray(descriptor.compute(image)).reshape(7, 7, 2, 2, 18).transpose(1, 0, 3, 2, 4)
    ours = hog(image[None].astype(np.float32)).reshape(theirs.shape)

    def alike(other):
        return float((ours * other).sum() / np.linalg.norm(ours) / np.linalg.norm(other))

    assert alike(theirs) > 0.75
    assert max(alike(theirs[..., ::-1]), alike(theirs.transpose(1, 0, 3, 2, 4)), alike(theirs[::-1])) < 0.65


def test_mask_keeps_the_outline_out():
    values = np.zeros((1, 16, 16), np.float32)
    values[0, 4:12, 4:12] = 5
    assert hog(values).any()
    assert not hog(values, values > 0).any()


def test_cells_are_equal_parts():
    place = cell_of_pixels((64, 64), 8)
    assert_array_equal(np.bincount(place.ravel()), 64)
    assert place[0, 8] == 1 and place[8, 0] == 8


# --- the rotation and the bins of edges


@given(st.floats(0, np.pi / 2), angles)
def test_rotation_is_that_of_the_paper(theta, phi):
    normal = np.array([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), -np.cos(theta)])
    a = rotation_to(theta, phi)
    assert_allclose(a @ [0, 0, -1], normal, atol=1e-12)
    assert_allclose(a @ a.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(a) == pytest.approx(1)
    # The smallest one: it turns by theta and by no more.
    assert np.trace(a) == pytest.approx(1 + 2 * np.cos(theta))
    if theta > 1e-6:
        assert_allclose(a, slow_rotation(normal), atol=1e-6)


@given(angles, st.floats(0, 1e-3))
def test_rotation_is_continuous_at_the_line_of_sight(phi, theta):
    assert_array_equal(rotation_to(0.0, phi), np.eye(3))
    assert_allclose(rotation_to(theta, phi), np.eye(3), atol=1.5e-3)


@given(st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda e: np.linalg.norm(e) > 1e-3))
def test_an_edge_is_a_line(edge):
    there, back = line_angles(np.array(edge)), line_angles(-np.array(edge))
    assert_array_equal(there, back)
    theta, phi = there
    assert 0 <= theta <= np.pi and 0 <= phi < np.pi


def test_edges_in_the_image_plane_stay_there_when_the_surface_faces_the_scanner():
    edge = rotation_to(0.0, 1.0) @ [np.cos(0.7), np.sin(0.7), 0]
    theta, phi = line_angles(edge)
    assert (theta, phi) == (pytest.approx(np.pi / 2), pytest.approx(0.7))


@pytest.mark.parametrize("votes", ["hard", "interpolated"])
@pytest.mark.parametrize("signed", [True, False])
def test_every_pair_of_bins_gives_its_whole_vote(votes, signed):
    layout = Layout(signed=signed)
    table = projection_table(layout, votes).toarray()
    assert table.shape == (layout.n_theta * layout.n_phi * 18, 81)
    assert_allclose(table.sum(axis=1), 1, atol=1e-6)
    assert table.min() >= 0


def test_interpolated_votes_have_a_quarter_or_more_where_hard_ones_are():
    layout = Layout()
    hard, soft = (projection_table(layout, votes).toarray() for votes in ("hard", "interpolated"))
    assert ((soft > 0) >= (hard > 0)).all()
    assert (soft[hard > 0] >= 0.25 - 1e-6).all()


def test_interpolated_votes_are_continuous():
    """A line turned a little moves little of its vote, also across phi' = 180 and theta' = 0."""
    from laserimg.descriptors.hog3d import _interpolated

    layout = Layout()

    def votes(edge):
        theta, phi = (np.atleast_1d(angle) for angle in line_angles(edge))
        _, columns, shares = _interpolated(theta * 9 / np.pi, phi * 9 / np.pi, layout)
        return np.bincount(columns, shares, 81)

    for at in np.linspace(0, np.pi, 50):
        first = np.array([np.sin(at), 1e-4, -np.cos(at)])
        second = first * [1, -1, 1]
        if np.sin(at) > 0.1:
            assert np.abs(votes(first) - votes(second)).sum() < 0.02
    over_the_pole = [np.array([0.0, side, -1.0]) for side in (1e-6, -1e-6)]
    assert np.abs(votes(over_the_pole[0]) - votes(over_the_pole[1])).sum() < 1e-3


def test_facing_surface_gives_the_image_gradients():
    """On a surface that faces the scanner, 3DHOG is HOG with its directions in the image plane."""
    layout = Layout(cells=1, block=1, n_theta=45)
    images, _ = random_images(6, number=1)
    facing = np.broadcast_to(np.float32([0, 0, -1]), (*images.shape, 3))
    gradients, directions = hog_cells(images, None, layout), honv_cells(facing, layout)
    voted = hog3d_cells(gradients, directions, layout)[0, 0].reshape(45, 9)
    assert_allclose(voted[22], gradients[0, 0].reshape(9, 2).sum(axis=1) * images[0].size, rtol=1e-5)
    assert voted[:22].sum() == voted[23:].sum() == 0


# --- normals


def test_normals_of_a_ball():
    y, x = np.mgrid[-0.25:0.25:64j, -0.25:0.25:64j]
    rays = np.stack([x, y, np.ones_like(x)], axis=-1)
    rays /= np.linalg.norm(rays, axis=-1, keepdims=True)
    along = rays[..., 2] * 5
    inside = along**2 - 25 + 1
    known = inside > 0
    points = rays * (along - np.sqrt(np.maximum(inside, 0)))[..., None] * known[..., None]
    true = (points - [0, 0, 5]) * known[..., None]
    found = surface_normals(points[None].astype(np.float32), known[None])[0]
    has = np.linalg.norm(found, axis=-1) > 0
    assert has.sum() > 0.98 * known.sum() and not found[~known].any()
    cosine = np.einsum("hwc,hwc->hw", found, true)[has]
    assert np.degrees(np.arccos(np.clip(np.median(cosine), -1, 1))) < 0.5
    assert cosine.min() > 0.8


def test_surface_normals_do_not_depend_on_distance_but_the_gradient_formula_does():
    y, x = np.mgrid[-0.1:0.1:16j, -0.1:0.1:16j]
    points = np.stack([x, y, 2 + 0.5 * x], axis=-1).astype(np.float32)[None]
    known = np.ones((1, 16, 16), bool)
    once, twice = surface_normals(points, known), surface_normals(points * 2, known)
    assert_allclose(once, twice, atol=1e-5)
    assert_allclose(once[0, 8, 8], np.array([0.5, 0, -1]) / np.hypot(0.5, 1), atol=1e-4)
    near, far = (gradient_normals(points[..., 2] * scale, known, 1.0) for scale in (1, 2))
    assert np.abs(near - far).max() > 1e-3


def test_gradient_formula_with_its_own_scale():
    """The depth range of the object counts as 16 pixels: a ramp over 16 columns has slope 16/15."""
    ramp = np.arange(16, dtype=np.float32)[None, None].repeat(16, axis=1) * 0.03
    found = gradient_normals(ramp, np.ones((1, 16, 16), bool))
    slope = 16 / 15
    expected = np.array([slope, 0, -1]) / np.hypot(slope, 1)
    assert_allclose(found[0], np.broadcast_to(expected, (16, 16, 3)), atol=1e-5)


def test_no_difference_across_the_edge_of_an_object():
    depth = np.full((1, 8, 8), 2, np.float32)
    known = np.zeros((1, 8, 8), bool)
    known[0, 2:6, 2:6] = True
    depth[~known] = 0
    found = gradient_normals(depth, known)
    assert_array_equal(found[known], [[0, 0, -1]] * 16)
    assert not found[~known].any()


def test_one_pixel_has_no_normal():
    known = np.zeros((1, 8, 8), bool)
    known[0, 3, 3] = True
    points = np.ones((1, 8, 8, 3), np.float32)
    assert not surface_normals(points, known).any()


def test_turning_the_ball_turns_the_bins():
    """A quarter turn of the image moves votes of phi by a quarter turn, cells likewise."""
    layout = Layout(cells=2, block=1, n_phi=8)
    normals, _ = sphere()
    turned = np.rot90(normals).copy()
    turned[..., 0], turned[..., 1] = np.rot90(normals)[..., 1], -np.rot90(normals)[..., 0]
    first = honv_cells(normals[None], layout)[0].reshape(2, 2, 9, 8)
    second = honv_cells(turned[None], layout)[0].reshape(2, 2, 9, 8)
    expected = np.roll(np.rot90(first), -2, axis=-1)
    assert np.abs(expected - second).sum() < 0.08 * first.sum()


def test_unsigned_azimuth_folds_opposite_normals():
    layout = Layout(signed=False)
    normals = np.zeros((2, 8, 8, 3), np.float32)
    normals[0], normals[1] = [0.6, 0.3, -0.742], [-0.6, -0.3, -0.742]
    one, other = honv(normals, layout)
    assert_array_equal(one, other)
    one, other = honv(normals)
    assert one @ other == 0


@pytest.mark.parametrize(
    ("wrong", "message"),
    [({"cells": 0}, "cells must be at least 1, got 0"), ({"block": 9}, "a block of 9 cells does not fit 8")],
)
def test_wrong_layouts(wrong, message):
    with pytest.raises(ConfigError, match=message):
        Layout(**wrong)
