"""PTX, one or several scans in a file."""

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from laserimg.files import atomic_write
from laserimg.scan import Scan

# What the format writes where a scanner gives no intensity, or where nothing returned.
NO_INTENSITY = 0.5


def write_ptx(scans: Iterable[Scan], path: Path) -> None:
    """Write scans column by column from bottom to top, rays without return as ``0 0 0 0.5``.

    Coordinates have six digits after the point: micrometres. The directions of rays without return
    and the limits of the range are lost.
    """
    with atomic_write(path) as temporary, temporary.open("w", encoding="ascii") as file:
        for scan in scans:
            rows, columns = scan.shape
            pose = scan.world_from_scan
            axes = [pose[:3, 3], pose[:3, 0], pose[:3, 1], pose[:3, 2]]
            file.write(f"{columns}\n{rows}\n")
            np.savetxt(file, axes, fmt="%.9g")
            np.savetxt(file, pose.T, fmt="%.9g")
            np.savetxt(file, _table(scan), fmt="%.6f")


def _table(scan: Scan) -> np.ndarray:
    intensity = np.full(scan.shape, NO_INTENSITY, np.float32)
    if scan.reflectance is not None:
        intensity = np.where(scan.range > 0, scan.reflectance, intensity)
    grid = np.concatenate([scan.points(), intensity[..., None]], axis=-1)
    return grid[::-1].transpose(1, 0, 2).reshape(-1, 4)
