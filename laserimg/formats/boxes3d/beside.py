"""Which labels belong to a scan: data sets keep them in folders beside the scans'."""

from pathlib import Path

from laserimg.errors import LabelError
from laserimg.files import stem
from laserimg.formats.boxes3d.argoverse import read_argoverse_labels
from laserimg.formats.boxes3d.kitti import read_kitti_labels
from laserimg.formats.boxes3d.model import Labels3D
from laserimg.formats.boxes3d.sustech import read_sustech_labels


def labels_file(scan: Path) -> Path | None:
    """Return the file with the labels of a scan, from where its data set keeps them; None without one."""
    return next((path for path in _places(scan).values() if path.is_file()), None)


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
    places = _places(scan)
    file = labels_file(scan)
    if not scan.is_file():
        raise LabelError(f"{scan}: no such file")
    if file is None:
        known = ", ".join(f"{place} ({name})" for name, place in places.items())
        raise LabelError(f"{scan}: no labels beside it: needs {known}")
    if file == places["KITTI"]:
        return read_kitti_labels(file, file.parent.parent / "calib" / file.name)
    if file == places["SUSTech POINTS"]:
        return read_sustech_labels(file)
    return read_argoverse_labels(file, int(stem(scan)))


def _places(scan: Path) -> dict[str, Path]:
    folder, name = scan.absolute().parent.parent, stem(scan)
    places = {
        "KITTI": folder / "label_2" / f"{name}.txt",
        "SUSTech POINTS": folder / "label" / f"{name}.json",
    }
    # The timestamp is the name.
    return places | ({"Argoverse 2": folder.parent / "annotations.feather"} if name.isdecimal() else {})
