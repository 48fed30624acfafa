"""The truth of a simulated scan as boxes: what can be seen of every labelled thing, and its size."""

import cv2
import numpy as np
from numpy.typing import NDArray

from laserimg.formats.coco import Annotation, Size
from laserimg.formats.masks import run_lengths
from laserimg.regions import MIN_PIXELS, bounding_box
from laserimg.scan import BoolArray, Float32Array
from laserimg.simulate.cast import Caster
from laserimg.simulate.echoes import echoes_along
from laserimg.simulate.footprint import AROUND, near_edges, rays_around, within_reach
from laserimg.simulate.measure import Simulated, along_row
from laserimg.simulate.mesh import Mesh
from laserimg.simulate.scanner import Scanner
from laserimg.simulate.things import Scene
from laserimg.truth import position_of

# Rows and columns around a thing in which beams may see its rim.
MOST_RIM = 4


def truth_boxes(
    scene: Scene,
    seen: Simulated,
    scanner: Scanner,
    categories: dict[str, int],
    image_id: int,
    first_id: int,
) -> list[Annotation]:
    """Return a box around the returns of every labelled thing that more than 15 pixels show.

    Parameters
    ----------
    scene : Scene
    seen : Simulated
    scanner : Scanner
        That the scene was seen by.
    categories : dict of str to int
        Ids of the classes to label; things of other classes get no box.
    image_id, first_id : int
        Of the scan, and of the first box.

    Returns
    -------
    list of Annotation
        `area` is the number of pixels, `segmentation` those pixels; `size` that of the whole thing,
        also of its hidden parts; `position` that of its returns; `visibility` as `pixels_alone` has it.
    """
    (height, width), found = seen.scan.shape, []
    owner, pose = np.where(seen.scan.range > 0, seen.thing, -1).ravel(), seen.scan.world_from_scan
    shown = np.bincount(owner[owner >= 0], minlength=len(scene.things))
    for number, thing in enumerate(scene.things):
        if thing.label not in categories or shown[number] < MIN_PIXELS:
            continue
        pixels = np.flatnonzero(owner == number)
        found.append(
            Annotation(
                first_id + len(found),
                image_id,
                categories[thing.label],
                bounding_box(pixels, width, seen.scan.wraps),
                area=float(len(pixels)),
                size=thing_size(thing.mesh.vertices, seen.scan.world_from_scan[:2, 3]),
                position=position_of(seen.scan, pixels),
                visibility=min(1.0, len(pixels) / max(pixels_alone(thing.mesh, scanner, pose), 1)),
                segmentation=run_lengths((owner == number).reshape(height, width)),
            )
        )
    return found


def pixels_alone(mesh: Mesh, scanner: Scanner, world_from_scan: NDArray[np.float64]) -> int:
    """Return how many pixels would show a thing that stood alone, without noise.

    Parameters
    ----------
    mesh : Mesh
        In the world.
    scanner : Scanner
    world_from_scan : (4, 4) array
    """
    own = mesh.moved(np.linalg.inv(world_from_scan))
    caster, (height, width) = Caster(own), scanner.directions.shape[:2]
    along = scanner.directions.reshape(-1, 3)
    towards = _towards(along, own.vertices)
    echoes = echoes_along(caster, np.zeros(3), along[towards])
    seen = (echoes.distance >= scanner.min_range_m) & (echoes.distance <= scanner.max_range_m)
    seen &= echoes.power >= scanner.receiver.weakest
    nearest = np.full(height * width, np.inf, np.float32)
    nearest[towards[echoes.ray[seen]]] = echoes.distance[seen]
    return int(np.isfinite(nearest).sum()) + _rim(caster, nearest.reshape(height, width), scanner)


def _rim(caster: Caster, nearest: Float32Array, scanner: Scanner) -> int:
    """How many beams see a thing with their rims alone."""
    part = _surroundings(np.isfinite(nearest), scanner.wraps)
    nearest, grid = nearest[part], scanner.directions[part]
    if not nearest.size:
        return 0
    wraps = scanner.wraps and grid.shape[1] == scanner.directions.shape[1]
    edges = within_reach(near_edges(nearest, 0.0, wraps), nearest, grid, scanner.beam, wraps)
    beams = np.flatnonzero(edges & ~np.isfinite(nearest))
    along, turns = grid.reshape(-1, 3), np.zeros(len(beams), np.float32)
    next_ones = along_row(along, beams, grid.shape[1])
    echoes = echoes_along(caster, *rays_around(np.zeros(3), along[beams], next_ones, scanner.beam, turns))
    power = np.bincount(echoes.ray // AROUND, echoes.power) / (AROUND + 1)
    return int((power >= scanner.receiver.weakest).sum())


def _surroundings(seen: BoolArray, wraps: bool) -> tuple[slice, slice]:
    """Rows and columns around what is seen; all columns if it is near the seam of a full turn."""
    (rows, columns), width = (np.flatnonzero(seen.any(axis=axis)) for axis in (1, 0)), seen.shape[1]
    if not len(rows):
        return slice(0), slice(0)
    low, high = columns[0] - MOST_RIM, columns[-1] + 1 + MOST_RIM
    across = slice(None) if wraps and (low < 0 or high > width) else slice(max(low, 0), high)
    return slice(max(rows[0] - MOST_RIM, 0), rows[-1] + 1 + MOST_RIM), across


def _towards(rays: Float32Array, corners: NDArray[np.float64]) -> NDArray[np.intp]:
    """Indices of the rays from the origin within the cone around the corners of something."""
    towards = corners / np.maximum(np.linalg.norm(corners, axis=1, keepdims=True), 1e-9)
    axis = towards.mean(axis=0)
    axis /= max(float(np.linalg.norm(axis)), 1e-9)
    narrowest = float((towards @ axis).min())
    # A cone wider than 90 degrees is not convex: faces between its corners may bulge out of it.
    if narrowest <= 0:
        return np.arange(len(rays))
    return np.flatnonzero(rays @ axis.astype(np.float32) >= narrowest - 1e-4)


def thing_size(vertices: NDArray[np.float64], scanner_xy: NDArray[np.float64]) -> Size:
    """Return the size of a whole thing in metres, as the conventions define the five lengths.

    Parameters
    ----------
    vertices : (n, 3) array of float64
        In the world, z up.
    scanner_xy : (2,) array of float64
    """
    flat = vertices[:, :2]
    sight = np.median(flat, axis=0) - scanner_xy
    sight = sight / max(float(np.linalg.norm(sight)), 1e-9)
    across, along = np.ptp(flat @ np.array([-sight[1], sight[0]])), np.ptp(flat @ sight)
    sides = cv2.minAreaRect(flat.astype(np.float32))[1]
    height = np.ptp(vertices[:, 2])
    return Size(float(across), float(along), float(height), float(max(sides)), float(min(sides)))
