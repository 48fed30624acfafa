"""Labels of points beside their scan: ``.label`` files of SemanticKITTI and RELLIS-3D.

Behley et al. 2019, doi:10.1109/ICCV.2019.00939; Jiang et al. 2021, doi:10.1109/ICRA48506.2021.9561251.
A label is a little-endian uint32 for each point of the scan's file, in its order: class in the lower 16 bits,
number of the instance in the upper.
"""

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from laserimg.errors import LabelError, LaserImgError, ScanError
from laserimg.files import read_bytes, stem, without_compression
from laserimg.readers.kitti import read_table
from laserimg.readers.ply import points_of, read_vertices
from laserimg.readers.points import scan_from_points
from laserimg.scan import Scan

IntArray = NDArray[np.int64]

_SUFFIX = ".label"
# RELLIS names its scans frame000104-1581624663_170 and their labels 000104.
_FRAME = re.compile(r"frame(\d+)-")


def label_file(scan: Path) -> Path | None:
    """Return the file with the labels of a scan's points; None without one."""
    name = stem(scan)
    frame = _FRAME.match(name)
    names = [f"{one}{_SUFFIX}" for one in (name, frame.group(1) if frame else "") if one]
    folders = [scan.parent, scan.parent.parent / "labels"]
    return next((path for folder in folders for one in names if (path := folder / one).is_file()), None)


def read_labelled(path: Path) -> tuple[Scan, IntArray, IntArray]:
    """Return the scan of a ``.bin`` or ``.ply`` file, and class and instance of every pixel, 0 without.

    Raises
    ------
    ScanError, LabelError
        If the scan cannot be read, it has no labels, or not one for each of its points.
    """
    labels = label_file(path)
    if labels is None:
        raise LabelError(f"{path}: no {_SUFFIX} file beside it")
    try:
        points, values, ring = _points(path)
        # The reader that puts the points on the grid takes their numbers along.
        numbers = scan_from_points(points, np.arange(1.0, len(points) + 1), ring)
        data = read_bytes(labels)
    except LaserImgError as error:
        raise ScanError(f"{path}: {error}") from error
    if len(data) != 4 * len(points):
        raise LabelError(f"{labels}: holds {len(data)} bytes, not 4 for each of {len(points)} points")
    assert numbers.reflectance is not None
    place = np.where(numbers.range > 0, numbers.reflectance, 0).astype(np.intp)
    raw = np.r_[0, np.frombuffer(data, "<u4").astype(np.int64)][place]
    reflectance = None if values is None else np.r_[0.0, values][place]
    scan = Scan(
        numbers.range,
        numbers.directions,
        None if reflectance is None else np.nan_to_num(reflectance, posinf=0, neginf=0),
        numbers.world_from_scan,
        numbers.wraps,
        source=str(path),
    )
    return scan, raw & 0xFFFF, raw >> 16


def _points(path: Path) -> tuple[NDArray[np.float64], NDArray[np.float64] | None, NDArray[np.intp] | None]:
    data = read_bytes(path)
    if without_compression(path).suffix.lower() == ".ply":
        return points_of(read_vertices(data))
    table = read_table(data)
    return table[:, :3], table[:, 3], None
