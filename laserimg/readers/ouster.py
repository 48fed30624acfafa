"""Ouster frames in NPZ: ``range_mm`` destaggered, the angles of the beams, and optionally ``xyz_m``.

The grid is the sensor's own, as its software shows it and as boxes are drawn in it: it is not turned, so
column 0 lies up to 5 degrees off azimuth +180.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from laserimg.errors import ScanError
from laserimg.projection import directions_from_angles, ranges_of, reflectance_of
from laserimg.scan import Scan

_NEEDED = ("range_mm", "beam_altitude_deg", "beam_azimuth_deg", "pixel_shift")


def is_ouster(arrays: Mapping[str, NDArray]) -> bool:
    """Tell whether the arrays of an NPZ file are an Ouster frame."""
    return "range_mm" in arrays and "beam_altitude_deg" in arrays


def scan_of_ouster(arrays: Mapping[str, NDArray]) -> Scan:
    """Return the scan of a destaggered Ouster frame.

    Parameters
    ----------
    arrays : mapping of str to array
        ``range_mm`` (H, W), 0 = no return; ``beam_altitude_deg``, ``beam_azimuth_deg`` and ``pixel_shift``
        (H,) of the sensor's metadata; optionally ``reflectivity`` (H, W), and ``xyz_m`` (H, W, 3), which
        then gives the points: the beams do not start at the sensor's origin, but up to 16 mm beside it.

    Raises
    ------
    ScanError
        If a key is missing or a shape does not fit.
    """
    missing = [key for key in _NEEDED if key not in arrays]
    if missing:
        raise ScanError(f"an Ouster frame needs the keys {' '.join(missing)}")
    range_mm = arrays["range_mm"]
    if range_mm.ndim != 2:
        raise ScanError(f"range_mm must have two dimensions, got {range_mm.shape}")
    _check_shapes(arrays, range_mm.shape)
    aim = beam_directions(
        arrays["beam_altitude_deg"], arrays["beam_azimuth_deg"], arrays["pixel_shift"], range_mm.shape[1]
    )
    points = arrays["xyz_m"] if "xyz_m" in arrays else range_mm[..., None] / 1000 * aim
    length, known = ranges_of(np.asarray(points, np.float64))
    known &= range_mm > 0
    np.divide(points, length[..., None], out=aim, where=known[..., None], casting="unsafe")
    values = arrays.get("reflectivity")
    return Scan(
        np.where(known, length, 0).astype(np.float32),
        aim,
        None if values is None else reflectance_of(values, known),
        wraps=True,
    )


def beam_directions(
    altitude_deg: NDArray, azimuth_deg: NDArray, pixel_shift: NDArray, width: int
) -> NDArray[np.float32]:
    """Return the (H, W, 3) unit vectors of a destaggered frame.

    Measurement m of W stands at the encoder angle 2 pi (1 - m / W), the beam at minus its azimuth from
    there, and the sensor looks against its encoder's zero; destaggering moves a row by its shift (Ouster
    Software User Manual, section "Lidar Range to XYZ").

    Parameters
    ----------
    altitude_deg, azimuth_deg, pixel_shift : (H,) arrays
    width : int
    """
    measurement = np.arange(width)[None, :] - np.asarray(pixel_shift, np.float64)[:, None]
    azimuth = np.pi - 2 * np.pi * measurement / width - np.radians(azimuth_deg)[:, None]
    return directions_from_angles(azimuth, np.radians(altitude_deg))


def _check_shapes(arrays: Mapping[str, NDArray], shape: tuple[int, ...]) -> None:
    expected = dict.fromkeys(_NEEDED[1:], shape[:1]) | {"reflectivity": shape, "xyz_m": (*shape, 3)}
    for key, wanted in expected.items():
        if key in arrays and arrays[key].shape != wanted:
            raise ScanError(f"{key} must be {wanted} beside range_mm {shape}, got {arrays[key].shape}")
    for key in _NEEDED[1:]:
        if not np.isfinite(arrays[key]).all():
            raise ScanError(f"{key} holds values that are not finite")
    if arrays["beam_altitude_deg"][0] <= arrays["beam_altitude_deg"][-1]:
        raise ScanError("beam_altitude_deg must fall from row to row: row 0 is the highest beam")
