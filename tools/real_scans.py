"""What the shipped detectors find on real scans, with the default rules and no tuning per scan.

    python tools/real_scans.py
    python tools/real_scans.py --cascades other-seed/ --sets office_room,corridor -o real

A row is a class of a set: labelled objects, those found (IoU of the candidate's rectangle with the truth at
least 0.4 for boxes drawn by hand, 0.3 for rectangles of 3D boxes), and false positives a scan, within 4.5 m
indoors and at any range. Only the labelled field of view counts; buses, trucks, riders and the like are
ignored. Classes that are not labelled in a set have "-", and all their detections count as false, which they
need not be; "all" is the sum over classes. Below the table: every labelled object that was missed, and what
became of the candidate that fits it best.
"""

import argparse
import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

import cv2
import numpy as np

from laserimg.boxes import iou
from laserimg.build import Build
from laserimg.draw import overlay
from laserimg.evaluate.matching import match
from laserimg.files import write_text
from laserimg.formats.coco import Annotation
from laserimg.pipeline import Finding, Pipeline, Result
from laserimg.rules.edit import set_rules
from laserimg.rules.file import SHIPPED
from laserimg.scan import Scan
from laserimg.settings import Settings
from laserimg.sheet import Sheet
from real_sets import SETS, RealSet

TRUTH, IGNORED = (255, 220, 0), (150, 150, 150)


@dataclass(slots=True)
class Row:
    """The figures of one class of one set; what is not labelled has no objects, only detections."""

    set: str
    label: str
    min_points: int
    is_labelled: bool
    scans: int = 0
    labelled: int = 0
    found: int = 0
    false_near: int = 0
    false_all: int = 0

    def __str__(self) -> str:
        share = f"{self.found / self.labelled:.2f}" if self.labelled else "-"
        counts = (self.labelled, self.found, share) if self.is_labelled else ("-", "-", "-")
        near, every = (count / max(self.scans, 1) for count in (self.false_near, self.false_all))
        what = f"{self.set:17}{self.label:13}{self.min_points:>7}{counts[0]:>6}{counts[1]:>6}{counts[2]:>6}"
        return f"{what}{near:9.2f}{every:9.2f}{self.scans:7d}"


COUNTS = f"{'n':>6}{'found':>6}{'share':>6}{'FP near':>9}{'FP all':>9}{'scans':>7}"
HEADING = f"{'set':17}{'class':13}{'points':>7}{COUNTS}"


def pipeline_of(real: RealSet, cascades: str | None, rules: Path | None, out: Path) -> Pipeline:
    """Return the pipeline of `laserimg detect`, with the rules that the set allows to be changed."""
    file = rules or SHIPPED
    if real.rules:
        changed = out / f"{real.name}.rules.toml"
        write_text(changed, set_rules(file.read_text(encoding="utf-8"), real.rules, str(file)))
        file = changed
    return Build(Settings(rules=str(file), cascades=cascades)).pipeline()


def measure(real: RealSet, pipeline: Pipeline, out: Path) -> tuple[list[Row], list[str]]:
    """Return the rows of a set and a line for each missed object; write the pictures."""
    labels = dict.fromkeys((*real.classes, *pipeline.rules.labels))
    rows = {
        (label, least): Row(real.name, label, least, label in real.classes)
        for least in real.min_points
        for label in labels
    }
    missed = []
    for scan, truths in real.scans():
        result = pipeline(scan)
        for least, truth in zip(real.min_points, truths, strict=True):
            for label in labels:
                boxes = [entry for name, entry in truth if name == label]
                missed += _count(rows[label, least], result, boxes, real)
        _draw(result, truths[-1], out / f"{real.name}_{_name(scan)}.png")
    first = [row for row in rows.values() if row.min_points == real.min_points[0]]
    kept = [row for row in rows.values() if row.is_labelled or (row in first and row.false_all)]
    return [*kept, _total(first)], list(dict.fromkeys(missed))


def _total(rows: list[Row]) -> Row:
    """What was detected in excess of the labels, over all classes."""
    near, every = sum(row.false_near for row in rows), sum(row.false_all for row in rows)
    first = rows[0]
    return Row(first.set, "all", first.min_points, False, first.scans, false_near=near, false_all=every)


def _count(row: Row, result: Result, truth: list[Annotation], real: RealSet) -> Iterator[str]:
    scan = result.evidence.scan
    wrap = scan.shape[1] if scan.wraps else None
    found = [finding for finding in result.detections if finding.label == row.label]
    ignore = np.array([bool(entry.iscrowd) for entry in truth], bool)
    boxes = np.array([entry.bbox for entry in truth], float).reshape(-1, 4)
    scores = np.array([finding.score for finding in found])
    detected = np.array([finding.box for finding in found], float).reshape(-1, 4)
    matches = match(detected, scores, boxes, ignore, real.min_iou, wrap)
    row.scans += 1
    row.labelled += int((~ignore).sum())
    row.found += int((matches.truth >= 0).sum())
    wrong = [finding for k, finding in enumerate(found) if matches.truth[k] < 0 and not matches.ignored[k]]
    row.false_all += len(wrong)
    row.false_near += sum(one.size is not None and one.size.range <= real.near_m for one in wrong)
    for k in np.flatnonzero(~ignore):
        if k not in matches.truth:
            fate = _best(result, row.label, boxes[k], wrap)
            yield f"{real.name} {_name(scan)} {row.label} {truth[k].bbox}: {fate}"


def _best(result: Result, label: str, box: np.ndarray, wrap: int | None) -> str:
    """What became of the candidate that fits a missed object best."""
    own: list[Finding] = [finding for finding in result.findings if finding.label == label]
    if not own:
        return "no candidate of this class"
    overlaps = iou([finding.box for finding in own], [box], wrap)[:, 0]
    best = own[int(np.argmax(overlaps))]
    return f"best candidate ({best.candidate.source}) IoU {overlaps.max():.2f}: {best.reason or 'accepted'}"


def _draw(result: Result, truth: list[tuple[str, Annotation]], path: Path) -> None:
    sheet, picture = Sheet.of(result.evidence.scan), overlay(result)
    for _, entry in truth:
        colour = IGNORED if entry.iscrowd else TRUTH
        for x, y, w, h in sheet.places(entry.bbox):
            cv2.rectangle(picture, (round(x), round(y)), (round(x + w), round(y + h)), colour, 2)
    path.parent.mkdir(parents=True, exist_ok=True)
    cv2.imwrite(str(path), cv2.cvtColor(picture, cv2.COLOR_RGB2BGR))


def _name(scan: Scan) -> str:
    return Path(scan.source).name.split(".")[0] + (f"_{scan.index}" if scan.index else "")


def main() -> None:
    """Print the table, write the pictures."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--cascades", help="folder of detectors; default: the shipped ones; or 'none'")
    parser.add_argument("--rules", type=Path, help="rule file; default: the shipped one")
    parser.add_argument("--sets", default="", help="beginnings of names of sets, with commas; default: all")
    parser.add_argument("-o", "--out", type=Path, default=Path("real-scans"), help="folder for the pictures")
    parser.add_argument("--json", action="store_true", help="print JSON")
    arguments = parser.parse_args()
    chosen = [one for one in SETS if one.name.startswith(tuple(arguments.sets.split(",")))]
    rows, missed = [], []
    for real in chosen:
        pipeline = pipeline_of(real, arguments.cascades, arguments.rules, arguments.out)
        of_set, lines = measure(real, pipeline, arguments.out)
        rows += of_set
        missed += lines
    if arguments.json:
        print(json.dumps({"rows": [asdict(row) for row in rows], "missed": missed}, indent=1))
        return
    notes = [f"{one.name}: {one.note}" for one in chosen if one.note]
    print("\n".join([HEADING, *map(str, rows), *notes, "", "missed:", *missed]))


if __name__ == "__main__":
    main()
