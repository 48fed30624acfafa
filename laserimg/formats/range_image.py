"""16-bit PNG range images with their side file."""

import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from laserimg.errors import ScanError
from laserimg.files import atomic_write, write_text
from laserimg.projection import directions_from_angles
from laserimg.scan import Scan

_LARGEST = 65535
_FINEST_M = 0.001
# Rays further from a regular grid than this part of its pitch would move to other pixels.
_MAX_OFF = 0.5
# Angles that differ less from even ones are written as [first, last].
_EVEN_DEG = 1e-4


def write_range_image(scan: Scan, path: Path) -> None:
    """Write the range as a 16-bit PNG in steps of 1 mm (more, if the range needs it) and ``NAME.json``.

    The reflectance is lost, and the rays come back as those of a regular grid.

    Raises
    ------
    ScanError
        If the rays lie on no grid of azimuth by column and elevation by row.
    """
    import cv2

    azimuth, elevation = _axes(scan)
    scale = max(_FINEST_M, float(np.ceil(scan.range.max() / _LARGEST * 1e6)) / 1e6)
    about: dict[str, Any] = {
        "kind": "range",
        "scale_m": scale,
        "offset_m": 0.0,
        "azimuth_deg": _shortened(azimuth),
        "elevation_deg": _shortened(elevation),
        "wraps": scan.wraps,
        "world_from_scan": scan.world_from_scan.tolist(),
    }
    if scan.min_range > 0:
        about["min_range"] = scan.min_range
    if np.isfinite(scan.max_range):
        about["max_range"] = scan.max_range
    # A return nearer than half a step must not become "no return".
    values = np.where(scan.range > 0, np.maximum(np.round(scan.range / scale), 1), 0).astype(np.uint16)
    with atomic_write(path) as temporary:
        if not cv2.imwrite(str(temporary), values):
            raise ScanError("cannot be written")
    write_text(path.with_suffix(".json"), json.dumps(about, indent=1) + "\n")


def _axes(scan: Scan) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Degrees of every column and row, if the rays are a grid of them."""
    x, y, z = scan.directions.astype(np.float64).transpose(2, 0, 1)
    azimuth = np.unwrap(np.arctan2(y.sum(axis=0), x.sum(axis=0)))
    elevation = np.arcsin(np.clip(z.mean(axis=1), -1, 1))
    off = np.linalg.norm(scan.directions - directions_from_angles(azimuth, elevation), axis=-1)
    pitch = min(float(np.abs(np.median(np.diff(axis)))) for axis in (azimuth, elevation))
    if float(off.max()) > _MAX_OFF * pitch:
        raise ScanError(
            f"rays lie up to {np.degrees(off.max()):.2f} degrees beside a grid of azimuth and elevation; "
            "write .npz, which keeps them"
        )
    return np.degrees(azimuth), np.degrees(elevation)


def _shortened(degrees: NDArray[np.float64]) -> list[float]:
    even = np.linspace(degrees[0], degrees[-1], len(degrees))
    kept = degrees[[0, -1]] if np.abs(even - degrees).max() < _EVEN_DEG else degrees
    return [round(float(value), 6) for value in kept]
