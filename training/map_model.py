"""Train the classifiers of `laserimg map`: simulate, segment, label by majority, train, test on other scenes.

    python training/map_model.py                        # writes cascades/map.npz and map_range.npz
    python training/map_model.py --scenes 20 -o /tmp    # a quick look

Scenes are streets and parks seen by a turning LMS 151 of 760 x 1135 rays. Each is described as it is, and
three times as a coarser scanner might have seen it: fewer rows and columns, some of the elevations, more
noise, lost returns. Ground removal and segmentation are those of the map. A cluster has the class that
holds at least 85 % of its returns; where none holds 70 %, it is "undersegmented": there are few of these,
so scans are also segmented with 2 and 4 times the radius.
`map_range.npz` is for scans without reflectance. Needs the extra `simulate`; seeds are fixed.
"""

import argparse
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from laserimg.classify import ObjectModel, Recipe, class_table, save_model
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
# Radii, in times the usual, at which a scene is cut to find clusters of several objects.
WIDE = (2, 4)
# How often a scene is described as it is, and as a coarser scanner sees it.
TRAINED, FINE, COARSE = (1, 3), (1, 0), (0, 1)
PURE, MIXED = 0.85, 0.70
MIX, MIX_M = "mix", 0.2
UNDERSEGMENTED = "undersegmented"
CLASS_OF = {"window": "building", "door": "building", "hedge": "tree"}
# Things that are none of the paper's classes are neither trained nor counted.
CLASSES = ("building", "car", "person", "pole", "tree")
MOST_OF_A_CLASS, MOST_OF_A_SCENE = 1000, 30
# Decision values closer than this are "unknown".
MARGIN = 0.15


class Described(NamedTuple):
    """Clusters: vectors of either recipe, class and number of returns of each."""

    vectors: dict[str, NDArray]
    labels: NDArray
    points: NDArray


def clusters_of_scene(seed: int, own: int, coarse: int, number: int) -> Described:
    """Simulate a scene and describe its clusters, `own` times as it is and `coarse` times coarser."""
    random = np.random.default_rng([seed, number])
    scene = SCENES[("street", "park")[number % 3 == 2]](random)
    seen = simulated(scene, 0, SCANNERS["lms151_turn"], seed=seed * 1_000_003 + number)
    names = np.array([CLASS_OF.get(thing.kind, thing.label) for thing in scene.things] + [MIX])[seen.thing]
    # The truth is that of the middle of a beam; the return may be from its edge, or from between surfaces.
    names = np.where(np.abs(seen.scan.range - seen.truth_range) < MIX_M, names, MIX)
    looks = [(seen.scan, names)] * own + [coarser(seen.scan, names, random) for _ in range(coarse)]
    found = [_described(scan, named, 1) for scan, named in looks]
    return joined([*found, *(_described(*looks[-1], times) for times in WIDE)])


def coarser(scan: Scan, names: NDArray, random: np.random.Generator) -> tuple[Scan, NDArray]:
    """Return a scan as another scanner might give it: every n-th row and column, a band of elevations.

    Noise of up to 3 cm, up to 15 % of the returns lost, and in one of two a reflectance that is corrected
    for the range, as many scanners give it.
    """
    across, up = int(random.integers(1, 3)), int(random.integers(1, 5))
    elevation = np.degrees(np.arcsin(scan.directions[:, 0, 2]))
    low, high = random.choice([(-25, 3), (-24, 15), (-30, 30), (-90, 90)])
    rows = np.flatnonzero((elevation >= low) & (elevation <= high))[int(random.integers(up)) :: up]
    part = rows[:, None], np.arange(int(random.integers(across)), scan.shape[1], across)
    kept = random.random(scan.range[part].shape) >= random.uniform(0, 0.15)
    noise = random.normal(0, random.uniform(0, 0.03), kept.shape)
    range_m = np.maximum(scan.range[part] + noise, 0.1) * (kept & (scan.range[part] > 0))
    values = scan.reflectance[part]
    if random.random() < 0.5:
        values = values * range_m**2
    pose = scan.world_from_scan
    return Scan(range_m, scan.directions[part], values, pose, scan.wraps), names[part]


def _described(scan: Scan, names: NDArray, times: int) -> Described:
    """Describe the clusters of a class; of those cut with a wide radius, the undersegmented."""
    clusters = segments_of(scan, times * LINK).clusters
    labels = np.array([_majority(names.ravel()[cluster.pixels]) for cluster in clusters])
    kept = np.flatnonzero(labels == UNDERSEGMENTED if times > 1 else labels != "")
    chosen = [clusters[place] for place in kept]
    vectors = {name: described_clusters(scan, chosen, recipe) for name, recipe in MODELS.items()}
    return Described(vectors, labels[kept], np.array([len(cluster.pixels) for cluster in chosen], int))


def _majority(names: NDArray) -> str:
    sure = names[names != MIX]
    if len(sure) < len(names) / 3:
        return ""
    found, count = np.unique(sure, return_counts=True)
    share = count.max() / count.sum()
    if share < MIXED:
        return UNDERSEGMENTED
    name = str(found[count.argmax()])
    return name if share >= PURE and name in CLASSES else ""


def joined(parts: list[Described]) -> Described:
    """Return all clusters together."""
    return Described(
        {name: np.concatenate([part.vectors[name] for part in parts]) for name in MODELS},
        np.concatenate([part.labels for part in parts]).astype(str),
        np.concatenate([part.points for part in parts]),
    )


def gathered(seed: int, scenes: int, looks: tuple[int, int], jobs: int) -> Described:
    """Return the clusters of many scenes, in the same order whatever the jobs."""
    found = dict(unordered(partial(_numbered, seed, looks), range(scenes), jobs, _died))
    return joined([found[number] for number in range(scenes)])


def _numbered(seed: int, looks: tuple[int, int], number: int) -> tuple[int, Described]:
    return number, _capped(clusters_of_scene(seed, *looks, number), MOST_OF_A_SCENE)


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
    found = np.array([one.label for one in model.classify(test.vectors[name.split(",")[0]])])
    table = class_table(test.labels, found, model.labels)
    low, high = table.interval()
    weight = (found == test.labels) @ test.points / test.points.sum()
    print(f"{name}: {len(test.labels)} clusters, accuracy {table.accuracy:.4f} ({low:.4f} to {high:.4f}), "
          f"balanced {table.balanced_accuracy:.4f}, of returns {weight:.4f}")  # fmt: skip
    for margin in (0, 0.1, 0.2, 0.3, 0.5):
        found = np.array([one.label for one in model.classify(test.vectors[name.split(",")[0]], margin)])
        known = found != "unknown"
        right = np.mean(found[known] == test.labels[known])
        print(f"  margin {margin}: {known.mean():.3f} known, of these {right:.4f} right")
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
    found = _capped(gathered(SEED, options.scenes, TRAINED, options.jobs), MOST_OF_A_CLASS)
    test = {
        "as the LMS 151 shows them": gathered(TEST_SEED, options.test_scenes, FINE, options.jobs),
        "as a coarser scanner shows them": gathered(TEST_SEED + 1, options.test_scenes, COARSE, options.jobs),
    }
    print({str(label): int((found.labels == label).sum()) for label in np.unique(found.labels)})
    for name in MODELS:
        model = trained(name, found, joined(list(test.values())))
        for how, clusters in test.items():
            print_table(f"{name}, {how}", model, clusters)
        save_model(options.out / f"{name}.npz", model)


if __name__ == "__main__":
    main()
