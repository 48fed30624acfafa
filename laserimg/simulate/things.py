"""Things, and scenes of things with the places of scanners."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from laserimg.simulate.mesh import Mesh


@dataclass(frozen=True, eq=False, slots=True)
class Thing:
    """An object on z = 0 around the origin, its front towards +x.

    Parameters
    ----------
    kind : str
        What it is.
    mesh : Mesh
    label : str
        The class it has in the truth; "" when nothing is asked of it.
    clear_m : float
        Free space to keep around it, in metres.
    """

    kind: str
    mesh: Mesh
    label: str = ""
    clear_m: float = 0.0

    def at(self, x: float, y: float, z: float = 0.0, yaw_deg: float = 0.0) -> "Thing":
        """Return the thing turned about z by `yaw_deg`, then shifted."""
        return replace(self, mesh=self.mesh.at(x, y, z, yaw_deg))

    @property
    def footprint(self) -> float:
        """Radius in metres, seen from above, around the origin the thing was made at."""
        return float(np.hypot(*self.mesh.vertices[:, :2].T).max())


@dataclass(frozen=True, eq=False, slots=True)
class Scene:
    """Things at their places.

    Parameters
    ----------
    things : tuple of Thing
    scanners : tuple of (4, 4) arrays
        Poses ``world_from_scan`` to scan from.
    name : str
    """

    things: tuple[Thing, ...]
    scanners: tuple[NDArray[np.float64], ...]
    name: str
