"""KITTI ``.bin``: float32 x, y, z, reflectance, ring after ring; the rings are recovered."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from laserimg.errors import ScanError
from laserimg.files import read_bytes
from laserimg.projection import ranges_of
from laserimg.readers.points import scan_from_points
from laserimg.scan import Scan

_BYTES_PER_POINT = 16
# In other binary data floats hardly ever come near the range of a spinning scanner.
_MAX_M = 500.0
_PLAUSIBLE_SHARE = 0.95


def read_kitti(path: Path) -> Iterator[Scan]:
    """Yield the one scan of a KITTI file.

    Raises
    ------
    ScanError
        If the file is cut off, or is other binary data.
    """
    table = read_table(read_bytes(path))
    yield scan_from_points(table[:, :3], table[:, 3])


def read_table(data: bytes) -> NDArray[np.float64]:
    """Return the (n, 4) points and reflectances of the bytes of a KITTI file.

    Raises
    ------
    ScanError
        If the file is cut off, or is other binary data.
    """
    if not data or len(data) % _BYTES_PER_POINT:
        raise ScanError(f"is cut off or not a KITTI file: {len(data)} bytes are no whole number of points")
    with np.errstate(invalid="ignore"):
        table = np.frombuffer(data, "<f4").reshape(-1, 4).astype(np.float64)
    length, known = ranges_of(table[:, :3])
    if not (known & (length < _MAX_M)).mean() > _PLAUSIBLE_SHARE:
        raise ScanError(f"not a KITTI file: few points within {_MAX_M:.0f} m")
    return table
