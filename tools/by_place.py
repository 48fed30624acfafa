"""What the detectors report on every kind of place: false positives of all classes, precision by scanner.

    python tools/by_place.py --work simulated
    python tools/by_place.py --work simulated --cascades other/ --most 20

Of the simulated scans that `laserimg train recipe` keeps in a folder those to measure on, of one seed. First
the false positives a scan of every class by scene and scanner, at the `score` of the rules, whether a class
is at home there or not. Then, for each class and scanner, the objects that are asked for, how many distinct
ones they are (things of one scene are told apart by their size; of those alike as many count as one scan
shows), average precision at IoU 0.5, and recall at the rules' score.
"""

import argparse
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from laserimg.cascade.folder import one_thread
from laserimg.detectors.shipped import detector_files, load_model, shipped_folder
from laserimg.evaluate.curves import Curve
from laserimg.evaluate.matching import match
from laserimg.formats.coco_file import read_coco
from laserimg.pipeline import Pipeline
from laserimg.readers import read_file
from laserimg.recipes.measuring import MIN_IOU, boxes_of
from laserimg.recipes.observation import killed
from laserimg.recipes.recipe import Recipe, read_recipe
from laserimg.recipes.scans import TrainingScan, asked_for
from laserimg.rules.file import load_rules
from laserimg.rules.model import Rules
from laserimg.sources import detectors_for
from laserimg.workers import in_order

TRAINING = Path(__file__).parents[1] / "training"
# Of the scans to measure on, beside the seed (`laserimg.recipes.scans`).
TEST = 2_000_000


class Place(NamedTuple):
    """Where a scan was made, by what, and of which scene."""

    kind: str
    scanner: str
    scene: str


@dataclass(frozen=True, eq=False, slots=True)
class Seen:
    """What became of one class in one scan.

    Parameters
    ----------
    place : Place
    label : str
    scores : (n,) array
        Of all that was found, but of what is to be ignored.
    hits : (n,) array of bool
    things : tuple
        Size in mm of each object asked for.
    """

    place: Place
    label: str
    scores: NDArray[np.float64]
    hits: NDArray[np.bool_]
    things: tuple[tuple[int, ...], ...]


def place_of(path: Path) -> Place:
    """Return where a simulated scan is from, by its name.

    Examples
    --------
    >>> place_of(Path("office-lms200_turn-2000000-desk-00003.npz"))
    Place(kind='office', scanner='lms200_turn', scene='office-2000000-desk-00003')
    """
    kind, scanner, rest = path.stem.split("-", 2)
    return Place(kind, scanner, f"{kind}-{rest}")


def kept_scans(work: Path, seed: int, most: int | None) -> list[TrainingScan]:
    """Return the scans of a seed to measure on, at most so many of each folder."""
    folders = sorted(work.glob(f"*-{TEST + seed}"))
    names = [sorted(folder.glob("*.npz"))[:most] for folder in folders]
    return [
        TrainingScan(path, path.parent / "truth" / f"{path.name}.json") for paths in names for path in paths
    ]


@lru_cache(maxsize=1)
def _pipeline(cascades: Path) -> Pipeline:
    """All classes, whatever their score."""
    rules = Rules(tuple(replace(one, score=0.0) for one in load_rules()))
    return Pipeline(rules, detectors_for(rules, [load_model(path) for path in detector_files(cascades)]))


def looked_at(cascades: Path, recipes: tuple[Recipe, ...], scan: TrainingScan) -> list[Seen]:
    """Return what became of the class of each recipe in a scan."""
    (read,) = read_file(scan.path)
    with one_thread():
        found = _pipeline(cascades)(read).detections
    coco, width = read_coco(scan.truth), read.shape[1] if read.wraps else None
    seen = []
    for recipe in recipes:
        asked, ignored = scan.objects(recipe)
        truth = np.concatenate([asked, ignored])
        mine = [one for one in found if one.label == recipe.label]
        scores = np.array([one.score for one in mine], np.float64)
        ignore = np.arange(len(truth)) >= len(asked)
        matches = match(boxes_of([one.box for one in mine]), scores, truth, ignore, MIN_IOU, width)
        counted = ~matches.ignored
        things = [
            one.size
            for one in coco.annotations
            if coco.labels[one.category_id] == recipe.label and asked_for(one, recipe)
        ]
        sizes = tuple(
            tuple(round(1000 * side) for side in (one.length, one.breadth, one.height)) if one else ()
            for one in things
        )
        hits = (matches.truth >= 0)[counted]
        seen.append(Seen(place_of(scan.path), recipe.label, scores[counted], hits, sizes))
    return seen


def distinct(seen: Iterable[Seen]) -> int:
    """Return how many different objects some scans show: a thing of a scene counts once."""
    things: dict[tuple[str, str], Counter] = {}
    for one in seen:
        key = one.place.scene, one.label
        things[key] = things.get(key, Counter()) | Counter(one.things)
    return sum(counter.total() for counter in things.values())


def false_positives(seen: list[Seen], least: dict[str, float]) -> str:
    """Return the table of false positives a scan, a line for each scene and scanner."""
    labels = list(least)
    lines = [f"{'scene, scanner':26}{'scans':>6}" + "".join(f"{one[:8]:>9}" for one in (*labels, "all"))]
    for where in sorted({one.place[:2] for one in seen}):
        own = [one for one in seen if one.place[:2] == where]
        scans = len(own) // len(labels)
        wrong = [
            sum(int((~one.hits & (one.scores > least[label])).sum()) for one in own if one.label == label)
            for label in labels
        ]
        rates = "".join(f"{count / scans:9.2f}" for count in (*wrong, sum(wrong)))
        lines.append(f"{', '.join(where):26}{scans:6}{rates}")
    return "\n".join(lines)


def precisions(seen: list[Seen], least: dict[str, float]) -> str:
    """Return the table of average precisions, a line for each class and scanner that has objects."""
    lines = [f"{'class':14}{'scanner':14}{'scans':>6}{'objects':>9}{'distinct':>9}{'AP@0.5':>8}{'recall':>8}"]
    for label, threshold in least.items():
        mine = [one for one in seen if one.label == label]
        for scanner in (*sorted({one.place.scanner for one in mine}), "all"):
            own = [one for one in mine if scanner in ("all", one.place.scanner)]
            objects = sum(len(one.things) for one in own)
            if objects == 0:
                continue
            scores, hits = (
                np.concatenate([getattr(one, name) for one in own]) for name in ("scores", "hits")
            )
            precision = Curve.of(scores, hits, objects, len(own)).average_precision
            recall = (hits & (scores > threshold)).sum() / objects
            counts = f"{len(own):6}{objects:9}{distinct(own):9}"
            lines.append(f"{label:14}{scanner:14}{counts}{precision:8.3f}{recall:8.3f}")
    return "\n".join(lines)


def _died(scan: TrainingScan) -> list[Seen]:
    raise killed(scan)


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--work", type=Path, required=True, help="folder of simulated scans")
    parser.add_argument("--cascades", type=Path, default=shipped_folder(), help="folder of detectors")
    parser.add_argument("--seed", type=int, default=0, help="of the recipes")
    parser.add_argument("--most", type=int, help="scans of each folder; default: all")
    parser.add_argument("--jobs", type=int, default=2)
    given = parser.parse_args()
    scans = kept_scans(given.work, given.seed, given.most)
    if not scans:
        parser.error(f"{given.work}: no scans of seed {given.seed} to measure on")
    least = {one.label: one.score for one in load_rules()}
    recipes = tuple(one for one in map(read_recipe, sorted(TRAINING.glob("*.toml"))) if one.label in least)
    least = {one.label: least[one.label] for one in recipes}
    found = in_order(partial(looked_at, given.cascades, recipes), scans, given.jobs, _died)
    seen = [one for of_scan in found for one in of_scan]
    print(false_positives(seen, least))
    print()
    print(precisions(seen, least))


if __name__ == "__main__":
    main()
