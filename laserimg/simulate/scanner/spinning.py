"""Scanners whose rows of beams spin about the vertical."""

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from laserimg.projection import directions_from_angles
from laserimg.scan import Float32Array
from laserimg.simulate.footprint import Beam
from laserimg.simulate.receiver import Receiver
from laserimg.simulate.scanner.model import Intensity, Noise, Scanner


def full_turn(elevation_deg: ArrayLike, columns: int) -> Float32Array:
    """Return (H, W, 3) beams of rows at elevations (H,), columns from just below azimuth 180 degrees."""
    azimuth = np.radians(180 - 360 * (np.arange(columns) + 0.5) / columns)
    return directions_from_angles(azimuth, np.radians(elevation_deg))


def spinning32() -> Scanner:
    """Return a Velodyne VLP-32C at 10 turns a second: 32 rows of 1800 beams.

    VLP-32C User Manual 63-9325, table 9-2: rows from +15 to -25 degrees, 1/3 degree apart near the horizon
    and up to 9 at the ends; ranges in steps of 4 mm. Beams of 3 x 1.5 mrad: Velodyne's VLS-128 (manual,
    table F-1). Accuracy is 3 cm; that a third of it is noise (1 sigma) of strong pulses and all of it that of
    the weakest is our assumption, as are 1 to 200 m, 80 m at 10 %, 10 mm at the window, and the strongest of
    several echoes. Reflectivity is made up for range, 100 for white, 255 at
    most (manual, section 6.2). The length of a pulse is that of the HDL-64E.
    """
    near_horizon = np.concatenate([[2.333], (5 - np.arange(18)) / 3, [-4.667, -5.333, -6.148, -7.254]])
    elevation = [15.0, 10.333, 7.0, 4.667, 3.333, *near_horizon, -8.843, -11.31, -15.639, -25.0]
    return Scanner(
        "spinning32",
        full_turn(elevation, 1800),
        wraps=True,
        step_m=0.004,
        min_range_m=1.0,
        max_range_m=200.0,
        beam=Beam(0.010, 0.003, height=0.5),
        receiver=Receiver(reach_m=80.0, pulse_m=1.5, strongest=True),
        noise=Noise(white_m=0.010, weakest_m=0.03, ring_m=0.0, ring_period_m=1.0, power=0.1),
        intensity=Intensity(made_up=2.0, exponent=1.0, scale=100, top=255),
    )


def spinning40() -> Scanner:
    """Return a Hesai Pandar40 at 10 turns a second: 40 rows of 1800 beams.

    Rows from +7 to -16 degrees, 1/3 degree apart between +2 and -6, 1 degree elsewhere: what it sees ends
    above the feet of near things. User's Manual, appendix I: 200 m at 20 %, which is 141 m at 10 %.
    Ranges in steps of 2 mm, noise (1 sigma) of 10 mm, 30 mm on the weakest pulses, 0.3 to 200 m, beams of
    3 x 1.5 mrad, 10 mm at the window, the strongest echo, and reflectivity as of the Velodyne's
    (`spinning32`) are our assumptions.
    """
    elevation = np.concatenate([7 - np.arange(5), 2 - np.arange(25) / 3, -7 - np.arange(10)])
    return replace(
        spinning32(),
        name="spinning40",
        directions=full_turn(elevation, 1800),
        step_m=0.002,
        min_range_m=0.3,
        receiver=Receiver(reach_m=141.0, pulse_m=1.5, strongest=True),
    )


def spinning64() -> Scanner:
    """Return a Velodyne HDL-64E S2 at 10 turns a second: 64 rows of 2083 beams.

    User's Manual 63-HDL64E S2: upper 32 rows from +2 degrees in steps of 1/3, lower 32 from -8.83 in
    steps of 1/2, columns of 0.1728 degrees, 2 cm noise (1 sigma), steps of 2 mm, 0.9 to 120 m, 50 m at
    10 %, 2 mrad, the strongest echo, 8 bits made up for range. Pulses of 10 ns: HELIOS++,
    data/scanners_tls.xml. Beams half as high as wide: Velodyne's VLS-128 (manual, table F-1). The square
    root is our assumption: it gives roads 0.2 and grass 0.3 of full scale as in SemanticKITTI (0.20,
    0.36). So are the 10 mm at the window, no more noise on weak pulses than on strong ones, and no rings.
    """
    elevation = np.concatenate([2 - np.arange(32) / 3, -8.83 - np.arange(32) / 2])
    return Scanner(
        "spinning64",
        full_turn(elevation, 2083),
        wraps=True,
        step_m=0.002,
        min_range_m=0.9,
        max_range_m=120.0,
        beam=Beam(0.010, 0.002, height=0.5),
        receiver=Receiver(reach_m=50.0, pulse_m=1.5, strongest=True),
        noise=Noise(white_m=0.02, weakest_m=0.02, ring_m=0.0, ring_period_m=1.0, power=0.1),
        intensity=Intensity(made_up=2.0, exponent=0.5, scale=255, top=255),
    )


def spinning128() -> Scanner:
    """Return an Ouster OS1 of 128 rows and 1024 columns.

    Data sheet of the OS1: 0.8 m to 120 m, 40 m at 10 %, steps of 12 mm, noise (1 sigma) of 15 mm on
    strong and 100 mm on the weakest pulses, a beam of 10 mm that grows by 0.18 degrees, the strongest
    echo. Rows from 21 to -21.8 degrees: the beam angles in a public recording (ouster-sdk, OS1-128).
    Reflectivity is made up for range, 100 for white, 255 at most: Ouster Software User Guide. The length
    of a pulse is that of the HDL-64E.
    """
    return Scanner(
        "spinning128",
        full_turn(np.linspace(21.0, -21.8, 128), 1024),
        wraps=True,
        step_m=0.012,
        min_range_m=0.8,
        max_range_m=120.0,
        beam=Beam(0.010, 0.00314),
        receiver=Receiver(reach_m=40.0, pulse_m=1.5, strongest=True),
        noise=Noise(white_m=0.015, weakest_m=0.10, ring_m=0.0, ring_period_m=1.0, power=0.1),
        intensity=Intensity(made_up=2.0, exponent=1.0, scale=100, top=255),
    )
