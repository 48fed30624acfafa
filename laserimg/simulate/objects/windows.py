"""Windows and glazed walls; their wall's face is the plane x = 0, the wall is behind it."""

import numpy as np

from laserimg.simulate.mesh import Mesh, joined
from laserimg.simulate.objects.copies import Row, boxes
from laserimg.simulate.objects.loft import quads_mesh, varied
from laserimg.simulate.things import Thing


def window_size(rng: np.random.Generator) -> tuple[float, float]:
    """Return width 0.6-2.2 m and height 0.7-1.7 m of a wall opening: usual office windows, set by eye."""
    return rng.uniform(0.6, 2.2), rng.uniform(0.7, 1.7)


def window(
    rng: np.random.Generator, size: tuple[float, float] | None = None, wall_m: float | None = None
) -> Thing:
    """Return a window that fills an opening: frame, 1-3 sashes with panes, sill board, blinds on 3 in 10.

    Frames 50-80 mm and sashes 40-70 mm wide, set back 0.02-0.25 m from the wall's face.

    Parameters
    ----------
    rng : Generator
    size : tuple of float, optional
        Width and height of the opening, by default drawn as in `window_size`.
    wall_m : float, optional
        Thickness of the wall, by default 0.2-0.4 m.
    """
    wide, high = size or window_size(rng)
    wall = wall_m or rng.uniform(0.2, 0.4)
    thick = rng.uniform(0.05, 0.075)
    back = -rng.uniform(min(0.02 + thick / 2, wall / 2), max(wall - thick / 2, wall / 2 + 0.001))
    paint = varied(rng, str(rng.choice(["paint_white", "plastic_light", "wood", "metal_painted"])), 0.2)
    sill = 0.025
    rows, panes = _sashes(rng, wide, high - sill, thick)
    parts = [boxes(rows, paint).at(back, 0, sill), boxes(panes, "glass").at(back, 0, sill)]
    front = rng.uniform(0.0, 0.2)
    parts.append(boxes([((back + front) / 2, 0, 0, front - back, wide - 0.004, sill)], paint))
    if rng.random() < 0.3:
        parts.append(_blind(rng, wide - 0.04, high - sill - 0.02).at(back + thick / 2 + 0.03, 0, high - 0.01))
    return Thing("window", joined(parts), "window")


def glazing(rng: np.random.Generator, size: tuple[float, float] | None = None, wall_m: float = 0.1) -> Thing:
    """Return a glazed wall down to the floor: posts 0.8-1.6 m apart, 1-3 rails; it has no label."""
    wide, high = size or (rng.uniform(2.0, 6.0), rng.uniform(2.4, 3.0))
    bays = max(1, round(wide / rng.uniform(0.8, 1.6)))
    levels = [0.0, *sorted(rng.uniform(0.3, high - 0.3, int(rng.integers(0, 2)))), high]
    post = rng.uniform(0.04, 0.09)
    x = -wall_m / 2
    rows: list[Row] = [(x, y, 0, 0.06, post, high) for y in np.linspace(-0.5, 0.5, bays + 1) * (wide - post)]
    rows += [(x, 0, min(z, high - post), 0.06, wide, post) for z in levels]
    pane = boxes([(x, 0, 0.01, 0.01, wide - 0.02, high - 0.02)], "glass")
    return Thing("glazing", joined([boxes(rows, varied(rng, "metal_painted", 0.3)), pane]))


def _sashes(rng: np.random.Generator, wide: float, high: float, thick: float) -> tuple[list[Row], list[Row]]:
    """Boxes of the fixed frame and the sashes, and the panes within."""
    frame, sash = rng.uniform(0.05, 0.08), rng.uniform(0.04, 0.07)
    count = max(1, min(3, round(wide / rng.uniform(0.6, 1.1))))
    rows: list[Row] = [(0, s * (wide - frame) / 2, 0, thick, frame, high) for s in (-1, 1)]
    rows += [(0, 0, z, thick, wide - 2 * frame, frame) for z in (0, high - frame)]
    inner, tall, panes = (wide - 2 * frame) / count, high - 2 * frame, []
    for k in range(count):
        y = -wide / 2 + frame + (k + 0.5) * inner
        rows += [(0.008, y + s * (inner - sash) / 2, frame, thick, sash, tall) for s in (-1, 1)]
        rows += [(0.008, y, z, thick, inner - 2 * sash, sash) for z in (frame, frame + tall - sash)]
        panes.append((0, y, frame + sash, 0.02, inner - 2 * sash, tall - 2 * sash))
        rows.append((0.05, y + 0.45 * inner, high / 2, 0.05, 0.02, 0.12))
    if rng.random() < 0.2:
        rows.append((0, 0, rng.uniform(0.55, 0.75) * high, thick, wide - 2 * frame, sash))
    return rows, panes


def _blind(rng: np.random.Generator, wide: float, high: float) -> Mesh:
    """Slats 25-80 mm deep or a cloth, let down from z = 0 by 20-100 %."""
    fall = high * rng.uniform(0.2, 1.0)
    white = varied(rng, "plastic_light", 0.4)
    head = boxes([(0, 0, -0.05, 0.05, wide, 0.05)], white)
    if rng.random() < 0.35:
        return joined([head, boxes([(0, 0, -fall, 0.003, wide, fall - 0.04)], white)])
    deep, tilt = rng.uniform(0.025, 0.08), np.radians(rng.uniform(-75, 75))
    z = -np.arange(0.06, fall, 0.9 * deep)
    x, rise = deep / 2 * np.cos(tilt), deep / 2 * np.sin(tilt)
    y = wide / 2
    edge = np.stack([np.array([(-x, -y, -rise), (x, -y, rise), (x, y, rise), (-x, y, -rise)])] * len(z))
    edge[:, :, 2] += z[:, None]
    return joined([head, quads_mesh(edge, [white], np.zeros(len(z), int))])
