"""Labels of SUSTech POINTS: ``label/NAME.json``, a list of boxes in the scanner's frame.

Li et al. 2020, doi:10.1109/IV47402.2020.9304562. ``psr`` holds position (centre), scale (length, width,
height) and rotation (radians about x, then the new y, then the new z).
"""

import json
from pathlib import Path
from typing import Any

import numpy as np

from laserimg.errors import LabelError
from laserimg.formats.boxes3d.model import Box3D, Labels3D


def read_sustech_labels(path: Path) -> Labels3D:
    """Read the labels of one scan.

    Raises
    ------
    LabelError
        Naming the file and the box that is wrong.
    """
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise LabelError(f"{path}: cannot be read: {getattr(error, 'strerror', None) or error}") from None
    if not isinstance(content, list):
        raise LabelError(f"{path}: not a list of boxes")
    return Labels3D(tuple(_box(entry, f"{path}: box {number}") for number, entry in enumerate(content, 1)))


def _box(entry: Any, place: str) -> Box3D:
    from scipy.spatial.transform import Rotation

    try:
        centre, size, turn = (
            np.array([float(entry["psr"][key][axis]) for axis in "xyz"])
            for key in ("position", "scale", "rotation")
        )
        kind = str(entry["obj_type"]).lower()
    except (KeyError, TypeError, ValueError):
        raise LabelError(f"{place}: needs obj_type and psr with position, scale and rotation") from None
    if not np.isfinite([centre, size, turn]).all():
        raise LabelError(f"{place}: holds numbers that are not finite")
    return Box3D(kind, centre, Rotation.from_euler("XYZ", turn).as_matrix(), size)
