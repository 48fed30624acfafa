"""Materials of simulated objects: how much they reflect, mirror and let through at 905 nm."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType


@dataclass(frozen=True, slots=True)
class Material:
    """What a surface does to an infrared pulse.

    Reflectances of `MATERIALS` are rounded, for 905 nm, and makers of objects vary them. From SICK's
    table of remissions (LD-LRS, Operating Instructions 8016506, table 3: rubber 0.02, black board 0.10,
    grey cardboard 0.20, wood 0.40, grey PVC 0.50, white paper 0.80, white plaster 1.00): rubber, paint,
    wood, plastic, paper, plaster. From spectra at 0.9 micrometres of the ASTER library (Baldridge et al.
    2009, doi:10.1016/j.rse.2008.11.007: asphaltic concrete 0.28, rye grass 0.51, deciduous leaves 0.55):
    asphalt, which cars darken, grass, leaves. A pane reflects 0.04 a face (Fresnel, index 1.5). The rest
    are our assumptions.

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
    Material("wood", 0.5),
    Material("metal_bare", 0.35, 0.5),
    Material("metal_painted", 0.5, 0.1),
    Material("chrome", 0.03, 0.85),
    Material("plastic_light", 0.65, 0.05),
    Material("plastic_dark", 0.08, 0.05),
    Material("fabric_light", 0.6),
    Material("fabric_dark", 0.2),
    Material("glass", 0.002, 0.04, 0.92),
    Material("rubber", 0.03),
    Material("asphalt", 0.2),
    Material("concrete", 0.4),
    Material("brick", 0.4),
    Material("plaster", 0.8),
    Material("grass", 0.5),
    Material("leaves", 0.5),
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
