"""Ground removal and RBNN on labelled real scans, and their time beside that of DBSCAN.

    python tools/ground_and_clusters.py
    python tools/ground_and_clusters.py --ratio 0.02 --clearance 0.3
    python tools/ground_and_clusters.py --speed

Ground: IoU against the labels within 30 m, points without a label left out; with vegetation counted as
"not ground", and with vegetation left out as Patchwork++ does. Objects: of labelled cars and people with at
least 50 points, the share that is one cluster of its own: a cluster has at least 80 % of the
object's points over the ground, and at least 80 % of the cluster lies in the object's box, grown by 0.2 m.
"""

import argparse
import contextlib
import json
import os
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from laserimg.clusters import LINK
from laserimg.ground import CLEARANCE_M, ground_of_points, ground_of_scan
from laserimg.rbnn import rbnn
from laserimg.readers import read_file
from laserimg.scan import Scan

DATA = Path(os.environ.get("LASERIMG_DATA", Path(__file__).parents[2] / "shared" / "data"))
NEAR_M = 30.0
RELLIS_RECORD = [
    ("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("intensity", "<f4"), ("t", "<u4"), ("reflectivity", "<u2"),
    ("ring", "u1"), ("noise", "<u2"), ("range", "<u4"),
]  # fmt: skip
SUSTECH_RECORD = np.dtype(
    {"names": ["x", "y", "z"], "formats": ["<f4"] * 3, "offsets": [0, 4, 8], "itemsize": 48}
)
PEOPLE = ("Pedestrian", "Rider")


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


def sustech() -> Iterator[tuple[np.ndarray, list[dict]]]:
    """Yield the points and the labelled boxes of every scan."""
    folder = DATA / "sustech/data/example"
    for file in sorted((folder / "lidar").glob("*.pcd")):
        data = file.read_bytes()
        count = int(data.split(b"\nPOINTS ")[1].split()[0])
        start = data.index(b"\n", data.index(b"\nDATA ") + 1) + 1
        records = np.frombuffer(data, SUSTECH_RECORD, count=count, offset=start)
        points = np.stack([records[axis] for axis in "xyz"], axis=-1).astype(float)
        points = points[np.isfinite(points).all(axis=1) & (np.linalg.norm(points, axis=1) > 0.5)]
        yield points, json.loads((folder / "label" / f"{file.stem}.json").read_text())


def inside(points: np.ndarray, box: dict, grown: float) -> np.ndarray:
    """Return which points are in a labelled box, grown by some metres."""
    at, size, turn = (np.array([box["psr"][k][a] for a in "xyz"]) for k in ("position", "scale", "rotation"))
    local = (points - at) @ Rotation.from_euler("XYZ", turn).as_matrix()
    return (np.abs(local) <= size / 2 + grown).all(axis=1)


def print_objects(ratio: float, clearance_m: float, least: int = 50) -> None:
    """Print the share of labelled objects that are one cluster of their own."""
    found: dict[str, list[bool]] = {"car": [], "person": []}
    for points, boxes in sustech():
        ground = ground_of_points(points, clearance_m=clearance_m)
        objects = points if ground is None else points[~ground.mask]
        labels = rbnn(objects, ratio, 10)
        for box in boxes:
            kind = "person" if box["obj_type"] in PEOPLE else "car" if box["obj_type"] == "Car" else None
            own = labels[inside(objects, box, 0.05)]
            if kind is None or len(own) < least:
                continue
            cluster = int(np.bincount(own).argmax())
            of_cluster = inside(objects[labels == cluster], box, 0.2)
            one = cluster > 0 and (own == cluster).mean() >= 0.8 and of_cluster.mean() >= 0.8
            found[kind].append(bool(one))
    for kind, each in found.items():
        print(f"sustech {kind}: {sum(each)} of {len(each)} are one cluster of their own")


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
    arguments = parser.parse_args()
    if arguments.speed:
        print_speed(arguments.ratio)
        return
    print_ground()
    print_objects(arguments.ratio, arguments.clearance)


if __name__ == "__main__":
    main()
