"""Real corridor scans of a tilting LMS 200 beside simulated ones: noise, lost returns, mixed pixels, ranges.

    python tools/simulated_against_real.py
    python tools/simulated_against_real.py --scans 40
    python tools/simulated_against_real.py --picture docs/simulated_against_real.png

The simulated scanners are in random corridors, 0.36 m above the floor as the real one stood, without the
carrier: `lms200_tilt`, whose tilt is exact, and `lms200_swing`, whose head swings as that of the recordings
did. Beams that met the real carrier, nearer than 0.5 m, are left out of everything.
"""

import argparse
import os
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np

from laserimg.clusters import find_clusters
from laserimg.geometry.floor import find_floor
from laserimg.ground import ground_plane
from laserimg.images import make_image, write_png
from laserimg.normals import normals
from laserimg.readers import read_file
from laserimg.scan import Scan
from laserimg.simulate.measure import simulated
from laserimg.simulate.scanner import SCANNERS
from laserimg.simulate.scenes import SCENES

DATA = Path(os.environ.get("LASERIMG_DATA", Path(__file__).parents[2] / "shared" / "data"))
REAL = ("corridor_lms200/scan000.3d", "corridor_lms200/scan001.3d")
SIMULATED = ("lms200_tilt", "lms200_swing")
HEIGHT_M = 0.36
NEAREST_M = 0.5
PITCH_RAD = np.radians(0.5)
WINDOW = np.ones((7, 7), np.float32)


class Figure(NamedTuple):
    """One measure of one scan, and the number of pixels, edges or rays it is from."""

    name: str
    value: float
    n: int


def without_carrier(scan: Scan) -> Scan:
    """Return the scan without its nearest returns, which `filled` marks."""
    carrier = (scan.range > 0) & (scan.range < NEAREST_M)
    return replace(scan, range=np.where(carrier, 0, scan.range), reflectance=None, filled=carrier)


def real_scans() -> list[Scan]:
    """Return the real scans."""
    return [without_carrier(next(read_file(DATA / name))) for name in REAL]


def simulated_scan(scanner: str, seed: int) -> Scan:
    """Return one simulated scan from a low place in a random corridor."""
    scene = SCENES["corridor"](np.random.default_rng([seed, 28]))
    pose = scene.scanners[0].copy()
    pose[2, 3] = HEIGHT_M
    things = tuple(thing for thing in scene.things if thing.kind != "carrier")
    seen = simulated(replace(scene, things=things, scanners=(pose,)), 0, SCANNERS[scanner], seed)
    return without_carrier(seen.scan)


def incidence(scan: Scan) -> np.ndarray:
    """Return the cosine of incidence, from the slopes of the inverse range over seven pixels."""
    inverse = np.where(scan.range > 0, 1 / np.maximum(scan.range, 0.1), np.nan)
    slopes = [
        (np.roll(inverse, -3, axis) - np.roll(inverse, 3, axis)) / (6 * PITCH_RAD * inverse)
        for axis in (0, 1)
    ]
    return 1 / np.sqrt(1 + slopes[0] ** 2 + slopes[1] ** 2)


def range_noise(scan: Scan) -> Iterator[Figure]:
    """Yield the noise of ranges: second differences of the inverse range, which on a plane are 0."""
    r, cosine = scan.range.astype(float), incidence(scan)
    inverse = np.where(r > 0, 1 / np.maximum(r, 0.1), np.nan)
    for axis, across in ((0, "from line to line"), (1, "within a line")):
        before, after = np.roll(r, 1, axis), np.roll(r, -1, axis)
        bend = (np.roll(inverse, 1, axis) - 2 * inverse + np.roll(inverse, -1, axis)) * r**2 / 6**0.5
        smooth = (np.maximum(abs(before - r), abs(after - r)) < 0.08 * r) & (abs(bend) < 0.05)
        for low, high in ((1, 1.5), (1.5, 3), (3, 6), (6, 12)):
            kept = smooth & (cosine > 0.75) & (r >= low) & (r < high)
            spread = (
                np.subtract(*np.percentile(bend[kept], [84.13, 15.87])) / 2 if kept.sum() > 50 else np.nan
            )
            yield Figure(f"range noise {across}, {low:g}-{high:g} m, mm", 1e3 * spread, int(kept.sum()))


def normal_noise(scan: Scan) -> Iterator[Figure]:
    """Yield the angle between each normal and the mean of the 7 x 7 around it, where those are one plane."""
    found, up = normals(scan), scan.up
    r = scan.range.astype(np.float32)
    inverse = np.where(r > 0, 1 / np.maximum(r, np.float32(0.1)), 0)
    bend = abs(cv2.Laplacian(cv2.blur(inverse, (3, 3)), cv2.CV_32F)) * r**2
    whole = cv2.erode(((r > 0) & (bend < 0.03)).astype(np.uint8), WINDOW.astype(np.uint8)) > 0
    mean = cv2.filter2D(found, -1, WINDOW)
    mean /= np.maximum(np.linalg.norm(mean, axis=-1, keepdims=True), 1e-6)
    angle = np.degrees(np.arccos(np.clip(np.einsum("ijk,ijk->ij", found, mean), -1, 1)))
    upright = mean @ up
    surfaces = {"floor": upright > 0.95, "walls": abs(upright) < 0.2, "ceiling": upright < -0.95}
    for name, chosen in surfaces.items():
        kept = whole & chosen & (r < 6)
        values = np.percentile(angle[kept], [50, 90]) if kept.sum() > 50 else (np.nan, np.nan)
        yield Figure(f"normals of {name}, median angle, degrees", values[0], int(kept.sum()))
        yield Figure(f"normals of {name}, 90 % angle, degrees", values[1], int(kept.sum()))


def lost_returns(scan: Scan) -> Iterator[Figure]:
    """Yield shares of beams without a return: of all, and of those to the floor by its distance."""
    lost, away = scan.range.ravel() == 0, ~scan.filled.ravel()
    yield Figure("beams without a return, %", 100 * (lost & away).sum() / away.sum(), int(away.sum()))
    r = scan.range.ravel().astype(float)
    plane = ground_plane(scan.points().reshape(-1, 3).astype(float)[r > 0], scan.up)
    expected = np.full(len(r), np.inf)
    if plane is not None:
        downward = scan.directions.reshape(-1, 3) @ plane.normal
        down = downward < -1e-3
        expected[down] = plane.offset_m / downward[down]
    for low, high in ((1, 2), (2, 3.5), (3.5, 5), (5, 7), (7, 12)):
        free = (expected > low) & (expected < high) & away & (lost | (r > 0.85 * expected))
        share = 100 * lost[free].mean() if free.sum() > 10 else np.nan
        yield Figure(f"floor {low:g}-{high:g} m away without a return, %", share, int(free.sum()))


def edges(scan: Scan) -> tuple[np.ndarray, ...]:
    """Return gap, place in it (0 near, 1 far) and whether it is a return, of each beam between two levels.

    A beam, or none, between two pixels a step apart that each continue smoothly on their side.
    """
    found = []
    for r in (scan.range, scan.range.T):
        outer, near, own, far, last = (r[:, k : r.shape[1] - 4 + k] for k in range(5))
        gap = abs(near - far)
        level = (np.minimum.reduce([outer, near, far, last]) > 0) & (gap > 0.15)
        level &= (abs(outer - near) < 0.05) & (abs(far - last) < 0.05)
        place = (own - np.minimum(near, far)) / np.maximum(gap, 1e-6)
        found.append((gap[level], place[level], own[level] > 0))
    return tuple(np.concatenate(parts) for parts in zip(*found, strict=True))


def mixed_pixels(scan: Scan) -> Iterator[Figure]:
    """Yield the shares of mixed pixels: by the pipeline, and of edges by the depth of the step."""
    partition = find_clusters(scan, find_floor(scan))
    given_back = (partition.range != scan.range).sum() / max((partition.labels > 0).sum(), 1)
    yield Figure("pixels of clusters that are mixed, %", 100 * given_back, int((partition.labels > 0).sum()))
    gap, place, returned = edges(scan)
    for low, high in ((0.15, 0.3), (0.3, 0.5), (0.5, 0.8), (0.8, 1.2), (1.2, 2), (2, 4), (4, 10)):
        kept = (gap >= low) & (gap < high)
        between = kept & returned & (place * gap > 0.05) & ((1 - place) * gap > 0.05)
        # A step between two beams is counted by both of them.
        steps = between.sum() + (kept & returned & ~between).sum() / 2 + (kept & ~returned).sum()
        share = 100 * between.sum() / steps if steps > 10 else np.nan
        yield Figure(f"mixed pixels at steps of {low:g}-{high:g} m, %", share, int(steps))
        if high <= 1.2:
            middle = np.median(place[between]) if between.sum() > 10 else np.nan
            yield Figure(
                f"  their place in the step, 0 near, 1 far, {low:g}-{high:g} m", middle, int(between.sum())
            )


def jumps(scan: Scan) -> Iterator[Figure]:
    """Yield the shares of neighbours whose ranges differ by more than some steps."""
    steps = [abs(np.diff(scan.range, axis=axis)) for axis in (0, 1)]
    both = [
        (np.minimum(a, b) > 0)
        for a, b in ((scan.range[1:], scan.range[:-1]), (scan.range[:, 1:], scan.range[:, :-1]))
    ]
    step = np.concatenate([values[pair] for values, pair in zip(steps, both, strict=True)])
    for limit in (0.05, 0.2, 1.0):
        yield Figure(
            f"neighbours more than {limit:g} m apart in range, %", 100 * (step > limit).mean(), len(step)
        )


def ranges(scan: Scan) -> Iterator[Figure]:
    """Yield percentiles of the ranges."""
    returned = scan.range[scan.range > 0]
    for share in (5, 25, 50, 75, 95):
        yield Figure(f"range, {share} %, m", float(np.percentile(returned, share)), len(returned))


def figures(scan: Scan) -> list[Figure]:
    """Return all measures of a scan."""
    parts = (range_noise, normal_noise, lost_returns, mixed_pixels, jumps, ranges)
    return [figure for part in parts for figure in part(scan)]


def print_table(real: list[list[Figure]], made: list[list[list[Figure]]]) -> None:
    """Print each measure of the real scans, and its median and 10 to 90 % among the simulated scans."""
    titles = [*(Path(name).stem for name in REAL), "n"]
    titles += [title for name in SIMULATED for title in (name, "10-90 % of scans", "n")]
    print(f"| | {' | '.join(titles)} |\n|{'---|' * (len(titles) + 1)}")
    for number, name in enumerate(figure.name for figure in real[0]):
        row = [figures[number] for figures in real]
        cells = [*(f"{figure.value:.2f}" for figure in row), ", ".join(str(figure.n) for figure in row)]
        for scans in made:
            many = [figures[number] for figures in scans]
            values = [figure.value for figure in many if np.isfinite(figure.value)]
            low, middle, high = np.percentile(values, [10, 50, 90]) if values else [np.nan] * 3
            cells += [f"{middle:.2f}", f"{low:.2f}-{high:.2f}", str(sum(figure.n for figure in many))]
        print(f"| {name} | {' | '.join(cells)} |")


def write_picture(path: Path, real: Scan, made: Scan) -> None:
    """Write the normal images of both, the real one on the left."""
    images = [make_image(scan, "normals") for scan in (real, made)]
    height = max(len(image) for image in images)
    gap = np.full((height, 8, 3), 255, np.uint8)
    left, right = (np.pad(image, ((0, height - len(image)), (0, 0), (0, 0))) for image in images)
    write_png(path, np.hstack([left, gap, right]))


def main() -> None:
    """Measure, print, and write the picture if asked."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--scans", type=int, default=20, help="simulated scans")
    parser.add_argument("--picture", type=Path, help="PNG of two normal images")
    parser.add_argument("--seed", type=int, default=3, help="of the simulated scan in the picture")
    options = parser.parse_args()
    real = real_scans()
    if options.picture:
        write_picture(options.picture, real[0], simulated_scan(SIMULATED[-1], options.seed))
    made = [[figures(simulated_scan(name, seed)) for seed in range(options.scans)] for name in SIMULATED]
    print_table([figures(scan) for scan in real], made)


if __name__ == "__main__":
    main()
