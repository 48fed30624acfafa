"""SICK scanners on a moving head, as in the papers."""

from dataclasses import replace

import numpy as np

from laserimg.simulate.footprint import Beam
from laserimg.simulate.receiver import Receiver
from laserimg.simulate.scanner.head import Head, tilting_fan, turning_fan
from laserimg.simulate.scanner.model import Intensity, Noise, Scanner

LMS200_TILT_DEG, LMS200_ROWS = (67.6, -48.7), 226


def lms200_tilt() -> Scanner:
    """Return a tilting SICK LMS 200: 226 rows of 361 beams.

    Technical Description 8008970: a 12 mm beam that grows by 4.4 mrad, 10 m at 10 % reflectivity, 5 mm
    noise (1 sigma to 8 m), millimetres to 32 m in mode 06h. From two public recordings (3DTK, dat/), as
    `docs/simulate.md` describes them: tilts from -48.7 to 67.6 degrees in 226 slices; ranges in steps of
    8.1-8.7 mm, which make the rings; noise of 3 mm at 1 m and 7 mm at 10 m, rings included; mixed pixels
    at gaps up to 1.2 m, at upright edges 1.6 times as often as at level ones, so that the beam is 0.6 times
    as high as wide. The 0.3 m minimum is our assumption, and so are 14 mm of noise for the weakest pulse, of
    the size of the 11 and 14 mm that beams of one row of the recordings scatter at 6-12 m. The reflectivity
    values are not linear and have no unit (Telegram Listing 8007954): a square root to 13000, 6000 for
    white at 1 m, is our assumption.
    """
    fan = np.radians(np.linspace(90, -90, 361))
    tilt = np.radians(np.linspace(*LMS200_TILT_DEG, LMS200_ROWS))
    return Scanner(
        "lms200_tilt",
        tilting_fan(fan, tilt),
        wraps=False,
        step_m=0.001,
        min_range_m=0.3,
        max_range_m=32.0,
        beam=Beam(0.012, 0.0044, height=0.6),
        receiver=Receiver(reach_m=10.0, pulse_m=1.2, strongest=False),
        noise=Noise(white_m=0.0022, weakest_m=0.014, ring_m=0.0024, ring_period_m=0.0084, power=0.05),
        intensity=Intensity(made_up=0.0, exponent=0.5, scale=6000, top=13000),
    )


def lms200_swing() -> Scanner:
    """Return the LMS 200 of `lms200_tilt` on a servo that swings down without a stop, unaccounted for.

    One tilt is taken for a scan of two mirror turns of 13.32 ms: whole degrees come from the first, half
    degrees from the second, each angle/360 turns after its start, counted from the right (Telegram
    Listing 8007954); in the 26.64 ms the head moves on by one row. The servo does not swing evenly: in
    both 3DTK recordings ceiling and floor show errors of the tilt of 0.4-0.5 degrees (standard deviation)
    that go up and down once in 9 rows; a scan draws half to double of both.
    """
    from_right = 360 - np.arange(361)
    turns = from_right % 2 + from_right / 2 / 360
    pitch_deg = (LMS200_TILT_DEG[0] - LMS200_TILT_DEG[1]) / (LMS200_ROWS - 1)
    head = Head(late_deg=turns / 2 * pitch_deg, wave_deg=0.4, wave_rows=9.0)
    return replace(lms200_tilt(), name="lms200_swing", head=head)


def lms200_turn() -> Scanner:
    """Return the LMS 200 of `lms200_tilt` with an upright fan on a turning head: 181 x 360 over the sphere.

    One degree both ways, the coarsest angle of the LMS 200 (Technical Description 8008970), all of whose
    beams come from one mirror turn (Telegram Listing 8007954). That the head turns on without a stop, by a
    degree in these 13.32 ms, the fan from above down, is our assumption.
    """
    beams = turning_fan(90.0 - np.arange(181), 360)
    return replace(lms200_tilt(), name="lms200_turn", directions=beams, wraps=True)


def lms200_tilt_cm() -> Scanner:
    """Return the LMS 200 of `lms200_tilt` as it is delivered: centimetres, to 80 m.

    Telegram Listing 8007954: measuring mode 00h with the unit cm has 13 bits of range, the highest values of
    which are codes of errors: 81.82 m at most; 80 m is what the Technical Description gives. All else
    is as in `lms200_tilt`: what that measures is rounded.
    """
    return replace(lms200_tilt(), name="lms200_tilt_cm", step_m=0.01, max_range_m=80.0)


def lms151_turn() -> Scanner:
    """Return a SICK LMS 151 on a turntable, 760 x 1135 over the full sphere.

    Manual 8012471 and SICK support: 12 mm noise (1 sigma, 20 mm at most), an 8 mm beam that grows by
    15 mrad, 18 m at 10 % reflectivity, 0.5 to 50 m, millimetres as in the telegrams, 8 bits of received
    signal strength that are logarithmic and not made up for range. The length of a pulse is that of the
    LMS 200; the rings are those of the public office scan of a turning 2D laser (PCL data): an error that
    is the same at the same range and loses its likeness within 20 mm. That the table turns on by a column in
    each mirror turn, the fan from above down, is our assumption, as are the power that reports as 200
    for white at 1 m and its fourth root in place of the logarithm.
    """
    return Scanner(
        "lms151_turn",
        turning_fan(90 - 180 * (np.arange(760) + 0.5) / 760, 1135),
        wraps=True,
        step_m=0.001,
        min_range_m=0.5,
        max_range_m=50.0,
        beam=Beam(0.008, 0.015),
        receiver=Receiver(reach_m=18.0, pulse_m=1.2, strongest=False),
        noise=Noise(white_m=0.012, weakest_m=0.02, ring_m=0.0023, ring_period_m=0.05, power=0.05),
        intensity=Intensity(made_up=0.0, exponent=0.25, scale=200, top=254),
    )
