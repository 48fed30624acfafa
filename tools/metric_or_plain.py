"""Metric beside plain search on the same simulated scans: time, objects hit, false positives before rules.

    python tools/metric_or_plain.py --work simulated                # all classes, 24 scans each
    python tools/metric_or_plain.py --work simulated door --scans 0   # all of its test scans

`--work` holds the simulated scans of `laserimg train recipe`; those that are missing are simulated. Metric
search tries the sizes that an object has at each range, plain search all sizes everywhere. A line for each
cascade, then one for each kind of image. An object counts as hit by one proposal with IoU 0.5; all proposals
count, not only the best that a second stage looks at.
"""

import argparse
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter

import numpy as np

from laserimg.detectors.ranked import proposer
from laserimg.detectors.search import Scale, Searched, WindowDetector
from laserimg.detectors.shipped import load_model, shipped_folder
from laserimg.detectors.window import WindowModel
from laserimg.recipes.measuring import boxes_of
from laserimg.recipes.observation import observed
from laserimg.recipes.recipe import Recipe, read_recipe
from laserimg.recipes.scans import TrainingScan, scans_of
from proposal_counts import counted, some_of

ROOT = Path(__file__).parents[1]
SCALES: tuple[Scale, Scale] = "metric", "plain"


@dataclass(frozen=True, slots=True)
class Tally:
    """What one way of searching did.

    Parameters
    ----------
    seconds : float
    hits, false_positives, objects, scans : int
    """

    seconds: float = 0.0
    hits: int = 0
    false_positives: int = 0
    objects: int = 0
    scans: int = 0

    def __add__(self, other: "Tally") -> "Tally":
        pairs = zip(self._numbers(), other._numbers(), strict=True)
        return Tally(*(one + two for one, two in pairs))

    def _numbers(self) -> tuple:
        return self.seconds, self.hits, self.false_positives, self.objects, self.scans


def tally(window: WindowDetector, searched: Searched, asked: np.ndarray, ignored: np.ndarray) -> Tally:
    """Return what one search of a scan took and found; pyramids and sizes are made before."""
    begin = perf_counter()
    found = window.found(searched)
    seconds = perf_counter() - begin
    scan = searched.evidence.scan
    width = scan.shape[1] if scan.wraps else None
    boxes = boxes_of([one.box for one in found])
    return Tally(seconds, *counted(boxes, asked, ignored, width), scans=1)


def tallies(model: WindowModel, recipe: Recipe, scans: list[TrainingScan]) -> dict[Scale, Tally]:
    """Return what each way of searching does on some scans, one after the other in each scan."""
    total: dict[Scale, Tally] = {scale: Tally() for scale in SCALES}
    for scan in scans:
        asked, ignored = scan.objects(recipe)
        searched = Searched(observed(scan.path))
        for scale in SCALES:
            proposer(model, scale).found(searched)
        for scale in SCALES:
            total[scale] += tally(proposer(model, scale), searched, asked, ignored)
    return total


def cascades(recipe: Recipe, folder: Path) -> Iterator[tuple[str, WindowModel]]:
    """Yield name and model of each cascade of a recipe."""
    for one in recipe.cascades:
        name = f"{recipe.label}.{one.name}"
        yield name, load_model(folder / f"{name}.xml")  # type: ignore[misc]


def line(name: str, image: str, total: dict[Scale, Tally]) -> str:
    """Return a line of the table."""
    metric, plain = (total[scale] for scale in SCALES)
    objects = max(metric.objects, 1)
    hits = f"{metric.hits / objects:6.3f}{plain.hits / objects:7.3f}"
    wrong = f"{metric.false_positives / metric.scans:8.1f}{plain.false_positives / plain.scans:8.1f}"
    times = f"{plain.seconds / max(metric.seconds, 1e-9):6.1f} x"
    return f"{name:22}{image:18}{metric.scans:6}{metric.objects:8}{times}{hits}{wrong}"


def main() -> None:
    """Print a line for each cascade, then for each kind of image."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("labels", nargs="*", metavar="CLASS")
    parser.add_argument("--work", type=Path, required=True, help="folder of simulated scans")
    parser.add_argument("--cascades", type=Path, default=shipped_folder(), help="folder of detectors")
    parser.add_argument("--scans", type=int, default=24, help="about so many test scans a class; 0 is all")
    arguments = parser.parse_args()
    print(f"{'':63}{'objects hit':<15}{'false a scan'}")
    print(
        f"{'cascade':22}{'image':18}{'scans':>6}{'objects':>8}{'faster':>8}"
        + "  metric plain  metric   plain"
    )
    images: dict[str, dict[Scale, Tally]] = {}
    for path in sorted((ROOT / "training").glob("*.toml")):
        recipe = read_recipe(path)
        if arguments.labels and recipe.label not in arguments.labels:
            continue
        test = scans_of(recipe, "test", arguments.work, 2)
        chosen = some_of(test, arguments.scans)
        for name, model in cascades(recipe, arguments.cascades):
            total = tallies(model, recipe, chosen)
            image = model.card.image
            before = images.get(image, {scale: Tally() for scale in SCALES})
            images[image] = {scale: before[scale] + total[scale] for scale in SCALES}
            print(line(name, image, total), flush=True)
    for image, total in images.items():
        print(line("all", image, total))


if __name__ == "__main__":
    main()
