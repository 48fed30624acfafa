"""The project's own NPZ: ``range`` with ``directions``, or with ``azimuth_deg`` and ``elevation_deg``; and
Ouster frames, which their keys tell apart."""

import io
import math
import zipfile
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from laserimg.errors import LaserImgError, ScanError
from laserimg.files import MAX_UNPACKED_BYTES, read_bytes
from laserimg.projection import directions_from_angles, measured
from laserimg.readers.ouster import is_ouster, scan_of_ouster
from laserimg.scan import Scan

_OPTIONAL = ("reflectance", "filled", "world_from_scan")
_SINGLE = ("wraps", "min_range", "max_range")
_BROKEN = (zipfile.BadZipFile, zlib.error, EOFError, OSError, ValueError, NotImplementedError, RuntimeError)


def read_npz(path: Path) -> Iterator[Scan]:
    """Yield the one scan of an NPZ file.

    Raises
    ------
    ScanError
        If it is no NPZ file, holds objects, or lacks a key.
    """
    arrays = load_arrays(read_bytes(path))
    if is_ouster(arrays):
        yield scan_of_ouster(arrays)
        return
    if "range" not in arrays:
        raise ScanError(f"has no key 'range', only {' '.join(sorted(arrays)) or 'nothing'}")
    optional: dict[str, Any] = {key: arrays[key] for key in _OPTIONAL if key in arrays}
    optional |= {key: arrays[key].item() for key in _SINGLE if key in arrays and arrays[key].size == 1}
    yield Scan(measured(arrays["range"]), _directions(arrays), **optional).right_way_round()


def holds_range(path: Path) -> bool:
    """Tell whether an NPZ file is a scan or broken, for folders that hold other arrays too."""
    try:
        arrays = load_arrays(read_bytes(path))
    except LaserImgError:
        return True
    return is_ouster(arrays) or ("range" in arrays and bool(set(arrays) & {"directions", "azimuth_deg"}))


def load_arrays(data: bytes, limit: int = MAX_UNPACKED_BYTES) -> dict[str, NDArray]:
    """Return the arrays of an NPZ file; nothing is allocated that the file does not hold.

    `numpy.load` makes room for the shape a header claims before it reads; this compares first.

    Raises
    ------
    ScanError
        If the file is broken, an array holds objects, or all take more than `limit` bytes.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            members = [info for info in archive.infolist() if info.filename.endswith(".npy")]
            if sum(info.file_size for info in members) > limit:
                raise ScanError(f"unpacks to more than {limit >> 20} MB")
            return {info.filename[:-4]: _array(archive.read(info)) for info in members}
    except _BROKEN as error:
        raise ScanError(f"not an NPZ file: {error}") from error


def _array(data: bytes) -> NDArray:
    stream = io.BytesIO(data)
    version = np.lib.format.read_magic(stream)
    read_header = {
        (1, 0): np.lib.format.read_array_header_1_0,
        (2, 0): np.lib.format.read_array_header_2_0,
    }.get(version)
    if read_header is None:
        raise ValueError(f"array format {version} is not known")
    try:
        shape, fortran, dtype = read_header(stream)
    except Exception as error:  # numpy reads the header as Python and raises whatever that raises
        raise ValueError("the header of an array is malformed") from error
    if dtype.kind not in "fiub":
        raise ValueError(f"an array holds {dtype}, not numbers")
    if min(shape, default=0) < 0 or math.prod(shape) * dtype.itemsize != len(data) - stream.tell():
        raise ValueError(f"an array of {shape} does not fit its {len(data)} bytes")
    array = np.frombuffer(data, dtype, offset=stream.tell())
    return array.reshape(shape, order="F" if fortran else "C")


def _directions(arrays: dict[str, NDArray]) -> NDArray[np.float32]:
    if "directions" in arrays:
        return np.asarray(arrays["directions"], np.float32)
    if "azimuth_deg" in arrays and "elevation_deg" in arrays:
        return directions_from_angles(np.radians(arrays["azimuth_deg"]), np.radians(arrays["elevation_deg"]))
    raise ScanError("needs 'directions', or 'azimuth_deg' and 'elevation_deg'")
