"""Materials of simulated objects: how much they reflect, mirror and let through at 905 nm."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType


@dataclass(frozen=True, slots=True)
class Material:
    """What a surface does to an infrared pulse.

    The values of `MATERIALS` are rounded assumptions of ours for 905 nm, not measurements; makers
    of objects vary them.

    Parameters
    ----------
    name : str
    reflectance : float
        Diffuse share in 0..1.
    specular : float
        Mirrored share in 0..1.
    transmission : float
        Share in 0..1 that passes to what is behind, at one face: a pane of glass has two.
    """

    name: str
    reflectance: float
    specular: float = 0.0
    transmission: float = 0.0


_ALL = (
    Material("paint_white", 0.85),
    Material("paint_dark", 0.15),
    Material("wood", 0.55),
    Material("metal_bare", 0.35, 0.5),
    Material("metal_painted", 0.5, 0.1),
    Material("chrome", 0.03, 0.85),
    Material("plastic_light", 0.65, 0.05),
    Material("plastic_dark", 0.08, 0.05),
    Material("fabric_light", 0.6),
    Material("fabric_dark", 0.2),
    Material("glass", 0.002, 0.04, 0.92),
    Material("rubber", 0.05),
    Material("asphalt", 0.17),
    Material("concrete", 0.4),
    Material("brick", 0.4),
    Material("plaster", 0.75),
    Material("grass", 0.5),
    Material("leaves", 0.5, 0.0, 0.0),
    Material("bark", 0.3),
    Material("soil", 0.2),
    Material("skin", 0.55),
    Material("cardboard", 0.55),
    Material("paper", 0.75),
    Material("carpet", 0.3),
    Material("tiles", 0.5, 0.1),
    Material("retroreflector", 0.95),
)
MATERIALS: Mapping[str, Material] = MappingProxyType({material.name: material for material in _ALL})
