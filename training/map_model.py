"""Train the classifiers of `laserimg map`: simulate, segment, label by majority, train, test on other scenes.

    python training/map_model.py                        # writes cascades/map.npz and map_range.npz
    python training/map_model.py --scenes 20 -o /tmp    # a quick look

Scenes are streets and parks seen by a turning LMS 151 of 760 x 1135 rays; every second row, and every
fourth row and second column, stand for coarser scanners. Ground removal and segmentation are those of the
map. A cluster has the class that holds at least 85 % of its returns; where none holds 70 %, it is
"undersegmented": there are few of these, so scans are also segmented with 2 and 4 times the radius.
`map_range.npz` is for scans without reflectance. Needs the extra `simulate`; seeds are fixed.
"""

import argparse
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from laserimg.classify import ObjectModel, Recipe, class_table, save_model
from laserimg.classify.model import verdicts
from laserimg.classify.svm import LinearClassifier
from laserimg.classify.training import sharpness
from laserimg.clusters import LINK
from laserimg.scan import Scan
from laserimg.semantic_map.segments import described_clusters, segments_of
from laserimg.simulate.measure import simulated
from laserimg.simulate.scanner import SCANNERS
from laserimg.simulate.scenes import SCENES
from laserimg.workers import unordered

SEED = 151
TEST_SEED = 152
MODELS = {
    "map": Recipe("honv+hog", views=1, size=True),
    "map_range": Recipe("honv", views=1, size=True),
}
# Every how many rows and columns, and how many times the radius.
LOOKS = [((1, 1), 1), ((2, 1), 1), ((4, 2), 1), ((1, 1), 2), ((2, 1), 4)]
PURE, MIXED = 0.85, 0.70
UNDERSEGMENTED = "undersegmented"
CLASS_OF = {"window": "building", "door": "building", "hedge": "tree"}
# Things that are none of the paper's classes are neither trained nor counted.
CLASSES = ("building", "car", "person", "pole", "tree")
MOST_OF_A_CLASS = 700
# Decision values closer than this are "unknown".
MARGIN = 0.15


class Described(NamedTuple):
    """Clusters: vectors of either recipe, class and number of returns of each."""

    vectors: dict[str, NDArray]
    labels: NDArray
    points: NDArray


def clusters_of_scene(looks: list, seed: int, number: int) -> Described:
    """Simulate a scene and describe its clusters as each of `looks` shows them."""
    scene = SCENES[("street", "park")[number % 3 == 2]](np.random.default_rng([seed, number]))
    seen = simulated(scene, 0, SCANNERS["lms151_turn"], seed=seed * 1_000_003 + number)
    names = np.array([CLASS_OF.get(thing.kind, thing.label) for thing in scene.things] + [""])
    found = [_look(seen.scan, names[seen.thing], (rows, columns), times, number)
             for (rows, columns), times in looks]  # fmt: skip
    return _joined(found)


def _look(scan: Scan, names: NDArray, step: tuple[int, int], times: int, number: int) -> Described:
    every = slice(number % step[0], None, step[0]), slice(number % step[1], None, step[1])
    scan = Scan(
        scan.range[every], scan.directions[every], scan.reflectance[every], scan.world_from_scan, scan.wraps
    )
    if number % 2:
        # Many scanners compensate for the range.
        scan = replace(scan, reflectance=scan.reflectance * scan.range**2)
    clusters = segments_of(scan, times * LINK).clusters
    named = names[every].ravel()
    labels = np.array([_majority(named[cluster.pixels]) for cluster in clusters])
    kept = np.flatnonzero(labels == UNDERSEGMENTED if times > 1 else labels != "")
    chosen = [clusters[place] for place in kept]
    vectors = {name: described_clusters(scan, chosen, recipe) for name, recipe in MODELS.items()}
    return Described(vectors, labels[kept], np.array([len(cluster.pixels) for cluster in chosen], int))


def _majority(names: NDArray) -> str:
    found, count = np.unique(names, return_counts=True)
    share = count.max() / count.sum()
    if share < MIXED:
        return UNDERSEGMENTED
    name = str(found[count.argmax()])
    return name if share >= PURE and name in CLASSES else ""


def _joined(parts: list[Described]) -> Described:
    return Described(
        {name: np.concatenate([part.vectors[name] for part in parts]) for name in MODELS},
        np.concatenate([part.labels for part in parts]).astype(str),
        np.concatenate([part.points for part in parts]),
    )


def gathered(seed: int, scenes: int, looks: list, jobs: int) -> Described:
    """Return the clusters of many scenes, in the same order whatever the jobs."""
    numbered = partial(_numbered, looks, seed)
    found = sorted(unordered(numbered, range(scenes), jobs, _died), key=lambda pair: pair[0])
    return _joined([part for _, part in found])


def _numbered(looks: list, seed: int, number: int) -> tuple[int, Described]:
    return number, _capped(clusters_of_scene(looks, seed, number), 60)


def _died(number: int) -> tuple[int, Described]:
    raise SystemExit(f"the process that made scene {number} was killed")


def _capped(found: Described, most: int) -> Described:
    """Keep at most so many clusters of a class, drawn with a fixed seed."""
    random = np.random.default_rng(0)
    kept = np.sort(np.concatenate(list(_chosen(found.labels, most, random))))
    vectors = {name: values[kept] for name, values in found.vectors.items()}
    return Described(vectors, found.labels[kept], found.points[kept])


def _chosen(labels: NDArray, most: int, random: np.random.Generator) -> Iterator[NDArray]:
    yield np.zeros(0, int)
    for label in np.unique(labels):
        yield random.permutation(np.flatnonzero(labels == label))[:most]


def trained(name: str, found: Described, test: Described) -> ObjectModel:
    """Train a model; its confidences are fitted to the scenes of the test."""
    machine = LinearClassifier().fit(found.vectors[name], found.labels)
    decisions = np.asarray(machine.decision_function(test.vectors[name]))
    labels = tuple(str(label) for label in machine.classes_)
    place = np.array([labels.index(label) for label in test.labels])
    sharp = sharpness(decisions, place)
    return ObjectModel(labels, machine.weights_, machine.bias_, MODELS[name], sharp, MARGIN)


def print_table(name: str, model: ObjectModel, test: Described) -> None:
    """Print what the clusters of the test scenes were taken for."""
    verdict = np.array([one.label for one in model.classify(test.vectors[name])])
    best = np.array([one.label for one in verdicts(model.decide(test.vectors[name]), model.labels)])
    table = class_table(test.labels, verdict, model.labels)
    low, high = table.interval()
    weight = (verdict == test.labels) @ test.points / test.points.sum()
    print(f"{name}: {len(test.labels)} clusters, accuracy {table.accuracy:.4f} ({low:.4f} to {high:.4f}), "
          f"balanced {table.balanced_accuracy:.4f}, of returns {weight:.4f}, "
          f"without margin {np.mean(best == test.labels):.4f}, sharpness {model.sharpness:.2f}")  # fmt: skip
    for label, row in zip(table.labels, table.counts.astype(int).tolist(), strict=True):
        print(f"  {label:<15}{row}")


def main() -> None:
    """Make both models and print their tables."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--scenes", type=int, default=150)
    parser.add_argument("--test-scenes", type=int, default=30)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("-o", "--out", type=Path, default=Path(__file__).parents[1] / "cascades")
    options = parser.parse_args()
    found = _capped(gathered(SEED, options.scenes, LOOKS, options.jobs), MOST_OF_A_CLASS)
    test = gathered(TEST_SEED, options.test_scenes, LOOKS[:1] + LOOKS[3:], options.jobs)
    print({str(label): int((found.labels == label).sum()) for label in np.unique(found.labels)})
    for name in MODELS:
        model = trained(name, found, test)
        print_table(name, model, test)
        save_model(options.out / f"{name}.npz", model)


if __name__ == "__main__":
    main()
