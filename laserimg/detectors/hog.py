"""HOG window and linear SVM, run by OpenCV."""

import io
import zipfile
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from laserimg.detectors.window import Hits
from laserimg.errors import LaserImgError, ModelError
from laserimg.evidence import Image
from laserimg.files import read_bytes
from laserimg.formats.card import Card

# The arguments of cv2.HOGDescriptor in order: all are given, since a default changed between
# OpenCV 4.14 and 5.0.
ARGUMENTS = (
    "winSize",
    "blockSize",
    "blockStride",
    "cellSize",
    "nbins",
    "derivAperture",
    "winSigma",
    "histogramNormType",
    "L2HysThreshold",
    "gammaCorrection",
    "nlevels",
    "signedGradient",
)
_KINDS = (tuple, tuple, tuple, tuple, int, int, float, int, float, bool, int, bool)
MAX_BYTES = 64 << 20
MAX_SIDE = 1024


@dataclass(frozen=True, eq=False, slots=True)
class HogModel:
    """A HOG descriptor with a linear SVM as a classifier of windows.

    The score is the distance to the plane of the SVM; windows that score below 0 are no hits.

    Parameters
    ----------
    name : str
    card : Card
    descriptor : cv2.HOGDescriptor
        With its SVM set.
    """

    name: str
    card: Card
    descriptor: cv2.HOGDescriptor

    def hits(self, image: Image) -> Hits:
        """Return the windows of a gray image on the object's side of the plane."""
        width, height = self.card.window
        if image.shape[0] < height or image.shape[1] < width:
            return Hits(np.empty((0, 2)), np.empty(0))
        corners, scores = self.descriptor.detect(image, hitThreshold=0.0, padding=(0, 0))
        return Hits(np.asarray(corners, np.float64).reshape(-1, 2), np.asarray(scores, np.float64).ravel())


def load_hog(path: Path) -> cv2.HOGDescriptor:
    """Read a HOG file: weights, bias and the 12 arguments of `cv2.HOGDescriptor`.

    Raises
    ------
    ModelError
        If the file cannot be read, an array is missing or the weights do not fit the window.
    """
    try:
        with np.load(io.BytesIO(read_bytes(path, MAX_BYTES)), allow_pickle=False) as file:
            arrays = {name: file[name] for name in (*ARGUMENTS, "weights", "bias")}
    except LaserImgError as error:
        raise ModelError(f"{path}: {error}") from error
    except KeyError as error:
        raise ModelError(f"{path}: array {error} is missing") from error
    except (ValueError, OSError, EOFError, TypeError, zipfile.BadZipFile, NotImplementedError) as error:
        raise ModelError(f"{path}: not a HOG file: {error}") from error
    try:
        return _descriptor(arrays)
    except (cv2.error, ModelError, ValueError, TypeError, OverflowError) as error:
        raise ModelError(f"{path}: {error}") from error


def save_hog(descriptor_arguments: dict[str, object], weights: NDArray, bias: float) -> bytes:
    """Return the contents of a HOG file.

    Parameters
    ----------
    descriptor_arguments : mapping
        One value for each name of `ARGUMENTS`.
    weights : (n,) array
    bias : float
    """
    buffer = io.BytesIO()
    arrays = {name: np.asarray(descriptor_arguments[name]) for name in ARGUMENTS}
    np.savez(buffer, weights=np.asarray(weights, np.float32), bias=np.float32(bias), **arrays)
    return buffer.getvalue()


def _descriptor(arrays: dict[str, NDArray]) -> cv2.HOGDescriptor:
    values = [
        tuple(int(v) for v in arrays[name].ravel()) if kind is tuple else kind(arrays[name].item())
        for name, kind in zip(ARGUMENTS, _KINDS, strict=True)
    ]
    _check_sizes(*values[:5])
    descriptor = cv2.HOGDescriptor(*values)
    vector = np.append(arrays["weights"].astype(np.float32).ravel(), np.float32(arrays["bias"].item()))
    if len(vector) != descriptor.getDescriptorSize() + 1:
        raise ModelError(
            f"{len(vector) - 1} weights for {descriptor.getDescriptorSize()} values of the window"
        )
    if not np.isfinite(vector).all():
        raise ModelError("the weights are not finite")
    descriptor.setSVMDetector(vector)
    return descriptor


def _check_sizes(window: tuple, block: tuple, stride: tuple, cell: tuple, bins: int) -> None:
    """Refuse what would make OpenCV divide by zero or read outside the window."""
    for sizes in (window, block, stride, cell):
        if len(sizes) != 2 or not all(1 <= side <= MAX_SIDE for side in sizes):
            raise ModelError(f"sizes must be two numbers from 1 to {MAX_SIDE}, got {sizes}")
    for axis in range(2):
        fits = block[axis] <= window[axis] and (window[axis] - block[axis]) % stride[axis] == 0
        if not fits or block[axis] % cell[axis]:
            raise ModelError(
                f"blocks of {block} by steps of {stride} and cells of {cell} do not fit {window}"
            )
    if not 1 <= bins <= 180:
        raise ModelError(f"nbins must be from 1 to 180, got {bins}")
