"""Varied images of scans are images that a scan could have given."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial.transform import Rotation

from analytic import boxes_and_floor, ray_grid
from command import laserimg
from laserimg.errors import ConfigError
from laserimg.images import make_images
from laserimg.images.kinds import IMAGE_NAMES
from laserimg.samples.augment import Variation, vary
from laserimg.samples.laser import mirrored
from laserimg.samples.vec import read_vec, write_vec
from laserimg.scan import Scan

PLANES = [name for name in IMAGE_NAMES if "." in name or not name.startswith("normals")]
GREY = arrays(np.uint8, (14, 12), elements=st.one_of(st.just(0), st.integers(0, 255)))


@pytest.fixture(scope="module")
def pair():
    """A scan of boxes that stand in different directions, and the scan of the mirrored scene."""
    grid = ray_grid(np.arange(60, -60.01, -0.5), np.arange(30, -40, -0.5))
    low = [(2, -1, -1.5), (3.5, 0.5, -1.5), (6, -9, -2)]
    high = [(3, 0.2, 0.5), (4, 1.7, 0.1), (7, 9, 4)]
    # The scene is drawn with rays turned by 25 degrees: no wall of it faces an axis of the scanner.
    turn = Rotation.from_euler("z", 25, degrees=True).as_matrix()
    turned = Scan(grid.range, grid.directions @ turn.T)
    scan = boxes_and_floor(turned, list(zip(low, high, strict=True)), noise_m=0.01)
    scan = Scan(scan.range, grid.directions)
    reflectance = (10 * scan.range + scan.directions[..., 1]).astype(np.float32)
    scan = Scan(scan.range, scan.directions, reflectance)
    directions = scan.directions[:, ::-1] * np.float32([1, -1, 1])
    return scan, Scan(scan.range[:, ::-1], directions, reflectance[:, ::-1])


@pytest.mark.parametrize("name", PLANES)
def test_a_mirrored_image_is_that_of_the_mirrored_scan(pair, name):
    scan, other = pair
    image, expected = make_images(scan, [name])[name], make_images(other, [name])[name]
    difference = np.abs(mirrored(image, name).astype(int) - expected)
    assert (difference > 3).mean() < 1e-3
    # And mirroring is not the same as doing nothing, nor are signs turned where they must not be.
    assert (np.abs(image.astype(int) - expected) > 3).mean() > 0.05
    if name.startswith("normals"):
        inverted = np.where(image[:, ::-1] > 0, 255 - image[:, ::-1], 0)
        wrong = image[:, ::-1] if name.endswith(".g") and "abs" not in name else inverted
        assert (np.abs(wrong.astype(int) - expected) > 3).mean() > 0.005


@given(GREY, st.sampled_from(PLANES))
@settings(max_examples=60, deadline=None)
def test_mirrored_twice_is_as_before_but_for_the_outermost_grey(image, name):
    image = np.minimum(image, 254)
    np.testing.assert_array_equal(mirrored(mirrored(image, name), name), image)


@given(GREY, st.sampled_from(PLANES), st.integers(0, 10**6))
@settings(max_examples=60, deadline=None)
def test_no_return_stays_none_and_returns_stay(image, name, seed):
    varied = Variation(noise=40, mirror=True, image=name)
    image = np.minimum(image, 254)
    made = vary(image[None], 6, varied, np.random.default_rng(seed))
    for one in made:
        assert (one > 0).tolist() in ((image > 0).tolist(), (image[:, ::-1] > 0).tolist())


@given(GREY, st.integers(0, 10**6))
@settings(max_examples=60, deadline=None)
def test_moving_invents_no_grey_between_a_return_and_none(image, seed):
    """A sample of one grey and gaps keeps these two greys."""
    two = np.where(image > 0, np.uint8(180), np.uint8(0))
    varied = Variation((0, 5, 5), shift=0.2, scale=0.2, image="range")
    made = vary(two[None], 5, varied, np.random.default_rng(seed))
    assert set(np.unique(made)) <= set(np.unique(two))


def test_moving_still_interpolates_between_returns():
    ramp = np.repeat(np.arange(10, 250, 12, dtype=np.uint8)[None], 20, axis=0)
    made = vary(ramp[None], 20, Variation(shift=0.1, image="range"), np.random.default_rng(0))
    assert len(np.unique(made)) > 60


def test_dropped_returns_are_black():
    made = vary(
        np.full((1, 20, 20), 90, np.uint8),
        50,
        Variation(dropped=0.3, image="range"),
        np.random.default_rng(0),
    )
    assert set(np.unique(made)) == {0, 90} and (made == 0).mean() == pytest.approx(0.3, abs=0.02)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"image": "range", "contrast": 0.2}, "range is measured, not lit"),
        ({"image": "range", "brightness": 5}, "measured, not lit"),
        ({"image": "normals_view.g", "invert": True}, "measured, not lit"),
        ({"image": "range", "turn_deg": (0, 6, 0)}, "more than 5 degrees"),
        ({"image": "normals_view.g", "turn_deg": (0, 0, -9)}, "more than 5 degrees"),
        (
            {"image": "normals", "mirror": True},
            "take a plane of it, normals.g",
        ),
        ({"image": "normal"}, "no image is called 'normal'; nearest: normals"),
    ],
)
def test_what_no_scan_could_give_is_refused(options, message):
    with pytest.raises(ConfigError, match=message):
        Variation(**options)


def test_small_turns_are_allowed():
    assert Variation((2, 5, 5), image="normals_view").turn_deg == (2, 5, 5)


def test_the_command_refuses_and_mirrors(tmp_path):
    ramp = np.repeat(np.arange(1, 241, 12, dtype=np.uint8)[None], 20, axis=0)[None]
    write_vec(tmp_path / "a.vec", ramp)
    words = ("samples", tmp_path / "a.vec", "--window", "20x20", "-o", tmp_path / "b.vec", "--mirror")
    done = laserimg(*words, "--image", "normals_view")
    assert done.code == 2 and "take a plane of it" in " ".join(done.err.replace("│", " ").split())
    assert not (tmp_path / "b.vec").exists()
    assert laserimg(*words, "--count", 30, "--image", "normals_view.g").code == 0
    kinds = {tuple(window[0].tolist()) for window in read_vec(tmp_path / "b.vec", (20, 20))}
    assert kinds == {tuple(ramp[0, 0].tolist()), tuple((255 - ramp[0, 0, ::-1]).tolist())}
