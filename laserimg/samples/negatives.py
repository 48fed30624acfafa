"""Images to take negatives from, by folder, list or labels."""

from dataclasses import dataclass
from pathlib import Path

from laserimg.errors import LabelError
from laserimg.samples.images import image_files
from laserimg.samples.labelled import LabelledImage, of_scans
from laserimg.samples.labels import holds_labels, read_labels
from laserimg.samples.text import text_lines


@dataclass(frozen=True, eq=False, slots=True)
class Negatives:
    """Images, and what was left out with the reason, one line each."""

    images: tuple[LabelledImage, ...]
    skipped: tuple[str, ...] = ()


def read_negatives(path: Path, pictures: tuple[Path, str] | None = None) -> Negatives:
    """Return the images of a folder, of a list with one name a line, or of a file of labels.

    Names in a list are relative to the list, as in opencv_traincascade; negatives from labelled images keep
    outside all boxes, whatever their class; for `pictures` see
    `laserimg.samples.positives.read_positives`. Files that do not exist are left out and named.

    Raises
    ------
    LabelError
        If there is no image.
    """
    if path.is_dir() and not holds_labels(path):
        images = [LabelledImage(file, source=str(file)) for file in image_files(path)]
    elif path.suffix.lower() == ".txt" and not _is_info(path):
        lines = list(text_lines(path))
        images = [
            LabelledImage(path.parent / line, source=f"{path}, line {number}") for number, line in lines
        ]
    else:
        images = read_labels(path)
        images = of_scans(images, *pictures) if pictures else images
    there = tuple(image for image in images if image.path.is_file())
    if not there:
        raise LabelError(f"{path}: no images" + (f"; {images[0].path} does not exist" if images else ""))
    gone = (f"{image.source}: {image.path} does not exist" for image in images if not image.path.is_file())
    return Negatives(there, tuple(gone))


def _is_info(path: Path) -> bool:
    first = next(iter(text_lines(path)), None)
    if first is None or (path.parent / first[1]).exists():
        return False
    words = first[1].split()
    return any(word.isdigit() and len(words) - i - 1 == 4 * int(word) for i, word in enumerate(words) if i)
