"""Sets of simulated scans with their truth: the scan of a number depends on it and the seed alone."""

from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Protocol
from zlib import crc32

import numpy as np

from laserimg.errors import ConfigError, LaserImgError
from laserimg.files import make_folder, sources_sha256, write_text
from laserimg.formats.coco import Annotation, Category, CocoFile, CocoImage
from laserimg.formats.coco_file import read_coco, write_coco
from laserimg.formats.npz import write_npz
from laserimg.formats.toml import unknown_name
from laserimg.simulate.labels import truth_boxes
from laserimg.simulate.measure import simulated
from laserimg.simulate.objects import OBJECTS
from laserimg.simulate.scanner import SCANNERS
from laserimg.simulate.scenes import SCENES
from laserimg.simulate.things import Thing
from laserimg.workers import unordered

# The classes of a set, with the same numbers in every set.
LABELS = (
    "building", "car", "door", "person", "pole", "tree", "window", "office_chair", "stairs", "wastebasket",
    "bench", "bicycle", "bollard", "fence", "hedge", "litter_bin", "lorry", "low_wall",
)  # fmt: skip
TRUTH = "truth.coco.json"
# Holds the digest of the simulator that made the scans of a folder.
MARK = "simulator.sha256"


class Extra(Protocol):
    """A maker of things that come into every scene; workers are sent it."""

    @property
    def label(self) -> str:
        """The class its things have in the truth."""
        ...

    @property
    def tag(self) -> str:
        """Tells files made with it from others."""
        ...

    def __call__(self, rng: np.random.Generator) -> Thing:
        """Return one of them."""
        ...


@dataclass(frozen=True, slots=True)
class Known:
    """More of the package's own things.

    Parameters
    ----------
    kind : str
        Name in `OBJECTS`.
    label : str
    """

    kind: str
    label: str

    @property
    def tag(self) -> str:
        """Tells files made with it from others."""
        return self.kind

    def __call__(self, rng: np.random.Generator) -> Thing:
        """Return one of them."""
        return OBJECTS[self.kind](rng)


def known(kind: str) -> Known:
    """Return a maker of more of the package's own things.

    Raises
    ------
    ConfigError
        If there are none of this name.
    """
    if kind not in OBJECTS:
        raise ConfigError(unknown_name(kind, OBJECTS, "thing"))
    return Known(kind, OBJECTS[kind](np.random.default_rng(0)).label)


@dataclass(frozen=True, slots=True)
class SetPlan:
    """Which scans to make.

    Parameters
    ----------
    scene, scanner : str
        Names in `SCENES` and `SCANNERS`.
    seed : int
    out : Path
    extras : tuple of Extra
        Makers of things that come into every scene.
    """

    scene: str
    scanner: str
    seed: int
    out: Path
    extras: tuple[Extra, ...] = ()

    @property
    def categories(self) -> dict[str, int]:
        """Numbers of the classes: those of every set, then the new ones of the extras."""
        labels = dict.fromkeys([*LABELS, *(extra.label for extra in self.extras if extra.label)])
        return {label: number for number, label in enumerate(labels, 1)}

    def name(self, number: int) -> str:
        """Return the file name of a scan; it tells scans of other plans apart."""
        tag = "".join(f"-{extra.tag}" for extra in self.extras)
        return f"{self.scene}-{self.scanner}-{self.seed}{tag}-{number:05d}.npz"

    def entropy(self, number: int) -> tuple[int, ...]:
        """Return what the scene of a scan is drawn from: no two plans share their streets and rooms."""
        things = [f"{extra.tag}:{extra.label}" for extra in self.extras]
        return self.seed, number, crc32("/".join([self.scene, self.scanner, *things]).encode())

    def truth(self, number: int) -> Path:
        """Return where the truth of one scan is kept until the set is whole."""
        return self.out / "truth" / f"{self.name(number)}.json"


def make_scans(plan: SetPlan, count: int, jobs: int = 1) -> Iterator[int]:
    """Make the scans of a set that are not there yet; yield the number of each as it is finished.

    Raises
    ------
    ConfigError
        If the folder holds scans of another version of the simulator.
    MissingExtraError
        Without Embree.
    LaserImgError
        If the process that made a scan was killed.
    """
    _mark(plan.out)
    missing = []
    for number in range(count):
        if plan.truth(number).exists() and (plan.out / plan.name(number)).exists():
            yield number
        else:
            missing.append(number)
    yield from unordered(partial(_make_scan, plan), missing, min(jobs, max(len(missing), 1)), _died)


def _mark(folder: Path) -> None:
    """Mark a folder as this simulator's; other versions make other scans of the same seed."""
    mark, mine = folder / MARK, sources_sha256(Path(__file__).parent)
    if mark.is_file() and mark.read_text(encoding="utf-8") == mine:
        return
    if (folder / "truth").is_dir():
        raise ConfigError(
            f"{folder}: holds scans of another version of the simulator; remove it, or name another folder"
        )
    make_folder(folder)
    write_text(mark, mine)


def _make_scan(plan: SetPlan, number: int) -> int:
    scenes, noise = np.random.SeedSequence(plan.entropy(number)).spawn(2)
    scene, scanner = SCENES[plan.scene](np.random.default_rng(scenes), plan.extras), SCANNERS[plan.scanner]
    seen = simulated(scene, 0, scanner, noise)
    height, width = seen.scan.shape
    boxes = truth_boxes(scene, seen, scanner, plan.categories, image_id=1, first_id=1)
    image = CocoImage(1, plan.name(number), width, height)
    write_npz(seen.scan, plan.out / plan.name(number))
    write_coco(plan.truth(number), CocoFile((image,), _categories(plan), tuple(boxes)))
    return number


def _died(number: int) -> int:
    raise LaserImgError(f"the process that made scan {number} was killed; fewer --jobs need less memory")


def write_truth(folder: Path) -> CocoFile:
    """Write the truth of all scans in a folder, of whatever plans, beside them, and return it."""
    parts = [read_coco(path) for path in sorted((folder / "truth").glob("*.json"))]
    parts = [one for one in parts if (folder / one.images[0].file_name).exists()]
    names = [*LABELS, *(category.name for one in parts for category in one.categories)]
    numbers = {label: number for number, label in enumerate(dict.fromkeys(names), 1)}
    images: list[CocoImage] = []
    boxes: list[Annotation] = []
    for number, one in enumerate(parts, 1):
        images.append(replace(one.images[0], id=number))
        for box in one.annotations:
            category = numbers[one.labels[box.category_id]]
            boxes.append(replace(box, id=len(boxes) + 1, image_id=number, category_id=category))
    categories = tuple(Category(number, label) for label, number in numbers.items())
    coco = CocoFile(tuple(images), categories, tuple(boxes), source=str(folder / TRUTH))
    write_coco(folder / TRUTH, coco)
    return coco


def is_shown(truth: CocoFile, label: str, scans: Collection[str]) -> bool:
    """Return whether any of the scans, by file name, has a labelled object of that class."""
    images = {image.id for image in truth.images if image.file_name in scans}
    return any(truth.labels[box.category_id] == label and box.image_id in images for box in truth.annotations)


def _categories(plan: SetPlan) -> tuple[Category, ...]:
    return tuple(Category(number, label) for label, number in plan.categories.items())
