"""PCD, binary and organised: the grid stays a grid."""

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from laserimg.files import atomic_write
from laserimg.scan import Scan


def write_pcd(scan: Scan, path: Path) -> None:
    """Write a scan as float32 points in its world frame, with its pose as VIEWPOINT.

    Rays without return are NaN; their directions and the limits of the range are lost.
    """
    pose = scan.world_from_scan
    names = ["x", "y", "z"] if scan.reflectance is None else ["x", "y", "z", "intensity"]
    records = np.empty((*scan.shape, len(names)), "<f4")
    world = scan.points().astype(np.float64) @ pose[:3, :3].T + pose[:3, 3]
    records[..., :3] = np.where(scan.range[..., None] > 0, world, np.nan)
    if scan.reflectance is not None:
        records[..., 3] = scan.reflectance
    with atomic_write(path) as temporary:
        temporary.write_bytes(_header(scan, names) + records.tobytes())


def _header(scan: Scan, names: list[str]) -> bytes:
    x, y, z, w = Rotation.from_matrix(scan.world_from_scan[:3, :3]).as_quat()
    viewpoint = [*scan.world_from_scan[:3, 3], w, x, y, z]
    rows, columns = scan.shape
    lines = [
        "# .PCD v0.7 - Point Cloud Data file format",
        "VERSION 0.7",
        f"FIELDS {' '.join(names)}",
        f"SIZE {' '.join('4' for _ in names)}",
        f"TYPE {' '.join('F' for _ in names)}",
        f"COUNT {' '.join('1' for _ in names)}",
        f"WIDTH {columns}",
        f"HEIGHT {rows}",
        # Plain decimals: not every reader takes exponents.
        f"VIEWPOINT {' '.join(np.format_float_positional(value, trim='-') for value in viewpoint)}",
        f"POINTS {rows * columns}",
        "DATA binary",
    ]
    return ("\n".join(lines) + "\n").encode("ascii")
