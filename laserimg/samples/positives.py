"""Windows of the objects to learn, from vec files, folders of crops or labelled images."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from laserimg.errors import LabelError
from laserimg.samples.images import image_files, read_grey
from laserimg.samples.labelled import LabelledImage, of_scans
from laserimg.samples.labels import holds_labels, read_labels
from laserimg.samples.vec import read_vec

Window = tuple[int, int]


@dataclass(frozen=True, eq=False, slots=True)
class Positives:
    """Windows, and what was left out with the reason, one line each.

    Attributes
    ----------
    windows : (n, height, width) uint8
    skipped : tuple of str
    """

    windows: NDArray[np.uint8]
    skipped: tuple[str, ...] = ()


def read_positives(
    path: Path,
    window: Window,
    margin: float = 0.0,
    label: str | None = None,
    pictures: tuple[Path, str] | None = None,
) -> Positives:
    """Return the positives of a vec file, a folder of crops, or a file of labels.

    Parameters
    ----------
    path : Path
        ``.vec``; a folder whose images are one object each; or labels (see `laserimg.samples.labels`).
    window : (int, int)
        Width and height in pixels.
    margin : float
        How far a window reaches over a labelled box on every side, as a share of the box.
    label : str, optional
        The class to take, where the labels have classes.
    pictures : (Path, str), optional
        Labels of scans: the folder with their images, and the kind of image.

    Raises
    ------
    LabelError
        If nothing can be read, or there is no positive.
    """
    if path.suffix.lower() == ".vec":
        found = Positives(read_vec(path, window))
    elif path.is_dir() and not holds_labels(path):
        images = [LabelledImage(file, source=str(file)) for file in image_files(path)]
        found = _gathered([_whole(image, window) for image in images], window)
    else:
        labelled = read_labels(path, label)
        found = cut_out(of_scans(labelled, *pictures) if pictures else labelled, window, margin)
    if len(found.windows) == 0:
        raise LabelError("\n".join([f"{path}: no positives", *found.skipped[:5]]))
    return found


def cut_out(images: Sequence[LabelledImage], window: Window, margin: float = 0.0) -> Positives:
    """Return the labelled objects, each box with its margin scaled to the window.

    Beyond the image's border its outermost pixels are repeated. Objects smaller than the window are left out.
    """
    parts: list[NDArray[np.uint8] | str] = []
    for image in images:
        if len(image.objects):
            pixels = read_grey(image.path)
            if pixels is None:
                parts.append(f"{image.source or image.path}: {image.path} cannot be read as an image")
                continue
            parts += [_object(pixels, box, window, margin, image) for box in image.objects]
    return _gathered(parts, window)


def _whole(image: LabelledImage, window: Window) -> NDArray[np.uint8] | str:
    pixels = read_grey(image.path)
    if pixels is None:
        return f"{image.path} cannot be read as an image"
    return _object(pixels, np.array([0, 0, pixels.shape[1], pixels.shape[0]]), window, 0.0, image)


def _object(
    pixels: NDArray[np.uint8], box: NDArray, window: Window, margin: float, image: LabelledImage
) -> NDArray[np.uint8] | str:
    x, y, w, h = (float(value) for value in box)
    rows, columns = pixels.shape
    if x < -0.5 or y < -0.5 or x + w > columns + 0.5 or y + h > rows + 0.5:
        raise LabelError(
            f"{image.source}: box {x:g} {y:g} {w:g} {h:g} is outside {image.path.name} ({columns}x{rows})"
        )
    left, top = round(x - margin * w), round(y - margin * h)
    right, bottom = round(x + w + margin * w), round(y + h + margin * h)
    if right - left < window[0] or bottom - top < window[1]:
        return f"{image.source}: {right - left}x{bottom - top} is smaller than the window"
    out = max(0, -left, -top, right - columns, bottom - rows)
    padded = cv2.copyMakeBorder(pixels, out, out, out, out, cv2.BORDER_REPLICATE) if out else pixels
    crop = padded[top + out : bottom + out, left + out : right + out]
    scaled = crop if crop.shape[::-1] == window else cv2.resize(crop, window, interpolation=cv2.INTER_AREA)
    return np.asarray(scaled, np.uint8)


def _gathered(parts: Sequence[NDArray[np.uint8] | str], window: Window) -> Positives:
    windows = [part for part in parts if not isinstance(part, str)]
    pixels = np.array(windows, np.uint8).reshape(-1, window[1], window[0])
    return Positives(pixels, tuple(part for part in parts if isinstance(part, str)))
