"""What a receiver makes of the echoes of each beam: one range and one power, or none."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from laserimg.scan import Float32Array

# Echoes below this share of the weakest pulse are none: they would only bridge gaps between others.
MIN_SHARE = 0.01


class Receiver(NamedTuple):
    """How a scanner finds its range in what comes back.

    Parameters
    ----------
    reach_m : float
        Range at which a matt target of 10 % straight on is just seen: it sets the weakest pulse.
    pulse_m : float
        Echoes nearer together than this run into one pulse. Its range is found at its rising edge, which
        the farther echoes pull back, each by its share of the power and by how much of it comes in time:
        a share that falls to 0 at this distance.
    strongest : bool
        Of several pulses the strongest is measured; else the first.
    """

    reach_m: float
    pulse_m: float
    strongest: bool

    @property
    def weakest(self) -> float:
        """Power of the weakest pulse that is seen."""
        return 0.1 / self.reach_m**2


def received(
    beam: NDArray[np.integer], distance: Float32Array, power: Float32Array, count: int, receiver: Receiver
) -> tuple[Float32Array, Float32Array]:
    """Return range and power measured by each of `count` beams; 0 and 0 for no return.

    Parameters
    ----------
    beam : (k,) array of int
        The beam of each echo.
    distance, power : (k,) arrays of float32
    count : int
    receiver : Receiver

    Returns
    -------
    range, power : (count,) arrays of float32
    """
    strong = power >= MIN_SHARE * receiver.weakest
    beam, distance, power = beam[strong], distance[strong], power[strong]
    several = np.bincount(beam, minlength=count)[beam] > 1
    range_m, strength = np.zeros(count, np.float32), np.zeros(count, np.float32)
    alone = ~several & (power >= receiver.weakest)
    range_m[beam[alone]], strength[beam[alone]] = distance[alone], power[alone]
    owner, centre, total = _pulses(beam[several], distance[several], power[several], receiver.pulse_m)
    seen = np.flatnonzero(total >= receiver.weakest)
    # The last that is written stays: the first pulse, or the strongest.
    order = seen[np.argsort(total[seen], kind="stable")] if receiver.strongest else seen[::-1]
    range_m[owner[order]], strength[owner[order]] = centre[order], total[order]
    return range_m, strength


def _pulses(
    beam: NDArray[np.integer], distance: Float32Array, power: Float32Array, pulse_m: float
) -> tuple[NDArray[np.integer], Float32Array, Float32Array]:
    """Beam, range and power of the pulses of each beam, from near to far."""
    if not len(beam):
        return beam, distance, power
    # One key of integers sorts three times as fast as two keys: beam, then tenths of a millimetre.
    order = np.argsort(beam.astype(np.int64) << 32 | (distance * 1e4).astype(np.int64))
    beam, distance, power = beam[order], distance[order], power[order]
    starts = np.r_[True, (beam[1:] != beam[:-1]) | (np.diff(distance) > pulse_m)]
    first = np.flatnonzero(starts)
    total = np.add.reduceat(power, first)
    behind = distance - np.repeat(distance[first], np.diff(np.r_[first, len(distance)]))
    pull = power * behind * np.maximum(1 - behind / np.float32(pulse_m), 0)
    found = distance[first] + np.add.reduceat(pull, first) / total
    return beam[first], found.astype(np.float32), total
