"""Scenes: things placed as in the world, each seed another one."""

from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np

from laserimg.simulate.scenes.corridor import corridor
from laserimg.simulate.scenes.office import office
from laserimg.simulate.scenes.park import park
from laserimg.simulate.scenes.stairwell import stairwell
from laserimg.simulate.scenes.street import street
from laserimg.simulate.things import Scene

SCENES: Mapping[str, Callable[[np.random.Generator], Scene]] = MappingProxyType(
    {"corridor": corridor, "office": office, "park": park, "stairwell": stairwell, "street": street}
)
