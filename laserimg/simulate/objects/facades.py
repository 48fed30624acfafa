"""Facades with windows and doors set back in their reveals."""

import numpy as np

from laserimg.simulate.mesh import Mesh, box, joined
from laserimg.simulate.objects.copies import Row, boxes
from laserimg.simulate.objects.doors import door
from laserimg.simulate.objects.loft import quads_mesh, varied
from laserimg.simulate.objects.windows import window
from laserimg.simulate.things import Thing


def facade(rng: np.random.Generator) -> Thing:
    """Return a `front` as one thing, label building."""
    return Thing("facade", joined([thing.mesh for thing in front(rng)]), "building")


def front(rng: np.random.Generator, width_m: float | None = None) -> tuple[Thing, ...]:
    """Return the front of a house along y that faces +x: the wall, labelled building, then windows and doors.

    Windows, of two kinds a house, and doors, which open inwards, are made as those of rooms.
    Storeys 2.7-3.3 m, 2 to 4 of them; bays 2.2-3.4 m; windows 0.9-1.5 x 1.2-1.7 m with sill at
    0.8-1.0 m; doors 0.9-1.1 x 2.0-2.2 m; reveals 0.08-0.25 m. Usual values of housing, set by eye.
    """
    width = width_m or rng.uniform(8.0, 18.0)
    bays, floors, storey = (
        max(2, round(width / rng.uniform(2.2, 3.4))),
        int(rng.integers(2, 5)),
        rng.uniform(2.7, 3.3),
    )
    wide, high, sill = rng.uniform(0.9, 1.5), rng.uniform(1.2, 1.7), rng.uniform(0.8, 1.0)
    depth, wall = rng.uniform(0.08, 0.25), varied(rng, str(rng.choice(["brick", "concrete"])), 0.3)
    entrance = int(rng.integers(bays))
    narrow = min(wide, 0.7 * width / bays)
    # A house has windows of two kinds, not one made anew for each hole.
    panes = [window(rng, (narrow, high), depth) for _ in range(2)]
    centres = (np.arange(bays) + 0.5) / bays * width - width / 2
    holes, things = [], []
    for floor in range(floors):
        for bay, y in enumerate(centres):
            is_door = floor == 0 and bay == entrance
            half = rng.uniform(0.45, 0.55) if is_door else narrow / 2
            low, tall = (0.0, rng.uniform(2.0, 2.2)) if is_door else (floor * storey + sill, high)
            hole = (y - half, y + half, low, low + tall)
            holes.append((bay, floor, *hole))
            things.append(
                door(rng, (2 * half, tall), depth, is_inward=True).at(0, y)
                if is_door
                else panes[int(rng.integers(2))].at(0, y, low)
            )
    height = floors * storey
    panels = _panels(holes, bays, storey, width, depth)
    ledges = [
        box((0.12, width, 0.1), wall).at(0.06, 0, floor * storey - 0.05) for floor in range(1, floors + 1)
    ]
    room = rng.uniform(2.5, 4.0)
    shell = [
        box((0.05, width, height), wall).at(-room, 0),
        box((room, width, 0.1), wall).at(-room / 2, 0, height),
    ]
    shell += [box((room, 0.02, height), wall).at(-room / 2, y) for y in (0.01 - width / 2, width / 2 - 0.01)]
    details = _details(rng, width, height, storey, centres)
    mesh = joined([quads_mesh(panels, [wall], np.zeros(len(panels), int)), *shell, *ledges, *details])
    return (Thing("facade", mesh, "building"), *things)


def _details(
    rng: np.random.Generator, width: float, height: float, storey: float, centres: np.ndarray
) -> list[Mesh]:
    """A cornice, rain pipes, balconies on upper floors and an awning over the ground floor, each on some."""
    rows: list[Row] = []
    if rng.random() < 0.6:
        proud = rng.uniform(0.1, 0.5)
        rows.append((proud / 2, 0, height - 0.05, proud, width, rng.uniform(0.15, 0.4)))
    rows += [(0.06, s * (width / 2 - 0.15), 0, 0.1, 0.1, height) for s in (-1, 1) if rng.random() < 0.4]
    if rng.random() < 0.25:
        deep = rng.uniform(0.8, 1.6)
        rows.append((deep / 2, 0, rng.uniform(2.4, 2.6), deep, width * rng.uniform(0.4, 0.95), 0.06))
    if rng.random() < 0.3:
        deep, wide = rng.uniform(0.8, 1.5), min(2.6, 0.9 * width / len(centres))
        for floor in range(1, max(2, round(height / storey))):
            for y in centres[:: int(rng.integers(1, 4))]:
                rows.append((deep / 2, float(y), floor * storey - 0.1, deep, wide, 0.12))
                rows.append((deep - 0.03, float(y), floor * storey, 0.05, wide, 0.95))
                rows += [
                    (deep / 2, y + s * (wide / 2 - 0.03), floor * storey, deep, 0.05, 0.95) for s in (-1, 1)
                ]
    return [boxes(rows, varied(rng, "concrete", 0.4))] if rows else []


def _panels(holes, bays: int, storey: float, width: float, depth: float) -> np.ndarray:
    """Four wall pieces around each hole, and the four sides of its reveal."""
    quads = []
    for bay, floor, left, right, low, high in holes:
        a, b = -width / 2 + bay * width / bays, -width / 2 + (bay + 1) * width / bays
        bottom, top = floor * storey, (floor + 1) * storey
        for y0, y1, z0, z1 in (
            (a, left, bottom, top),
            (right, b, bottom, top),
            (left, right, bottom, low),
            (left, right, high, top),
        ):
            quads.append([(0, y0, z0), (0, y1, z0), (0, y1, z1), (0, y0, z1)])
        ring = [(left, low), (right, low), (right, high), (left, high)]
        for (y0, z0), (y1, z1) in zip(ring, ring[1:] + ring[:1], strict=True):
            quads.append([(0, y0, z0), (0, y1, z1), (-depth, y1, z1), (-depth, y0, z0)])
    return np.array(quads, float)
