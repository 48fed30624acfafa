"""Objects of public data sets, read from the folders as they are downloaded; none of them ships."""

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import NamedTuple

from laserimg.classify.datasets.boxes import has_boxes, objects_in_boxes
from laserimg.classify.datasets.point_labels import labelled_objects
from laserimg.classify.datasets.sydney import sydney_files, sydney_objects
from laserimg.classify.source import Source
from laserimg.files import without_compression
from laserimg.readers.point_labels import label_file

Watch = Callable[[list[Path]], Iterable[Path]]

_SCANS = (".bin", ".feather", ".pcd", ".ply")


class DataSet(NamedTuple):
    """Where a data set comes from, under which licence, and by which files it is known."""

    name: str
    page: str
    licence: str
    files: str


DATA_SETS = (
    DataSet(
        "Sydney Urban Objects",
        "https://www.acfr.usyd.edu.au/papers/SydneyUrbanObjectsDataset.shtml",
        "see its page",
        "objects/CLASS.*.csv, folds/fold*.txt",
    ),
    DataSet(
        "KITTI 3D objects",
        "https://www.cvlibs.net/datasets/kitti/eval_object.php?obj_benchmark=3d",
        "CC BY-NC-SA 3.0",
        "velodyne/N.bin, label_2/N.txt, calib/N.txt",
    ),
    DataSet(
        "SemanticKITTI",
        "http://www.semantic-kitti.org",
        "CC BY-NC-SA",
        "velodyne/N.bin, labels/N.label (or N.label beside it)",
    ),
    DataSet(
        "Argoverse 2",
        "https://www.argoverse.org/av2.html",
        "CC BY-NC-SA 4.0",
        "LOG/sensors/lidar/T.feather, LOG/annotations.feather, LOG/calibration",
    ),
    DataSet(
        "SUSTech POINTS",
        "https://github.com/naurril/SUSTechPOINTS",
        "GPL-3.0 (repository)",
        "lidar/NAME.pcd, label/NAME.json",
    ),
    DataSet(
        "RELLIS-3D",
        "https://github.com/unmannedlab/RELLIS-3D",
        "CC BY-NC-SA 3.0",
        "frameN-*.ply, N.label beside it",
    ),
)


def dataset_objects(folder: Path, watch: Watch = iter) -> list[Source]:
    """Return the objects of a public data set; none if the folder is none that is known.

    Parameters
    ----------
    folder : Path
    watch : function
        Iterates over the files, showing progress if it likes.

    Raises
    ------
    LaserImgError
        If a scan or its labels cannot be read.
    """
    objects = sydney_files(folder)
    if objects:
        return sydney_objects(folder, objects)
    found: list[Source] = []
    for file in watch(_labelled_scans(folder)):
        found += objects_in_boxes(file) if has_boxes(file) else labelled_objects(file)
    return found


def _labelled_scans(folder: Path) -> list[Path]:
    files = (path for path in sorted(folder.rglob("*")) if without_compression(path).suffix.lower() in _SCANS)
    return [path for path in files if path.is_file() and (has_boxes(path) or label_file(path) is not None)]
