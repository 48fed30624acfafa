"""The pipeline: scan to images to candidates to checks to detections, each with its reasons."""

from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Literal

from laserimg.clusters import find_clusters
from laserimg.detectors.box_samples import seen_box
from laserimg.detectors.candidate import Candidate, Detector
from laserimg.detectors.shipped import detector_files, load_model, shipped_folder
from laserimg.evidence import Box, Evidence, Window
from laserimg.geometry.floor import Floor, find_floor
from laserimg.geometry.pitch import angular_pitch
from laserimg.images import make_images
from laserimg.matching import matching_region, region_of_box, shares
from laserimg.measure import MetricBox, metric_box
from laserimg.regions import Partition, Region, reference_regions, regions_of
from laserimg.rules.checks import (
    Check,
    continuity,
    demoted_score,
    near_miss,
    near_score,
    no_region,
    plausible_box,
    plausible_size,
    size_rules,
    sure_enough,
    with_odds,
)
from laserimg.rules.file import load_rules
from laserimg.rules.model import ClassRules, Interval, Rules
from laserimg.rules.suppression import MAX_IOU, Claim, suppressed_by
from laserimg.scan import Scan
from laserimg.sources import detectors_for

Partitioning = Literal["default", "reference"]


@dataclass(frozen=True, eq=False, slots=True)
class Finding:
    """A candidate with its region, its sizes and the checks that were made.

    Parameters
    ----------
    candidate : Candidate
    score : float
        The candidate's, lowered by failed checks if its class demotes.
    region : Region or None
        None if no region is in the candidate, or none was looked for: see `Pipeline.measures_all`.
    size : MetricBox or None
    checks : tuple of Check
        All that ran, in order.
    accepted : bool
    reason : str
        "" when accepted, else the first failed check in words.
    """

    candidate: Candidate
    score: float
    region: Region | None
    size: MetricBox | None
    checks: tuple[Check, ...]
    accepted: bool
    reason: str

    @property
    def label(self) -> str:
        """The class."""
        return self.candidate.label

    @property
    def box(self) -> Box:
        """The candidate's own rectangle, in pixels of the scan's grid."""
        return self.candidate.box

    @property
    def is_near(self) -> bool:
        """Whether it is worth a line although rejected.

        Candidates with a small score, and regions of any size, are many: of what a detector scored it is
        what has at least half the score that its class asks for, of bare regions what fails by size alone
        and lies within twice the limits, and every other candidate.
        """
        if self.candidate.source == "regions" and not self.candidate.scored:
            return near_miss(self.checks)
        return near_score(self.checks)


@dataclass(frozen=True, eq=False)
class Result:
    """What came out for one scan; it keeps every intermediate.

    Parameters
    ----------
    evidence : Evidence
    findings : tuple of Finding
        One for each candidate, in the order proposed.
    """

    evidence: Evidence
    findings: tuple[Finding, ...]

    @cached_property
    def detections(self) -> list[Finding]:
        """Candidates that passed every check, best score first."""
        return sorted((f for f in self.findings if f.accepted), key=lambda f: -f.score)

    @cached_property
    def rejected(self) -> list[Finding]:
        """Candidates that failed a check, best score first."""
        return sorted((f for f in self.findings if not f.accepted), key=lambda f: -f.score)


@dataclass(frozen=True, slots=True)
class Pipeline:
    """Finds objects in scans.

    Parameters
    ----------
    rules : Rules
    detectors : tuple of Detector
        What proposes candidates.
    partition : "default" or "reference"
        Which regions candidates are compared with: `find_clusters`, or those of paper 2.
    min_range, max_range : float or None
        Metres; None keeps the limits of the scan.
    measures_all : bool
        Also find the region of candidates that a second stage scored so low that no check could bring them
        near the limit (see `Finding.is_near`), measure it and check it. Else the check of the score is the
        only one they have.
    """

    rules: Rules
    detectors: tuple[Detector, ...] = field(default=())
    partition: Partitioning = "default"
    min_range: float | None = None
    max_range: float | None = None
    measures_all: bool = False

    @classmethod
    def from_folder(cls, cascades: str | None = None, rules: str | None = None) -> "Pipeline":
        """Return the pipeline of a folder of detectors and a rule file; both default to the shipped ones.

        Raises
        ------
        ConfigError, ModelError
            If the rules or a detector are wrong.
        """
        loaded = load_rules(Path(rules) if rules else None)
        files = detector_files(Path(cascades) if cascades else shipped_folder())
        return cls(loaded, detectors_for(loaded, [load_model(file) for file in files]))

    def __call__(self, scan: Scan) -> Result:
        """Return the detections of one scan, and why the other candidates are none."""
        evidence = self.observe(scan.with_limits(self.min_range, self.max_range))
        return Result(evidence, self.judge(evidence))

    def judge(self, evidence: Evidence) -> tuple[Finding, ...]:
        """Return what becomes of every candidate of a scan that was observed."""
        candidates = [candidate for detector in self.detectors for candidate in detector(evidence)]
        return self._settled(evidence, [self._judged(evidence, candidate) for candidate in candidates])

    def observe(self, scan: Scan) -> Evidence:
        """Return images, floor and regions of a scan."""
        kinds = sorted(frozenset().union(*(detector.images for detector in self.detectors)))
        floor = find_floor(scan)
        partition = self._partition(scan, floor)
        regions = tuple(regions_of(partition, scan.wraps))
        images = make_images(scan, kinds) if kinds else {}
        return Evidence(scan, images, angular_pitch(scan), floor, partition, regions)

    def _partition(self, scan: Scan, floor: Floor | None) -> Partition:
        return reference_regions(scan) if self.partition == "reference" else find_clusters(scan, floor)

    def _region(self, evidence: Evidence, candidate: Candidate) -> Region | None:
        rules = self.rules[candidate.label]
        if candidate.region is not None:
            return candidate.region
        find = region_of_box if _is_doubted(candidate, rules) else matching_region
        return find(evidence, candidate.box, rules.region_inside, rules.region_fills)

    def _judged(self, evidence: Evidence, candidate: Candidate) -> Finding:
        rules = self.rules[candidate.label]
        if not self.measures_all and _is_hopeless(candidate, rules):
            return _finding(candidate, None, None, (), (), rules)
        seen = seen_box(evidence, candidate.box) if _is_doubted(candidate, rules) else None
        far = () if seen is None else plausible_box(seen, rules)
        region = self._region(evidence, candidate)
        if region is None:
            return _finding(candidate, None, None, (no_region(),), far, rules)
        scan = evidence.scan
        window = Window.of(candidate.box, scan.shape, scan.wraps)
        size = metric_box(scan, region, evidence.floor)
        if seen is not None:
            far += plausible_size(size, seen.cut, rules)
        inside, fills = shares(region, window, scan.shape, scan.counts(window.cut(scan.range)))
        checks = (*continuity(inside, fills, rules), *size_rules(size, rules))
        return _finding(candidate, region, size, checks, far, rules)

    def _settled(self, evidence: Evidence, findings: list[Finding]) -> tuple[Finding, ...]:
        """Add the suppression check to every finding that passed the others."""
        passed = [i for i, finding in enumerate(findings) if finding.accepted and finding.region is not None]
        claims = [_claim(findings[i]) for i in passed]
        settled = list(findings)
        width = evidence.scan.shape[1]
        for i, (winner, overlap) in zip(
            passed, suppressed_by(claims, width, evidence.scan.wraps), strict=True
        ):
            by = findings[passed[winner]] if winner >= 0 else None
            settled[i] = _with_suppression(findings[i], by, overlap)
        return tuple(settled)


def _finding(
    candidate: Candidate,
    region: Region | None,
    size: MetricBox | None,
    checks: tuple[Check, ...],
    far: tuple[Check, ...],
    rules: ClassRules,
) -> Finding:
    """The finding after its checks; those that it is far off (`far`) reject also what others only doubt."""
    failed = [check.reason for check in checks if not check.passed]
    doubted = _is_doubted(candidate, rules)
    score = candidate.score
    if doubted and checks and not failed:
        score = with_odds(score, candidate.odds or 0.0)
    elif rules.on_fail == "demote":
        score = demoted_score(score, checks)
    lowers = doubted or rules.on_fail == "demote"
    sure = sure_enough(score, rules) if candidate.scored else ()
    passed = not failed or (lowers and region is not None)
    accepted = passed and all(check.passed for check in (*sure, *far))
    unsure = [check.reason for check in (*sure, *far) if not check.passed]
    reasons = [*unsure, *failed] if doubted else [*failed, *unsure]
    every = (*checks, *far, *sure)
    return Finding(candidate, score, region, size, every, accepted, "" if accepted else reasons[0])


def _is_doubted(candidate: Candidate, rules: ClassRules) -> bool:
    """Whether no check ends the candidate: its score says more."""
    return rules.on_fail == "doubt" and candidate.odds is not None


def _is_hopeless(candidate: Candidate, rules: ClassRules) -> bool:
    """Whether a candidate is not even near the limit of its score, whatever its checks say."""
    best = with_odds(candidate.score, max(candidate.odds or 0.0, 0.0))
    return _is_doubted(candidate, rules) and not near_score(sure_enough(best, rules))


def _claim(finding: Finding) -> Claim:
    assert finding.region is not None
    return Claim(
        finding.label,
        finding.score,
        finding.candidate.scored or finding.candidate.source == "given",
        finding.region,
    )


def _with_suppression(finding: Finding, winner: Finding | None, overlap: float) -> Finding:
    reason = "" if winner is None else f"same object as {winner.label} with score {winner.score:.2f}"
    check = Check("suppression", overlap, Interval(None, MAX_IOU), winner is None, reason)
    return replace(finding, checks=(*finding.checks, check), accepted=winner is None, reason=reason)
