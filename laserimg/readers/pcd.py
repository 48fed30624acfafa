"""PCD: organised grids, and points in scan order whose grid is recovered."""

import io
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from laserimg.errors import ScanError
from laserimg.files import read_bytes
from laserimg.readers.grid import scan_from_grid
from laserimg.readers.hidden_grid import recover
from laserimg.scan import Scan


def read_pcd(path: Path) -> Iterator[Scan]:
    """Yield the one scan of a PCD file."""
    from pypcd4.pypcd4 import PointCloud

    cloud = PointCloud.from_fileobj(io.BytesIO(read_bytes(path)))  # type: ignore[arg-type]
    points = np.stack([cloud.pc_data[name].astype(np.float64) for name in "xyz"], axis=1)
    grid = recover(points)
    if grid is None:
        raise ScanError("points stand in no scan order")
    yield scan_from_grid(grid.place(points))
