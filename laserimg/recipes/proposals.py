"""What the cascades of a recipe, and regions, propose to its second stage: as where it will run."""

from functools import lru_cache
from pathlib import Path

import numpy as np

from laserimg.boxes import Boxes, as_boxes
from laserimg.detectors.candidate import Candidate
from laserimg.detectors.ranked import proposed_by, proposer
from laserimg.detectors.search import Searched, WindowDetector
from laserimg.detectors.shipped import load_model
from laserimg.evidence import Evidence
from laserimg.files import changed_ns


def proposals(evidence: Evidence, cascades: tuple[Path, ...]) -> list[Candidate]:
    """Return what cascades propose in a scan."""
    searched = Searched(evidence)
    detectors = _detectors(cascades, tuple(map(changed_ns, cascades)))
    return [one for detector in detectors for one in proposed_by(detector, searched)]


def proposed_boxes(evidence: Evidence, cascades: tuple[Path, ...], regions: bool) -> Boxes:
    """Return the boxes (n, 4) that cascades propose in a scan, then those of its regions if asked for."""
    boxes = [one.box for one in proposals(evidence, cascades)]
    if regions:
        boxes += [region.box for region in evidence.regions]
    return as_boxes(boxes or np.empty((0, 4)))


@lru_cache(maxsize=4)
def _detectors(cascades: tuple[Path, ...], _changed_ns: tuple[int, ...]) -> tuple[WindowDetector, ...]:
    return tuple(proposer(load_model(path)) for path in cascades)  # type: ignore[arg-type]
