"""Boxes of metres become boxes of pixels: the truth that detections are compared with."""

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from laserimg.formats.boxes3d import Labels3D
from laserimg.formats.coco import Annotation, Box, Category, CocoImage, Position
from laserimg.regions import bounding_box
from laserimg.scan import BoolArray, Scan

# Class of ours, and the data sets' names for it; a bus or a cyclist is neither a hit nor a miss.
CLASSES: Mapping[str, frozenset[str]] = {
    "car": frozenset({"car", "regular_vehicle", "policecar", "tourcar"}),
    "person": frozenset({"pedestrian", "roadworker", "child"}),
}
ALIKE: Mapping[str, frozenset[str]] = {
    "car": frozenset(
        {"van", "truck", "tram", "misc", "bus", "longvehicle", "concretetruck", "trimo", "box_truck",
         "large_vehicle", "truck_cab", "vehicular_trailer", "school_bus", "articulated_bus",
         "message_board_trailer", "railed_vehicle"}
    ),
    "person": frozenset(
        {"person_sitting", "cyclist", "rider", "scooterrider", "bicyclerider", "motorcyclerider",
         "motorcylerider", "bicyclist", "motorcyclist", "wheeled_rider", "wheelchair", "official_signaler"}
    ),
}  # fmt: skip
CATEGORIES = tuple(Category(number, label) for number, label in enumerate(CLASSES, 1))
# How far rays without return are followed to see whether the camera sees them.
_FAR_M = 50.0


def truth_of(
    scan: Scan, labels: Labels3D, image: CocoImage, first_id: int = 1, min_points: int = 1
) -> list[Annotation]:
    """Return the truth of a scan: a box around the pixels whose points lie in each labelled box.

    An object that is labelled twice counts once. `area` is the number of those pixels. ``iscrowd`` is 1
    where nothing is asked: other vehicles and riders, objects with fewer than `min_points`, parts without
    labels and what lies outside the labelled view.

    Parameters
    ----------
    scan : Scan
    labels : Labels3D
    image : CocoImage
    first_id : int
        Of the first annotation.
    min_points : int
        Objects with fewer returns are to be ignored.
    """
    boxes = [*_objects(scan, labels, min_points), *_ignored(scan, labels)]
    return [replace(box, id=first_id + number, image_id=image.id) for number, box in enumerate(boxes)]


def _objects(scan: Scan, labels: Labels3D, min_points: int) -> Iterator[Annotation]:
    """Every labelled object with a return; its numbers come later."""
    returns = np.flatnonzero(scan.range > 0)
    points = in_world(scan, scan.points().reshape(-1, 3)[returns])
    known: set[tuple[str, bytes]] = set()
    for box in labels.boxes:
        for category in CATEGORIES:
            counted = box.kind in CLASSES[category.name]
            if not counted and box.kind not in ALIKE[category.name]:
                continue
            pixels = returns[box.holds(points)]
            # Argoverse has objects that two tracks label.
            if len(pixels) and (box.kind, key := pixels.tobytes()) not in known:
                known.add((box.kind, key))
                found = bounding_box(pixels, scan.shape[1], scan.wraps)
                crowd = not counted or len(pixels) < min_points
                where = position_of(scan, pixels)
                yield Annotation(
                    0, 0, category.id, found, area=float(len(pixels)), iscrowd=int(crowd), position=where
                )


def _ignored(scan: Scan, labels: Labels3D) -> Iterator[Annotation]:
    if labels.view is None:
        return
    reach = np.where(scan.range > 0, scan.range, np.float32(_FAR_M))[..., None]
    column, row, seen = labels.view.pixels(in_world(scan, reach * scan.directions))
    parts = [
        seen & (column >= left) & (column <= right) & (row >= top) & (row <= bottom)
        for left, top, right, bottom in _parts(labels)
    ]
    boxes = [bounding_box(np.flatnonzero(part), scan.shape[1], scan.wraps) for part in parts if part.any()]
    for found in [*boxes, *_unseen(seen, scan.wraps)]:
        for category in CATEGORIES:
            yield Annotation(0, 0, category.id, found, area=float(round(found[2] * found[3])), iscrowd=1)


def _parts(labels: Labels3D) -> NDArray[np.float64]:
    return np.empty((0, 4)) if labels.unlabelled is None else labels.unlabelled


def _unseen(seen: BoolArray, wraps: bool) -> list[Box]:
    """Boxes of full height beside the columns that the camera sees."""
    height, width = seen.shape
    if not seen.any():
        return [(0.0, 0.0, float(width), float(height))]
    x, _, across, _ = bounding_box(np.flatnonzero(seen), width, wraps)
    end = x + across
    runs = [(end % width, width - across)] if wraps else [(0.0, x), (end, width - end)]
    return [(first, 0.0, count, float(height)) for first, count in runs if count > 0]


def position_of(scan: Scan, pixels: NDArray[np.intp]) -> Position:
    """Return where the returns of some flattened pixels are: their median point and range."""
    range_m = scan.range.ravel()[pixels]
    x, y, z = np.median(range_m[:, None] * scan.directions.reshape(-1, 3)[pixels], axis=0).tolist()
    azimuth, elevation = np.degrees(np.arctan2([y, z], [x, np.hypot(x, y)])).tolist()
    return Position(x, y, z, float(np.median(range_m)), azimuth, elevation)


def in_world(scan: Scan, points: ArrayLike) -> NDArray[np.float64]:
    """Return points of the scanner's frame in the frame of the file."""
    pose = scan.world_from_scan
    return np.asarray(points, np.float64) @ pose[:3, :3].T + pose[:3, 3]
