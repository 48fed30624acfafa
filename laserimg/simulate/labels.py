"""The truth of a simulated scan as boxes: what can be seen of every labelled thing, and its size."""

import cv2
import numpy as np
from numpy.typing import NDArray

from laserimg.formats.coco import Annotation, Size
from laserimg.regions import MIN_PIXELS, bounding_box
from laserimg.simulate.measure import Simulated
from laserimg.simulate.things import Scene


def truth_boxes(
    scene: Scene, seen: Simulated, categories: dict[str, int], image_id: int, first_id: int
) -> list[Annotation]:
    """Return a box around the returns of every labelled thing that more than 15 pixels show.

    Parameters
    ----------
    scene : Scene
    seen : Simulated
    categories : dict of str to int
        Ids of the classes to label; things of other classes get no box.
    image_id, first_id : int
        Of the scan, and of the first box.

    Returns
    -------
    list of Annotation
        `area` is the number of pixels; `size` that of the whole thing, also of its hidden parts.
    """
    width, found = seen.scan.shape[1], []
    owner = np.where(seen.scan.range > 0, seen.thing, -1).ravel()
    for number, thing in enumerate(scene.things):
        pixels = np.flatnonzero(owner == number) if thing.label in categories else np.empty(0, np.intp)
        if len(pixels) < MIN_PIXELS:
            continue
        found.append(
            Annotation(
                first_id + len(found),
                image_id,
                categories[thing.label],
                bounding_box(pixels, width, seen.scan.wraps),
                area=float(len(pixels)),
                size=thing_size(thing.mesh.vertices, seen.scan.world_from_scan[:2, 3]),
            )
        )
    return found


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
