"""What the shipped detectors cost, beside plain search: rows of `tools/benchmark.py`."""

import os
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path

import cv2

from laserimg.cascade.xml import read_cascade_info
from laserimg.detectors.candidate import Candidate
from laserimg.detectors.search import Searched, WindowDetector
from laserimg.detectors.shipped import detector_files, shipped_folder
from laserimg.evidence import Evidence
from laserimg.images import make_images
from laserimg.pipeline import Pipeline
from laserimg.scan import Scan
from rows import Row, best_times, faster, under, within

FRONTAL_FACE = "haarcascade_frontalface_default.xml"


def detector_rows(name: str, scan: Scan) -> Iterator[Row]:
    """The whole pipeline beside one plain search, and where its time goes."""
    gray = cv2.cvtColor(make_images(scan, ["normals_view"])["normals_view"], cv2.COLOR_RGB2GRAY)
    pipeline = Pipeline.from_folder()
    classes = sum(len(getattr(one, "stages", ())) for one in pipeline.detectors)
    what = f"pipeline, {classes} classes, {name}"
    for peer, plain, at_most in _plain_cascades():
        if plain is None:
            yield Row(what, "", peer, "not found", "", f"<= {at_most:g} x" if at_most else "", None)
        elif at_most:
            yield within(what, lambda: pipeline(scan), peer, partial(plain.detectMultiScale, gray), at_most)
        else:
            (theirs,) = best_times(partial(plain.detectMultiScale, gray))
            yield Row("  for comparison", "", peer, f"{theirs * 1e3:.1f} ms", "", "", None)
    evidence = pipeline.observe(scan)
    yield under("  floor, regions and images", lambda: pipeline.observe(scan), None)
    for window in _windows(pipeline):
        yield under(f"  cascade {window.model.name}", partial(window, evidence), None)
    yield under("  all cascades, sharing the scan", lambda: _all_found(pipeline, evidence), None)
    detectors = pipeline.detectors
    yield under("  cascades and second stages", lambda: [one(evidence) for one in detectors], None)
    yield under("  the same, measured and checked", lambda: pipeline.judge(evidence), None)


def _plain_cascades() -> Iterator[tuple[str, cv2.CascadeClassifier | None, float | None]]:
    """Peers with what is wanted of them: OpenCV's own of 25 stages, and the first that ships.

    OpenCV's wheels hold `FRONTAL_FACE` before version 5; with later ones, name a copy in the variable
    `LASERIMG_FRONTAL_FACE`. Scale factor 1.1 is the default of `detectMultiScale`.
    """
    beside = Path(cv2.__file__).parent / "data" / FRONTAL_FACE
    own = Path(os.environ.get("LASERIMG_FRONTAL_FACE", beside))
    yield "plain search, 25 stages", cv2.CascadeClassifier(str(own)) if own.exists() else None, 5.0
    shipped = next(path for path in detector_files(shipped_folder()) if path.suffix == ".xml")
    stages = read_cascade_info(shipped).stages
    yield f"plain, {shipped.stem}, {stages} stages", cv2.CascadeClassifier(str(shipped)), None


def scale_rows(name: str, scan: Scan) -> Iterator[Row]:
    """Metric beside plain search, cascade by cascade."""
    pipeline = Pipeline.from_folder()
    evidence = pipeline.observe(scan)
    for window in _windows(pipeline):
        plain = replace(window, scale="plain")
        peer = f"plain: {len(window(evidence))} against {len(plain(evidence))} proposed"
        yield faster(
            f"{window.model.name}, {name}", partial(window, evidence), peer, partial(plain, evidence)
        )


def _all_found(pipeline: Pipeline, evidence: Evidence) -> list[list[Candidate]]:
    searched = Searched(evidence)
    return [window.found(searched) for window in _windows(pipeline)]


def _windows(pipeline: Pipeline) -> list[WindowDetector]:
    return [window for one in pipeline.detectors for window in getattr(one, "windows", ())]
