"""Reading an image file as grey levels."""

from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

SUFFIXES = frozenset({".png", ".jpg", ".jpeg", ".bmp", ".pgm", ".ppm", ".tif", ".tiff", ".webp"})


def read_grey(path: Path) -> NDArray[np.uint8] | None:
    """Return the (rows, columns) grey levels, or none if the file cannot be read as an image."""
    try:
        data = np.fromfile(path, np.uint8)
    except OSError:
        return None
    # Not cv2.imread: it prints its own warning for a missing file, and cannot open some names on Windows.
    image = cv2.imdecode(data, cv2.IMREAD_GRAYSCALE) if data.size else None
    return None if image is None else image.astype(np.uint8, copy=False)


def image_files(folder: Path) -> list[Path]:
    """Return the image files in a folder and its subfolders, by name."""
    return sorted(path for path in folder.rglob("*") if path.suffix.lower() in SUFFIXES and path.is_file())
