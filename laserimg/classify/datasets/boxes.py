"""Objects in labelled 3D boxes: KITTI, SUSTech POINTS, Argoverse 2."""

from pathlib import Path

import numpy as np

from laserimg.classify.source import Source, source_of_pixels
from laserimg.formats.boxes3d import Box3D, labels_beside
from laserimg.formats.boxes3d.beside import labels_file
from laserimg.ground import ground_of_scan
from laserimg.readers import read_file
from laserimg.scan import BoolArray, Scan
from laserimg.truth import CLASSES, in_world

# Fewer returns do not show what an object is.
MIN_POINTS = 50


def has_boxes(file: Path) -> bool:
    """Tell whether a scan file has labelled boxes beside it."""
    return labels_file(file) is not None


def objects_in_boxes(file: Path) -> list[Source]:
    """Return the labelled objects of a scan file with at least 50 returns above the ground.

    An object that two scans of the file show is that of the scan which shows more of it. Cars and people
    have our names, ``car`` and ``person``; the others keep the data set's, in lower case.

    Raises
    ------
    LaserImgError
        If the scan or its labels cannot be read.
    """
    boxes = labels_beside(file).boxes
    scans = list(read_file(file))
    masks = [_masks(scan, boxes) for scan in scans]
    found, known = [], set()
    for number, box in enumerate(boxes):
        counts = [int(of_scan[number].sum()) for of_scan in masks]
        best = int(np.argmax(counts))
        mask = masks[best][number]
        # Argoverse has objects that two tracks label.
        if counts[best] < MIN_POINTS or mask.tobytes() in known:
            continue
        known.add(mask.tobytes())
        name = f"{file} [{best}] {box.kind} {number}"
        found.append(source_of_pixels(name, class_of(box.kind), scans[best], mask))
    return found


def class_of(kind: str) -> str:
    """Return our name of a data set's class, or its own.

    Examples
    --------
    >>> class_of("regular_vehicle"), class_of("cyclist")
    ('car', 'cyclist')
    """
    return next((ours for ours, kinds in CLASSES.items() if kind in kinds), kind)


def _masks(scan: Scan, boxes: tuple[Box3D, ...]) -> list[BoolArray]:
    ground = ground_of_scan(scan)
    above = scan.valid if ground is None else scan.valid & ~ground.mask
    pixels = np.flatnonzero(above)
    points = in_world(scan, scan.points().reshape(-1, 3)[pixels])
    masks = []
    for box in boxes:
        mask = np.zeros(scan.range.size, np.bool_)
        mask[pixels[box.holds(points)]] = True
        masks.append(mask.reshape(scan.shape))
    return masks
