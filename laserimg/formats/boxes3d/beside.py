"""Which labels belong to a scan: data sets keep them in folders beside the scans'."""

from pathlib import Path

from laserimg.errors import LabelError
from laserimg.files import stem
from laserimg.formats.boxes3d.argoverse import read_argoverse_labels
from laserimg.formats.boxes3d.kitti import read_kitti_labels
from laserimg.formats.boxes3d.model import Labels3D
from laserimg.formats.boxes3d.sustech import read_sustech_labels


def labels_beside(scan: Path) -> Labels3D:
    """Return the labels of a scan file, from where its data set keeps them.

    KITTI: ``velodyne/N.bin`` with ``label_2/N.txt`` and ``calib/N.txt``; SUSTech POINTS:
    ``lidar/NAME.pcd`` with ``label/NAME.json``; Argoverse 2: ``sensors/lidar/TIMESTAMP.feather`` with
    ``annotations.feather`` in the folder of the log.

    Raises
    ------
    LabelError
        If there are none, or they are wrong.
    MissingExtraError
        For Argoverse without pyarrow.
    """
    folder, name = scan.absolute().parent.parent, stem(scan)
    kitti, sustech = folder / "label_2" / f"{name}.txt", folder / "label" / f"{name}.json"
    argoverse = folder.parent / "annotations.feather"
    if kitti.is_file():
        return read_kitti_labels(kitti, folder / "calib" / f"{name}.txt")
    if sustech.is_file():
        return read_sustech_labels(sustech)
    if argoverse.is_file() and name.isdecimal():
        return read_argoverse_labels(argoverse, int(name))
    raise LabelError(
        f"{scan}: no labels beside it: needs {kitti} (KITTI), {sustech} (SUSTech POINTS) "
        f"or {argoverse} (Argoverse 2)"
    )
