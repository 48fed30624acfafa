"""A picture of the detections of every shipped class on a simulated scan that none was trained on.

    python tools/detector_pictures.py --work simulated -o docs/detectors

`--work` is the folder of ``laserimg train recipe``: of its scans of other seeds the one with the most
detections of the class is drawn.
"""

import argparse
from pathlib import Path

import cv2

from laserimg.detectors.shipped import detector_files, load_model
from laserimg.draw import overlay
from laserimg.pipeline import Pipeline, Result
from laserimg.readers import read_file
from laserimg.recipes.recipe import read_recipe
from laserimg.recipes.scans import scans_of
from laserimg.rules.file import load_rules
from laserimg.rules.model import Rules
from laserimg.sources import detectors_for

LOOKED_AT, WIDTH = 12, 1100


def main() -> None:
    """Write one PNG a recipe."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--work", type=Path, default=Path("simulated"))
    parser.add_argument("--cascades", type=Path, default=Path("cascades"))
    parser.add_argument("--recipes", type=Path, default=Path("training"))
    parser.add_argument("-o", "--out", type=Path, default=Path("docs/detectors"))
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    for file in sorted(given.recipes.glob("*.toml")):
        recipe = read_recipe(file)
        pipeline = pipeline_of(recipe.label, given.cascades)
        scans = scans_of(recipe, "test", given.work, 1)
        chosen = scans[:: max(1, len(scans) // LOOKED_AT)]
        results = [pipeline(next(iter(read_file(scan.path)))) for scan in chosen]
        write(max(results, key=lambda one: len(one.detections)), given.out / f"{recipe.label}.png")


def pipeline_of(label: str, folder: Path) -> Pipeline:
    """Return the pipeline of one class."""
    rules = Rules((load_rules()[label],))
    models = [load_model(path) for path in detector_files(folder)]
    return Pipeline(rules, detectors_for(rules, [one for one in models if one.card.label == label]))


def write(result: Result, path: Path) -> None:
    """Write the picture of a result without what was rejected."""
    shown = Result(result.evidence, tuple(result.detections))
    picture = overlay(shown, "normals_view")
    height = round(picture.shape[0] * WIDTH / picture.shape[1])
    small = cv2.resize(picture, (WIDTH, height), interpolation=cv2.INTER_AREA)
    cv2.imwrite(str(path), cv2.cvtColor(small, cv2.COLOR_RGB2BGR), [cv2.IMWRITE_PNG_COMPRESSION, 9])
    print(f"{path}: {len(result.detections)} detections, {path.stat().st_size >> 10} kB")


if __name__ == "__main__":
    main()
