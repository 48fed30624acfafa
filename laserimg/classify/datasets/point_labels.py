"""Objects of scans whose every point has a label: SemanticKITTI and RELLIS-3D."""

from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from laserimg.classify.datasets.boxes import MIN_POINTS
from laserimg.classify.source import Source, source_of_pixels
from laserimg.files import without_compression
from laserimg.rbnn import rbnn_of_scan
from laserimg.readers.point_labels import read_labelled
from laserimg.scan import BoolArray, Scan

# Numbers of the classes that are objects, from the data sets' own tables (semantic-kitti.yaml, rellis.yaml):
# ground and what is not told apart are left out; moving objects are of the class of standing ones.
SEMANTIC_KITTI: Mapping[int, str] = {
    10: "car", 11: "bicycle", 13: "bus", 15: "motorcycle", 16: "on-rails", 18: "truck", 20: "other-vehicle",
    30: "person", 31: "bicyclist", 32: "motorcyclist", 50: "building", 51: "fence", 70: "vegetation",
    71: "trunk", 80: "pole", 81: "traffic-sign", 252: "car", 253: "bicyclist", 254: "person",
    255: "motorcyclist", 256: "on-rails", 257: "bus", 258: "truck", 259: "other-vehicle",
}  # fmt: skip
RELLIS: Mapping[int, str] = {
    4: "tree", 5: "pole", 8: "vehicle", 12: "building", 15: "log", 17: "person", 18: "fence", 19: "bush",
    27: "barrier",
}  # fmt: skip


def labelled_objects(file: Path) -> list[Source]:
    """Return the objects of a scan whose points are labelled, with at least 50 returns.

    An object is an instance where the labels count instances, else what holds together of a class: its
    clusters by `laserimg.rbnn`, with a gap of one row and column closed.

    Raises
    ------
    LaserImgError
        If the scan or its labels cannot be read.
    """
    scan, kinds, instances = read_labelled(file)
    names = RELLIS if without_compression(file).suffix.lower() == ".ply" else SEMANTIC_KITTI
    found = []
    for label in dict.fromkeys(names.values()):
        own = np.isin(kinds, [number for number, name in names.items() if name == label]) & scan.valid
        for number, mask in enumerate(_objects(scan, own, instances), 1):
            found.append(source_of_pixels(f"{file} {label} {number}", label, scan, mask))
    return found


def _objects(scan: Scan, own: BoolArray, instances: NDArray[np.int64]) -> Iterator[BoolArray]:
    counted = own & (instances > 0)
    for number in np.unique(instances[counted]).tolist():
        mask = counted & (instances == number)
        if mask.sum() >= MIN_POINTS:
            yield mask
    rest = own & ~counted
    if rest.sum() < MIN_POINTS:
        return
    clusters = rbnn_of_scan(scan, rest, min_points=MIN_POINTS, reach=(2, 2))
    for number in range(1, int(clusters.max()) + 1):
        yield clusters == number
