"""PCD: organised grids, and points in scan order whose grid is recovered."""

import io
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from laserimg.files import read_bytes
from laserimg.readers.points import scan_from_points
from laserimg.scan import Scan


def read_pcd(path: Path) -> Iterator[Scan]:
    """Yield the one scan of a PCD file."""
    from pypcd4.pypcd4 import PointCloud

    cloud = PointCloud.from_fileobj(io.BytesIO(read_bytes(path)))  # type: ignore[arg-type]
    points = np.stack([cloud.pc_data[name].astype(np.float64) for name in "xyz"], axis=1)
    yield scan_from_points(points)
