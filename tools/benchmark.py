"""Speed and accuracy on the benchmark scenes, each beside a named peer in the same run.

    python tools/benchmark.py                      # all sections
    python tools/benchmark.py images normals       # some

Times are the best of 5 after a warm-up, ours and the peer's in turn: their ratio is what counts,
milliseconds on a busy machine do not. Peers that are not installed are named as such
(``pip install "laserimg[bench]"``). A section is a function that yields rows; to add one, write it and
list it in `SECTIONS`.
"""

import argparse
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache

import cv2
import numpy as np
from numpy.typing import NDArray

from laserimg.images import IMAGE_KINDS, make_images
from laserimg.normals import normals
from laserimg.scan import Scan
from scenes import Truth, room, scan_of, street

ROUNDS = 5


@dataclass(frozen=True, slots=True)
class Row:
    """One measurement: what, ours, the peer and its figure, their relation, what is wanted and kept."""

    what: str
    ours: str
    peer: str
    theirs: str
    relation: str
    wanted: str
    kept: bool | None

    def __str__(self) -> str:
        verdict = {True: "kept", False: "MISSED", None: ""}[self.kept]
        cells = (self.what, self.ours, self.peer, self.theirs, self.relation, self.wanted, verdict)
        return "".join(f"{cell:<{width}}" for cell, width in zip(cells, WIDTHS, strict=True)).rstrip()


WIDTHS = (46, 22, 32, 22, 16, 16, 6)
TITLES = Row("", "laserimg", "peer", "", "", "wanted", None)


def best_times(*calls: Callable[[], object]) -> list[float]:
    """Return the best time of each call in seconds; they run in turn, so that all see the same machine."""
    times: list[list[float]] = [[] for _ in calls]
    for round_ in range(ROUNDS + 1):
        for call, seen in zip(calls, times, strict=True):
            start = time.perf_counter()
            call()
            if round_:
                seen.append(time.perf_counter() - start)
    return [min(seen) for seen in times]


def faster(
    what: str, ours: Callable, peer: str, theirs: Callable | None, at_least: float | None = None
) -> Row:
    """Time ours beside a peer's; `at_least` times faster is wanted."""
    if theirs is None:
        (mine,) = best_times(ours)
        return Row(what, f"{mine * 1e3:.1f} ms", peer, "not installed", "", "", None)
    mine, other = best_times(ours, theirs)
    ratio = other / mine
    wanted = "" if at_least is None else f">= {at_least:g} x"
    kept = None if at_least is None else ratio >= at_least
    return Row(
        what, f"{mine * 1e3:.1f} ms", peer, f"{other * 1e3:.1f} ms", f"{ratio:.1f} x faster", wanted, kept
    )


def within(what: str, ours: Callable, peer: str, theirs: Callable, at_most: float) -> Row:
    """Time ours beside a peer's; at most so many times its time is wanted."""
    mine, other = best_times(ours, theirs)
    ratio = mine / other
    texts = (
        f"{mine * 1e3:.1f} ms",
        peer,
        f"{other * 1e3:.1f} ms",
        f"{ratio:.2f} x its time",
        f"<= {at_most:g} x",
    )
    return Row(what, *texts, ratio <= at_most)


def error(what: str, ours_deg: float, peer: str, theirs_deg: float | None, at_most_deg: float) -> Row:
    """Set an error in degrees beside a peer's; at most so much is wanted."""
    theirs = "not installed" if theirs_deg is None else f"{theirs_deg:.2f} deg"
    return Row(
        what, f"{ours_deg:.2f} deg", peer, theirs, "", f"<= {at_most_deg:g} deg", ours_deg <= at_most_deg
    )


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


def _spread(vectors: NDArray, mask: NDArray) -> NDArray:
    image = np.zeros((*mask.shape, 3))
    image[mask] = vectors
    return image


def _turned(vectors: NDArray, scan: Scan) -> NDArray:
    away = (vectors * scan.directions).sum(axis=-1, keepdims=True) > 0
    return np.where(away, -vectors, vectors)


def _degrees(a: NDArray, b: NDArray) -> NDArray:
    return np.degrees(np.arccos(np.clip((a * b).sum(axis=-1), -1, 1)))


SECTIONS = {"images": images_section, "normals": normals_section}


def main() -> int:
    """Print the rows of the sections asked for; exit 1 when a wanted figure is missed."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("sections", nargs="*", choices=[*SECTIONS, []], help="default: all")
    sections = parser.parse_args().sections or list(SECTIONS)
    print(f"cv2 {cv2.__version__}, {cv2.getNumThreads()} threads\n{TITLES}")
    missed = 0
    for name in sections:
        for row in SECTIONS[name]():
            print(row, flush=True)
            missed += row.kept is False
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
