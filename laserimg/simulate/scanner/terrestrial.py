"""Terrestrial scanners: still, slow, exact."""

import numpy as np

from laserimg.simulate.footprint import Beam
from laserimg.simulate.receiver import Receiver
from laserimg.simulate.scanner.model import Intensity, Noise, Scanner
from laserimg.simulate.scanner.spinning import full_turn


def terrestrial() -> Scanner:
    """Return a RIEGL VZ-400: 500 rows from +60 to -40 degrees and 1800 columns, 0.2 degrees apart.

    Data sheet of the VZ-400, long range mode: 3 mm noise (1 sigma), a 7 mm beam that grows by 0.35 mrad,
    1.5 to 600 m, 280 m at 20 % and so 198 m at 10 %. Pulses of 5 ns: HELIOS++, data/scanners_tls.xml.
    Our assumptions: of several echoes the strongest; 5 mm noise on the weakest pulses; the pitch, which
    can be 0.0024 degrees; reflectance as a fourth root in place of decibels, made up for range, white
    40000. It shines at 1550 nm,
    where plants are darker than in `MATERIALS`.
    """
    return Scanner(
        "terrestrial",
        full_turn(60 - 0.2 * (np.arange(500) + 0.5), 1800),
        wraps=True,
        step_m=0.001,
        min_range_m=1.5,
        max_range_m=600.0,
        beam=Beam(0.007, 0.00035),
        receiver=Receiver(reach_m=198.0, pulse_m=0.75, strongest=True),
        noise=Noise(white_m=0.003, weakest_m=0.005, ring_m=0.0, ring_period_m=1.0, power=0.05),
        intensity=Intensity(made_up=2.0, exponent=0.25, scale=40000, top=65535),
    )
