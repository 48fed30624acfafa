"""Labels of Argoverse 2: ``annotations.feather`` of a log, in the frame of the vehicle.

Wilson et al. 2021, arXiv:2301.00493. Only objects within 5 m of the drivable area are annotated.
"""

from pathlib import Path

import numpy as np

from laserimg.errors import LabelError, ScanError
from laserimg.formats.boxes3d.model import Box3D, Labels3D
from laserimg.formats.feather import read_feather

_NUMBERS = ("length_m", "width_m", "height_m", "qx", "qy", "qz", "qw", "tx_m", "ty_m", "tz_m")


def read_argoverse_labels(path: Path, timestamp_ns: int) -> Labels3D:
    """Read the labels of the sweep with a timestamp.

    Raises
    ------
    LabelError
        If the file cannot be read, or has no annotation of this sweep.
    MissingExtraError
        Without pyarrow.
    """
    try:
        table = read_feather(path, ("timestamp_ns", "category", *_NUMBERS))
    except ScanError as error:
        raise LabelError(f"{path}: {error}") from None
    own = np.flatnonzero(table["timestamp_ns"] == timestamp_ns)
    if not len(own):
        raise LabelError(f"{path}: has no annotation at {timestamp_ns} ns")
    numbers = np.stack([table[name][own].astype(np.float64) for name in _NUMBERS], axis=1)
    turns = np.linalg.norm(numbers[:, 3:7], axis=1)
    if not np.isfinite(numbers).all() or (turns == 0).any():
        raise LabelError(f"{path}: a box at {timestamp_ns} ns has no size, place or rotation")
    kinds = (str(kind).lower() for kind in table["category"][own])
    return Labels3D(tuple(_box(*pair) for pair in zip(kinds, numbers, strict=True)))


def _box(kind: str, numbers: np.ndarray) -> Box3D:
    from scipy.spatial.transform import Rotation

    return Box3D(kind, numbers[7:], Rotation.from_quat(numbers[3:7]).as_matrix(), numbers[:3])
