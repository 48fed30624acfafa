"""A map of files: read, mapped and drawn one by one, in parallel, and written as one."""

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import lru_cache, partial
from pathlib import Path

from threadpoolctl import threadpool_limits

from laserimg.errors import LaserImgError, ScanError
from laserimg.files import changed_ns, write_text
from laserimg.geometry.mounting import with_up
from laserimg.images import write_png
from laserimg.readers import read_file
from laserimg.scan import Scan
from laserimg.semantic_map.maps import MappedScan, SemanticMap, map_scan
from laserimg.semantic_map.models import MapModels
from laserimg.semantic_map.page import page
from laserimg.semantic_map.panorama import panorama
from laserimg.semantic_map.ply import write_ply
from laserimg.semantic_map.record import record
from laserimg.semantic_map.top_view import top_view
from laserimg.workers import unordered

PANORAMAS, PLY, TOP, PAGE, RECORD = "panoramas", "map.ply", "top.png", "map.html", "map.json"


@dataclass(frozen=True, slots=True)
class MapOptions:
    """How scans are mapped.

    Parameters
    ----------
    model : Path or None
        Classifier for all scans; None for those that ship.
    margin : float or None
        In place of the model's.
    min_range : float or None
        Metres; nearer returns are left out.
    up : str or None
        Axis of the scanner that points up; None for the pose in the file.
    """

    model: Path | None = None
    margin: float | None = None
    min_range: float | None = None
    up: str | None = None


@dataclass(frozen=True, slots=True)
class MappedFile:
    """What became of one file: its scans, or why there are none."""

    file: Path
    scans: list[MappedScan] = field(default_factory=list)
    error: str = ""


def map_files(
    files: Sequence[tuple[Path, str]], options: MapOptions, out: Path, jobs: int = 1
) -> Iterator[MappedFile]:
    """Map the scans of files and write the panorama of each; yields files as they are finished.

    Parameters
    ----------
    files : sequence of (file, name)
        The name is that of its panorama, without suffix.
    options : MapOptions
    out : Path
        Folder for the results.
    jobs : int
        Worker processes.

    Raises
    ------
    LaserImgError
        If there is no such model; a file that cannot be read is no error.
    """
    MapModels.load(options.model)
    work = partial(_map_file, options=options, out=out)
    yield from unordered(work, files, min(jobs, max(len(files), 1)), _died)


def write_map(whole: SemanticMap, out: Path, title: str) -> None:
    """Write `map.html`, `map.json`, `map.ply` and `top.png`."""
    cloud = whole.cloud()
    # All is made before any of it is written.
    facts, view, text = record(whole), top_view(whole, cloud, title), page(whole, cloud, title)
    write_text(out / RECORD, json.dumps(facts, indent=1) + "\n")
    write_ply(out / PLY, whole, cloud)
    write_png(out / TOP, view)
    write_text(out / PAGE, text)


@lru_cache(maxsize=1)
def _models(path: Path | None, _changed_ns: int) -> MapModels:
    """The models of a worker: loaded once, not once a file."""
    return MapModels.load(path)


def _map_file(task: tuple[Path, str], options: MapOptions, out: Path) -> MappedFile:
    file, name = task
    models, scans = _models(options.model, changed_ns(options.model) if options.model else 0), []
    try:
        with threadpool_limits(1):
            for scan in read_file(file):
                one = map_scan(_prepared(scan, options), models, options.margin)
                number = f".{scan.index}" if scan.index else ""
                write_png(
                    out / PANORAMAS / f"{name}{number}.png", panorama(one, models.labels, name + number)
                )
                scans.append(one.in_world())
    except ScanError as error:
        return MappedFile(file, error=str(error))
    except LaserImgError as error:
        return MappedFile(file, error=f"{file}: {error}")
    return MappedFile(file, scans)


def _prepared(scan: Scan, options: MapOptions) -> Scan:
    scan = scan.with_limits(options.min_range)
    if not scan.valid.any():
        raise LaserImgError(f"no return between {scan.min_range:g} and {scan.max_range:g} m")
    return scan if options.up is None else with_up(scan, options.up)


def _died(task: tuple[Path, str]) -> MappedFile:
    return MappedFile(task[0], error=f"{task[0]}: the process that worked on it was killed: out of memory?")
