"""What detectors propose, and what a detector is."""

from dataclasses import dataclass
from typing import Literal, Protocol

from laserimg.evidence import Box, Evidence
from laserimg.regions import Region

Source = Literal["cascade", "hog", "regions", "given"]


@dataclass(frozen=True, eq=False, slots=True)
class Candidate:
    """A rectangle that a detector, a region or a given file proposes, before any check.

    Parameters
    ----------
    label : str
        The class.
    box : (float, float, float, float)
        ``x, y, w, h`` in pixels of the scan's grid.
    score : float
        How sure the detector is.
    source : str
        What kind of detector it was.
    name : str
        Which one: the name of the cascade or second stage, or the source again.
    region : Region or None
        The region it was made from; None when one must be found.
    odds : float or None
        If a second stage gave the score: by how much the logarithm of its odds grows when the
        candidate passes all checks.
    """

    label: str
    box: Box
    score: float
    source: Source
    name: str
    region: Region | None = None
    odds: float | None = None

    @property
    def scored(self) -> bool:
        """Whether a detector gave the score: neither the share of a region nor a file."""
        return self.odds is not None or self.source in ("cascade", "hog")


class Detector(Protocol):
    """Anything that proposes candidates for one scan, without remembering others."""

    @property
    def images(self) -> frozenset[str]:
        """Kinds of image it looks at."""
        ...

    def __call__(self, evidence: Evidence) -> list[Candidate]:
        """Return the candidates of one scan."""
        ...
