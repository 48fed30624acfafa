"""Scanner models: the grid of beams and how ranges are rounded, limited and disturbed."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from laserimg.projection import directions_from_angles
from laserimg.scan import Float32Array


@dataclass(frozen=True, eq=False, slots=True)
class Scanner:
    """A laser scanner.

    Parameters
    ----------
    name : str
    directions : (H, W, 3) array of float32
        Unit vectors of the beams.
    wraps : bool
    noise_m : float
        Standard deviation of a range.
    step_m : float
        Ranges are whole multiples of it.
    min_range_m, max_range_m : float
    """

    name: str
    directions: Float32Array
    wraps: bool
    noise_m: float
    step_m: float
    min_range_m: float
    max_range_m: float


def tilting_fan(fan: np.ndarray, tilt: np.ndarray) -> Float32Array:
    """Return (H, W, 3) beams of a fan at angles (W,) that tilts about y by (H,) radians, up positive."""
    a, t = np.meshgrid(fan, tilt)
    beams = np.stack([np.cos(a) * np.cos(t), np.sin(a), np.cos(a) * np.sin(t)], axis=-1)
    return beams.astype(np.float32)


def lms200_tilt() -> Scanner:
    """Return a tilting SICK LMS 200.

    Noise 5 mm (1 sigma to 8 m), millimetres in mode 06h to 32 m: Technical Description 8008970. The
    tilt, +-56 degrees in 226 rows, and the 0.3 m minimum are our assumption.
    """
    fan, tilt = np.radians(np.linspace(90, -90, 361)), np.radians(np.linspace(56, -56, 226))
    return Scanner("lms200_tilt", tilting_fan(fan, tilt), False, 0.005, 0.001, 0.3, 32.0)


def lms151_turn() -> Scanner:
    """Return a SICK LMS 151 on a turntable, 760 x 1135 over the full sphere.

    Noise 12 mm and 0.5 to 50 m: SICK support and manual 8012471; millimetres as in its telegrams.
    """
    elevation = np.radians(90 - 180 * (np.arange(760) + 0.5) / 760)
    azimuth = np.radians(180 - 360 * (np.arange(1135) + 0.5) / 1135)
    return Scanner("lms151_turn", directions_from_angles(azimuth, elevation), True, 0.012, 0.001, 0.5, 50.0)


SCANNERS: Mapping[str, Scanner] = MappingProxyType({s.name: s for s in (lms200_tilt(), lms151_turn())})
