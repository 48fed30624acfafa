"""Train the classifiers of `laserimg map`: simulate, segment, label by majority, train, test on other scenes.

    python training/map_model.py                        # writes cascades/map.npz and map_range.npz
    python training/map_model.py --scenes 20 -o /tmp    # a quick look
    python training/map_model.py --keep /tmp/scenes     # can be stopped, and goes on where it was

Scenes are streets, parks and groves, each seen by a turning LMS 151 of 760 x 1135 rays, by spinning
scanners of 64 and 128 rows, and by a terrestrial scanner of which a part is taken: fewer rows and columns,
a narrower view. Ground removal and segmentation are those of the map. A cluster has the class that holds at
least 85 % of its returns; where none holds 70 %, it is "undersegmented". Street furniture, fences, bicycles
and lorries are no class: their clusters are left out.
`map_range.npz` is for scans without reflectance. Needs the extra `simulate`; seeds are fixed.
"""

import argparse
from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

import laserimg
from laserimg.classify import ObjectModel, Recipe, class_table, save_model
from laserimg.classify.svm import LinearClassifier
from laserimg.classify.training import sharpness
from laserimg.descriptors import Layout
from laserimg.files import atomic_write, sources_sha256
from laserimg.scan import Scan
from laserimg.semantic_map.segments import described_clusters, segments_of
from laserimg.simulate.measure import simulated, staged
from laserimg.simulate.scanner import SCANNERS
from laserimg.simulate.scenes import SCENES
from laserimg.simulate.things import Scene
from laserimg.workers import unordered

SEED = 151
TEST_SEED = 152
MODELS = {
    "map": Recipe("honv+hog", views=1, size=True),
    "map_range": Recipe("honv", views=1, size=True),
}
KINDS = ("street", "street", "park", "street", "street", "grove")
# Scanners that see every scene; of those in PARTS, parts are taken.
SEEN_BY = ("lms151_turn", "spinning64", "spinning128", "terrestrial")
PARTS = ("spinning64", "terrestrial")
PURE, MIXED = 0.85, 0.70
MIX, MIX_M = "mix", 0.2
UNDERSEGMENTED = "undersegmented"
OTHER = "other"
# Parts of houses and what is like them, plants, short poles; the ground is no class.
CLASS_OF = {
    "facade": "building", "window": "building", "door": "building", "low_wall": "building",
    "hedge": "tree", "shrub": "tree", "tree": "tree", "bollard": "pole", "lamp_post": "pole",
    "sign_post": "pole", "traffic_light": "pole", "car": "car", "person": "person", "ground": "",
}  # fmt: skip
# Of one class and scanner.
MOST_OF_A_CLASS, MOST_OF_A_SCENE = 300, 12
# Of the undersegmented, which are 3 in 100 clusters of scenes: with 120 they took the place of cars.
MOST_MIXED = 50
# Cost of an error. Of 0.3 to 10 the best on clusters of other scenes; ten times as much costs 1 % of them.
COST = 1.0
# Decision values closer than this are "unknown".
MARGIN = 0.15
# What scenes look like, and how they are described, depends on it.
PROGRAM = Path(laserimg.__file__).parent


class Described(NamedTuple):
    """Clusters: vectors of the recipe "map", class and number of returns of each."""

    vectors: NDArray
    labels: NDArray
    points: NDArray


def clusters_of_scene(seed: int, number: int) -> dict[str, Described]:
    """Simulate a scene and describe its clusters as each scanner shows them, in half precision."""
    random = np.random.default_rng([seed, number])
    scene = {**SCENES, "grove": grove}[KINDS[number % len(KINDS)]](random)
    labels = np.array([CLASS_OF.get(thing.kind, OTHER) for thing in scene.things] + [MIX])
    found, stage = {}, staged(scene)
    for name in SEEN_BY:
        seen = simulated(scene, 0, SCANNERS[name], seed * 1_000_003 + number, stage)
        # The truth is that of the middle of a beam; a return may be from its edge, or from between surfaces.
        sure = np.abs(seen.scan.range - seen.truth_range) < MIX_M
        look = seen.scan, np.where(sure, labels[seen.thing], MIX)
        looks = [look] if name != "terrestrial" else []
        if name in PARTS:
            looks.append(part_of(*look, random))
        found[name] = _capped(joined([_described(*one) for one in looks]), MOST_OF_A_SCENE)
    return found


def grove(random: np.random.Generator) -> Scene:
    """Return a park with the trees and hedges of three more, which grow into each other."""
    scene, *others = (SCENES["park"](random) for _ in range(4))
    green = [thing for other in others for thing in other.things if thing.kind in ("tree", "hedge")]
    free = [thing for thing in green if np.hypot(*thing.mesh.vertices[:, :2].T).min() > 1.5]
    return Scene((*scene.things, *free), scene.scanners, "grove")


def part_of(scan: Scan, names: NDArray, random: np.random.Generator) -> tuple[Scan, NDArray]:
    """Return a scan as a coarser scanner with another field of view might give it.

    Every n-th row and column of what is left, up to 10 % of the returns lost, and in one of two a
    reflectance with another trend over range.
    """
    height, width = scan.shape
    up, across = (
        int(random.integers(1, max(3, size // least))) for size, least in ((height, 90), (width, 400))
    )
    rows, columns = np.arange(int(random.integers(up)), height, up), np.arange(0, width, across)
    wraps = scan.wraps and random.random() < 0.5
    if not wraps:
        columns = columns[: int(len(columns) * random.uniform(0.15, 0.4))]
    part = rows[:, None], columns
    range_m = scan.range[part] * (random.random((len(rows), len(columns))) >= random.uniform(0, 0.1))
    values = scan.reflectance[part]
    if random.random() < 0.5:
        values = values * np.maximum(range_m, 1) ** np.float32(random.choice([-2, 2]))
    return Scan(range_m, scan.directions[part], values, scan.world_from_scan, wraps), names[part]


def _described(scan: Scan, names: NDArray) -> Described:
    """Describe the clusters of a class."""
    clusters = segments_of(scan).clusters
    labels = np.array([_majority(names.ravel()[cluster.pixels]) for cluster in clusters])
    kept = np.flatnonzero((labels != "") & (labels != OTHER))
    chosen = [clusters[place] for place in kept]
    vectors = described_clusters(scan, chosen, MODELS["map"]).astype(np.float16)
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
    return name if share >= PURE else ""


def joined(parts: list[Described]) -> Described:
    """Return all clusters together."""
    return Described(
        np.concatenate([part.vectors for part in parts]),
        np.concatenate([part.labels for part in parts]).astype(str),
        np.concatenate([part.points for part in parts]),
    )


def gathered(seed: int, scenes: int, jobs: int, keep: Path | None = None) -> dict[str, Described]:
    """Return the clusters of many scenes as each scanner shows them, in the same order whatever the jobs.

    Those of scenes are kept in a folder, if one is given, and read from there if the same program made them.
    """
    found = dict(unordered(partial(_numbered, seed, keep), range(scenes), jobs, _died))
    return {name: joined([found[number][name] for number in range(scenes)]) for name in SEEN_BY}


def _numbered(seed: int, keep: Path | None, number: int) -> tuple[int, dict[str, Described]]:
    if keep is None:
        return number, clusters_of_scene(seed, number)
    path = keep / f"{seed}-{number}.npz"
    found = read_kept(path)
    if found is None:
        found = clusters_of_scene(seed, number)
        write_kept(path, found)
    return number, found


def read_kept(path: Path) -> dict[str, Described] | None:
    """Return the clusters of a scene as they were kept, None if not by this program."""
    if not path.exists():
        return None
    with np.load(path) as arrays:
        if str(arrays["program"]) != sources_sha256(PROGRAM):
            return None
        return {
            name: Described(*(arrays[f"{name}.{part}"] for part in Described._fields)) for name in SEEN_BY
        }


def write_kept(path: Path, found: dict[str, Described]) -> None:
    """Keep the clusters of a scene."""
    arrays = {f"{name}.{part}": getattr(one, part) for name, one in found.items() for part in one._fields}
    with atomic_write(path) as temporary, temporary.open("wb") as file:
        np.savez(file, program=np.array(sources_sha256(PROGRAM)), **arrays)


def _died(number: int) -> tuple[int, dict[str, Described]]:
    raise SystemExit(f"the process that made scene {number} was killed")


def _capped(found: Described, most: int, most_mixed: int | None = None) -> Described:
    """Keep at most so many clusters of a class, and of the undersegmented, drawn with a fixed seed."""
    random = np.random.default_rng(0)
    limits = {} if most_mixed is None else {UNDERSEGMENTED: most_mixed}
    kept = np.sort(np.concatenate(list(_chosen(found.labels, most, limits, random))))
    return Described(found.vectors[kept], found.labels[kept], found.points[kept])


def _chosen(
    labels: NDArray, most: int, limits: Mapping[str, int], random: np.random.Generator
) -> Iterator[NDArray]:
    yield np.zeros(0, int)
    for label in np.unique(labels):
        yield random.permutation(np.flatnonzero(labels == label))[: limits.get(str(label), most)]


def vectors_of(name: str, found: Described) -> NDArray:
    """Return the vectors of a recipe: those without HOG are a part of those with it, scaled anew."""
    vectors = found.vectors.astype(np.float32)
    if name == "map":
        return vectors
    honv = vectors[:, : Layout().honv_length]
    length = np.linalg.norm(honv, axis=1, keepdims=True)
    return np.concatenate([honv / np.where(length > 0, length, 1), vectors[:, -3:]], axis=1)


def trained(name: str, found: Described, test: Described) -> ObjectModel:
    """Train a model; its confidences are fitted to the scenes of the test."""
    machine = LinearClassifier(COST).fit(vectors_of(name, found), found.labels)
    decisions = np.asarray(machine.decision_function(vectors_of(name, test)))
    labels = tuple(str(label) for label in machine.classes_)
    place = np.array([labels.index(label) for label in test.labels])
    sharp = sharpness(decisions, place)
    return ObjectModel(labels, machine.weights_, machine.bias_, MODELS[name], sharp, MARGIN)


def print_table(name: str, scanner: str, model: ObjectModel, test: Described) -> None:
    """Print what the clusters of the test scenes were taken for."""
    vectors = vectors_of(name, test)
    found = np.array([one.label for one in model.classify(vectors)])
    table = class_table(test.labels, found, model.labels)
    low, high = table.interval()
    weight = (found == test.labels) @ test.points / test.points.sum()
    print(f"{name}, {scanner}: {len(test.labels)} clusters, accuracy {table.accuracy:.4f}", end=" ")
    print(f"({low:.4f} to {high:.4f}), balanced {table.balanced_accuracy:.4f}, of returns {weight:.4f}")
    for margin in (0, 0.1, 0.2, 0.3, 0.5):
        found = np.array([one.label for one in model.classify(vectors, margin)])
        known = found != "unknown"
        right = np.mean(found[known] == test.labels[known])
        print(f"  margin {margin}: {known.mean():.3f} known, of these {right:.4f} right")
    print(f"  {'':<15}{'  '.join(table.labels)}  unknown")
    for label, row in zip(table.labels, table.counts.astype(int).tolist(), strict=True):
        print(f"  {label:<15}{row}")


def main() -> None:
    """Make both models and print their tables."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--scenes", type=int, default=300)
    parser.add_argument("--test-scenes", type=int, default=18)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument(
        "--keep", type=Path, help="folder for the clusters of scenes, so that a run can go on"
    )
    parser.add_argument("-o", "--out", type=Path, default=Path(__file__).parents[1] / "cascades")
    options = parser.parse_args()
    seen = gathered(SEED, options.scenes, options.jobs, options.keep)
    found = joined([_capped(part, MOST_OF_A_CLASS, MOST_MIXED) for part in seen.values()])
    test = gathered(TEST_SEED, options.test_scenes, options.jobs, options.keep)
    print({str(label): int((found.labels == label).sum()) for label in np.unique(found.labels)})
    for name in MODELS:
        model = trained(name, found, joined(list(test.values())))
        for scanner, clusters in test.items():
            print_table(name, scanner, model, clusters)
        save_model(options.out / f"{name}.npz", model)


if __name__ == "__main__":
    main()
