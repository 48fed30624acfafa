"""Sydney Urban Objects: one csv an object, its class the beginning of the file's name.

De Deuge, Quadros, Hung, Douillard 2013, "Unsupervised feature learning for classification of outdoor 3D
scans", ACRA. Columns: t, intensity, id, x, y, z, azimuth, range, pid. ``folds/fold0.txt`` to ``fold3.txt``
name the files of the four parts that are left out in turn; objects of other classes are in none. The files'
z points down, as public loaders that turn it have it (the data's page does not say): objects are turned by
half a turn about x.
"""

import re
from pathlib import Path

import numpy as np

from laserimg.classify.clouds import ObjectCloud
from laserimg.classify.recipe import Recipe, describe_cloud
from laserimg.classify.source import Source
from laserimg.errors import LabelError, LaserImgError, ScanError
from laserimg.files import read_bytes, read_start
from laserimg.scan import Float32Array

_COLUMNS = 9
_UPRIGHT = np.array([1.0, -1.0, -1.0])
_NAME = re.compile(r"\w+\.\d+\.\d+\.csv")
_NAMES = ["t", "intensity", "id", "x", "y", "z", "azimuth", "range", "pid"]


def sydney_files(folder: Path) -> list[Path]:
    """Return the objects of the data set, in the folder or in ``objects`` below; none if it is another."""
    for place in (folder, folder / "objects", *sorted(folder.glob("*/objects"))):
        files = sorted(place.glob("*.csv")) if place.is_dir() else []
        if files and is_sydney(files[0]):
            return files
    return []


def is_sydney(file: Path) -> bool:
    """Tell whether a file has nine columns, and a name such as car.23.17038.csv or a time in the first."""
    try:
        first = read_start(file, 512).decode("ascii", "replace").splitlines()[0]
    except (LaserImgError, IndexError):
        return False
    fields = [field.strip() for field in first.split(",")]
    named = _NAME.fullmatch(file.name) is not None
    return len(fields) == _COLUMNS and (named or fields == _NAMES or "T" in fields[0])


def sydney_objects(folder: Path, files: list[Path]) -> list[Source]:
    """Return the objects of some files, with the folds that stand beside them.

    Raises
    ------
    LabelError
        If an object is in two folds.
    """
    folds = _folds(files[0].parent.parent) or _folds(folder)
    return [_source(file, folds.get(file.stem, -1)) for file in files]


def read_sydney(path: Path) -> ObjectCloud:
    """Return the object of a csv file.

    Raises
    ------
    ScanError
        If a line is no point, or there are too few.
    """
    rows = []
    for number, line in enumerate(read_bytes(path).decode("ascii", "replace").splitlines(), 1):
        fields = [field.strip() for field in line.split(",")]
        if fields == [""] or fields == _NAMES:
            continue
        try:
            # The time is a word such as 20110901T071453.106291.
            rows.append([float(field) for field in fields[1:_COLUMNS]])
        except ValueError:
            raise ScanError(f"line {number} is not t, intensity, id, x, y, z, azimuth, range, pid") from None
        if len(fields) != _COLUMNS:
            raise ScanError(f"line {number} has {len(fields)} fields, not {_COLUMNS}")
    table = np.array(rows, np.float64).reshape(-1, _COLUMNS - 1)
    return ObjectCloud(table[:, 2:5] * _UPRIGHT, table[:, 0])


def _source(file: Path, fold: int) -> Source:
    def describe(recipe: Recipe) -> Float32Array:
        return describe_cloud(read_sydney(file), recipe)

    return Source(str(file), file.name.split(".")[0], describe, fold)


def _folds(folder: Path) -> dict[str, int]:
    """The fold of every object by its name without suffix."""
    found: dict[str, int] = {}
    for number, file in enumerate(sorted(folder.glob("folds/*.txt"))):
        for line in file.read_text(encoding="utf-8", errors="replace").split():
            name = Path(line).stem
            if found.setdefault(name, number) != number:
                raise LabelError(f"{file}: {name} is in another fold too")
    return found
