"""Print what each way of cutting a scan into regions gives for the labelled objects of real scans.

    python tools/region_variants.py [DATA]

For every object: IoU of its region's rectangle with the hand-drawn one, and the share of the region
inside it (paper 2 asks for more than 0.9). The region is the one with the largest common area.
"""

import json
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from laserimg.boxes import iou
from laserimg.clusters import LINK, find_clusters, fixed_log, link_limits, standing_objects
from laserimg.evidence import Window
from laserimg.geometry.floor import Floor, find_floor
from laserimg.geometry.pitch import angular_pitch
from laserimg.lattice import connected, step_links
from laserimg.mixed_pixels import with_mixed_pixels
from laserimg.readers import open_scans
from laserimg.regions import MIN_PIXELS, Labels, Partition, reference_regions, regions_of
from laserimg.scan import BoolArray, Scan

SCENES = {
    "leica_ptx/1.ptx": ("leica_ptx/1.coco.json", ("car",)),
    "office_room/room_scan1.pcd": (
        "office_room/room_scan1.coco.json",
        ("wastebasket", "drum", "office_chair"),
    ),
}
Variant = Callable[[Scan, Floor | None], Labels]


def reference(step_m: float) -> Variant:
    """Constant step in metres, everything in one image."""
    return lambda scan, floor: reference_regions(scan, step_m).labels


def reference_without_floor(step_m: float) -> Variant:
    """Constant step, floor taken out."""

    def labels(scan: Scan, floor: Floor | None) -> Labels:
        return reference_regions(masked(scan, above_floor(scan, floor)), step_m).labels

    return labels


def angle_criterion(degrees: float) -> Variant:
    """Bogoslavskyi and Stachniss (2016): neighbours are linked if their connecting line is steep enough."""

    def labels(scan: Scan, floor: Floor | None) -> Labels:
        objects = above_floor(scan, floor)
        links = {}
        for offset, pitch in zip(((0, 1), (1, 0)), angular_pitch(scan), strict=True):
            second = np.roll(scan.range, [-o for o in offset], (0, 1))
            far, near = np.maximum(scan.range, second), np.minimum(scan.range, second)
            beta = np.arctan2(near * np.sin(pitch), far - near * np.cos(pitch))
            inside = objects & np.roll(objects, [-o for o in offset], (0, 1))
            if offset == (1, 0):
                inside[-1] = False
            elif not scan.wraps:
                inside[:, -1] = False
            links[offset] = inside & (beta > np.radians(degrees))
        return connected(objects, links, MIN_PIXELS)

    return labels


def linked_by_share(link: float, reach: int, walls: bool, mixed: bool) -> Variant:
    """Distance in 3D as a share of the range, to pixels up to `reach` away."""

    def labels(scan: Scan, floor: Floor | None) -> Labels:
        objects = standing_objects(scan, floor) if walls else above_floor(scan, floor)
        limits = {o: limit for o, limit in link_limits(scan.directions, link).items() if max(o) <= reach}
        found = connected(objects, step_links(fixed_log(scan.range), objects, limits, scan.wraps), MIN_PIXELS)
        if mixed:
            found, _ = with_mixed_pixels(found, scan.range, objects & (found == 0), scan.wraps)
        return found

    return labels


def default(scan: Scan, floor: Floor | None) -> Labels:
    """What the package does."""
    return find_clusters(scan, floor).labels


VARIANTS: dict[str, Variant] = {
    "reference, step 0.05 m": reference(0.05),
    "reference, step 0.05 m, no floor": reference_without_floor(0.05),
    "reference, step 0.15 m, no floor": reference_without_floor(0.15),
    "reference, step 0.40 m, no floor": reference_without_floor(0.40),
    "angle criterion 10 degrees, no floor": angle_criterion(10),
    "angle criterion 20 degrees, no floor": angle_criterion(20),
    "share 1/30, neighbours, no floor": linked_by_share(LINK, 1, walls=False, mixed=False),
    "share 1/30, reach 16, no floor": linked_by_share(LINK, 16, walls=False, mixed=False),
    "  and no large planes": linked_by_share(LINK, 16, walls=True, mixed=False),
    "  and mixed pixels given back = default": default,
    "share 1/45, else default": linked_by_share(1 / 45, 16, walls=True, mixed=True),
    "share 1/36, else default": linked_by_share(1 / 36, 16, walls=True, mixed=True),
    "share 1/26, else default": linked_by_share(1 / 26, 16, walls=True, mixed=True),
    "share 1/20, else default": linked_by_share(1 / 20, 16, walls=True, mixed=True),
}


def above_floor(scan: Scan, floor: Floor | None) -> BoolArray:
    """Valid returns that are not floor."""
    return scan.valid if floor is None else scan.valid & (floor.height_of(scan.points()) > floor.clearance_m)


def masked(scan: Scan, keep: BoolArray) -> Scan:
    """The scan with other returns taken away."""
    return replace(scan, range=np.where(keep, scan.range, 0), min_range=0.0)


def agreement(scan: Scan, labels: Labels, box: tuple) -> str:
    """IoU and share inside of the region with the largest common area, as text."""
    window = Window.of(box, scan.shape, scan.wraps)
    common = np.bincount(window.cut(labels).ravel(), minlength=int(labels.max()) + 1)
    common[0] = 0
    if common.max() == 0:
        return "  -   -  "
    number = int(common.argmax())
    region = regions_of(Partition(labels, scan.range, labels > 0), scan.wraps)[number - 1]
    overlap = iou([box], [region.box], scan.shape[1] if scan.wraps else None)[0, 0]
    return f"{overlap:.2f} {common[number] / len(region.pixels):.2f}"


def main(data: Path) -> None:
    """Print the table."""
    columns, rows = [], {name: [] for name in VARIANTS}
    for file, (truth, labels) in SCENES.items():
        (scan,) = open_scans(data / file)
        floor = find_floor(scan)
        coco = json.loads((data / truth).read_text())
        names = {entry["id"]: entry["name"] for entry in coco["categories"]}
        boxes = [(names[a["category_id"]], a["bbox"]) for a in coco["annotations"] if not a["iscrowd"]]
        boxes = [(name, box) for label in labels for name, box in boxes if name == label]
        columns += [name[:9] for name, _ in boxes]
        for name, variant in VARIANTS.items():
            found = variant(scan, floor)
            rows[name] += [agreement(scan, found, tuple(box)) for _, box in boxes]
    print(f"{'IoU, share inside':42}" + "  ".join(f"{column:9}" for column in columns))
    for name, cells in rows.items():
        print(f"{name:42}" + "  ".join(f"{cell:9}" for cell in cells))


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "../shared/data"))
