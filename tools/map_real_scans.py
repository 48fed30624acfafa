"""What the shipped map classifiers say on labelled real scans, from which they have not learnt.

    python tools/map_real_scans.py
    python tools/map_real_scans.py --model objects.npz

A cluster counts if half of its returns are labelled, and has the class that holds 85 % of these. Clusters
of other things (fences, bicycles, lorries) are printed, but not counted. Labels: those of single points in
SemanticKITTI and RELLIS-3D, boxes of cars and people in SUSTech, Argoverse 2 and KITTI.
"""

import argparse
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from ground_and_clusters import DATA, KINDS, RELLIS_RECORD
from ground_and_clusters import labelled_scans as boxed_scans
from laserimg.classify.scores import wilson
from laserimg.formats.boxes3d import Box3D
from laserimg.readers import read_file
from laserimg.scan import Scan
from laserimg.semantic_map import MapModels, map_scan

CLASSES = ("building", "car", "person", "pole", "tree")
# Not labelled, and labelled as something that no cluster should be.
NONE, OTHER = "", "other"
SEMANTICKITTI = {
    10: "car", 252: "car", 30: "person", 31: "person", 254: "person", 50: "building", 70: "tree", 71: "tree",
    80: "pole", 81: "pole", 0: NONE,
}  # fmt: skip
RELLIS = {4: "tree", 19: "tree", 17: "person", 5: "pole", 8: "car", 12: "building", 0: NONE}
PURE, LABELLED = 0.85, 0.5


def labelled_scans() -> Iterator[tuple[str, Scan, NDArray]]:
    """Yield the set, the scan, and the class (H, W) of its returns."""
    file = DATA / "semantickitti/000000.bin"
    points = np.fromfile(file, "<f4").reshape(-1, 4)[:, :3]
    codes = np.fromfile(file.with_suffix(".label"), "<u4") & 0xFFFF
    scan = next(iter(read_file(file)))
    yield "SemanticKITTI", scan, of_pixels(scan, points, codes, SEMANTICKITTI)
    file = next((DATA / "rellis").glob("*.ply"))
    data = file.read_bytes()
    records = np.frombuffer(data, RELLIS_RECORD, offset=data.index(b"end_header\n") + 11)
    codes = np.fromfile(next((DATA / "rellis").glob("*.label")), "<u4") & 0xFFFF
    scan = next(iter(read_file(file))).with_limits(2.5)
    yield "RELLIS-3D", scan, of_pixels(scan, np.stack([records[a] for a in "xyz"], -1), codes, RELLIS)
    for name, scan, boxes in boxed_scans():
        yield name, scan, in_boxes(scan, boxes)


def of_pixels(scan: Scan, points: NDArray, codes: NDArray, names: Mapping[int, str]) -> NDArray:
    """Return the class of the nearest labelled point."""
    found = np.full(scan.shape, NONE, object)
    nearest = KDTree(points.astype(float)).query(scan.points()[scan.valid])[1]
    found[scan.valid] = [names.get(int(code), OTHER) for code in codes[nearest]]
    return found


def in_boxes(scan: Scan, boxes: Iterable[Box3D]) -> NDArray:
    """Return the class of the box that a return is in; outside of boxes nothing is known."""
    points = scan.points()[scan.valid].astype(float)
    own = np.full(len(points), NONE, object)
    for box in boxes:
        own[box.holds(points, 0.1)] = KINDS.get(box.kind, OTHER)
    found = np.full(scan.shape, NONE, object)
    found[scan.valid] = own
    return found


def class_of(names: NDArray) -> str:
    """Return the class of a cluster by the labels of its returns; "" if it has none."""
    known, count = np.unique(names[names != NONE].astype(str), return_counts=True)
    if count.sum() < LABELLED * len(names):
        return NONE
    return str(known[count.argmax()]) if count.max() >= PURE * count.sum() else "several"


def main() -> None:
    """Print a table for each set, and the total."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--model", type=Path, help="default: those that ship")
    parser.add_argument("--bare", action="store_true", help="leave the reflectance out")
    options = parser.parse_args()
    models = MapModels.load(options.model)
    tables: dict[str, Counter] = {}
    for name, scan, classes in labelled_scans():
        if options.bare:
            scan = Scan(
                scan.range, scan.directions, None, scan.world_from_scan, scan.wraps, min_range=scan.min_range
            )
        one = map_scan(scan, models)
        table = tables.setdefault(name, Counter())
        for cluster, region in zip(one.clusters, one.segments.clusters, strict=True):
            table[class_of(classes.ravel()[region.pixels]), cluster.label] += 1
    right = total = 0
    for name, table in tables.items():
        for truth in sorted({truth for truth, _ in table} - {NONE}):
            row = {label: count for (own, label), count in table.items() if own == truth}
            print(f"{name:14}{truth:10}{sum(row.values()):5}  {row}")
            if truth in CLASSES:
                right, total = right + row.get(truth, 0), total + sum(row.values())
    low, high = wilson(right, total)
    print(f"{right} of {total} clusters right: {right / total:.3f} ({low:.3f} to {high:.3f})")


if __name__ == "__main__":
    main()
