"""Grey in place of reflectance, for depth images with a registered colour image and points with colours.

The grey is the luma of ITU-R BT.601, .299 red + .587 green + .114 blue, 0 to 255, as OpenCV has it.
"""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from laserimg.errors import LaserImgError, ScanError
from laserimg.files import read_bytes
from laserimg.scan import Scan

_LUMA = np.array([0.299, 0.587, 0.114])


def grey_image(path: Path, shape: tuple[int, int]) -> NDArray[np.uint8]:
    """Return the grey (H, W) of a colour image.

    Parameters
    ----------
    path : Path
        PNG, JPEG or whatever OpenCV reads, of 8 bits.
    shape : (int, int)
        Rows and columns of the scan: the image must be registered, pixel by pixel.

    Raises
    ------
    ScanError
        If it cannot be read, or has another size.
    """
    import cv2

    try:
        data = read_bytes(path)
    except LaserImgError as error:
        raise ScanError(f"colour image {path.name}: {error}") from error
    grey = _decoded(np.frombuffer(data, np.uint8), cv2) if data else None
    if grey is None:
        raise ScanError(f"colour image {path.name}: not a readable image")
    if grey.shape != shape:
        raise ScanError(
            f"colour image {path.name} has {grey.shape[0]} x {grey.shape[1]} pixels, the scan {shape[0]} x "
            f"{shape[1]}: register it to the scan first, pixel by pixel"
        )
    return grey


def with_colour(scan: Scan, path: Path) -> Scan:
    """Return the scan with the grey of a colour image as its reflectance.

    Raises
    ------
    ScanError
        As `grey_image`.
    """
    grey = grey_image(path, scan.shape)
    return replace(scan, reflectance=np.where(scan.range > 0, grey, 0).astype(np.float32))


def grey_of_points(records: NDArray[np.void]) -> NDArray[np.float64]:
    """Return the grey of points with the fields ``rgb`` or ``rgba`` (packed, as in PCL) or ``r g b``.

    Raises
    ------
    ScanError
        If they have none of these.

    Examples
    --------
    >>> grey_of_points(np.array([(0x00FF8000,)], [("rgb", np.uint32)])).round(1).tolist()
    [151.4]
    """
    names = records.dtype.names or ()
    packed = next((name for name in ("rgb", "rgba") if name in names), None)
    if packed is not None:
        # PCL stores the 4 bytes as a float as often as an integer.
        bits = np.ascontiguousarray(records[packed]).astype(records.dtype[packed].newbyteorder("="))
        if bits.dtype.itemsize != 4:
            raise ScanError(f"its field {packed} has {bits.dtype.itemsize} bytes a point, not 4")
        colour = np.stack([bits.view(np.uint32) >> shift & 255 for shift in (16, 8, 0)], axis=-1)
    elif all(name in names for name in "rgb"):
        colour = np.stack([records[name] for name in "rgb"], axis=-1)
    else:
        raise ScanError("has no colours (a field rgb or rgba, or r g b): leave out colour = true")
    return colour.astype(np.float64) @ _LUMA


def _decoded(data: NDArray[np.uint8], cv2: Any) -> NDArray[np.uint8] | None:
    # OpenCV prints what it thinks of a broken image on stderr. In 4.10 the switch is in cv2 itself.
    logging: Any = getattr(cv2.utils, "logging", cv2)
    level = logging.getLogLevel()
    try:
        logging.setLogLevel(0)
        # Decoders that give grey at once round it in their own ways.
        colour = cv2.imdecode(data, cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION)
        return None if colour is None else cv2.cvtColor(colour, cv2.COLOR_BGR2GRAY)
    except cv2.error:
        return None
    finally:
        logging.setLogLevel(level)
