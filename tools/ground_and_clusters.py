"""Ground removal and RBNN on labelled real scans, and their time beside that of DBSCAN.

    python tools/ground_and_clusters.py
    python tools/ground_and_clusters.py --ratio 0.02 --clearance 0.3
    python tools/ground_and_clusters.py --speed
    python tools/ground_and_clusters.py --simulated 6

Ground: IoU against the labels within 30 m, points without a label left out; with vegetation counted as
"not ground", and with vegetation left out as Patchwork++ does. Objects: of labelled cars and people with at
least 50 points, the share that is one cluster of its own: a cluster has at least 80 % of the
object's points over the ground, and at least 80 % of the cluster lies in the object's box, grown by 0.2 m.
"""

import argparse
import contextlib
import os
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from laserimg.clusters import LINK
from laserimg.formats.boxes3d import Box3D, labels_beside
from laserimg.ground import CLEARANCE_M, ground_of_points, ground_of_scan
from laserimg.object_clusters import object_clusters
from laserimg.rbnn import rbnn
from laserimg.readers import read_file
from laserimg.scan import Scan
from laserimg.semantic_map.segments import segments_of

DATA = Path(os.environ.get("LASERIMG_DATA", Path(__file__).parents[2] / "shared" / "data"))
NEAR_M = 30.0
RELLIS_RECORD = [
    ("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("intensity", "<f4"), ("t", "<u4"), ("reflectivity", "<u2"),
    ("ring", "u1"), ("noise", "<u2"), ("range", "<u4"),
]  # fmt: skip
SETS = {
    "sustech": "sustech/data/example/lidar/*.pcd",
    "argoverse": "argoverse2/*/sensors/lidar/*.feather",
    "kitti": "kitti/training/velodyne/*.bin",
}
KINDS = {
    **dict.fromkeys(("pedestrian", "rider", "cyclist", "person_sitting"), "person"),
    **dict.fromkeys(("car", "van", "regular_vehicle"), "car"),
}
CARRIER_M = 0.5
FEWEST = 10


def semantickitti() -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return points, whether labelled, whether ground, whether vegetation."""
    points = np.fromfile(DATA / "semantickitti/000000.bin", "<f4").reshape(-1, 4)[:, :3].astype(float)
    label = np.fromfile(DATA / "semantickitti/000000.label", "<u4") & 0xFFFF
    return points, label > 0, np.isin(label, (40, 44, 48, 49, 72)), label == 70


def rellis() -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return points farther than the carrier, whether labelled, whether ground, whether vegetation."""
    data = next((DATA / "rellis").glob("*.ply")).read_bytes()
    records = np.frombuffer(data, RELLIS_RECORD, offset=data.index(b"end_header\n") + 11)
    label = np.fromfile(next((DATA / "rellis").glob("*.label")), "<u4") & 0xFFFF
    points = np.stack([records[axis] for axis in "xyz"], axis=-1).astype(float)
    seen = np.linalg.norm(points, axis=1) > 2.5
    points, label = points[seen], label[seen]
    return points, label > 0, np.isin(label, (1, 3, 6, 10, 23, 31, 33)), np.isin(label, (4, 19))


def iou(found: np.ndarray, truth: np.ndarray) -> float:
    """Return the intersection of two masks over their union."""
    return float((found & truth).sum() / (found | truth).sum())


def print_ground() -> None:
    """Print the table of ground removal."""
    print(f"{'ground':16}{'method':10}{'IoU':8}{'IoU without vegetation':24}{'points':10}ms")
    for name, read in (("semantickitti", semantickitti), ("rellis", rellis)):
        points, labelled, truth, green = read()
        near = labelled & (np.linalg.norm(points, axis=1) < NEAR_M)
        scan = next(iter(read_file(DATA / "semantickitti/000000.bin"))) if name == "semantickitti" else None
        scan = Scan.from_points(points, shape=(64, 2048)) if scan is None else scan
        for method in ("points", "image"):
            start = time.perf_counter()
            ground = ground_of_points(points) if method == "points" else ground_of_scan(scan)
            taken = (time.perf_counter() - start) * 1000
            assert ground is not None
            mask = ground.mask if method == "points" else of_points(scan, ground.mask, points)
            both = iou(mask[near], truth[near]), iou(mask[near & ~green], truth[near & ~green])
            print(f"{name:16}{method:10}{both[0]:<8.4f}{both[1]:<24.4f}{near.sum():<10}{taken:.0f}")


def of_points(scan: Scan, mask: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return a mask of pixels for points: that of the nearest return."""
    from scipy.spatial import KDTree

    return mask[scan.valid][KDTree(scan.points()[scan.valid]).query(points)[1]]


def labelled_scans() -> Iterator[tuple[str, Scan, tuple[Box3D, ...]]]:
    """Yield the set, the scan and the boxes in the scanner's frame; each lidar of a vehicle is a scan."""
    for name, pattern in SETS.items():
        for file in sorted(DATA.glob(pattern)):
            boxes = labels_beside(file).boxes
            for scan in read_file(file):
                yield name, scan, tuple(in_frame_of(scan, box) for box in boxes)


def in_frame_of(scan: Scan, box: Box3D) -> Box3D:
    """Return a box of the file's frame in the scanner's."""
    turn, at = scan.world_from_scan[:3, :3], scan.world_from_scan[:3, 3]
    return replace(box, centre=(box.centre - at) @ turn, axes=turn.T @ box.axes)


# The clusters of `laserimg map`: the lattice, 30 returns or more.
OF_MAP = "laserimg map"

Way = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]


def ways_of(ratio: float) -> dict[str, Way]:
    """Return the ways to cluster points, given with their heights over the ground and the vertical."""
    return {
        f"RBNN {ratio:.4f}": lambda points, _, up: rbnn(points, ratio, FEWEST),
        f"RBNN {0.6 * ratio:.4f}": lambda points, _, up: rbnn(points, 0.6 * ratio, FEWEST),
        f"height / 5, {ratio:.4f}": lambda points, _, up: rbnn(
            points - np.outer(points @ up, 0.8 * up), ratio, FEWEST
        ),
        "object clusters": lambda points, height, up: object_clusters(points, height, up, ratio, FEWEST),
    }


def print_objects(ratio: float, clearance_m: float) -> None:
    """Print the share of labelled objects that are one cluster of their own, and why the others are not."""
    ways = ways_of(ratio)
    tables = {way: Counter() for way in (*ways, OF_MAP)}
    for name, scan, boxes in labelled_scans():
        kept = scan.valid & (scan.range > CARRIER_M)
        points = scan.points()[kept].astype(float)
        ground = ground_of_points(points, scan.up, clearance_m)
        if ground is None:
            print(f"{scan.source}: no ground")
            continue
        points, height = points[~ground.mask], ground.height[~ground.mask]
        found = {way: clusters(points, height, scan.up) for way, clusters in ways.items()}
        found[OF_MAP] = segments_of(scan).labels[kept][~ground.mask]
        for box in boxes:
            own, grown = box.holds(points, 0.05), box.holds(points, 0.2)
            for way, labels in found.items():
                tables[way].update(verdict(labels, own, grown, KINDS.get(box.kind), name))
    print_table(tables, ("person", "car"), SETS)


def print_simulated(ratio: float, clearance_m: float, count: int) -> None:
    """Print the same for the things of simulated streets, seen by 64 turning beams."""
    from laserimg.simulate.measure import simulated
    from laserimg.simulate.scanner import SCANNERS
    from laserimg.simulate.scenes import SCENES

    ways = ways_of(ratio)
    tables = {way: Counter() for way in ways}
    for seed in range(count):
        scene = SCENES["street"](np.random.default_rng(200 + seed))
        seen = simulated(scene, 0, SCANNERS["spinning64"], seed)
        returned = seen.scan.valid & (seen.scan.range > CARRIER_M)
        points, thing = seen.scan.points()[returned].astype(float), seen.thing[returned]
        ground = ground_of_points(points, seen.scan.up, clearance_m)
        assert ground is not None
        points, height, thing = points[~ground.mask], ground.height[~ground.mask], thing[~ground.mask]
        for way, clusters in ways.items():
            labels = clusters(points, height, seen.scan.up)
            for number, label in enumerate(one.label for one in scene.things):
                own = thing == number
                tables[way].update(verdict(labels, own, own, label or "other", "streets"))
    kinds = {key[0] for table in tables.values() for key in table}
    print_table(tables, sorted(kinds), ("streets",))


def verdict(
    labels: np.ndarray, own: np.ndarray, grown: np.ndarray, kind: str | None, name: str
) -> Iterator[tuple[str, ...]]:
    """Yield what to count of an object: that it is seen, is one cluster, is split, is merged with others."""
    if kind is None or own.sum() < 50:
        return
    cluster = int(np.bincount(labels[own]).argmax())
    yield kind, name, "seen"
    whole = cluster > 0 and (labels[own] == cluster).mean() >= 0.8
    pure = cluster > 0 and grown[labels == cluster].mean() >= 0.8
    if whole and pure:
        yield kind, name, "one"
    if not whole:
        yield kind, "split"
    if whole and not pure:
        yield kind, "merged"


def print_table(tables: dict[str, Counter], kinds: Iterable[str], names: Iterable[str]) -> None:
    """Print how many objects of each kind are one cluster of their own."""
    print(
        f"\n{'clusters':20}{'kind':12}" + "".join(f"{name:16}" for name in [*names, "all"]) + "split   merged"
    )
    for kind in kinds:
        for way, table in tables.items():
            cells = [(table[kind, name, "one"], table[kind, name, "seen"]) for name in names]
            cells.append((sum(one for one, _ in cells), sum(seen for _, seen in cells)))
            texts = "".join(f"{one} of {seen}".ljust(16) for one, seen in cells)
            print(f"{way:20}{kind:12}{texts}{table[kind, 'split']:<8}{table[kind, 'merged']}")


def print_speed(ratio: float) -> None:
    """Print the time of RBNN and of DBSCAN, of what is installed, in one run."""
    frames = [DATA / "semantickitti/000000.bin", *sorted((DATA / "kitti/training/velodyne").glob("*.bin"))]
    points = np.concatenate([np.fromfile(frame, "<f4").reshape(-1, 4)[:, :3] for frame in frames])
    points = points[:230_000].astype(float)
    ours = seconds(lambda: rbnn(points, ratio, 10))
    print(f"{len(points)} points: RBNN {ours:.2f} s")
    with contextlib.suppress(ImportError):
        from sklearn.cluster import DBSCAN

        machine = DBSCAN(eps=0.4, min_samples=1)
        theirs = seconds(lambda: machine.fit(np.unique(np.floor(points / 0.15), axis=0) * 0.15))
        print(f"scikit-learn DBSCAN on 15 cm voxels {theirs:.2f} s, {theirs / ours:.1f} x")
    with contextlib.suppress(ImportError):
        import open3d

        cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(points))
        theirs = seconds(lambda: cloud.voxel_down_sample(0.05).cluster_dbscan(0.4, 1))
        print(f"Open3D DBSCAN after a 5 cm voxel grid {theirs:.2f} s, {theirs / ours:.1f} x")


def seconds(run: Callable[[], object], repeats: int = 3) -> float:
    """Return the shortest time of a few runs."""
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        run()
        times.append(time.perf_counter() - start)
    return min(times)


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--ratio", type=float, default=LINK)
    parser.add_argument("--clearance", type=float, default=CLEARANCE_M)
    parser.add_argument("--speed", action="store_true")
    parser.add_argument("--simulated", type=int, metavar="COUNT", help="streets in place of real scans")
    arguments = parser.parse_args()
    if arguments.speed:
        print_speed(arguments.ratio)
        return
    if arguments.simulated:
        print_simulated(arguments.ratio, arguments.clearance, arguments.simulated)
        return
    print_ground()
    print_objects(arguments.ratio, arguments.clearance)


if __name__ == "__main__":
    main()
