"""The labelled real scans that `tools/real_scans.py` measures on, each with its truth."""

import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from laserimg.formats.boxes3d import labels_beside
from laserimg.formats.coco import Annotation, CocoFile, CocoImage
from laserimg.formats.coco_file import read_coco
from laserimg.readers import find_files, read_file
from laserimg.scan import Scan
from laserimg.truth import CATEGORIES, truth_of

DATA = Path(os.environ.get("LASERIMG_DATA", Path(__file__).parents[2] / "shared" / "data"))
# Class and box of every object; ``iscrowd`` where nothing is asked.
Truth = list[tuple[str, Annotation]]
# The lowest overlap of a hit: boxes drawn by hand, and bounding rectangles of 3D boxes.
DRAWN_IOU, BOXES_IOU = 0.4, 0.3


@dataclass(frozen=True, eq=False)
class RealSet:
    """Scans of one kind, and what is labelled in them.

    Parameters
    ----------
    name : str
    files : str
        File, folder or glob below the data folder.
    drawn : str or None
        COCO file of boxes drawn by hand; None for the 3D boxes beside the scans.
    labels : mapping of str to str
        The file's names of classes, and ours; "~door" is neither a hit nor a false positive as a door.
    empty : tuple of str
        Classes of which there is none in these scans.
    min_points : tuple of int
        Objects with fewer returns are to be ignored (3D boxes); one measurement for each.
    near_m : float
        False positives farther away are counted apart.
    note : str
        What is known to be missing in the labels.
    rules : mapping of str to str
        Changes to the default rules, as `laserimg rules set` takes them.
    """

    name: str
    files: str
    drawn: str | None = None
    labels: Mapping[str, str] = field(default_factory=dict)
    empty: tuple[str, ...] = ()
    min_points: tuple[int, ...] = (1,)
    near_m: float = float("inf")
    note: str = ""
    rules: Mapping[str, str] = field(default_factory=dict)

    @property
    def min_iou(self) -> float:
        """The lowest overlap of a hit."""
        return DRAWN_IOU if self.drawn or self.empty else BOXES_IOU

    @property
    def classes(self) -> tuple[str, ...]:
        """Classes of which every object is labelled, or known to be absent."""
        if self.empty:
            return self.empty
        if self.drawn is None:
            return tuple(category.name for category in CATEGORIES)
        return tuple(dict.fromkeys(ours for ours in self.labels.values() if not ours.startswith("~")))

    def scans(self) -> Iterator[tuple[Scan, list[Truth]]]:
        """Yield every scan with its truth, for each of `min_points`."""
        for file in find_files([DATA / self.files]):
            for scan in read_file(file):
                yield scan, [self._truth(scan, file, least) for least in self.min_points]

    def _truth(self, scan: Scan, file: Path, least: int) -> Truth:
        if self.empty:
            return []
        if self.drawn is not None:
            return self._drawn(read_coco(DATA / self.drawn), scan)
        height, width = scan.shape
        image = CocoImage(1, file.name, width, height, scan.index)
        found = truth_of(scan, labels_beside(file), image, min_points=least)
        names = {category.id: category.name for category in CATEGORIES}
        return [(names[entry.category_id], entry) for entry in found]

    def _drawn(self, coco: CocoFile, scan: Scan) -> Truth:
        found = []
        for entry in coco.annotations_of(scan, only=True):
            ours = self.labels.get(coco.labels[entry.category_id], "")
            if ours.startswith("~"):
                found.append((ours[1:], replace(entry, iscrowd=1)))
            elif ours:
                found.append((ours, entry))
        return found


ROOM = {"wastebasket": "wastebasket", "office_chair": "office_chair"}
# A garage door is a door of another kind: neither a hit nor a false positive.
CROSSING = {
    "litter_bin": "wastebasket", "car": "car", "door": "door", "garage_door": "~door", "person": "person",
    "pole": "pole", "window": "window",
}  # fmt: skip
OFFICE, STAIRS, CARS = "office_room/room_scan1", "staircase/scan", "leica_ptx/1"
INDOORS_M = 4.5
POINTS = (200, 50)

SETS = (
    RealSet("office_room", f"{OFFICE}.pcd", f"{OFFICE}.coco.json", ROOM, near_m=INDOORS_M),
    RealSet("corridor", "corridor_lms200", empty=("wastebasket", "office_chair"), near_m=INDOORS_M),
    RealSet("staircase", f"{STAIRS}.dat.bz2", f"{STAIRS}.coco.json", {"stairs": "stairs"}, near_m=INDOORS_M),
    RealSet("leica_ptx", f"{CARS}.ptx", f"{CARS}.coco.json", {"car": "car"}),
    RealSet(
        "ouster_crossing",
        "ouster/ouster_os1_128_crossing.npz",
        "ouster/os1_crossing.coco.json",
        CROSSING,
        note="far cars and people have no box: their detections count as false",
        rules={"wastebasket.height.max": "1.2"},
    ),
    RealSet(
        "sustech",
        "sustech/data/example/lidar",
        min_points=POINTS,
        note="3 cars nearer than 15 m (000950, 000965) have no box: their detections count as false",
    ),
    RealSet("argoverse2", "argoverse2", min_points=POINTS),
    RealSet("kitti", "kitti/training/velodyne", min_points=POINTS),
)
