"""What every scanner model says."""

from dataclasses import dataclass
from typing import NamedTuple

from laserimg.scan import Float32Array
from laserimg.simulate.footprint import Beam
from laserimg.simulate.receiver import Receiver
from laserimg.simulate.scanner.head import Head


class Noise(NamedTuple):
    """How ranges and powers are disturbed.

    Parameters
    ----------
    white_m, weakest_m : float
        Standard deviation of a range, different for every beam: of a strong pulse, and of the weakest
        that is seen. Between, the variance grows with one over the power, as that of photons counted.
    ring_m : float
        Standard deviation of an error that depends on the range alone: on a wall it makes rings.
    ring_period_m : float
        Ranges over which it goes up and down once.
    power : float
        Standard deviation of the power, as a share of it: 0.05 to 0.1, our assumption in all models.
    """

    white_m: float
    weakest_m: float
    ring_m: float
    ring_period_m: float
    power: float


class Intensity(NamedTuple):
    """How a scanner reports power: ``scale * (power * range**made_up) ** exponent``, in whole steps.

    Parameters
    ----------
    made_up : float
        The part of the falloff with the range squared that the scanner takes back: 0 none, 2 all.
    exponent : float
        Below 1 the scale is compressed.
    scale : float
        What white, straight on, at 1 m, is reported as.
    top : float
        The largest value.
    """

    made_up: float
    exponent: float
    scale: float
    top: float


@dataclass(frozen=True, eq=False, slots=True)
class Scanner:
    """A laser scanner.

    Parameters
    ----------
    name : str
    directions : (H, W, 3) array of float32
        Unit vectors of the beams, as the scanner reports them.
    wraps : bool
        The columns close a full turn.
    step_m : float
        Ranges are whole multiples of it.
    min_range_m, max_range_m : float
    beam : Beam
    receiver : Receiver
    noise : Noise
    intensity : Intensity
    head : Head, optional
        That tilts the fan and does not report its tilt exactly.
    """

    name: str
    directions: Float32Array
    wraps: bool
    step_m: float
    min_range_m: float
    max_range_m: float
    beam: Beam
    receiver: Receiver
    noise: Noise
    intensity: Intensity
    head: Head | None = None
