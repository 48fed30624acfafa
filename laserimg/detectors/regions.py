"""Candidates straight from regions: every region, once for each class that asks for them."""

from dataclasses import dataclass

from laserimg.detectors.candidate import Candidate
from laserimg.evidence import Evidence


@dataclass(frozen=True, slots=True)
class RegionDetector:
    """Proposes the bounding rectangle of every region.

    The score is the share of the rectangle that is the region.

    Parameters
    ----------
    labels : tuple of str
        Classes to propose the regions as.
    """

    labels: tuple[str, ...]
    images: frozenset[str] = frozenset()

    def __call__(self, evidence: Evidence) -> list[Candidate]:
        """Return one candidate for each region and class."""
        return [
            Candidate(label, region.box, _share(region.box, len(region.pixels)), "regions", "regions", region)
            for region in evidence.regions
            for label in self.labels
        ]


def _share(box: tuple[float, float, float, float], pixels: int) -> float:
    return pixels / (box[2] * box[3])
