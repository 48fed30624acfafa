"""Scenes: things placed as in the world, each seed another one."""

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Protocol

import numpy as np

from laserimg.simulate.scenes.corridor import corridor
from laserimg.simulate.scenes.furnishing import Maker
from laserimg.simulate.scenes.office import office
from laserimg.simulate.scenes.park import park
from laserimg.simulate.scenes.stairwell import stairwell
from laserimg.simulate.scenes.street import street
from laserimg.simulate.things import Scene


class SceneMaker(Protocol):
    """Makes a scene from random numbers; of each of the makers `extras` 1-4 things come too."""

    def __call__(self, rng: np.random.Generator, extras: Sequence[Maker] = ...) -> Scene:
        """Return a scene."""
        ...


SCENES: Mapping[str, SceneMaker] = MappingProxyType(
    {"corridor": corridor, "office": office, "park": park, "stairwell": stairwell, "street": street}
)
