"""Contact sheets of the simulated scenes: normal images with the labelled things boxed by class.

    python tools/scene_sheets.py                   # writes docs/simulated_indoor.png, ..._outdoor.png
    python tools/scene_sheets.py -o somewhere --seed 3

The same command writes the same pictures again.
"""

import argparse
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from laserimg.boxes import split_at_seam
from laserimg.formats.coco import Annotation
from laserimg.images import make_image, write_png
from laserimg.simulate.labels import truth_boxes
from laserimg.simulate.measure import simulated
from laserimg.simulate.scanner import SCANNERS
from laserimg.simulate.scenes import SCENES
from laserimg.simulate.sets import LABELS

DOCS = Path(__file__).parents[1] / "docs"
WIDTH = 1020
# Rows of a sheet: scene, scanner, rows of the image to show, pictures side by side.
SHEETS = {
    "simulated_indoor": (
        ("office", "lms151_turn", (200, 610), 1),
        ("office", "lms151_turn", (200, 610), 1),
        ("corridor", "lms200_tilt", (0, 226), 3),
        ("stairwell", "lms200_tilt", (0, 226), 3),
    ),
    "simulated_outdoor": (
        ("street", "terrestrial", (110, 400), 1),
        ("street", "terrestrial", (110, 400), 1),
        ("street", "spinning128", (0, 128), 1),
        ("park", "terrestrial", (110, 400), 1),
    ),
}
COLOURS = (
    (120, 120, 120), (255, 255, 0), (0, 255, 255), (255, 255, 255), (0, 0, 0), (0, 120, 0), (0, 0, 160),
    (0, 255, 0), (255, 255, 0), (255, 150, 0), (130, 70, 0), (0, 255, 120), (200, 255, 120), (90, 0, 130),
    (0, 170, 90), (160, 255, 255), (255, 140, 0), (255, 200, 120),
)  # fmt: skip
SEEDS = {"simulated_indoor": 4, "simulated_outdoor": 2}
MIN_PIXELS, MIN_VISIBILITY, MIN_SIDE = 60, 0.4, 8
# Less than 8 bits a colour: a sheet stays below 400 kB.
STEP = 17


def main() -> None:
    """Write the sheets."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--out", type=Path, default=DOCS)
    parser.add_argument("--seed", type=int, help="other scenes")
    options = parser.parse_args()
    for name, rows in SHEETS.items():
        seed = SEEDS[name] if options.seed is None else options.seed
        path = options.out / f"{name}.png"
        write_png(path, sheet(rows, seed))
        print(f"{path}: {path.stat().st_size / 1000:.0f} kB")


def sheet(rows: tuple[tuple[str, str, tuple[int, int], int], ...], seed: int) -> NDArray[np.uint8]:
    """Return the rows of pictures above each other, and the colours of the classes below."""
    strips, classes = [], set()
    for number, (scene, scanner, cut, beside) in enumerate(rows):
        pictures = []
        for place in range(beside):
            image, found = picture(scene, scanner, cut, [seed, number, place], WIDTH // beside)
            pictures.append(image)
            classes |= found
        strips.append(np.hstack(pictures))
    return np.vstack([*strips, legend([label for label in LABELS if label in classes])])


def picture(scene_name: str, scanner_name: str, cut: tuple[int, int], seed: list[int], width: int):
    """Return an image of normals of a new scene, its labels drawn, and the classes in it."""
    scene, scanner = SCENES[scene_name](np.random.default_rng(seed)), SCANNERS[scanner_name]
    seen = simulated(scene, 0, scanner, seed[0])
    image = make_image(seen.scan, "normals_view")
    scale = width / image.shape[1]
    height = round((cut[1] - cut[0]) * scale) * (2 if scanner_name.startswith("spinning") else 1)
    image = cv2.resize(image[cut[0] : cut[1]], (width, height), interpolation=cv2.INTER_AREA)
    image = np.ascontiguousarray((image // STEP) * STEP)
    numbers = {label: number for number, label in enumerate(LABELS, 1)}
    classes = set()
    for box in truth_boxes(scene, seen, scanner, numbers, 1, 1):
        if shows(box, scale):
            label = LABELS[box.category_id - 1]
            classes.add(label)
            draw(image, box, (scale, height / (cut[1] - cut[0])), cut[0], seen.scan, colour(label))
    cv2.putText(image, f"{scene_name}, {scanner_name}", (6, 16), _FONT, 0.45, (255, 255, 255), 1, cv2.LINE_AA)
    return image, classes


_FONT = cv2.FONT_HERSHEY_SIMPLEX


def shows(box: Annotation, scale: float) -> bool:
    """Say whether a thing is large and free enough to be drawn."""
    large = (box.area or 0) >= MIN_PIXELS and min(box.bbox[2:]) * scale >= MIN_SIDE
    return large and (box.visibility or 0) >= MIN_VISIBILITY


def draw(image, box: Annotation, scale: tuple[float, float], above: int, scan, tint) -> None:
    """Draw a box of the scan's grid into the cut and scaled image."""
    for x, y, w, h in split_at_seam(box.bbox, scan.shape[1]) if scan.wraps else [box.bbox]:
        first = round(x * scale[0]), round((y - above) * scale[1])
        last = round((x + w) * scale[0]), round((y + h - above) * scale[1])
        cv2.rectangle(image, first, last, tint, 2)


def colour(label: str) -> tuple[int, int, int]:
    """Return the colour of a class."""
    # Normals are pink, blue and olive: green, cyan, yellow, white and dark tones stand out.
    return COLOURS[LABELS.index(label) % len(COLOURS)]


def legend(labels: list[str]) -> NDArray[np.uint8]:
    """Return a strip with the names of the classes in their colours."""
    wide, rows = 120, -(-len(labels) // (WIDTH // 120))
    strip = np.full((22 * rows + 4, WIDTH, 3), 70, np.uint8)
    for k, label in enumerate(labels):
        x, y = wide * (k % (WIDTH // wide)) + 6, 22 * (k // (WIDTH // wide)) + 16
        cv2.rectangle(strip, (x, y - 9), (x + 10, y + 1), colour(label), -1)
        cv2.putText(strip, label, (x + 15, y), _FONT, 0.42, (255, 255, 255), 1, cv2.LINE_AA)
    return strip


if __name__ == "__main__":
    main()
