"""Doors in the plane x = 0, which is the face of their wall; the wall is behind it."""

import numpy as np

from laserimg.simulate.materials import Material
from laserimg.simulate.mesh import Mesh, joined
from laserimg.simulate.objects.copies import Row, boxes, rods
from laserimg.simulate.objects.loft import varied
from laserimg.simulate.things import Thing

LEAF_M = 0.04
HANDLE_M = 1.05
"""Height of the handle's axis, DIN 18101."""


def door_size(rng: np.random.Generator) -> tuple[float, float]:
    """Return width and height of a wall opening for a door (DIN 18100), one in ten for two leaves."""
    wide = float(rng.choice([0.76, 0.885, 1.01, 1.135], p=[0.15, 0.4, 0.35, 0.1]))
    return (1.6 if rng.random() < 0.1 else wide) + 0.02 * rng.random(), float(rng.choice([2.005, 2.13]))


def door(
    rng: np.random.Generator,
    size: tuple[float, float] | None = None,
    wall_m: float | None = None,
    *,
    is_inward: bool = False,
) -> Thing:
    """Return a door with frame, leaf and handles: closed (3 in 5), ajar by 5-30 or open by 60-110 degrees.

    Parameters
    ----------
    rng : Generator
    size : tuple of float, optional
        Width and height of the opening it fills, by default drawn as in `door_size`.
    wall_m : float, optional
        Thickness of the wall, by default 0.10-0.30 m.
    is_inward : bool
        Opens to what is behind the wall alone, not to either side.
    """
    wide, high = size or door_size(rng)
    wall = wall_m or rng.uniform(0.10, 0.30)
    face = rng.uniform(0.03, 0.07)
    steel = varied(rng, str(rng.choice(["metal_painted", "wood", "paint_white"])), 0.3)
    parts = [_frame(rng, wide, high, wall, face, steel)]
    at_x = -rng.choice([0.03, rng.uniform(0.03, max(wall - 0.03, 0.031)), max(wall - 0.03, 0.031)])
    clear = wide - 2 * face
    leaves = 2 if clear > 1.25 else 1
    wood = varied(rng, str(rng.choice(["wood", "paint_white", "metal_painted", "paint_dark"])), 0.3)
    make = _glazing(rng)
    for side in (-1, 1)[:leaves] if leaves == 2 else (int(rng.choice([-1, 1])),):
        leaf = _leaf(rng, clear / leaves - 0.004, high - face - 0.006, wood, make)
        turned = joined([leaf]).at(0, 0, 0, _opening_deg(rng) * (1 if is_inward else rng.choice([-1, 1])))
        mirror = np.diag([1.0, -side, 1.0, 1.0])
        parts.append(turned.moved(mirror).at(at_x, side * clear / 2, 0.006))
    mesh = joined(parts)
    return Thing("door", mesh.at(0, 0, -float(mesh.vertices[:, 2].min())), "door")


def _opening_deg(rng: np.random.Generator) -> float:
    state = rng.random()
    return 0.0 if state < 0.6 else rng.uniform(5, 30) if state < 0.8 else rng.uniform(60, 110)


def _frame(rng, wide: float, high: float, wall: float, face: float, steel: Material) -> Mesh:
    """Jambs and head as deep as the wall; half of them with an architrave around on both sides."""
    proud = rng.uniform(0.003, 0.02)
    deep, x = wall + 2 * proud, -wall / 2
    y = (wide - face) / 2
    rows: list[Row] = [(x, s * y, 0, deep, face, high) for s in (-1, 1)]
    rows.append((x, 0, high - face, deep, wide, face))
    if rng.random() < 0.5:
        trim, thick = rng.uniform(0.04, 0.08), 0.012 + proud
        for front in (thick / 2, -wall - thick / 2):
            rows += [(front, s * (wide + trim) / 2, 0, thick, trim, high + trim) for s in (-1, 1)]
            rows.append((front, 0, high, thick, wide, trim))
    return boxes(rows, steel)


def _glazing(rng: np.random.Generator) -> tuple[float, float, float] | None:
    """Margin at the sides, sill and head margin of a pane in the leaf; three in four have none."""
    if rng.random() < 0.75:
        return None
    return rng.uniform(0.1, 0.2), float(rng.choice([0.15, 0.4, 1.0])), rng.uniform(0.1, 0.2)


def _leaf(
    rng: np.random.Generator,
    wide: float,
    high: float,
    wood: Material,
    pane: tuple[float, float, float] | None,
) -> Mesh:
    """A leaf hinged on the z axis that reaches to y = wide, with a handle or knob on both sides."""
    if pane is None:
        parts = [boxes([(0, wide / 2, 0, LEAF_M, wide, high)], wood)]
    else:
        side, low, top = pane
        tall = high - low - top
        rows = [(0, wide / 2, 0, LEAF_M, wide, low), (0, wide / 2, high - top, LEAF_M, wide, top)]
        rows += [(0, y, low, LEAF_M, side, tall) for y in (side / 2, wide - side / 2)]
        glass = boxes([(0, wide / 2, low, 0.008, wide - 2 * side, tall)], "glass")
        parts = [boxes(rows, wood), glass]
    y, lever = wide - 0.06, rng.uniform(0.1, 0.14)
    ends = []
    for x in (-1, 1):
        ends += [((0, y, HANDLE_M), (x * 0.07, y, HANDLE_M))]
        ends += [((x * 0.065, y + 0.01, HANDLE_M), (x * 0.065, y - lever, HANDLE_M))]
    plate = boxes([(0, y, HANDLE_M - 0.12, LEAF_M + 0.01, 0.04, 0.2)], "metal_bare")
    return joined([*parts, rods(ends, 0.01, "metal_bare"), plate])
