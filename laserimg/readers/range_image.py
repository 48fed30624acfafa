"""Range and depth images: 16-bit PNG or float TIFF, described by ``NAME.json`` beside them.

Keys: ``scale_m`` and ``offset_m`` (metres = value x scale + offset; value 0 is no return), ``kind``
("range" along the ray or "depth" along x), and the rays: ``azimuth_deg`` and ``elevation_deg`` as
[first, last] or as one number a column and row, or intrinsics ``fx fy cx cy`` in pixels. Optional:
``world_from_scan`` (4x4), ``wraps``, ``min_range``, ``max_range``, and ``colour``, a registered colour image
beside it whose grey becomes the reflectance.
"""

import json
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from laserimg.errors import LaserImgError, ScanError
from laserimg.files import read_bytes, stem
from laserimg.projection import directions_from_angles, measured
from laserimg.readers.colour import with_colour
from laserimg.readers.limits import side_file
from laserimg.readers.png import SIGNATURE, check_png
from laserimg.readers.pose import rigid
from laserimg.scan import MAX_PIXELS, Scan

FloatArray = NDArray[np.float64]

# Deflate packs at most 1032 bytes into one.
_MAX_PACKING = 1032
_TIFF_WIDTH, _TIFF_HEIGHT = 256, 257
# Level of OpenCV's own messages.
_SILENT = 0


def read_range_image(path: Path) -> Iterator[Scan]:
    """Yield the one scan of a range or depth image.

    Raises
    ------
    ScanError
        If the side file is missing or lacks a key, or the image is not 16 bit or float, one channel.
    """
    data = read_bytes(path)
    about = side_file(path)
    if about is None:
        beside = path.with_name(f"{stem(path)}.json")
        fault = "is not a JSON object with" if beside.exists() else "is missing: a JSON object with"
        raise ScanError(f"{beside.name} beside it {fault} kind, scale_m and the rays")
    image = _decode(data)
    try:
        scan = _scan_of(image, about)
        if "colour" in about:
            scan = with_colour(scan, path.with_name(_colour_image(about)))
    except (TypeError, ValueError, LaserImgError) as error:
        raise ScanError(f"with {stem(path)}.json: {error}") from error
    # After the colours, which are in the order of the file.
    yield scan.right_way_round()


def is_described(path: Path) -> bool:
    """Tell whether an image has a side file that makes it a scan, for folders that hold pictures too."""
    about = side_file(path)
    return about is not None and "kind" in about


def _scan_of(image: NDArray, about: dict[str, Any]) -> Scan:
    kind = about.get("kind")
    if kind not in ("range", "depth"):
        raise ScanError(f'kind must be "range" or "depth", got {json.dumps(kind)[:40]}')
    with np.errstate(over="ignore", invalid="ignore"):
        metres = image.astype(np.float64) * _number(about, "scale_m", 1.0) + _number(about, "offset_m", 0.0)
    directions = _directions(about, image.shape)
    # A depth counts along x, the axis of view; a range along the ray.
    length = metres / directions[..., 0].astype(np.float64) if kind == "depth" else metres
    if kind == "depth" and float(directions[..., 0].min()) <= 0:
        raise ScanError("depth needs every ray to point forward")
    range_m = np.where(image > 0, measured(length), np.float32(0))
    optional: dict[str, Any] = (
        {"world_from_scan": rigid(about["world_from_scan"])} if "world_from_scan" in about else {}
    )
    return Scan(range_m, directions, wraps=about.get("wraps") is True, **optional)


def _colour_image(about: dict[str, Any]) -> str:
    name = about["colour"]
    if not isinstance(name, str) or not name:
        raise ScanError(f"colour must be the name of an image beside it, got {json.dumps(name)[:40]}")
    return name


def _directions(about: dict[str, Any], shape: tuple[int, ...]) -> NDArray[np.float32]:
    height, width = shape
    if "fx" in about:
        fx, fy, cx, cy = (_number(about, key) for key in ("fx", "fy", "cx", "cy"))
        if fx <= 0 or fy <= 0:
            raise ScanError("fx and fy must be above 0")
        rays = np.ones((height, width, 3))
        rays[..., 1] = -(np.arange(width) - cx)[None, :] / fx
        rays[..., 2] = -(np.arange(height) - cy)[:, None] / fy
        return (rays / np.linalg.norm(rays, axis=-1, keepdims=True)).astype(np.float32)
    if "azimuth_deg" not in about or "elevation_deg" not in about:
        raise ScanError("needs azimuth_deg and elevation_deg, or fx fy cx cy")
    return directions_from_angles(
        _angles(about["azimuth_deg"], width), _angles(about["elevation_deg"], height)
    )


def _angles(values: Any, count: int) -> FloatArray:
    degrees = np.array(values, np.float64)
    if degrees.shape not in ((2,), (count,)) or not np.isfinite(degrees).all():
        raise ScanError(f"angles must be [first, last] or {count} numbers, got {str(values)[:40]}")
    return np.radians(degrees if len(degrees) == count else np.linspace(degrees[0], degrees[1], count))


def _number(about: dict[str, Any], key: str, default: float | None = None) -> float:
    value = about.get(key, default)
    if isinstance(value, bool) or not isinstance(value, int | float) or not np.isfinite(value):
        raise ScanError(f"{key} must be a number, got {json.dumps(value)[:40]}")
    return float(value)


def _decode(data: bytes) -> NDArray:
    import cv2

    if data.startswith(SIGNATURE):
        check_png(data)
    elif _announced_pixels(data) > min(MAX_PIXELS, len(data) * _MAX_PACKING):
        raise ScanError(f"is cut off: the header says {_announced_pixels(data)} pixels")
    # OpenCV prints what it thinks of a broken image on stderr. In 4.10 the switch is in cv2 itself.
    logging: Any = getattr(cv2.utils, "logging", cv2)
    level = logging.getLogLevel()
    try:
        logging.setLogLevel(_SILENT)
        image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    except cv2.error as error:
        raise ScanError(f"not a readable image: {error.err}") from error
    finally:
        logging.setLogLevel(level)
    if image is None:
        raise ScanError("not a readable image")
    if image.ndim != 2 or image.dtype not in (np.uint16, np.float32, np.float64):
        raise ScanError(f"must be 16 bit or float with one channel, got {image.dtype} {image.shape}")
    return image


def _announced_pixels(data: bytes) -> int:
    """Width x height from the header of a TIFF file."""
    order = {b"II*\0": "<", b"MM\0*": ">"}.get(data[:4])
    if order is None or len(data) < 8:
        raise ScanError("not a PNG or TIFF file")
    (start,) = struct.unpack(order + "I", data[4:8])
    (count,) = struct.unpack(order + "H", data[start : start + 2].ljust(2, b"\0"))
    sizes = {}
    for entry in range(start + 2, min(start + 2 + 12 * count, len(data) - 11), 12):
        tag, kind = struct.unpack(order + "HH", data[entry : entry + 4])
        sizes[tag] = struct.unpack_from(order + ("H" if kind == 3 else "I"), data, entry + 8)[0]
    return sizes.get(_TIFF_WIDTH, 0) * sizes.get(_TIFF_HEIGHT, 0)
