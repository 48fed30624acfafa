"""Tables of real single objects: what each set of features gives, with intervals and controls.

    python tools/object_tables.py dales
    python tools/object_tables.py poles --views 8 --repeats 10

The archives are those of the shared data (``LASERIMG_DATA``); they are unpacked to a temporary folder.
Every row is the mean of repeated stratified 5-fold runs; intervals are 95 %, bootstrap over objects. Rows
with "size only" say what three numbers without any image give; rows with "range" in place of reflectance
say what reflectance adds.
"""

import argparse
import json
import os
import tarfile
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from laserimg.classify import ObjectCloud, Recipe, class_table, describe_images, views_of_cloud
from laserimg.classify.recipe import FEATURES, size_numbers
from laserimg.classify.sources import read_cloud
from laserimg.classify.validation import leave_one_out, predicted, repeated_folds

DATA = Path(os.environ.get("LASERIMG_DATA", Path(__file__).parents[2] / "shared" / "data"))
ARCHIVE = {"dales": "dales_objects/objects.tar.xz", "poles": "pole_objects/objects.tar.xz"}
DALES = ("building", "car", "fence", "pole", "tree")
POLES = ("SL", "PS", "Pole", "SS", "STL")


class Row(NamedTuple):
    """One line of the table."""

    features: str
    appearance: str
    size: bool
    accuracy: float
    low: float
    high: float
    balanced: float
    left_out: float


def label_of(which: str, file: Path) -> str | None:
    """Return the class that a file's name tells, None for what is not part of the task."""
    if which == "dales":
        return DALES[int(file.stem) // 100]
    prefix = file.stem.split("_")[0]
    return prefix if prefix in POLES else None


def read_objects(which: str, folder: Path) -> tuple[list[ObjectCloud], np.ndarray]:
    """Unpack an archive and return its objects without stray points, and their classes."""
    with tarfile.open(DATA / ARCHIVE[which]) as archive:
        archive.extractall(folder, filter="data")
    clouds, labels = [], []
    for file in sorted(path for path in folder.rglob("*") if path.suffix in (".xyz", ".csv")):
        label = label_of(which, file)
        if label is not None:
            cloud = read_cloud(file, 1.0 if which == "dales" else 0.001)
            assert cloud is not None
            clouds.append(cloud.without_strays())
            labels.append(label)
    return clouds, np.array(labels)


def row_of(vectors: np.ndarray, labels: np.ndarray, repeats: int, what: tuple[str, str, bool]) -> Row:
    """Cross-validate described objects."""
    runs = [predicted(run, labels) for run in repeated_folds(vectors, labels, 5, repeats)]
    return summed_up(runs, predicted(leave_one_out(vectors, labels), labels), labels, what)


def summed_up(runs: list, left_out: np.ndarray, labels: np.ndarray, what: tuple[str, str, bool]) -> Row:
    """Return accuracies and their interval from what objects were taken for in every run."""
    right = np.mean([run == labels for run in runs], axis=0)
    draws = np.random.default_rng(0).integers(0, len(right), (4000, len(right)))
    low, high = np.quantile(right[draws].mean(axis=1), [0.025, 0.975])
    balanced = class_table(labels, runs).balanced_accuracy
    return Row(
        *what, float(right.mean()), float(low), float(high), balanced, float((left_out == labels).mean())
    )


def size_only(clouds: list[ObjectCloud], labels: np.ndarray, repeats: int) -> Iterator[Row]:
    """Classify by the three size numbers alone: linear, and by a kernel of Gaussian shape."""
    from sklearn.model_selection import LeaveOneOut, StratifiedKFold, cross_val_predict
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import StandardScaler
    from sklearn.svm import SVC

    sizes = np.array([size_numbers(cloud.points) for cloud in clouds])
    yield row_of(sizes - sizes.mean(axis=0), labels, repeats, ("size only, linear", "-", True))
    machine = make_pipeline(StandardScaler(), SVC(C=10))
    folds = min(5, int(np.unique(labels, return_counts=True)[1].min()))
    runs = [
        cross_val_predict(machine, sizes, labels, cv=StratifiedKFold(folds, shuffle=True, random_state=seed))
        for seed in range(repeats)
    ]
    left_out = cross_val_predict(machine, sizes, labels, cv=LeaveOneOut())
    yield summed_up(runs, left_out, labels, ("size only, RBF", "-", True))


def rows(clouds: list[ObjectCloud], labels: np.ndarray, views: int, repeats: int) -> Iterator[Row]:
    """Yield a row for every set of features, with and without size, and the controls."""
    yield from size_only(clouds, labels, repeats)
    images = [views_of_cloud(cloud, views) for cloud in clouds]
    with_reflectance = all(cloud.reflectance is not None for cloud in clouds)
    for features in FEATURES:
        appearances = ("reflectance", "range") if with_reflectance else ("range",)
        for appearance in appearances[:1] if features == "honv" else appearances:
            for size in (False, True):
                recipe = Recipe(features, views, size, appearance)
                pairs = zip(images, clouds, strict=True)
                vectors = np.stack([describe_images(image, cloud.points, recipe) for image, cloud in pairs])
                shown = "-" if features == "honv" else appearance
                yield row_of(vectors, labels, repeats, (features, shown, size))


def main() -> None:
    """Print the table of one archive."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("which", choices=("dales", "poles"))
    parser.add_argument("--views", type=int, default=4)
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        clouds, labels = read_objects(arguments.which, Path(folder))
    found = rows(clouds, labels, arguments.views, arguments.repeats)
    if arguments.json:
        print(json.dumps([row._asdict() for row in found], indent=1))
        return
    counts = ", ".join(f"{name} {n}" for name, n in zip(*np.unique(labels, return_counts=True), strict=True))
    print(f"{len(labels)} objects: {counts}; {arguments.views} views, 5 folds, {arguments.repeats} times")
    print(f"{'features':20}{'gradients of':14}{'size':6}{'accuracy':10}{'95 %':16}{'balanced':10}left out")
    for row in found:
        interval = f"{row.low:.3f}-{row.high:.3f}"
        print(
            f"{row.features:20}{row.appearance:14}{'yes' if row.size else 'no':6}{row.accuracy:<10.4f}"
            f"{interval:16}{row.balanced:<10.3f}{row.left_out:.4f}",
            flush=True,
        )


if __name__ == "__main__":
    main()
