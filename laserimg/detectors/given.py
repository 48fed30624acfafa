"""Candidates that a file gives, in place of any detector."""

from dataclasses import dataclass

from laserimg.detectors.candidate import Candidate
from laserimg.evidence import Evidence
from laserimg.formats.coco import CocoFile


@dataclass(frozen=True, eq=False, slots=True)
class GivenCandidates:
    """Proposes the boxes of a COCO file; without a score they score 1.

    Parameters
    ----------
    coco : CocoFile
    label : str or None
        The class to take every box for; None keeps the file's own.
    only : bool
        The run has one scan: a file of one image is of it, whatever its name.
    """

    coco: CocoFile
    label: str | None = None
    only: bool = False
    images: frozenset[str] = frozenset()

    def __call__(self, evidence: Evidence) -> list[Candidate]:
        """Return the boxes given for this scan.

        Raises
        ------
        LabelError
            If they do not fit the scan's grid.
        """
        return [
            Candidate(
                self.label or self.coco.labels[given.category_id],
                given.bbox,
                1.0 if given.score is None else given.score,
                "given",
                "given",
            )
            for given in self.coco.annotations_of(evidence.scan, self.only)
        ]
