"""Files of labels in other tools' formats, as labelled images.

Which format a file has is told by its name: ``.json`` COCO, ``.xml`` Pascal VOC or dlib's imglab,
``.dat`` or ``.txt`` OpenCV's info file; a folder holds VOC (``.xml``) or YOLO (``.txt``) files.
"""

from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

import numpy as np

from laserimg.errors import LabelError
from laserimg.files import is_hidden
from laserimg.samples.labelled import LabelledImage
from laserimg.samples.text import text_lines
from laserimg.samples.xml_labels import read_xml
from laserimg.samples.yolo import read_yolo

Reader = Callable[[Path, str | None], Iterator[LabelledImage]]


def read_labels(path: Path, label: str | None = None) -> list[LabelledImage]:
    """Return the labelled images of a file or folder.

    Parameters
    ----------
    path : Path
    label : str, optional
        The class whose boxes are objects; boxes of the others are ignored. Without it all are objects.

    Raises
    ------
    LabelError
        Names file and line of what cannot be read.
    """
    if path.is_dir():
        files = [file for file in sorted(path.glob("*.xml")) if not is_hidden(file)]
        images = [image for file in files for image in read_xml(file, label)]
        return images or list(read_yolo(path, label))
    readers: dict[str, Reader] = {".json": _coco, ".dat": _info, ".txt": _info, ".xml": read_xml}
    if not path.exists():
        raise LabelError(f"{path}: no such file or folder")
    reader = readers.get(path.suffix.lower())
    if reader is None:
        raise LabelError(f"{path}: labels of a kind not known; known are {', '.join(readers)}")
    return list(reader(path, label))


def holds_labels(folder: Path) -> bool:
    """Return whether a folder holds VOC or YOLO files, not only images."""
    return any(folder.glob("*.xml")) or any(folder.glob("*.txt"))


def _info(path: Path, label: str | None) -> Iterator[LabelledImage]:
    """Lines of ``image count x y w h ...``; names are relative to the file and may hold spaces."""
    for number, line in text_lines(path):
        where = f"{path}, line {number}"
        words = line.split()
        # From the end: names may hold spaces, and so may their last words be numbers.
        for start in range(1, len(words)):
            count = words[start]
            if count.isdigit() and len(words) - start - 1 == 4 * int(count):
                break
        else:
            raise LabelError(f"{where}: expected 'image count x y w h ...', got '{line[:60]}'")
        name = line.rsplit(None, len(words) - start)[0]
        yield LabelledImage(path.parent / name, _boxes(words[start + 1 :], where), source=where)


def _boxes(words: Iterable[str], where: str) -> np.ndarray:
    try:
        boxes = np.array([float(word) for word in words]).reshape(-1, 4)
    except ValueError:
        raise LabelError(f"{where}: a box is not four numbers") from None
    if not np.isfinite(boxes).all() or (boxes[:, 2:] <= 0).any():
        raise LabelError(f"{where}: boxes need a width and height above 0")
    return boxes


def _coco(path: Path, label: str | None) -> Iterator[LabelledImage]:
    from laserimg.formats.coco_file import read_coco

    coco = read_coco(path)
    names = {category.id: category.name for category in coco.categories}
    if label is not None and label not in names.values():
        raise LabelError(f"{path}: no category '{label}'; there are {', '.join(sorted(names.values()))}")
    for image in coco.images:
        objects, ignored = [], []
        for entry in coco.annotations:
            if entry.image_id == image.id:
                # What checks rejected is no object to learn, and may be one all the same: no background.
                judged = not entry.iscrowd and entry.accepted is not False
                wanted = judged and (label is None or names[entry.category_id] == label)
                (objects if wanted else ignored).append(entry.bbox)
        yield LabelledImage(
            path.parent / image.file_name,
            np.array(objects, float).reshape(-1, 4),
            np.array(ignored, float).reshape(-1, 4),
            f"{path}, image {image.file_name}",
        )
