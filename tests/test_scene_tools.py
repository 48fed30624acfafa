"""The tools that show and measure simulated scenes."""

import numpy as np
import pytest

from laserimg.scan import Scan

pytest.importorskip("embreex")


def test_a_flat_floor_is_all_floor_and_a_step_between_columns_is_one_jump():
    from scene_density import figures, scanner_along

    up, around = np.radians([-30.0, -20.0, -10.0]), np.radians([6.0, 2.0, -2.0, -6.0])
    floor = np.repeat(1.0 / np.sin(-up)[:, None], 4, axis=1)
    scan = Scan.from_range_image(floor, around, up)
    median, beside, _, on_floor = figures(scan, 1.0)
    assert median == pytest.approx(floor[1, 0])
    assert (beside, on_floor) == (0, 100)
    stepped = Scan.from_range_image(floor - np.array([0, 0, 0.5, 0.5]), around, up)
    assert figures(stepped, 1.0)[1] == pytest.approx(100 / 3)
    assert scanner_along(scan).directions is scan.directions


def test_a_picture_of_a_scene_shows_boxes_of_its_classes():
    from scene_sheets import colour, legend, picture

    found = {}
    for seed in range(3):
        image, classes = picture("corridor", "lms200_tilt", (0, 226), [seed, 0, 0], 361)
        assert image.shape == (226, 361, 3)
        for label in classes:
            found[label] = (image == colour(label)).all(axis=-1).sum()
    assert "door" in found and found["door"] > 40
    assert legend(["door", "person"]).shape[1] == 1020
