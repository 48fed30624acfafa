"""The picture of a map of a simulated street in docs/map.md: the panorama, and the street from above.

    python tools/map_picture.py                   # writes docs/map.png
    python tools/map_picture.py --seed 3 -o somewhere/map.png

The same command writes the same picture again.
"""

import argparse
import tempfile
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from laserimg.formats.npz import write_npz
from laserimg.images import write_png
from laserimg.semantic_map.fusing import fused
from laserimg.semantic_map.maps import SemanticMap
from laserimg.semantic_map.models import MapModels
from laserimg.semantic_map.run import PANORAMAS, TOP, MapOptions, map_files, write_map
from laserimg.simulate.measure import simulated
from laserimg.simulate.scanner import SCANNERS
from laserimg.simulate.scenes import SCENES

DOCS = Path(__file__).parents[1] / "docs"
NAME, SCANNER = "street", "lms151_turn"
WIDTH, STEP = 1150, 16
# Of the view from above, the middle that is no higher than this share of its width.
TOP_SHARE = 0.55


def pictures(seed: int, model: Path | None) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """Return the panorama and the view from above that `laserimg map` writes for a simulated street."""
    scene = SCENES[NAME](np.random.default_rng(seed))
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_npz(simulated(scene, 0, SCANNERS[SCANNER], seed).scan, folder / f"{NAME}.npz")
        (done,) = map_files([(folder / f"{NAME}.npz", NAME)], MapOptions(model), folder)
        assert not done.error, done.error
        write_map(SemanticMap(fused(done.scans), MapModels.load(model).labels), folder, NAME)
        return read(folder / PANORAMAS / f"{NAME}.png"), read(folder / TOP)


def read(path: Path) -> NDArray[np.uint8]:
    """Return a picture, RGB."""
    return np.asarray(cv2.cvtColor(np.asarray(cv2.imread(str(path))), cv2.COLOR_BGR2RGB), np.uint8)


def composed(panorama: NDArray[np.uint8], top: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return one below the other, equally wide, in steps of grey that a PNG holds in less than 400 kB."""
    rows = top.shape[0]
    spare = max(0, rows - round(TOP_SHARE * top.shape[1]))
    parts = [panorama, top[spare // 2 : rows - spare // 2]]
    small = [
        cv2.resize(part, (WIDTH, round(len(part) * WIDTH / part.shape[1])), interpolation=cv2.INTER_AREA)
        for part in parts
    ]
    whole = np.asarray(np.concatenate(small), np.uint8)
    return np.minimum(whole // STEP * STEP + STEP // 2, 255).astype(np.uint8)


def main() -> None:
    """Write the picture."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--seed", type=int, default=14)
    parser.add_argument("--model", type=Path, help="default: those that ship")
    parser.add_argument("-o", "--out", type=Path, default=DOCS / "map.png")
    given = parser.parse_args()
    write_png(given.out, composed(*pictures(given.seed, given.model)))
    print(f"{given.out}: {given.out.stat().st_size >> 10} kB")


if __name__ == "__main__":
    main()
