"""Labels of the KITTI object benchmark: ``label_2/N.txt`` with ``calib/N.txt``.

Geiger, Lenz, Urtasun 2012, doi:10.1109/CVPR.2012.6248074; the fields are those of the readme in its
development kit: type, truncated, occluded, alpha, 4 image box, 3 size (height, width, length), 3 place of
the box's bottom in the rectified camera (x right, y down, z forward), turn about the camera's y.
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from laserimg.errors import LabelError
from laserimg.formats.boxes3d.model import Box3D, CameraView, Labels3D

FloatArray = NDArray[np.float64]

# The rectified images have 1224 to 1242 columns and 370 to 376 rows; the files do not say which.
WIDTH, HEIGHT = 1242, 375
_FIELDS = 15
_DONT_CARE = "dontcare"


def read_kitti_labels(path: Path, calibration: Path) -> Labels3D:
    """Read the labels of one frame, in the frame of its laser scanner.

    Raises
    ------
    LabelError
        Naming the file and the line that is wrong.
    """
    projection, camera_from_laser = _calibration(calibration)
    laser_from_camera = np.asarray(np.linalg.inv(camera_from_laser), np.float64)
    boxes, unlabelled = [], []
    for number, line in enumerate(_lines(path), 1):
        kind, values = _fields(line, f"{path}:{number}")
        if kind == _DONT_CARE:
            unlabelled.append(values[3:7])
        else:
            boxes.append(_box(kind, values, laser_from_camera))
    view = CameraView(projection @ camera_from_laser, WIDTH, HEIGHT)
    return Labels3D(tuple(boxes), view, np.array(unlabelled).reshape(-1, 4))


def _box(kind: str, values: FloatArray, laser_from_camera: FloatArray) -> Box3D:
    height, width, length = values[7:10]
    foot, turn = values[10:13], values[13]
    # Length along the camera's x, turned about its y, which points down.
    along = np.array([np.cos(turn), 0, -np.sin(turn)])
    up = np.array([0.0, -1, 0])
    axes = np.stack([along, np.cross(up, along), up], axis=1)
    centre = laser_from_camera[:3, :3] @ (foot + up * height / 2) + laser_from_camera[:3, 3]
    return Box3D(kind, centre, laser_from_camera[:3, :3] @ axes, np.array([length, width, height]))


def _calibration(path: Path) -> tuple[FloatArray, FloatArray]:
    """The projection of the left colour camera, and the pose of the laser scanner in its frame."""
    found = {line[0].rstrip(":"): line[1:] for line in _lines(path) if len(line) > 1}
    try:
        projection = np.array(found["P2"], np.float64).reshape(3, 4)
        rectify, pose = np.eye(4), np.eye(4)
        rectify[:3, :3] = np.array(found["R0_rect"], np.float64).reshape(3, 3)
        pose[:3] = np.array(found["Tr_velo_to_cam"], np.float64).reshape(3, 4)
        camera_from_laser = rectify @ pose
        np.linalg.inv(camera_from_laser)
    except (KeyError, ValueError, np.linalg.LinAlgError):
        raise LabelError(f"{path}: needs P2 (12 numbers), R0_rect (9) and Tr_velo_to_cam (12)") from None
    if not (np.isfinite(projection).all() and np.isfinite(camera_from_laser).all()):
        raise LabelError(f"{path}: holds numbers that are not finite")
    return projection, camera_from_laser


def _fields(line: list[str], place: str) -> tuple[str, FloatArray]:
    try:
        values = np.array(line[1:_FIELDS], np.float64)
    except ValueError:
        values = np.empty(0)
    if len(values) != _FIELDS - 1 or not np.isfinite(values).all():
        raise LabelError(f"{place}: needs a class and {_FIELDS - 1} numbers, as in KITTI's label_2")
    return line[0].lower(), values


def _lines(path: Path) -> list[list[str]]:
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise LabelError(f"{path}: cannot be read: {getattr(error, 'strerror', None) or error}") from None
    return [line.split() for line in text.splitlines() if line.strip()]
