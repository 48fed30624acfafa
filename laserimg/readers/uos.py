"""uos ``.3d``: text, x right, y up, z forward in centimetres, left-handed; the pose in ``.pose``.

An LMS 200 writes codes from 32759 to 32767 mm where nothing returned; these points tell the
directions of their rays. A header line ``rows x columns`` may come first.
"""

import io
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from laserimg.errors import LaserImgError, ScanError
from laserimg.files import read_bytes, stem
from laserimg.readers.points import scan_from_points
from laserimg.readers.pose import pose_from_euler
from laserimg.readers.table import read_table
from laserimg.scan import Scan

_HEADER = re.compile(rb"\s*#?\s*\d+\s+x\s+\d+\s*\n")
_COLUMNS = (3, 4, 6)
_NO_RETURN_CM = (3275.85, 3276.75)
_METRES_FROM_CM = 0.01
# x forward, y left, z up from x right, y up, z forward.
_OURS_FROM_UOS = np.array([[0.0, 0, 1], [-1, 0, 0], [0, 1, 0]])


def read_uos(path: Path) -> Iterator[Scan]:
    """Yield the one scan of a uos file.

    Raises
    ------
    ScanError
        If a line is not ``x y z``, with reflectance or colour, or the pose is malformed.
    """
    lines = io.BytesIO(read_bytes(path))
    first = _HEADER.match(lines.getbuffer()[:200].tobytes())
    lines.seek(first.end() if first else 0)
    table = read_table(lines)
    if table.shape[1] not in _COLUMNS:
        raise ScanError(
            f"a uos point has 3 numbers, 4 with reflectance or 6 with colour, got {table.shape[1]}"
        )
    length_cm = np.linalg.norm(table[:, :3], axis=1)
    returned = (length_cm < _NO_RETURN_CM[0]) | (length_cm > _NO_RETURN_CM[1])
    yield scan_from_points(
        table[:, :3] @ _OURS_FROM_UOS.T * _METRES_FROM_CM,
        table[:, 3] if table.shape[1] == 4 else None,
        returned=returned,
        world_from_scan=_pose_beside(path),
    )


def _pose_beside(path: Path) -> NDArray[np.float64]:
    """Position in cm and angles in degrees about x, y, z in the uos frame; identity without a file."""
    beside = path.with_name(f"{stem(path)}.pose")
    if not beside.is_file():
        return np.eye(4)
    try:
        values = np.array(read_bytes(beside, limit=1 << 16).split(), np.float64)
        if len(values) != 6:
            raise ScanError(f"a pose has 6 numbers, got {len(values)}")
        pose = pose_from_euler(np.radians(values[3:]), values[:3] * _METRES_FROM_CM)
    except (ValueError, LaserImgError) as error:
        raise ScanError(f"{beside.name}: {error}") from error
    ours = np.eye(4)
    ours[:3, :3] = _OURS_FROM_UOS
    return ours @ pose @ ours.T
