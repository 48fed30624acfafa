"""Two stages: cascades and regions propose boxes, a second stage scores all of them."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from laserimg.boxes import Boxes, as_boxes, inside_grid
from laserimg.detectors.candidate import Candidate
from laserimg.detectors.cascade import CascadeModel
from laserimg.detectors.description import IMAGES, Describer
from laserimg.detectors.search import Scale, Searched, WindowDetector
from laserimg.detectors.second_stage import SecondStage, distinct
from laserimg.detectors.window import WindowModel
from laserimg.evidence import Evidence
from laserimg.regions import Region
from laserimg.scan import Float32Array

# So many of the boxes that a cascade proposes are looked at, those that most hits speak for. With all of
# them average precision of doors, wastebaskets and people in 95, 95 and 62 simulated scans was 0.748, 0.909
# and 0.918, with 120 0.747, 0.909 and 0.918, with 60 0.752, 0.898 and 0.912.
MOST_PROPOSED = 120
# Candidates that would score below if they passed all checks are not worth a line of a result.
MIN_SCORE = 0.005


@dataclass(frozen=True, eq=False, slots=True)
class RankedDetector:
    """Proposes, for every class with a second stage, the best of what its cascades and the regions propose.

    Parameters
    ----------
    stages : tuple of SecondStage
    windows : tuple of WindowDetector
        Each proposes boxes for the class of its card.
    """

    stages: tuple[SecondStage, ...]
    windows: tuple[WindowDetector, ...] = ()

    @property
    def images(self) -> frozenset[str]:
        """Kinds of image it looks at."""
        return frozenset(IMAGES).union(*(window.images for window in self.windows))

    def __call__(self, evidence: Evidence) -> list[Candidate]:
        """Return the candidates of one scan."""
        regions = evidence.regions if any(stage.regions for stage in self.stages) else ()
        boxes_of_regions = as_boxes([region.box for region in regions])
        describe, searched = Describer.of(evidence), Searched(evidence)
        vectors_of_regions = describe(boxes_of_regions)
        candidates: list[Candidate] = []
        for stage in self.stages:
            proposed = list(self._proposed(stage.card.label, searched))
            boxes = as_boxes([one.box for one in proposed])
            vectors = describe(boxes)
            if stage.regions:
                proposed += [_of_region(stage, region) for region in regions]
                boxes = np.concatenate([boxes, boxes_of_regions])
                vectors = np.concatenate([vectors, vectors_of_regions])
            candidates += _best(stage, proposed, boxes, vectors, describe)
        return candidates

    def _proposed(self, label: str, searched: Searched) -> Iterator[Candidate]:
        for window in self.windows:
            if window.model.card.label == label:
                yield from proposed_by(window, searched)


def proposer(model: WindowModel, scale: Scale = "metric") -> WindowDetector:
    """Return the detector that proposes what a model finds to a second stage."""
    return WindowDetector(replace(model, coarse=True) if isinstance(model, CascadeModel) else model, scale)


def proposed_by(window: WindowDetector, searched: Searched) -> list[Candidate]:
    """Return the boxes of a `proposer` that a second stage looks at, in use and in training, best first."""
    return sorted(window.found(searched), key=lambda one: -one.score)[:MOST_PROPOSED]


def _of_region(stage: SecondStage, region: Region) -> Candidate:
    return Candidate(stage.card.label, region.box, 0.0, "regions", stage.name, region)


def _best(
    stage: SecondStage,
    proposed: list[Candidate],
    boxes: Boxes,
    vectors: Float32Array,
    describe: Describer,
) -> list[Candidate]:
    """Candidates with their scores and corrected boxes, each object once."""
    scan = describe.evidence.scan
    width = scan.shape[1] if scan.wraps else None
    places, moved, sums, means = stage.looked_at(describe, boxes, vectors)
    scores = stage.scores(sums, means)
    moved = inside_grid(moved, scan.shape, scan.wraps)
    seen = np.flatnonzero((stage.if_passed(scores) >= MIN_SCORE) & (moved[:, 2:] > 0).all(axis=1))
    kept = seen[distinct(moved[seen], scores[seen], width)]
    return [
        Candidate(
            stage.card.label,
            tuple(moved[i].tolist()),
            float(scores[i]),
            proposed[places[i]].source,
            proposed[places[i]].name,
            proposed[places[i]].region,
            odds=stage.passed,
        )
        for i in kept
    ]
