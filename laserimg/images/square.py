"""Square pixels for detectors, and the way of boxes between them and the scan's own grid."""

from dataclasses import dataclass
from typing import Self

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from laserimg.boxes import Boxes, as_boxes
from laserimg.errors import LaserImgError
from laserimg.geometry.pitch import sample_pitch
from laserimg.scan import Scan

# The finer pitch is taken unless that makes more than this many times the pixels.
MOST_MORE_PIXELS = 2.0


@dataclass(frozen=True, slots=True)
class SquareGrid:
    """A resampled grid with the same median pitch across and up.

    Parameters
    ----------
    scan_shape : (H, W)
        Rows and columns of the scan's grid.
    shape : (h, w)
        Rows and columns after resampling, without padding.
    pad : int
        Columns repeated at the right of a full turn, so that a window finds what lies across the seam.
    wraps : bool
        The columns close a full turn; otherwise nothing is padded.

    Examples
    --------
    >>> azimuth, elevation = np.radians([5, 3, 1, -1, -3, -5]), np.radians([3, 2, 1, 0])
    >>> scan = Scan.from_range_image(np.ones((4, 6)), azimuth, elevation)
    >>> grid = SquareGrid.of(scan)
    >>> grid.shape, grid.to_scan([[2, 1, 4, 2]]).tolist()
    ((4, 12), [[1.0, 1.0, 2.0, 2.0]])
    """

    scan_shape: tuple[int, int]
    shape: tuple[int, int]
    pad: int = 0
    wraps: bool = False

    @classmethod
    def of(cls, scan: Scan, enlarge: float = 1.0, pad: int = 0) -> Self:
        """Choose the square pixels of a scan.

        Parameters
        ----------
        scan : Scan
        enlarge : float
            Pixels per square pixel, both ways: above 1 for coarse scans of objects that are smaller
            than a detector's window.
        pad : int
            Columns after resampling; ignored unless the scan closes a full turn.

        Raises
        ------
        LaserImgError
            If `enlarge` is not above 0 or `pad` is below 0.
        """
        if not (np.isfinite(enlarge) and enlarge > 0) or pad < 0:
            raise LaserImgError(f"enlarge must be above 0 and pad not below 0, got {enlarge} and {pad}")
        _, across, up = sample_pitch(scan, np.ones(scan.shape, bool))
        pitch_across, pitch_up = np.median(across), np.median(up)
        finer, coarser = sorted([pitch_across, pitch_up])
        pitch = finer if round(coarser / finer, 2) <= MOST_MORE_PIXELS else coarser
        height = max(1, round(scan.shape[0] * enlarge * pitch_up / pitch))
        width = max(1, round(scan.shape[1] * enlarge * pitch_across / pitch))
        return cls(scan.shape, (height, width), pad if scan.wraps else 0, scan.wraps)

    @property
    def scale(self) -> tuple[float, float]:
        """Pixels after resampling for one of the scan: up and across."""
        return self.shape[0] / self.scan_shape[0], self.shape[1] / self.scan_shape[1]

    def resample(self, image: NDArray) -> NDArray:
        """Return an (h, w + pad) image from one of the scan's grid, of one or several planes."""
        if image.shape[:2] != self.scan_shape:
            raise LaserImgError(f"the image must be {self.scan_shape}, got {image.shape[:2]}")
        shrinks = self.shape[0] < image.shape[0] or self.shape[1] < image.shape[1]
        interpolation = cv2.INTER_AREA if shrinks else cv2.INTER_LINEAR
        square = image
        if self.shape != self.scan_shape:
            square = cv2.resize(image, self.shape[::-1], interpolation=interpolation)
        # A pad wider than the turn would repeat it more than once.
        return np.concatenate([square, square[:, : self.pad]], axis=1) if self.pad else square

    def to_scan(self, boxes: ArrayLike) -> Boxes:
        """Return boxes of the resampled image in the scan's grid; 0 <= x < W when it closes a turn."""
        up, across = self.scale
        scaled = as_boxes(boxes) / [across, up, across, up]
        if self.wraps:
            scaled[:, 0] %= self.scan_shape[1]
            scaled[:, 2] = np.minimum(scaled[:, 2], self.scan_shape[1])
        return scaled

    def from_scan(self, boxes: ArrayLike) -> Boxes:
        """Return boxes of the scan's grid in the resampled image; across the seam they reach into the pad."""
        up, across = self.scale
        return as_boxes(boxes) * [across, up, across, up]
