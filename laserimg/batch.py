"""Detection over sets of scans: in parallel, resumable, one bad file never stops the rest."""

import hashlib
import json
import os
import traceback
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from functools import lru_cache, partial
from pathlib import Path
from typing import Any

import cv2
from threadpoolctl import threadpool_limits

import laserimg
from laserimg.build import Build
from laserimg.draw import overlay
from laserimg.errors import LaserImgError
from laserimg.files import make_folder, sha256_of, write_text
from laserimg.formats.coco import CocoFile
from laserimg.formats.coco_file import coco_text, read_coco, write_coco
from laserimg.formats.detections_csv import write_detections_csv
from laserimg.geometry.mounting import rotated, with_up
from laserimg.images import write_png
from laserimg.pipeline import Pipeline
from laserimg.readers import read_file
from laserimg.records import merged, scan_record
from laserimg.scan import Scan
from laserimg.settings import Settings, fingerprint
from laserimg.workers import unordered

SCANS, OVERLAYS = "scans", "overlays"


@dataclass(frozen=True, slots=True)
class Task:
    """One file of a run.

    Parameters
    ----------
    file : Path
    name : str
        Relative to the common folder of the inputs, with forward slashes.
    key : str
        Hash of everything the file's results depend on.
    """

    file: Path
    name: str
    key: str

    def result(self, folder: Path, index: int, suffix: str) -> Path:
        """Return where a result of a scan is: folders as the inputs', a number from the second scan on."""
        return folder / f"{self.name}{f'.{index}' if index else ''}{suffix}"

    @property
    def done_name(self) -> str:
        """Name of the file that says that all scans of the file are finished."""
        return f"{self.name}.done"


@dataclass(frozen=True, slots=True)
class Done:
    """What became of one file: the records of its scans, or why there are none.

    Parameters
    ----------
    name : str
    scans : int
    error : str
        "" when all went well.
    resumed : bool
        The results of an earlier run were kept.
    """

    name: str
    scans: int = 0
    error: str = ""
    resumed: bool = False


def common_folder(files: Sequence[Path]) -> Path:
    """Return the folder that the names of the inputs are relative to."""
    return Path(os.path.commonpath([file.absolute().parent for file in files]))


def tasks_of(files: Sequence[Path], settings: Settings) -> list[Task]:
    """Return the tasks of a run, with the hash that says whether an earlier result still holds."""
    run_key = fingerprint(settings, Build(settings).files)
    folder = common_folder(files)
    return [Task(file, file.absolute().relative_to(folder).as_posix(), _key(file, run_key)) for file in files]


def _key(file: Path, run_key: str) -> str:
    try:
        stat = file.stat()
        parts = (str(file.absolute()), stat.st_size, stat.st_mtime_ns, run_key)
    except OSError:
        parts = (str(file.absolute()), run_key)
    return hashlib.sha256(json.dumps(parts).encode()).hexdigest()


def run(
    tasks: Sequence[Task], settings: Settings, out: Path, jobs: int = 1, force: bool = False
) -> Iterator[Done]:
    """Detect objects in every file; yields what became of each as it is finished.

    Parameters
    ----------
    tasks : sequence of Task
    settings : Settings
    out : Path
        Folder for the results.
    jobs : int
        Worker processes; each runs OpenCV and BLAS with one thread, as one job alone does.
    force : bool
        Redo files whose results of an earlier run still hold.

    Raises
    ------
    LaserImgError
        If rules, detectors or candidates are wrong; a file that cannot be read is not an error.
    """
    Build(settings, len(tasks) == 1).pipeline()  # wrong rules end the run before it begins
    waiting = []
    for task in tasks:
        scans = 0 if force else finished_scans(task, out, settings.overlays)
        if scans:
            yield Done(task.name, scans, resumed=True)
        else:
            waiting.append(task)
    if waiting:
        make_folder(out)  # before hours of work, not after
    work = partial(_process, settings=settings, out=out, only_scan=len(tasks) == 1)
    yield from unordered(work, waiting, min(jobs, max(len(waiting), 1)), _died)


def finished_scans(task: Task, out: Path, overlays: bool) -> int:
    """Return the number of scans of a file whose results still hold; 0 if it must be done.

    Results that are gone or damaged are made anew, pictures too if they are asked for.
    """
    try:
        state = json.loads((out / SCANS / task.done_name).read_text(encoding="utf-8"))
        scans = state["scans"] if state["key"] == task.key else 0
    except (OSError, ValueError, KeyError, TypeError):
        return 0
    if not isinstance(scans, int) or not all(map(_is_whole, record_paths(task, out, scans))):
        return 0
    pictures = (task.result(out / OVERLAYS, index, ".png") for index in range(scans) if overlays)
    return scans if all(path.exists() for path in pictures) else 0


def _is_whole(record: Path) -> bool:
    try:
        return bool(read_coco(record).images)
    except LaserImgError:
        return False


def record_paths(task: Task, out: Path, scans: int) -> list[Path]:
    """Return where the results of a file's scans are."""
    return [task.result(out / SCANS, index, ".json") for index in range(scans)]


def _process(task: Task, settings: Settings, out: Path, only_scan: bool) -> Done:
    """Run the pipeline over the scans of one file and write the result of each."""
    cv2.setNumThreads(1)
    try:
        with threadpool_limits(1):
            pipeline = _pipeline(settings, only_scan)
            scans = 0
            for scan in read_file(task.file):
                _process_scan(pipeline, _mounted(scan, settings), task, settings, out)
                scans += 1
    except LaserImgError as error:
        return Done(task.name, error=str(error))
    except Exception as error:
        return Done(task.name, error=f"{task.file}: {fault(error)}")
    state = {"key": task.key, "scans": scans}
    write_text(out / SCANS / task.done_name, json.dumps(state))
    return Done(task.name, scans)


def fault(error: Exception) -> str:
    """Return what to tell of an error that nobody expected: what, and where in the package."""
    place = traceback.extract_tb(error.__traceback__)[-1]
    return f"a fault of laserimg, please report it: {error!r} in {Path(place.filename).name}:{place.lineno}"


def _died(task: Task) -> Done:
    return Done(task.name, error=f"{task.file}: the process that worked on it was killed: out of memory?")


@lru_cache(maxsize=1)
def _pipeline(settings: Settings, only_scan: bool) -> Pipeline:
    """The pipeline of a worker: made once, not once a file."""
    return Build(settings, only_scan).pipeline()


def _process_scan(pipeline: Pipeline, scan: Scan, task: Task, settings: Settings, out: Path) -> None:
    result = pipeline(scan)
    record = scan_record(result, task.name, pipeline.rules.labels, settings.rejected, settings.split_seam)
    if settings.overlays:
        write_png(task.result(out / OVERLAYS, scan.index, ".png"), overlay(result))
    write_text(task.result(out / SCANS, scan.index, ".json"), coco_text(record))


def _mounted(scan: Scan, settings: Settings) -> Scan:
    if settings.up is not None:
        return with_up(scan, settings.up)
    return scan if settings.rotate is None else rotated(scan, *settings.rotate)


def assemble(tasks: Sequence[Task], done: Sequence[Done], settings: Settings, out: Path) -> CocoFile:
    """Write `detections.json`, `detections.csv`, `errors.json` and `config.json` of a run.

    Returns
    -------
    CocoFile
        What `detections.json` holds.
    """
    by_name = {entry.name: entry for entry in done}
    paths = [path for task in tasks for path in record_paths(task, out, by_name[task.name].scans)]
    build = Build(settings)
    labels = build.pipeline().rules.labels
    coco = merged((read_coco(path) for path in paths), labels, run_info(build))
    write_coco(out / "detections.json", coco)
    write_detections_csv(out / "detections.csv", coco)
    errors = [{"file_name": entry.name, "error": entry.error} for entry in done if entry.error]
    write_text(out / "errors.json", json.dumps(sorted(errors, key=lambda e: e["file_name"]), indent=1) + "\n")
    write_text(out / "config.json", json.dumps(run_info(build), indent=1) + "\n")
    return replace(coco, source=str(out / "detections.json"))


def run_info(build: Build) -> dict[str, Any]:
    """Return what made the results: version, rules, detectors and configuration."""
    return {
        "version": laserimg.__version__,
        "rules": {"file": str(build.rules_file), "sha256": sha256_of(build.rules_file)},
        "detectors": [{"file": file.name, "sha256": sha256_of(file)} for file in build.model_files],
        "configuration": asdict(build.settings),
    }
