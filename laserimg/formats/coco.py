"""COCO files: boxes of truth or candidates, and detections with every check and size.

The types, and how a file belongs to scans. `laserimg.formats.coco_file` reads and writes them.
"""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any

from annotated_types import Ge, Gt, Le, Len

from laserimg.errors import LabelError
from laserimg.files import stem
from laserimg.scan import MAX_PIXELS, Scan

# For pydantic, which reads these types from JSON: other tools may add keys, but not other types.
READING = {"strict": True, "allow_inf_nan": False, "extra": "ignore"}

# Drawing tools overstep the border by parts of a pixel.
BORDER_PIXELS = 0.5

Id = Annotated[int, Ge(0), Le(2**53)]
Pixels = Annotated[int, Gt(0), Le(MAX_PIXELS)]
Box = tuple[float, float, float, float]


@dataclass(frozen=True, slots=True)
class CheckRecord:
    """One check of a candidate, as written.

    Parameters
    ----------
    name : str
    value : float or None
        What was measured; None when it could not be.
    limit : (float or None, float or None)
        Lowest and highest allowed; None leaves a side open.
    passed : bool
    """

    __pydantic_config__ = READING
    name: str
    value: float | None
    limit: tuple[float | None, float | None]
    passed: bool


@dataclass(frozen=True, slots=True)
class Size:
    """Measured size of a candidate in metres; what each is, `laserimg.rules.model` says."""

    __pydantic_config__ = READING
    width: float
    depth: float
    height: float
    length: float
    breadth: float


@dataclass(frozen=True, slots=True)
class Position:
    """Where a candidate is: metres in the scanner's frame, and degrees.

    `height_above_floor` is None when the scan shows no floor.
    """

    __pydantic_config__ = READING
    x: float
    y: float
    z: float
    range: float
    azimuth_deg: float
    elevation_deg: float
    height_above_floor: float | None = None


@dataclass(frozen=True, slots=True)
class CocoImage:
    """One scan: its file, its number within the file, and its grid.

    Parameters
    ----------
    id : int
    file_name : str
        Relative to the common folder of the inputs.
    width, height : int
        Columns and rows of the grid.
    scan : int
        Index within the file.
    """

    __pydantic_config__ = READING
    id: Id
    file_name: str
    width: Pixels
    height: Pixels
    scan: Annotated[int, Ge(0)] = 0


@dataclass(frozen=True, slots=True)
class Category:
    """A class."""

    __pydantic_config__ = READING
    id: Id
    name: Annotated[str, Len(1)]


@dataclass(frozen=True, slots=True)
class Annotation:
    """A box: of truth, given as candidate, or found with everything measured of it.

    Parameters
    ----------
    id, image_id, category_id : int
    bbox : (float, float, float, float)
        ``x, y, w, h`` in pixels of the scan's grid; ``x + w`` above the width means that the box
        goes on at column 0 of a grid that closes a full turn.
    area : float, optional
        In pixels; that of the box when not given.
    iscrowd : int
        1: to be ignored when counting hits and misses.
    score : float or None
    source : str
        The cascade's name, "hog", "regions" or "given".
    accepted : bool or None
        None for truth and given candidates, which nobody has judged.
    reason : str
        The first failed check, such as ``height 0.81 m > 0.60 m``.
    region_bbox : (float, float, float, float) or None
        Bounding rectangle of the region.
    checks : tuple of CheckRecord
        All that ran; their names differ.
    size : Size or None
    position : Position or None
        None when the candidate has no return.
    visibility : float or None
        Pixels that show the thing, as a share of those that would if it stood alone.
    segmentation : mapping or sequence, optional
        The mask, as COCO has it: run lengths (`laserimg.formats.masks`) or polygons, passed on unread.
    """

    __pydantic_config__ = READING
    id: Id
    image_id: Id
    category_id: Id
    bbox: Box
    region_bbox: Box | None = None
    area: float | None = None
    iscrowd: Annotated[int, Ge(0), Le(1)] = 0
    score: float | None = None
    source: str = ""
    accepted: bool | None = None
    reason: str = ""
    checks: tuple[CheckRecord, ...] = ()
    size: Size | None = None
    position: Position | None = None
    visibility: float | None = None
    segmentation: Any = None

    def __post_init__(self) -> None:
        if self.area is None:
            object.__setattr__(self, "area", self.bbox[2] * self.bbox[3])


@dataclass(frozen=True)
class CocoFile:
    """Images, classes and boxes of one COCO file.

    Parameters
    ----------
    images : tuple of CocoImage
    categories : tuple of Category
    annotations : tuple of Annotation
    info : mapping
        Version, rules, detectors and configuration that made it.
    source : str
        The file's name in messages.

    Raises
    ------
    LabelError
        If an id is used twice or unknown, or a box has no area or leaves its image.
    """

    images: tuple[CocoImage, ...]
    categories: tuple[Category, ...]
    annotations: tuple[Annotation, ...]
    info: Mapping[str, Any] = field(default_factory=dict)
    source: str = "COCO file"

    def __post_init__(self) -> None:
        self._check_unique("image", self.images)
        self._check_unique("category", self.categories)
        self._check_unique("annotation", self.annotations)
        for annotation in self.annotations:
            if annotation.image_id not in self.images_by_id:
                raise self.error(annotation, f"image {annotation.image_id} does not exist")
            if annotation.category_id not in self.labels:
                raise self.error(annotation, f"category {annotation.category_id} does not exist")
            self._check_box(annotation)
            self._check_checks(annotation)

    @cached_property
    def images_by_id(self) -> dict[int, CocoImage]:
        """The images by their id."""
        return {image.id: image for image in self.images}

    @cached_property
    def labels(self) -> dict[int, str]:
        """Names of the classes by category id."""
        return {category.id: category.name for category in self.categories}

    def error(self, annotation: Annotation, message: str) -> LabelError:
        """Return an error that names file and annotation."""
        return LabelError(f"{self.source}: annotation {annotation.id}: {message}")

    def image_of(self, file_name: str, scan: int = 0, only: bool = False) -> CocoImage | None:
        """Return the image that stands for a scan; None if there is none.

        Files are the same when their names agree without folder, suffix and compression suffix;
        among several such images the folders decide.

        Parameters
        ----------
        file_name : str
            The scan's file.
        scan : int
            Its index within the file.
        only : bool
            The run has no other scan: then a file with a single image matches whatever its name.

        Raises
        ------
        LabelError
            If several images fit equally well.
        """
        if only and len(self.images) == 1:
            return self.images[0]
        found = self._by_stem.get((_stem(file_name), scan), [])
        if len(found) < 2:
            return found[0] if found else None
        ranks = [_common_folders(image.file_name, file_name) for image in found]
        best = [image for image, rank in zip(found, ranks, strict=True) if rank == max(ranks)]
        if len(best) > 1:
            names = ", ".join(image.file_name for image in best)
            raise LabelError(f"{self.source}: {file_name} may be any of the images {names}")
        return best[0]

    def annotations_of(self, scan: Scan, only: bool = False) -> tuple[Annotation, ...]:
        """Return the boxes of a scan; none if the file does not have it.

        Raises
        ------
        LabelError
            If the image and the scan's grid differ in size, or a box crosses the last column of
            a grid that closes no full turn.
        """
        image = self.image_of(scan.source, scan.index, only)
        if image is None:
            return ()
        height, width = scan.shape
        if (image.width, image.height) != (width, height):
            raise LabelError(
                f"{self.source}: image {image.id} ({image.file_name}) has {image.width} columns and "
                f"{image.height} rows, the scan {scan.source} has {width} and {height}"
            )
        found = self._by_image.get(image.id, [])
        for annotation in found:
            if not scan.wraps and annotation.bbox[0] + annotation.bbox[2] > width + BORDER_PIXELS:
                raise self.error(annotation, f"{_text(annotation.bbox)} leaves the {width} columns")
        return tuple(found)

    def _check_unique(self, what: str, entries: Sequence[CocoImage | Category | Annotation]) -> None:
        seen: set[int] = set()
        for entry in entries:
            if entry.id in seen:
                raise LabelError(f"{self.source}: {what} {entry.id} is there twice")
            seen.add(entry.id)

    def _check_checks(self, annotation: Annotation) -> None:
        names = [check.name for check in annotation.checks]
        if len(set(names)) != len(names):
            raise self.error(annotation, "two of its checks have the same name")

    def _check_box(self, annotation: Annotation) -> None:
        image = self.images_by_id[annotation.image_id]
        for box in (annotation.bbox, annotation.region_bbox):
            if box is None:
                continue
            x, y, w, h = box
            if w <= 0 or h <= 0:
                raise self.error(annotation, f"{_text(box)} has no area")
            # The right side may lie beyond the last column: the grid may close a full turn.
            inside_x = -BORDER_PIXELS <= x < image.width and w <= image.width + BORDER_PIXELS
            inside_y = y >= -BORDER_PIXELS and y + h <= image.height + BORDER_PIXELS
            if not (inside_x and inside_y):
                size = f"{image.width} columns and {image.height} rows"
                raise self.error(annotation, f"{_text(box)} is not inside the image of {size}")

    @cached_property
    def _by_image(self) -> dict[int, list[Annotation]]:
        grouped = defaultdict(list)
        for annotation in self.annotations:
            grouped[annotation.image_id].append(annotation)
        return grouped

    @cached_property
    def _by_stem(self) -> dict[tuple[str, int], list[CocoImage]]:
        grouped = defaultdict(list)
        for image in self.images:
            grouped[_stem(image.file_name), image.scan].append(image)
        return grouped


def _path(file_name: str) -> Path:
    return Path(file_name.replace("\\", "/"))


def _stem(file_name: str) -> str:
    return stem(_path(file_name))


def _common_folders(a: str, b: str) -> int:
    """Return how many folders above the two files have the same names, from the file upwards."""
    pairs = zip(reversed(_path(a).parts[:-1]), reversed(_path(b).parts[:-1]), strict=False)
    count = 0
    for first, second in pairs:
        if first != second:
            break
        count += 1
    return count


def _text(box: Box) -> str:
    return f"box [{', '.join(f'{value:g}' for value in box)}]"
