"""Seeded scenes with exact truth: what benchmarks and tests measure against.

    python tools/scenes.py room -o room.npz        # the benchmark room of 760 x 1135 rays

A scene is a list of things and the place of the scanner; `scan_of` casts a ray for every pixel and
returns the scan beside the truth of each pixel.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import maximum_filter, minimum_filter

from laserimg.projection import directions_from_angles
from laserimg.scan import Scan
from objects import (
    Thing,
    ball,
    car,
    chair,
    crate,
    drum,
    facade,
    hall,
    person,
    pole,
    ramp,
    terrain,
    tree,
    wastebasket,
)
from shapes import Cast, pose, raycast

ROWS, COLUMNS = 760, 1135
EDGE_PIXELS = 2


@dataclass(frozen=True, eq=False, slots=True)
class Scene:
    """Things in a world with z up, and where the scanner stands in it."""

    things: tuple[Thing, ...]
    scanner: tuple[float, float, float]
    max_range: float


@dataclass(frozen=True, eq=False, slots=True)
class Truth:
    """What each pixel of a scan of a scene shows.

    Parameters
    ----------
    range : (H, W) array of float64
        Metres without noise; 0 where nothing returned.
    normals : (H, W, 3) array of float64
        Unit normals turned to the scanner; 0 where nothing returned.
    surface : (H, W) array of int32
        One number per smooth face of a solid, from 1; 0 where nothing returned.
    thing : (H, W) array of int32
        Index into `things`; -1 where nothing returned.
    planar : (H, W) array of bool
        The face is a plane.
    edge : (H, W) array of bool
        Within 2 pixels of a change of surface.
    things : tuple of Thing
        As they stand in the world, with label and size.
    """

    range: NDArray[np.float64]
    normals: NDArray[np.float64]
    surface: NDArray[np.int32]
    thing: NDArray[np.int32]
    planar: NDArray[np.bool_]
    edge: NDArray[np.bool_]
    things: tuple[Thing, ...]


def panorama(rows: int = ROWS, columns: int = COLUMNS, top_deg: float = 90.0) -> NDArray[np.float32]:
    """Return the rays of a full turn, from elevation `top_deg` down to the same below the horizon."""
    elevation = np.radians(top_deg * (1 - (2 * np.arange(rows) + 1) / rows))
    azimuth = np.pi * (1 - (2 * np.arange(columns) + 1) / columns)
    return directions_from_angles(azimuth, elevation)


def room(seed: int = 0) -> Scene:
    """Return the benchmark room: 8 x 6 x 3 m, 12 boxes, cylinders, a sphere and tilted planes."""
    rng = np.random.default_rng(seed)
    places = iter(_free_places(rng, 22, (7.4, 5.4), keep_off=(-3.0, -2.0)))
    boxes = [_on_floor(rng, crate(*rng.uniform(0.25, 1.1, 3)), next(places)) for _ in range(12)]
    round_ones = [drum(), drum(1.5, 0.35), wastebasket(), wastebasket(open_top=False), pole(3.0, 0.3)]
    others = [*round_ones, ball(0.7), ramp(1.2, 0.9, 0.5), ramp(0.9, 1.1, 0.9), chair()]
    placed = [_on_floor(rng, thing, next(places)) for thing in others]
    return Scene((hall(8, 6, 3), *boxes, *placed), scanner=(-3.0, -2.0, 0.75), max_range=20.0)


def street(seed: int = 0) -> Scene:
    """Return the outdoor scene: ground, facades, cars, poles, trees and people to 60 m."""
    rng = np.random.default_rng(seed)
    facades = [facade(24, 7, 8).at(x, 9.5, yaw=-90) for x in (-40, -14, 12, 38)]
    facades += [facade(20, 9, 6, 3).at(x, -11, yaw=90) for x in (-30, 2, 33)]
    cars = [
        car().at(x, y, yaw=rng.uniform(-4, 4))
        for x, y in [(-9, 4), (5, 4.2), (11, 4), (-4, -5), (18, -5), (30, 4)]
    ]
    cars += [car(4.8, 1.9, 1.75).at(-18, -5.2, yaw=180), car(3.6, 1.6, 1.5).at(2.5, -5.1)]
    poles = [pole().at(x, 6.2) for x in range(-45, 50, 15)] + [
        pole(2.6, 0.06).at(x, -6.6) for x in (-6, 9, 24)
    ]
    trees = [tree(rng, rng.uniform(4.5, 8)).at(x, -7.8) for x in (-24, -12, 13, 27, 44)]
    people = [
        person(rng.uniform(1.6, 1.9)).at(x, y, yaw=rng.uniform(0, 360))
        for x, y in [(4, 7), (6, -7.4), (-5, 7.1), (14, 7.3), (-13, 1), (22, 1.5), (3.5, -1.5)]
    ]
    things = (terrain(), *facades, *cars, *poles, *trees, *people)
    return Scene(things, scanner=(0.0, 0.0, 1.6), max_range=60.0)


def scan_of(
    scene: Scene,
    directions: ArrayLike | None = None,
    noise: float = 0.01,
    seed: int = 0,
    wraps: bool = True,
    yaw_deg: float = 0.0,
) -> tuple[Scan, Truth]:
    """Cast a ray for every pixel and return the scan with the truth of each pixel.

    Parameters
    ----------
    scene : Scene
    directions : (H, W, 3) array, optional
        Unit vectors in the scanner's frame; by default the 760 x 1135 panorama.
    noise : float
        Standard deviation of the range in metres.
    seed : int
        Of the noise.
    wraps : bool
        The columns close a full turn.
    yaw_deg : float
        Heading of the scanner in the world.
    """
    rays = panorama() if directions is None else np.asarray(directions, np.float32)
    world_from_scan = pose(*scene.scanner, yaw_deg)
    things = [thing.at(0, 0) for thing in scene.things]
    scan_from_world = np.linalg.inv(world_from_scan)
    parts = [part.moved(scan_from_world) for thing in things for part in thing.parts]
    cast = raycast(parts, rays.reshape(-1, 3).astype(np.float64))
    reflectance, hit = _reflectance(parts, cast, rays.reshape(-1, 3), scene.max_range)
    truth = _truth(scene.things, parts, cast, hit, rays.shape[:2])
    noisy = truth.range + np.random.default_rng(seed).normal(0, noise, truth.range.shape)
    measured = np.where(truth.range > 0, np.maximum(noisy, 0.01), 0)
    scan = Scan(
        measured.astype(np.float32),
        rays,
        reflectance.reshape(rays.shape[:2]).astype(np.float32),
        world_from_scan,
        wraps,
    )
    return scan, truth


def _reflectance(parts, cast: Cast, directions, max_range: float):
    """Material times the cosine of incidence, and which rays give a return."""
    table = np.zeros((len(parts) + 1, max(part.shape.faces for part in parts)))
    for number, part in enumerate(parts):
        table[number, : part.shape.faces] = part.face_reflectance()
    material = table[cast.part, cast.face]
    hit = (material > 0) & (cast.distance <= max_range)
    cosine = np.abs(np.einsum("ij,ij->i", cast.normal, directions))
    return np.where(hit, material * (0.3 + 0.7 * cosine), 0), hit


def _truth(things, parts, cast: Cast, hit, shape: tuple[int, int]) -> Truth:
    first_face = np.cumsum([0, *[part.shape.faces for part in parts]])
    planar = np.array([part.shape.is_planar(face) for part in parts for face in range(part.shape.faces)])
    thing_of_part = np.repeat(np.arange(len(things)), [len(thing.parts) for thing in things])
    number = first_face[cast.part] + cast.face
    surface = np.where(hit, number + 1, 0).reshape(shape).astype(np.int32)
    return Truth(
        range=np.where(hit, cast.distance, 0).reshape(shape),
        normals=np.where(hit[:, None], cast.normal, 0).reshape(*shape, 3),
        surface=surface,
        thing=np.where(hit, thing_of_part[cast.part], -1).reshape(shape).astype(np.int32),
        planar=(hit & planar[np.minimum(number, len(planar) - 1)]).reshape(shape),
        edge=edges(surface),
        things=tuple(things),
    )


def edges(surface: NDArray[np.int32]) -> NDArray[np.bool_]:
    """Return the pixels within 2 pixels of a change of surface, columns closing a turn."""
    size = 2 * EDGE_PIXELS + 1
    mode = ["nearest", "wrap"]
    return maximum_filter(surface, size, mode=mode) != minimum_filter(surface, size, mode=mode)


def _free_places(rng, count: int, floor: tuple[float, float], keep_off: tuple[float, float]):
    """Places on the floor apart from each other and from the scanner."""
    places: list[NDArray] = [np.array(keep_off)]
    for apart in np.repeat([1.5, 1.2, 1.0, 0.8, 0.6, 0.4, 0.2], 2000):
        if len(places) > count:
            break
        place = rng.uniform(-0.5, 0.5, 2) * floor
        gaps = np.linalg.norm(np.array(places) - place, axis=1)
        if gaps[0] > 1.5 and (gaps[1:] > apart).all():
            places.append(place)
    return places[1:]


def _on_floor(rng, thing: Thing, place) -> Thing:
    return thing.at(*place, yaw=rng.uniform(0, 360))
