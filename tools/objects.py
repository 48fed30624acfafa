"""Objects of rooms and streets, made of simple solids, each with a label and its size in metres."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from shapes import Array, Ellipsoid, Frustum, Part, box, ground, pose, prism

NO_RETURN = 0.0


@dataclass(frozen=True, eq=False)
class Thing:
    """An object standing on z = 0 of its frame, front along x."""

    label: str
    parts: tuple[Part, ...]

    def at(self, x: float, y: float, z: float = 0.0, yaw: float = 0.0) -> Self:
        """Return the object at a place in metres, turned by `yaw` degrees."""
        place = pose(x, y, z, yaw)
        return type(self)(self.label, tuple(part.moved(place) for part in self.parts))

    @property
    def size(self) -> tuple[float, float, float]:
        """Extent along x, y, z in metres, in the frame it stands in."""
        corners = np.concatenate([part.corners for part in self.parts])
        x, y, z = np.ptp(corners, axis=0)
        return float(x), float(y), float(z)


def wastebasket(height: float = 0.36, rim: float = 0.27, foot: float = 0.21, open_top: bool = True) -> Thing:
    """Return a wastebasket: a cut-off cone, by default open at the top."""
    return Thing("wastebasket", (Part(Frustum(foot / 2, rim / 2, height, open_top), reflectance=0.35),))


def drum(height: float = 0.88, diameter: float = 0.58) -> Thing:
    """Return a drum: a closed cylinder."""
    return Thing("drum", (Part(Frustum(diameter / 2, diameter / 2, height), reflectance=0.6),))


def crate(length: float, width: float, height: float, reflectance: float = 0.5) -> Thing:
    """Return a plain box."""
    return Thing("box", (Part(box(length, width, height), reflectance=reflectance),))


def ball(diameter: float) -> Thing:
    """Return a ball lying on the floor."""
    radius = diameter / 2
    return Thing("ball", (Part(Ellipsoid((radius, radius, radius)), pose(z=radius), 0.8),))


def ramp(length: float, width: float, height: float) -> Thing:
    """Return a wedge that rises along x: a tilted plane."""
    return Thing("ramp", (Part(prism([(0, 0), (length, 0), (length, height)], width), reflectance=0.45),))


def table(length: float = 1.4, width: float = 0.7, height: float = 0.74) -> Thing:
    """Return a table: a top and four legs."""
    top = Part(box(length, width, 0.03), pose(z=height - 0.03), 0.7)
    x, y = length / 2 - 0.05, width / 2 - 0.05
    places = [(x, y), (x, -y), (-x, y), (-x, -y)]
    legs = [Part(Frustum(0.025, 0.025, height - 0.03), pose(*place), 0.5) for place in places]
    return Thing("table", (top, *legs))


def chair(seat: float = 0.46, back: float = 0.9) -> Thing:
    """Return an office chair: five feet, column, seat and a back leaning slightly."""
    feet = [Part(box(0.3, 0.04, 0.05), _turned_out(angle, 0.15), 0.15) for angle in range(0, 360, 72)]
    column = Part(Frustum(0.03, 0.03, seat - 0.05), pose(z=0.04), 0.2)
    cushion = Part(box(0.46, 0.46, 0.07), pose(z=seat - 0.07), 0.25)
    rest = Part(box(0.05, 0.42, back - seat - 0.1), pose(x=-0.21, z=seat + 0.1, pitch=-8), 0.25)
    return Thing("chair", (*feet, column, cushion, rest))


def car(length: float = 4.3, width: float = 1.75, height: float = 1.45, paint: float = 0.6) -> Thing:
    """Return a car: body and cabin as prisms, wheels, windows that give no return."""
    half, waist = length / 2, 0.62 * height
    lower = [(-half, 0.3), (half, 0.3), (half, 0.55), (half - 0.1, waist - 0.12), (half - 1.2, waist)]
    body = Part(prism([*lower, (-half + 0.1, waist), (-half, 0.7)], width), reflectance=paint)
    outline = [(half - 1.25, waist), (half - 1.95, height), (-half + 0.9, height), (-half + 0.3, waist)]
    glass = [NO_RETURN, paint, NO_RETURN, paint, NO_RETURN, NO_RETURN]
    cabin = Part(prism(outline, width - 0.16), reflectance=glass)
    pillars = [
        Part(
            prism([(x, waist), (x + 0.1, waist), (x + 0.1, height), (x, height)], width - 0.15),
            reflectance=paint,
        )
        for x in (0.1 - half / 2, half - 2.1)
    ]
    at = [(x, y) for x in (half - 0.8, 0.8 - half) for y in (width / 2 - 0.01, 0.21 - width / 2)]
    wheels = [Part(Frustum(0.31, 0.31, 0.2), pose(x, y, 0.31, roll=90), 0.1) for x, y in at]
    return Thing("car", (body, cabin, *pillars, *wheels))


def pole(height: float = 5.0, diameter: float = 0.12) -> Thing:
    """Return a pole."""
    return Thing("pole", (Part(Frustum(diameter / 2, diameter / 2, height), reflectance=0.5),))


def person(height: float = 1.75) -> Thing:
    """Return a standing person: legs, trunk, arms and head."""
    scale = height / 1.75
    legs = [Part(Frustum(0.07, 0.09, 0.85), pose(y=side * 0.1), 0.3) for side in (-1, 1)]
    arms = [Part(Frustum(0.04, 0.05, 0.6), pose(y=side * 0.26, z=0.82), 0.4) for side in (-1, 1)]
    trunk = Part(Ellipsoid((0.14, 0.22, 0.36)), pose(z=1.15), 0.4)
    head = Part(Ellipsoid((0.1, 0.08, 0.12)), pose(z=1.63), 0.6)
    parts = [*legs, *arms, trunk, head]
    return Thing("person", tuple(_scaled(part, scale) for part in parts))


def tree(rng: np.random.Generator, height: float = 6.0, crown: float = 3.0) -> Thing:
    """Return a tree: a trunk and a crown of small balls."""
    trunk = Part(Frustum(0.16, 0.11, height - crown / 2), reflectance=0.35)
    places = rng.normal((0, 0, height - crown / 2), crown / 5, (40, 3))
    radii = rng.uniform(0.15, 0.45, 40)
    leaves = [Part(Ellipsoid((r, r, r)), pose(*place), 0.45) for r, place in zip(radii, places, strict=True)]
    return Thing("tree", (trunk, *leaves))


def facade(width: float, height: float, windows: int = 4, floors: int = 2) -> Thing:
    """Return a facade along y with recessed windows, every other of them without return."""
    wall = Part(box(0.3, width, height), reflectance=0.5)
    parts = [wall]
    for floor in range(floors):
        for column in range(windows):
            glass = NO_RETURN if (floor + column) % 2 else 0.2
            y = width * ((column + 0.5) / windows - 0.5)
            parts.append(Part(box(0.1, 1.1, 1.4), pose(0.16, y, 1.0 + 2.9 * floor), glass))
    return Thing("facade", tuple(parts))


def terrain(slope_deg: float = 0.0) -> Thing:
    """Return endless ground, tilted about y."""
    tilt = np.radians(slope_deg)
    return Thing("ground", (Part(ground((np.sin(tilt), 0.0, np.cos(tilt))), reflectance=0.3),))


def hall(length: float, width: float, height: float) -> Thing:
    """Return the floor, ceiling and walls of an empty room, seen from inside."""
    return Thing("room", (Part(box(length, width, height), reflectance=(0.7, 0.7, 0.75, 0.75, 0.85, 0.4)),))


def _turned_out(angle_deg: float, radius: float) -> Array:
    return pose(yaw=angle_deg) @ pose(x=radius)


def _scaled(part: Part, scale: float) -> Part:
    if isinstance(part.shape, Frustum):
        old = part.shape
        shape = Frustum(old.bottom_radius * scale, old.top_radius * scale, old.height * scale, old.open_top)
    else:
        assert isinstance(part.shape, Ellipsoid)
        a, b, c = part.shape.radii
        shape = Ellipsoid((a * scale, b * scale, c * scale))
    place = part.pose.copy()
    place[:3, 3] *= scale
    return Part(shape, place, part.reflectance)
