"""How full simulated rooms are beside a real scan, along the real scan's own beams.

    python tools/scene_density.py                  # 60 offices beside the office scan
    python tools/scene_density.py corridor --count 40 --seed 1

Of the returns from 0.5 m on within 56 degrees of the horizon: median range, neighbours in a row more than 5
cm apart, neighbours in a column more than 10 cm apart, returns within 6 cm of the floor. Then how many
labelled things a scan shows with more than 15 returns, and the time a scene takes to make.
"""

import argparse
import os
import time
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np

from laserimg.readers import open_scans
from laserimg.scan import Scan
from laserimg.simulate.measure import simulated
from laserimg.simulate.scanner import SCANNERS, Scanner
from laserimg.simulate.scenes import SCENES

DATA = Path(os.environ.get("LASERIMG_DATA", Path(__file__).parents[2] / "shared" / "data"))
# The real scan of each scene, and how far below its scanner the floor is.
REAL = {
    "office": ("office_room/room_scan1.pcd", 1.264),
    "corridor": ("corridor_lms200/scan000.3d", 0.36),
    "stairwell": ("staircase/scan.dat.bz2", 0.52),
}
BAND_DEG, NEAREST_M = 56.0, 0.5


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scene", nargs="?", default="office", choices=REAL)
    parser.add_argument("--count", type=int, default=60)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    name, floor_m = REAL[options.scene]
    real = next(iter(open_scans(DATA / name)))
    scanner = scanner_along(real)
    rows, seconds, labels = [], [], Counter()
    for number in range(options.count):
        start = time.process_time()
        scene = SCENES[options.scene](np.random.default_rng([options.seed, number]))
        seconds.append(time.process_time() - start)
        seen = simulated(scene, 0, scanner, number)
        rows.append(figures(seen.scan, float(scene.scanners[0][2, 3])))
        shown = np.bincount(seen.thing[seen.scan.range > 0].clip(0), minlength=len(scene.things)) > 15
        labels.update(
            t.label for t, is_shown in zip(scene.things, shown, strict=True) if is_shown and t.label
        )
    print("                     median m   jumps %  up/down %   floor %")
    print(line("real", figures(real, floor_m)))
    for share in (5, 25, 50, 75, 95):
        print(line(f"{share} % of simulated", np.percentile(rows, share, axis=0)))
    print(", ".join(f"{label} {n / options.count:.1f}" for label, n in labels.most_common()), "a scan")
    print(f"{1000 * np.mean(seconds):.0f} ms a scene, {1000 * np.median(seconds):.0f} in the middle")


def scanner_along(real: Scan) -> Scanner:
    """Return an LMS 200 with the beams of a real scan, which shows its carrier from 5 cm on."""
    model = SCANNERS["lms200_tilt"]
    return replace(model, directions=real.directions, wraps=real.wraps, min_range_m=0.05, head=None)


def figures(scan: Scan, floor_m: float) -> list[float]:
    """Return median range, jumps along rows and columns, and the floor's share of a scan."""
    r, up = scan.range, scan.directions[..., 2]
    seen = (r >= NEAREST_M) & (np.abs(up) <= np.sin(np.radians(BAND_DEG)))
    beside, below = seen[:, 1:] & seen[:, :-1], seen[1:] & seen[:-1]
    on_floor = np.abs(r * up + floor_m)[seen] < 0.06
    jumps = (np.abs(np.diff(r, axis=1))[beside] > 0.05, np.abs(np.diff(r, axis=0))[below] > 0.10, on_floor)
    return [float(np.median(r[seen])), *(100 * float(np.mean(jump)) for jump in jumps)]


def line(name: str, values) -> str:
    """Return a row of the table."""
    return f"{name:18}" + "".join(f"{value:11.2f}" for value in values)


if __name__ == "__main__":
    main()
