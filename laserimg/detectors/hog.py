"""HOG window and linear SVM, run by OpenCV."""

import io
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from laserimg.detectors.window import Hits
from laserimg.errors import LaserImgError, ModelError
from laserimg.evidence import Image
from laserimg.files import read_bytes
from laserimg.formats.card import Card
from laserimg.readers.npz import load_arrays

# The arguments of cv2.HOGDescriptor in order: all are given, since a default changed between
# OpenCV 4.14 and 5.0.
SIZES = ("winSize", "blockSize", "blockStride", "cellSize")
ARGUMENTS = {
    **dict.fromkeys(SIZES, tuple),
    "nbins": int,
    "derivAperture": int,
    "winSigma": float,
    "histogramNormType": int,
    "L2HysThreshold": float,
    "gammaCorrection": bool,
    "nlevels": int,
    "signedGradient": bool,
}
MAX_BYTES = 16 << 20
MAX_SIDE, MAX_BINS = 1024, 180
_INT32_END = 2**31
# OpenCV keeps the histograms of as many rows of blocks as a window has. Of an image this wide they may take
# no more memory than this.
_WIDE, _MAX_CACHE_BYTES = 8192, 1 << 30


@dataclass(frozen=True, eq=False, slots=True)
class HogModel:
    """A HOG descriptor with a linear SVM as a classifier of windows.

    The margin is the signed distance to the plane of the SVM, times the length of its weights.

    Parameters
    ----------
    name : str
    card : Card
    descriptor : cv2.HOGDescriptor
        With its SVM set, as `load_hog` gives it.
    """

    name: str
    card: Card
    descriptor: cv2.HOGDescriptor

    # A step is wide and false alarms are few: of faces 80 % were found by one window, 67 % by two.
    min_neighbours = 1

    def hits(self, image: Image) -> Hits:
        """Return the windows of a gray image on the object's side of the plane."""
        width, height = self.card.window
        if image.shape[0] < height or image.shape[1] < width:
            return Hits.none()
        corners, margins = self.descriptor.detect(
            image, hitThreshold=0.0, winStride=_step(self.descriptor), padding=(0, 0)
        )
        return Hits(np.asarray(corners, np.float64).reshape(-1, 2), np.asarray(margins, np.float64).ravel())


def load_hog(path: Path) -> cv2.HOGDescriptor:
    """Read a HOG file: weights, bias and the 12 arguments of `cv2.HOGDescriptor`.

    Raises
    ------
    ModelError
        If the file cannot be read, an array is missing or wrong, or OpenCV could not run it safely.
    """
    try:
        return _descriptor(load_arrays(read_bytes(path, MAX_BYTES), MAX_BYTES))
    except LaserImgError as error:
        raise ModelError(f"{path}: {error}") from error


def save_hog(arguments: Mapping[str, Any], weights: ArrayLike, bias: float) -> bytes:
    """Return the contents of a HOG file.

    Parameters
    ----------
    arguments : mapping
        One value for each of `ARGUMENTS`.
    weights : (n,) array
        In the order of `cv2.HOGDescriptor.compute`.
    bias : float
    """
    buffer = io.BytesIO()
    arrays: dict[str, Any] = {name: np.asarray(arguments[name]) for name in ARGUMENTS}
    np.savez(buffer, weights=np.asarray(weights, np.float32), bias=np.float32(bias), **arrays)
    return buffer.getvalue()


def _step(descriptor: cv2.HOGDescriptor) -> tuple[int, int]:
    """Return columns and rows from window to window.

    At most a tenth of the window: with 20 pixels, steps of 4, 2 and 1 found 47, 80 and 87 % of faces in
    times as 1, 5 and 14. And a part of the block's stride, as other steps need finer blocks.
    """
    width, height = (
        max(step for step in range(1, stride + 1) if stride % step == 0 and (step == 1 or 10 * step <= side))
        for stride, side in zip(descriptor.blockStride, descriptor.winSize, strict=True)
    )
    return width, height


def _descriptor(arrays: Mapping[str, NDArray]) -> cv2.HOGDescriptor:
    values = [_argument(arrays, name) for name in ARGUMENTS]
    _check_sizes(*values[:5])
    if values[7] != cv2.HOGDESCRIPTOR_L2HYS:
        raise ModelError(f"histogramNormType is {values[7]}, OpenCV knows {cv2.HOGDESCRIPTOR_L2HYS}")
    descriptor = cv2.HOGDescriptor(*values)
    vector = np.append(_array(arrays, "weights"), _argument(arrays, "bias"))
    if len(vector) != descriptor.getDescriptorSize() + 1:
        raise ModelError(
            f"{len(vector) - 1} weights for {descriptor.getDescriptorSize()} values of the window"
        )
    if not (np.abs(vector) < np.finfo(np.float32).max).all():
        raise ModelError("the weights are not finite")
    _check_memory(descriptor)
    descriptor.setSVMDetector(vector.astype(np.float32))
    return descriptor


def _array(arrays: Mapping[str, NDArray], name: str) -> NDArray:
    if name not in arrays:
        raise ModelError(f"array '{name}' is missing")
    return arrays[name].astype(np.float64).ravel()


def _argument(arrays: Mapping[str, NDArray], name: str) -> Any:
    kind, values = ARGUMENTS.get(name, float), _array(arrays, name)
    count = 2 if kind is tuple else 1
    if len(values) != count or not (np.abs(values) < _INT32_END).all():
        numbers = "two numbers" if count == 2 else "one number"
        raise ModelError(f"{name} must be {numbers} of 32 bits, is {values[:4].tolist()}")
    return tuple(int(value) for value in values) if kind is tuple else kind(values[0])


def _check_sizes(window: tuple, block: tuple, stride: tuple, cell: tuple, bins: int) -> None:
    """Refuse what would make OpenCV divide by zero or read outside the window."""
    for name, sizes in zip(SIZES, (window, block, stride, cell), strict=True):
        if not all(1 <= side <= MAX_SIDE for side in sizes):
            raise ModelError(f"{name} must be from 1 to {MAX_SIDE}, is {sizes}")
    for axis in range(2):
        fits = block[axis] <= window[axis] and (window[axis] - block[axis]) % stride[axis] == 0
        if not fits or block[axis] % cell[axis]:
            raise ModelError(
                f"blocks of {block} by steps of {stride} and cells of {cell} do not fit {window}"
            )
    if not 1 <= bins <= MAX_BINS:
        raise ModelError(f"nbins must be from 1 to {MAX_BINS}, is {bins}")


def _check_memory(descriptor: cv2.HOGDescriptor) -> None:
    across, down = _step(descriptor)
    cells = np.prod(np.array(descriptor.blockSize) // descriptor.cellSize)
    blocks = (_WIDE // across + 1) * (descriptor.winSize[1] // down + 1)
    if 4 * cells * descriptor.nbins * blocks > _MAX_CACHE_BYTES:
        raise ModelError("blocks of so many cells by such small steps take too much memory")
