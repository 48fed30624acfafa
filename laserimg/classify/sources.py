"""Where objects come from: folders of object clouds or crops, one folder a class, or boxes in scans."""

from collections.abc import Iterable, Iterator
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from laserimg.classify.clouds import ObjectCloud
from laserimg.classify.datasets import Watch, dataset_objects
from laserimg.classify.datasets.sydney import is_sydney, read_sydney
from laserimg.classify.recipe import Recipe, describe_cloud
from laserimg.classify.source import Source, source_of_pixels
from laserimg.errors import LabelError, LaserImgError, ScanError
from laserimg.evidence import Window
from laserimg.files import is_hidden, read_bytes, without_compression
from laserimg.formats.coco import Annotation
from laserimg.formats.coco_file import read_coco
from laserimg.ground import ground_of_scan
from laserimg.rbnn import rbnn_of_scan
from laserimg.readers import ascii as text
from laserimg.readers import find_files, pcd, read_file, suffixes
from laserimg.readers.npz import load_arrays
from laserimg.readers.ply import points_of, read_vertices
from laserimg.readers.range_image import is_described
from laserimg.scan import BoolArray, Float32Array, Scan

_TEXT = {".xyz", ".txt", ".csv", ".asc", ".dat", ".pts"}
_IMAGES = {".png", ".tif", ".tiff"}


class Described(NamedTuple):
    """Objects as a classifier sees them, and what could not be read or described."""

    names: list[str]
    labels: NDArray[np.str_]
    folds: NDArray[np.intp]
    vectors: Float32Array
    errors: list[str]


def labelled_sources(path: Path, scale: float = 1.0, watch: Watch = iter) -> list[Source]:
    """Return the objects of a folder with one folder a class, of a data set, or of a COCO file.

    Parameters
    ----------
    path : Path
    scale : float
        Metres of a unit of the points; 0.001 for millimetres.
    watch : function
        Iterates over the scans of a data set, showing progress if it likes.

    Raises
    ------
    LabelError
        If there is no such file or folder, or it holds no objects.
    """
    if not path.exists():
        raise LabelError(f"{path}: no such file or folder")
    if path.is_file():
        found = _boxes(path)
    elif not (found := dataset_objects(path, watch)):
        folders = sorted(folder for folder in path.iterdir() if folder.is_dir())
        found = [source for folder in folders for source in _files(folder, folder.name, scale)]
    if not found:
        raise LabelError(
            f"{path}: no objects; needs one folder a class with a file an object, a COCO file, or a data set "
            "of those that laserimg classify datasets lists"
        )
    return found


def unlabelled_sources(paths: Iterable[Path], scale: float = 1.0) -> list[Source]:
    """Return the objects of files, and of the files of folders.

    Raises
    ------
    LabelError
        If a folder holds none.
    """
    found = []
    for path in paths:
        those = _files(path, "", scale) if path.is_dir() else [_file(path, "", scale)]
        if not those:
            raise LabelError(f"{path}: no objects: files of points or range images")
        found += those
    return found


def described(sources: Iterable[Source], recipe: Recipe) -> Described:
    """Describe objects; those that cannot be are named in `errors`."""
    names, labels, folds, vectors, errors = [], [], [], [], []
    for source in sources:
        try:
            vectors.append(source.describe(recipe))
        except LaserImgError as error:
            errors.append(f"{source.name}: {error}")
            continue
        names.append(source.name)
        labels.append(source.label)
        folds.append(source.fold)
    stacked = np.stack(vectors) if vectors else np.zeros((0, recipe.length), np.float32)
    return Described(names, np.array(labels, dtype=np.str_), np.array(folds, np.intp), stacked, errors)


def read_cloud(path: Path, scale: float = 1.0) -> ObjectCloud | None:
    """Return the object of a file of points; None if the file is a range image or another scan.

    Raises
    ------
    ScanError
        If the file cannot be read, or holds too few points.
    """
    suffix = without_compression(path).suffix.lower()
    if suffix == ".csv" and is_sydney(path):
        return read_sydney(path)
    if suffix in _TEXT:
        points, values = next(text.read_points(path))
    elif suffix == ".pcd":
        if (found := pcd.read_points(path)) is None:
            return None
        points, values = found
    elif suffix == ".ply":
        points, values, _ = points_of(read_vertices(read_bytes(path)))
    elif suffix == ".npz":
        arrays = load_arrays(read_bytes(path))
        if "points" not in arrays:
            return None
        points, values = arrays["points"], arrays.get("reflectance", arrays.get("intensity"))
    else:
        return None
    return ObjectCloud(np.asarray(points, np.float64) * scale, values)


def object_in_box(scan: Scan, box: tuple[float, float, float, float]) -> BoolArray:
    """Return the pixels (H, W) of the object in a box: the largest cluster in it, without the ground.

    Raises
    ------
    ScanError
        If nothing in the box is an object.
    """
    window = Window.of(box, scan.shape, scan.wraps)
    inside = np.zeros(scan.shape, np.bool_)
    inside[window.rows, window.columns] = True
    ground = _ground_of(scan)
    clusters = rbnn_of_scan(scan, inside if ground is None else inside & ~ground, min_points=2, reach=(2, 2))
    sizes = np.bincount(clusters.ravel())
    if len(sizes) < 2:
        raise ScanError("no object in the box: no two returns hold together")
    return clusters == int(np.argmax(sizes[1:])) + 1


def _files(folder: Path, label: str, scale: float) -> list[Source]:
    known = set(suffixes())
    files = sorted(
        path
        for path in folder.rglob("*")
        if path.is_file()
        and not is_hidden(path)
        and without_compression(path).suffix.lower() in known
        and not _is_picture(path)
    )
    return [_file(path, label, scale) for path in files]


def _is_picture(path: Path) -> bool:
    """Tell whether an image is no scan, such as the colour image beside one."""
    return without_compression(path).suffix.lower() in _IMAGES and not is_described(path)


def _file(path: Path, label: str, scale: float) -> Source:
    def describe(recipe: Recipe) -> Float32Array:
        cloud = read_cloud(path, scale)
        if cloud is not None:
            return describe_cloud(cloud, recipe)
        scan = _ScansInOrder()(path, 0)
        return _describe_crop(scan, scan.valid, recipe)

    return Source(str(path), label, describe)


def _boxes(path: Path) -> list[Source]:
    coco = read_coco(path)
    files = {image.id: image for image in coco.images}
    scans = _ScansInOrder()
    found = []
    for entry in coco.annotations:
        if entry.accepted is False or entry.iscrowd:
            continue
        image = files[entry.image_id]
        label = coco.labels[entry.category_id]
        found.append(_box(scans, path.parent / image.file_name, image.scan, entry, label))
    return found


def _box(scans: "_ScansInOrder", file: Path, index: int, entry: Annotation, label: str) -> Source:
    def describe(recipe: Recipe) -> Float32Array:
        scan = scans(file, index)
        return _describe_crop(scan, object_in_box(scan, entry.bbox), recipe)

    return Source(f"{file} [{index}] box {entry.id}", label, describe)


def _describe_crop(scan: Scan, mask: BoolArray, recipe: Recipe) -> Float32Array:
    return source_of_pixels("", "", scan, mask).describe(recipe)


class _ScansInOrder:
    """Scans of files; those that are asked for in the order of their file are read once."""

    def __init__(self) -> None:
        self._file: Path | None = None
        self._coming: Iterator[Scan] = iter(())
        self._last: Scan | None = None

    def __call__(self, path: Path, index: int) -> Scan:
        """Return a scan of a file; the error says what is wrong, the caller where."""
        if path == self._file and self._last is not None and self._last.index == index:
            return self._last
        if path != self._file or self._last is None or self._last.index > index:
            self._file, self._last = path, None
            self._coming = (scan for file in find_files([path]) for scan in read_file(file))
        try:
            for scan in self._coming:
                if scan.index == index:
                    self._last = replace(scan, source=str(path))
                    return self._last
        except ScanError as error:
            self._last = None
            raise ScanError(str(error).removeprefix(f"{path}: ")) from error
        self._last = None
        raise ScanError(f"has no scan {index}")


@lru_cache(maxsize=1)
def _ground_of(scan: Scan) -> BoolArray | None:
    ground = ground_of_scan(scan)
    return None if ground is None else ground.mask
