"""Images as PNG files."""

from pathlib import Path

import cv2
import numpy as np

from laserimg.errors import LaserImgError
from laserimg.files import atomic_write
from laserimg.images.stretch import Image


def write_png(path: Path, image: Image) -> None:
    """Write a gray image, or a colour image in the order red, green, blue, whole or not at all.

    Raises
    ------
    LaserImgError
        If the file cannot be written.
    """
    in_file_order = image[..., ::-1] if image.ndim == 3 else image
    ok, data = cv2.imencode(".png", np.ascontiguousarray(in_file_order))
    if not ok:
        raise LaserImgError(f"a {image.shape} image cannot be written as PNG")
    try:
        with atomic_write(path) as temporary:
            temporary.write_bytes(data.tobytes())
    except OSError as error:
        raise LaserImgError(f"cannot write {path}: {error.strerror}") from error
