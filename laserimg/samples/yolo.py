"""Boxes from a folder of YOLO files: beside each image a text of ``class x y w h`` in shares of the image."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from laserimg.errors import LabelError
from laserimg.files import is_hidden
from laserimg.samples.images import SUFFIXES, read_grey
from laserimg.samples.labelled import LabelledImage
from laserimg.samples.text import text_lines

# Files that tools put among the labels.
NAMES = ("classes.txt", "obj.names")


def read_yolo(folder: Path, label: str | None) -> Iterator[LabelledImage]:
    """Yield the labelled images of a folder; images lie beside the texts, or in ``images`` beside it.

    `label` is a name from ``classes.txt``, or the number itself.
    """
    wanted = _class_number(folder, label)
    texts = [path for path in sorted(folder.glob("*.txt")) if path.name not in NAMES and not is_hidden(path)]
    for text in texts:
        path = _image_of(text)
        pixels = read_grey(path)
        if pixels is None:
            yield LabelledImage(path, source=str(text))
            continue
        classes, boxes = _boxes(text, pixels.shape[1], pixels.shape[0])
        mine = np.full(len(classes), True) if wanted is None else classes == wanted
        yield LabelledImage(path, boxes[mine], boxes[~mine], str(text))


def _class_number(folder: Path, label: str | None) -> int | None:
    if label is None:
        return None
    names = [line for name in NAMES if (folder / name).exists() for _, line in text_lines(folder / name)]
    if label in names:
        return names.index(label)
    if label.isdigit():
        return int(label)
    raise LabelError(f"{folder}: no class '{label}' in {NAMES[0]}; give its number")


def _image_of(text: Path) -> Path:
    for folder in (text.parent, text.parent.parent / "images"):
        for suffix in sorted(SUFFIXES):
            if (path := folder / f"{text.stem}{suffix}").exists():
                return path
    return text.with_suffix(".jpg")


def _boxes(text: Path, width: int, height: int) -> tuple[np.ndarray, np.ndarray]:
    classes, boxes = [], []
    for number, line in text_lines(text):
        try:
            kind, x, y, w, h = (float(word) for word in line.split()[:5])
        except ValueError:
            raise LabelError(f"{text}, line {number}: expected 'class x y w h', got '{line[:60]}'") from None
        if not (0 <= x <= 1 and 0 <= y <= 1 and 0 < w <= 1 and 0 < h <= 1):
            raise LabelError(f"{text}, line {number}: shares of the image must lie between 0 and 1")
        classes.append(int(kind))
        boxes.append(((x - w / 2) * width, (y - h / 2) * height, w * width, h * height))
    return np.array(classes, int), np.array(boxes, float).reshape(-1, 4)
