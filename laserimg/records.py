"""Results as they are written: findings as COCO annotations, scans as COCO files."""

from collections.abc import Iterable, Sequence
from dataclasses import replace

from laserimg.boxes import split_at_seam
from laserimg.evidence import Box
from laserimg.formats.coco import Annotation, Category, CheckRecord, CocoFile, CocoImage, Position, Size
from laserimg.measure import MetricBox
from laserimg.pipeline import Finding, Result
from laserimg.settings import Rejected


def written_findings(result: Result, rejected: Rejected) -> list[Finding]:
    """Return the findings of a scan that are written, in the order proposed."""
    return [finding for finding in result.findings if finding.accepted or _is_written(finding, rejected)]


def _is_written(finding: Finding, rejected: Rejected) -> bool:
    return finding.is_near if rejected == "near" else rejected == "all"


def annotation(finding: Finding, category_id: int, box: Box) -> Annotation:
    """Return a finding as a COCO annotation 0 of image 0, with the rectangle `box`."""
    candidate, region = finding.candidate, finding.region
    return Annotation(
        id=0,
        image_id=0,
        category_id=category_id,
        bbox=box,
        region_bbox=region.box if region else None,
        area=float(len(region.pixels)) if region else None,
        score=finding.score,
        source=candidate.name if candidate.source == "cascade" else candidate.source,
        accepted=finding.accepted,
        reason=finding.reason,
        checks=tuple(
            CheckRecord(check.name, check.value, (check.limit.low, check.limit.high), check.passed)
            for check in finding.checks
        ),
        size=_size(finding.size) if finding.size else None,
        position=_position(finding.size) if finding.size else None,
    )


def _size(box: MetricBox) -> Size:
    return Size(box.width, box.depth, box.height, box.length, box.breadth)


def _position(box: MetricBox) -> Position:
    return Position(
        box.x, box.y, box.z, box.range, box.azimuth_deg, box.elevation_deg, box.height_above_floor
    )


def scan_record(
    result: Result, file_name: str, labels: Sequence[str], rejected: Rejected, split_seam: bool = False
) -> CocoFile:
    """Return the result of one scan as a COCO file of one image.

    Parameters
    ----------
    result : Result
    file_name : str
        Of the scan, relative to the common folder of the inputs.
    labels : sequence of str
        All classes of the run; a category's id is its place among them, from 1.
    rejected : "all", "near" or "none"
        Which rejected candidates to write.
    split_seam : bool
        Write a box across the seam as two.
    """
    scan = result.evidence.scan
    height, width = scan.shape
    entries = [
        annotation(finding, labels.index(finding.label) + 1, box)
        for finding in written_findings(result, rejected)
        for box in (split_at_seam(finding.box, width) if split_seam else [finding.box])
    ]
    return CocoFile(
        images=(CocoImage(0, file_name, width, height, scan.index),),
        categories=categories(labels),
        annotations=tuple(replace(entry, id=number) for number, entry in enumerate(entries, start=1)),
    )


def categories(labels: Sequence[str]) -> tuple[Category, ...]:
    """Return the classes of a run as COCO categories, numbered from 1."""
    return tuple(Category(number, label) for number, label in enumerate(labels, start=1))


def merged(records: Iterable[CocoFile], labels: Sequence[str], info: dict) -> CocoFile:
    """Return the results of many scans as one COCO file, with ids of its own."""
    images: list[CocoImage] = []
    annotations: list[Annotation] = []
    for image_id, record in enumerate(records, start=1):
        images.append(replace(record.images[0], id=image_id))
        for entry in record.annotations:
            annotations.append(replace(entry, id=len(annotations) + 1, image_id=image_id))
    return CocoFile(tuple(images), categories(labels), tuple(annotations), info)
