"""Reading an image file as grey levels."""

from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from laserimg.files import is_hidden

SUFFIXES = frozenset({".png", ".jpg", ".jpeg", ".bmp", ".pgm", ".ppm", ".tif", ".tiff", ".webp"})


def read_grey(path: Path) -> NDArray[np.uint8] | None:
    """Return the (rows, columns) grey levels, or none if the file cannot be read as an image.

    Colours of anything but JPEG get the weights of `cv2.COLOR_RGB2GRAY`, as images of scans do when they are
    searched; JPEG files hold a grey plane of their own.
    """
    try:
        data = np.fromfile(path, np.uint8)
    except OSError:
        return None
    # Not cv2.imread: it prints its own warning for a missing file, and cannot open some names on Windows.
    jpeg = path.suffix.lower() in (".jpg", ".jpeg")
    image = cv2.imdecode(data, cv2.IMREAD_GRAYSCALE if jpeg else cv2.IMREAD_ANYCOLOR) if data.size else None
    if image is not None and image.ndim == 3:
        image = cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
    return None if image is None else np.asarray(image, np.uint8)


def image_files(folder: Path) -> list[Path]:
    """Return the image files in a folder and its subfolders, by name."""
    return sorted(path for path in folder.rglob("*") if _is_image(path))


def _is_image(path: Path) -> bool:
    return path.suffix.lower() in SUFFIXES and path.is_file() and not is_hidden(path)
