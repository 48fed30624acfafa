"""Speed and accuracy on the benchmark scenes, each beside a named peer in the same run.

    python tools/benchmark.py                      # all sections
    python tools/benchmark.py images normals       # some

Times are the best of 5 after a warm-up, ours and the peer's in turn: their ratio is what counts,
milliseconds on a busy machine do not. Peers that are not installed are named as such
(``pip install "laserimg[bench]"``). A section is a function that yields rows; to add one, write it and
list it in `SECTIONS`.
"""

import argparse
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import cv2
import numpy as np
from numpy.typing import NDArray

import scenes
from detector_rows import detector_rows, scale_rows
from laserimg.clusters import find_clusters
from laserimg.formats.npz import write_npz
from laserimg.geometry.floor import Floor, find_floor
from laserimg.images import IMAGE_KINDS, make_images, write_png
from laserimg.measure import metric_box
from laserimg.normals import normals
from laserimg.rbnn import rbnn
from laserimg.regions import reference_regions, regions_of
from laserimg.rules.checks import size_rules
from laserimg.rules.file import load_rules
from laserimg.rules.model import Rules
from laserimg.scan import Scan
from laserimg.semantic_map import MapModels, SemanticMap, map_scan
from laserimg.semantic_map.panorama import panorama
from laserimg.semantic_map.run import write_map
from rows import TITLES, Row, count_cpu_time, error, faster, under, within
from scenes import COLUMNS, ROWS, Truth, room, scan_of, street

COMPONENTS = "cv2.connectedComponents"
SET_SIZE = 100
CLUSTERED = 230_000


@cache
def benchmark_room() -> tuple[Scan, Truth]:
    """The room of 760 x 1135 rays with 1 cm noise."""
    return scan_of(room())


@cache
def benchmark_street() -> tuple[Scan, Truth]:
    """The street of 760 x 1135 rays with 1 cm noise."""
    return scan_of(street())


KNN_30 = "Open3D estimate_normals KNN 30"


def _open3d_normals(scan: Scan) -> Callable[[], NDArray] | None:
    """Open3D's normals of the same points, turned to the scanner; None when it is not installed."""
    try:
        import open3d
    except ImportError:
        return None
    points = scan.points()[scan.range > 0].astype(np.float64)
    cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(points))
    search = open3d.geometry.KDTreeSearchParamKNN(30)

    def estimate() -> NDArray:
        cloud.estimate_normals(search)
        return np.asarray(cloud.normals)

    return estimate


def images_section() -> Iterator[Row]:
    """All images of a scan against what the normals alone cost there."""
    scan, _ = benchmark_room()
    peer = _open3d_normals(scan)
    yield faster(
        f"all {len(IMAGE_KINDS)} images, 760x1135", lambda: make_images(scan), KNN_30, peer, at_least=25
    )
    yield faster("normals alone", lambda: normals(scan), KNN_30, peer)
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    yield faster("all images on one thread", lambda: make_images(scan), KNN_30, peer)
    cv2.setNumThreads(threads)


def normals_section() -> Iterator[Row]:
    """Angular errors against exact truth."""
    for name, (scan, truth), wanted in (
        ("room", benchmark_room(), (1.2, 5.5)),
        ("street", benchmark_street(), (1.2, 5.5)),
    ):
        returned = scan.range > 0
        found = normals(scan)
        peer = _open3d_normals(scan)
        theirs = (
            None
            if peer is None
            else _turned(np.where(returned[..., None], _spread(peer(), returned), 0), scan)
        )
        planes, edge = truth.planar & ~truth.edge & returned, truth.edge & returned
        for what, mask, limit in (("planes", planes, wanted[0]), ("edges", edge, wanted[1])):
            ours = np.median(_degrees(found, truth.normals)[mask])
            other = None if theirs is None else float(np.median(_degrees(theirs, truth.normals)[mask]))
            yield error(f"{name}: median error on {what}", float(ours), KNN_30, other, limit)
        lengths = np.linalg.norm(found, axis=-1)
        without = int((lengths[returned] < 0.99).sum())
        yield Row(f"{name}: returns without a normal", str(without), "", "", "", "0", without == 0)


def regions_section() -> Iterator[Row]:
    """Partitions and metric boxes against the connected components of a mask, on one thread."""
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    for name, (scan, _) in (("room", benchmark_room()), ("street", benchmark_street())):
        mask = scan.valid.view(np.uint8)
        floor = find_floor(scan)
        regions = regions_of(find_clusters(scan, floor), scan.wraps)
        rules = load_rules()

        def components(mask: NDArray = mask) -> object:
            return cv2.connectedComponents(mask, connectivity=4)

        def measured(
            scan: Scan = scan, floor: Floor | None = floor, regions: list = regions, rules: Rules = rules
        ) -> list:
            boxes = [metric_box(scan, region, floor) for region in regions]
            return [size_rules(box, one) for box in boxes for one in rules]

        yield within(
            f"{name}: reference regions", lambda s=scan: reference_regions(s), COMPONENTS, components, 3
        )
        yield within(
            f"{name}: default regions",
            lambda s=scan, f=floor: find_clusters(s, f),
            COMPONENTS,
            components,
            12,
        )
        yield under(f"{name}: boxes and rules of {len(regions)} regions", measured, 0.020)
        yield under(f"{name}: floor", lambda s=scan: find_floor(s), None)
    cv2.setNumThreads(threads)


def clusters_section() -> Iterator[Row]:
    """RBNN of 230,000 points of the street against DBSCAN of fewer, of the voxels the points lie in."""
    scan, _ = benchmark_street()
    points = scan.points()[scan.valid].astype(np.float64)
    points = points[np.linspace(0, len(points) - 1, CLUSTERED).astype(int)]
    what = f"RBNN of {len(points)} points"
    yield faster(what, lambda: rbnn(points), "Open3D DBSCAN, 5 cm voxels", _open3d_dbscan(points), 10)
    yield faster(what, lambda: rbnn(points), "sklearn DBSCAN, 15 cm voxels", _sklearn_dbscan(points), 3)


def _open3d_dbscan(points: NDArray) -> Callable[[], object] | None:
    try:
        import open3d
    except ImportError:
        return None
    cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(points))
    return lambda: cloud.voxel_down_sample(0.05).cluster_dbscan(0.4, 1)


def _sklearn_dbscan(points: NDArray) -> Callable[[], object]:
    from sklearn.cluster import DBSCAN

    return lambda: DBSCAN(0.4, min_samples=1).fit(np.unique(np.floor(points / 0.15), axis=0) * 0.15)


def map_section() -> Iterator[Row]:
    """The semantic map of a scan: computed, and with all its files."""
    street_scan, _ = benchmark_street()
    speckle = np.random.default_rng(0).uniform(20, 60, street_scan.shape).astype(np.float32)
    scan, models = replace(street_scan, reflectance=speckle), MapModels.load()
    clusters = len(map_scan(scan, models).clusters)
    yield under(f"map of 760x1135, {clusters} clusters", lambda: map_scan(scan, models), None)
    with TemporaryDirectory() as folder:
        out = Path(folder)

        def written() -> None:
            one = map_scan(scan, models)
            write_png(out / "panorama.png", panorama(one, models.labels))
            write_map(SemanticMap([one.in_world()], models.labels), out, "street")

        yield under("the same with page, PLY, pictures and JSON", written, 1.0)


def jobs_section() -> Iterator[Row]:
    """100 scans with two jobs against one; each run in a fresh process and folder."""
    for shape in ((181, 316), (ROWS, COLUMNS)):
        yield _jobs_row(shape)


def _jobs_row(shape: tuple[int, int]) -> Row:
    with TemporaryDirectory() as folder:
        scan, _ = scan_of(room(), scenes.panorama(*shape))
        write_npz(scan, Path(folder) / "scan.npz")
        for number in range(SET_SIZE):
            shutil.copy(Path(folder) / "scan.npz", Path(folder) / f"{number:03}.npz")
        (Path(folder) / "scan.npz").unlink()
        one, two = (_detect_seconds(Path(folder), jobs) for jobs in (1, 2))
    return Row(
        f"{SET_SIZE} scans of {shape[0]}x{shape[1]} with --jobs 2",
        f"{two:.1f} s",
        "--jobs 1",
        f"{one:.1f} s",
        f"{one / two:.2f} x faster",
        ">= 1.7 x",
        one / two >= 1.7,
    )


def _detect_seconds(folder: Path, jobs: int) -> float:
    out = folder / f"out{jobs}"
    command = [sys.executable, "-m", "laserimg", "detect", str(folder / "*.npz"), "-o", str(out), "--quiet"]
    start = time.perf_counter()
    subprocess.run([*command, "--jobs", str(jobs)], check=True)
    return time.perf_counter() - start


def help_section() -> Iterator[Row]:
    """`laserimg --help` in a fresh process."""
    command = [sys.executable, "-m", "laserimg", "--help"]
    yield under("laserimg --help", lambda: subprocess.run(command, check=True, capture_output=True), 0.2)


def _spread(vectors: NDArray, mask: NDArray) -> NDArray:
    image = np.zeros((*mask.shape, 3))
    image[mask] = vectors
    return image


def _turned(vectors: NDArray, scan: Scan) -> NDArray:
    away = (vectors * scan.directions).sum(axis=-1, keepdims=True) > 0
    return np.where(away, -vectors, vectors)


def _degrees(a: NDArray, b: NDArray) -> NDArray:
    return np.degrees(np.arccos(np.clip((a * b).sum(axis=-1), -1, 1)))


def detectors_section() -> Iterator[Row]:
    """The whole pipeline with all shipped detectors beside one plain search by a cascade of 25 stages."""
    yield from detector_rows("room", benchmark_room()[0])
    yield from detector_rows("street", benchmark_street()[0])


def scale_section() -> Iterator[Row]:
    """Metric search beside plain search of every size, by the shipped cascades: time and proposals."""
    yield from scale_rows("room", benchmark_room()[0])
    yield from scale_rows("street", benchmark_street()[0])


SECTIONS = {
    "detectors": detectors_section,
    "scale": scale_section,
    "images": images_section,
    "normals": normals_section,
    "regions": regions_section,
    "clusters": clusters_section,
    "map": map_section,
    "jobs": jobs_section,
    "help": help_section,
}


def main() -> int:
    """Print the rows of the sections asked for; exit 1 when a wanted figure is missed."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("sections", nargs="*", choices=[*SECTIONS, []], help="default: all")
    parser.add_argument("--cpu", action="store_true", help="CPU time of one thread: other work does not show")
    given = parser.parse_args()
    sections = given.sections or list(SECTIONS)
    if given.cpu:
        count_cpu_time()
    print(f"cv2 {cv2.__version__}, {cv2.getNumThreads()} threads\n{TITLES}")
    missed = 0
    for name in sections:
        for row in SECTIONS[name]():
            print(row, flush=True)
            missed += row.kept is False
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
