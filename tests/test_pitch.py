"""The angle between neighbouring rays."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from laserimg.geometry.pitch import angular_pitch
from laserimg.scan import Scan


def panorama(rows: int, columns: int, top_deg: float = 60.0) -> Scan:
    azimuth = np.pi - 2 * np.pi * (np.arange(columns) + 0.5) / columns
    return Scan.from_range_image(
        np.ones((rows, columns)), azimuth, np.radians(np.linspace(top_deg, -top_deg, rows)), wraps=True
    )


@given(st.integers(2, 40), st.integers(3, 60), st.floats(1, 89))
def test_pitch_of_a_panorama_narrows_with_elevation(rows, columns, top_deg):
    across, up = angular_pitch(panorama(rows, columns, top_deg))
    elevation = np.radians(np.linspace(top_deg, -top_deg, rows))
    chord = 2 * np.cos(elevation) * np.sin(np.pi / columns)
    expected = np.broadcast_to(2 * np.arcsin(chord / 2)[:, None], across.shape)
    np.testing.assert_allclose(across, expected, rtol=1e-3, atol=1e-5)
    np.testing.assert_allclose(up, np.radians(2 * top_deg / (rows - 1)), rtol=1e-3)


def test_uneven_steps_are_averaged_and_borders_take_their_one_side():
    azimuth, elevation = np.radians([6, 5, 2, 1]), np.radians([2, 1, -3])
    across, up = angular_pitch(Scan.from_range_image(np.ones((3, 4)), azimuth, elevation))
    np.testing.assert_allclose(np.degrees(across[1]), [1, 2, 2, 1], rtol=1e-3)
    np.testing.assert_allclose(np.degrees(up[:, 0]), [1, 2.5, 4], rtol=1e-3)


def test_the_seam_is_a_neighbour_only_when_the_columns_close_a_turn():
    azimuth = np.radians([170, 60, -60, -170])
    fields = {"azimuth": azimuth, "elevation": np.radians([1, -1])}
    closed, _ = angular_pitch(Scan.from_range_image(np.ones((2, 4)), wraps=True, **fields))
    open_, _ = angular_pitch(Scan.from_range_image(np.ones((2, 4)), **fields))
    np.testing.assert_allclose(np.degrees(closed[0]), [65, 115, 115, 65], rtol=1e-2)
    np.testing.assert_allclose(np.degrees(open_[0]), [110, 115, 115, 110], rtol=1e-2)


def test_a_tilted_fan_has_its_own_pitch_at_each_pixel():
    """A fan turned about its own axis x keeps its pitch across; up it narrows towards the axis."""
    fan, tilt = np.radians(np.linspace(80, -80, 33)), np.radians(np.linspace(20, -20, 11))
    along, side = np.cos(fan), np.sin(fan)
    directions = np.stack(
        [
            along * np.cos(tilt)[:, None],
            np.broadcast_to(side, (11, 33)),
            along * np.sin(tilt)[:, None],
        ],
        axis=-1,
    )
    across, up = angular_pitch(Scan(np.ones((11, 33), np.float32), directions.astype(np.float32)))
    np.testing.assert_allclose(np.degrees(across), 5, rtol=1e-3)
    np.testing.assert_allclose(np.degrees(up), np.broadcast_to(4 * along, up.shape), rtol=2e-3)
