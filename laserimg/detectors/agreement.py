"""Several cascades of one class, on aligned images: candidates are what enough of them find."""

from dataclasses import dataclass, replace

import numpy as np

from laserimg.boxes import as_boxes, iou
from laserimg.detectors.candidate import Candidate
from laserimg.detectors.search import WindowDetector
from laserimg.evidence import Evidence

# Boxes of two cascades that overlap by as much are of one object: each is a mean of hits.
SAME_IOU = 0.3


@dataclass(frozen=True, eq=False, slots=True)
class Agreement:
    """Proposes what at least `least` of some window detectors find at one place.

    With as many as there are it is the logical and of A. Nuechter, H. Surmann and J. Hertzberg, "Automatic
    classification of objects in 3D laser range scans", IAS 2004, for depth and reflectance; with fewer a
    vote. Every cascade is one that cv2 runs. A serial combination, the next cascade only where the one before
    fired, finds what the and finds.

    Parameters
    ----------
    windows : tuple of WindowDetector
        Of one class.
    least : int
    """

    windows: tuple[WindowDetector, ...]
    least: int

    @property
    def images(self) -> frozenset[str]:
        """Kinds of image it looks at."""
        return frozenset().union(*(window.images for window in self.windows))

    def __call__(self, evidence: Evidence) -> list[Candidate]:
        """Return the candidates of one scan: of those at one place the surest, with the sum of scores."""
        found = [one for window in self.windows for one in window(evidence)]
        found.sort(key=lambda one: -one.score)
        wrap_width = evidence.scan.shape[1] if evidence.scan.wraps else None
        overlap = iou(boxes := as_boxes([one.box for one in found]), boxes, wrap_width)
        free = np.ones(len(found), np.bool_)
        agreed = []
        for best, candidate in enumerate(found):
            if not free[best]:
                continue
            members = np.flatnonzero(free & (overlap[best] >= SAME_IOU))
            free[members] = False
            # Of one cascade, the surest box counts.
            scores = {found[i].name: found[i].score for i in members[::-1]}
            if len(scores) >= self.least:
                agreed.append(replace(candidate, score=sum(scores.values())))
        return agreed
