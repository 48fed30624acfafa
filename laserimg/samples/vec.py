"""The ``.vec`` files of opencv_createsamples: grey windows of one size, without saying which."""

import math
import struct
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from laserimg.errors import LabelError, LaserImgError
from laserimg.files import atomic_write, read_bytes

# Number of windows, pixels of each, and two numbers that nothing reads.
_HEAD = struct.Struct("<iihh")


def read_vec(path: Path, window: tuple[int, int] | None = None) -> NDArray[np.uint8]:
    """Return the (n, height, width) windows of a file.

    Parameters
    ----------
    path : Path
    window : (int, int), optional
        Width and height; without it the windows must be square, because the file does not say.

    Raises
    ------
    LabelError
        If the file cannot be read, is cut off, or holds windows of another number of pixels.
    """
    try:
        data = read_bytes(path)
    except LaserImgError as error:
        raise LabelError(f"{path}: {error}") from None
    if len(data) < _HEAD.size:
        raise LabelError(f"{path}: too short for a vec file")
    count, pixels, _, _ = _HEAD.unpack_from(data)
    width, height = window or (math.isqrt(max(pixels, 0)),) * 2
    if count < 0 or pixels <= 0 or width * height != pixels:
        wanted = f"{width}x{height} = {width * height}" if window else "a square number of"
        raise LabelError(f"{path}: windows of {pixels} pixels, expected {wanted}")
    # Each window begins with a byte that nothing reads.
    if len(data) < _HEAD.size + count * (1 + 2 * pixels):
        raise LabelError(f"{path}: says {count} windows but ends before")
    record = np.dtype([("first", "u1"), ("pixels", "<i2", (height, width))])
    return np.frombuffer(data, record, count, _HEAD.size)["pixels"].clip(0, 255).astype(np.uint8)


def write_vec(path: Path, windows: NDArray[np.uint8]) -> None:
    """Write (n, height, width) windows as a file that opencv_traincascade reads, whole or not at all."""
    count, height, width = windows.shape
    records = np.zeros(count, np.dtype([("first", "u1"), ("pixels", "<i2", (height, width))]))
    records["pixels"] = windows
    with atomic_write(path) as temporary:
        temporary.write_bytes(_HEAD.pack(count, width * height, 0, 0) + records.tobytes())
