"""Writing samples as a vec file, a picture of all, or a folder of crops."""

from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from laserimg.errors import ConfigError, LabelError
from laserimg.files import atomic_write
from laserimg.samples.images import read_grey
from laserimg.samples.negatives import read_negatives
from laserimg.samples.sheet import contact_sheet
from laserimg.samples.vec import write_vec

_OTHER_IMAGES = {".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".webp"}


def write_samples(path: Path, samples: NDArray[np.uint8]) -> None:
    """Write (n, height, width) samples: ``.vec``, one ``.png`` of all, or a folder with a PNG each.

    Raises
    ------
    ConfigError
        If the name is that of an image of another format.
    """
    if path.suffix.lower() in _OTHER_IMAGES:
        raise ConfigError(f"{path}: samples are written as a .vec, a .png of all, or a folder of PNG")
    if path.suffix.lower() == ".vec":
        write_vec(path, samples)
    elif path.suffix.lower() == ".png":
        _write_png(path, contact_sheet(samples))
    else:
        for number, sample in enumerate(samples):
            _write_png(path / f"{number:05d}.png", sample)


def ground_windows(
    path: Path, window: tuple[int, int], count: int, rng: np.random.Generator
) -> NDArray[np.uint8]:
    """Return windows cut from images at any place and size, (count, height, width).

    Raises
    ------
    LabelError
        If no image is large enough.
    """
    images = read_negatives(path).images
    grounds: list[NDArray[np.uint8]] = []
    for number in rng.permutation(len(images)):
        pixels = read_grey(images[number].path)
        if pixels is None or pixels.shape[0] < window[1] or pixels.shape[1] < window[0]:
            continue
        each = -(-count // len(images))
        grounds += [_cut(pixels, window, rng) for _ in range(each)]
    if not grounds:
        raise LabelError(f"{path}: no image that can be read and is as large as the window")
    return np.stack(grounds)


def _cut(pixels: NDArray[np.uint8], window: tuple[int, int], rng: np.random.Generator) -> NDArray[np.uint8]:
    largest = min(pixels.shape[1] / window[0], pixels.shape[0] / window[1])
    scale = largest ** rng.random()
    width, height = int(window[0] * scale), int(window[1] * scale)
    x = int(rng.integers(pixels.shape[1] - width + 1))
    y = int(rng.integers(pixels.shape[0] - height + 1))
    cut = cv2.resize(pixels[y : y + height, x : x + width], window, interpolation=cv2.INTER_AREA)
    return np.asarray(cut, np.uint8)


def _write_png(path: Path, pixels: NDArray[np.uint8]) -> None:
    with atomic_write(path) as temporary:
        temporary.write_bytes(cv2.imencode(".png", pixels)[1].tobytes())
