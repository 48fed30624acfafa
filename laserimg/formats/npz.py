"""The project's own NPZ, which keeps all that a scan holds."""

from pathlib import Path
from typing import Any

import numpy as np

from laserimg.files import atomic_write
from laserimg.scan import Scan


def write_npz(scan: Scan, path: Path) -> None:
    """Write a scan with its directions as they are; `laserimg.open_scans` reads the same scan again.

    Keys: ``range``, ``directions``, ``world_from_scan``, ``wraps``, ``min_range``, ``max_range``, and
    where the scan has them ``reflectance`` and ``filled``.
    """
    arrays: dict[str, Any] = {
        "range": scan.range,
        "directions": scan.directions,
        "world_from_scan": scan.world_from_scan,
        "wraps": np.array(scan.wraps),
        "min_range": np.array(scan.min_range),
        "max_range": np.array(scan.max_range),
        "reflectance": scan.reflectance,
        "filled": scan.filled,
    }
    with atomic_write(path) as temporary:
        np.savez_compressed(temporary, **{key: value for key, value in arrays.items() if value is not None})
