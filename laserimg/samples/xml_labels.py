"""Boxes from Pascal VOC files and from the files of dlib's imglab."""

from collections.abc import Iterator
from pathlib import Path
from xml.etree.ElementTree import Element, ParseError

import numpy as np
from defusedxml import DefusedXmlException
from defusedxml.ElementTree import fromstring

from laserimg.errors import LabelError, LaserImgError
from laserimg.files import read_bytes
from laserimg.samples.labelled import LabelledImage

Box = tuple[float, float, float, float]


def read_xml(path: Path, label: str | None) -> Iterator[LabelledImage]:
    """Yield the labelled images of a VOC file (one image) or an imglab file (many).

    VOC counts pixels from 1 and includes the last one; objects marked "difficult" (VOC) or to be ignored
    (imglab) are neither positive nor negative.
    """
    root = _parsed(path)
    if root.tag == "annotation":
        yield _voc(path, root, label)
    elif root.tag == "dataset":
        for number, image in enumerate(root.iter("image"), 1):
            yield _imglab(path, image, f"{path}, image {number}", label)
    else:
        raise LabelError(f"{path}: neither a Pascal VOC file nor one of dlib's imglab")


def _parsed(path: Path) -> Element:
    try:
        return fromstring(read_bytes(path))
    except LaserImgError as error:
        raise LabelError(f"{path}: {error}") from None
    except (ParseError, DefusedXmlException) as error:
        raise LabelError(f"{path}: not a sound XML file: {error}") from None


def _voc(path: Path, root: Element, label: str | None) -> LabelledImage:
    objects: list[Box] = []
    ignored: list[Box] = []
    for entry in root.iter("object"):
        box = entry.find("bndbox")
        if box is None:
            raise LabelError(f"{path}: an object without bndbox")
        left, top, right, bottom = (
            _number(box.findtext(n), str(path)) for n in ("xmin", "ymin", "xmax", "ymax")
        )
        unclear = (entry.findtext("difficult") or "0").strip() == "1"
        wanted = not unclear and label in (None, (entry.findtext("name") or "").strip())
        (objects if wanted else ignored).append((left - 1, top - 1, right - left + 1, bottom - top + 1))
    name = (root.findtext("filename") or path.with_suffix(".jpg").name).strip()
    return _image(_found(path, name), objects, ignored, str(path))


def _found(path: Path, name: str) -> Path:
    # Beside the file, or as VOC lays folders out.
    beside, in_voc = path.parent / name, path.parent.parent / "JPEGImages" / name
    return in_voc if in_voc.exists() and not beside.exists() else beside


def _imglab(path: Path, image: Element, where: str, label: str | None) -> LabelledImage:
    objects: list[Box] = []
    ignored: list[Box] = []
    for box in image.iter("box"):
        left, top, width, height = (
            _number(box.get(name), where) for name in ("left", "top", "width", "height")
        )
        name = (box.findtext("label") or "").strip()
        wanted = box.get("ignore") != "1" and label in (None, name)
        (objects if wanted else ignored).append((left, top, width, height))
    return _image(path.parent / (image.get("file") or ""), objects, ignored, where)


def _number(text: str | None, where: str) -> float:
    try:
        return float(text or "")
    except ValueError:
        raise LabelError(f"{where}: '{text}' is not a number of a box") from None


def _image(path: Path, objects: list[Box], ignored: list[Box], where: str) -> LabelledImage:
    arrays = [np.array(boxes, float).reshape(-1, 4) for boxes in (objects, ignored)]
    for boxes in arrays:
        if not np.isfinite(boxes).all() or (boxes[:, 2:] <= 0).any():
            raise LabelError(f"{where}: boxes need a width and height above 0")
    return LabelledImage(path, *arrays, source=where)
