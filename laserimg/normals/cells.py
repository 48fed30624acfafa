"""The cells of a scan: all that plane fits need of it, at a sixteenth of its size."""

from dataclasses import dataclass
from typing import Self

import cv2
import numpy as np

from laserimg.geometry.cells import cell_means, cell_middles
from laserimg.geometry.pitch import Floats, pitch_of, sample_pitch
from laserimg.normals.noise import Noise
from laserimg.scan import Float32Array, Scan

# Standard deviation in radians of the normals that the largest windows give on a plane.
PRECISION = np.radians(0.25)
# Of the typical window: more follow edges better and cost more time.
CELLS_PER_WINDOW = 8
MAX_CELL_PIXELS = 8


@dataclass(frozen=True, eq=False, slots=True)
class Cells:
    """Means over cells of `rows` x `columns` pixels.

    Parameters
    ----------
    rows, columns : int
        Pixels of a cell.
    count : (h, w) array of float32
        Returns in each cell.
    directions : (3, h, w) array of float32
        Means of the directions of the returns; 0 without returns.
    inverse_range : (h, w) array of float32
        Means of their inverse ranges in 1/m; 0 without returns.
    window_height, window_width : (h, w) arrays of float32
        Cells of the window that a fit of the wanted precision needs.
    wraps : bool
        The columns close a full turn.
    """

    rows: int
    columns: int
    count: Floats
    directions: Floats
    inverse_range: Floats
    window_height: Floats
    window_width: Floats
    wraps: bool

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of cells."""
        height, width = self.count.shape
        return height, width

    @classmethod
    def of(cls, scan: Scan, inverse_range: Float32Array, noise: Noise) -> Self:
        """Divide a scan into cells of a size that suits its noise, pitch and ranges."""
        rows, columns = _cell_size(scan, noise)
        returned = scan.range > 0
        directions = scan.directions
        if not returned.all():
            directions = np.asarray(cv2.copyTo(directions, returned.view(np.uint8)), np.float32)
        share = cell_means(returned.astype(np.float32), rows, columns)
        per_return = 1 / np.maximum(share, 1e-9)
        mean = cell_means(inverse_range, rows, columns) * per_return
        across, up = pitch_of(cell_middles(scan.directions, rows, columns), scan.wraps)
        range_m = 1 / np.maximum(mean, 1e-6)
        height, width = window_pixels(range_m, across / columns, up / rows, noise)
        return cls(
            rows,
            columns,
            count=share * (rows * columns),
            directions=np.stack(cv2.split(cell_means(directions, rows, columns))) * per_return,
            inverse_range=mean,
            window_height=height / rows,
            window_width=width / columns,
            wraps=scan.wraps,
        )


def window_pixels(range_m: Floats, across: Floats, up: Floats, noise: Noise) -> tuple[Floats, Floats]:
    """Return height and width in pixels of the window in which a fit reaches `PRECISION`.

    The slope of a line through K points a distance d apart, each with noise s, has the standard
    deviation sqrt(12) s / (d K^1.5); K' such lines beside each other divide it by sqrt(K'). The
    window spans the same metres both ways, however the pitch differs.

    Parameters
    ----------
    range_m : (...) array
        Metres.
    across, up : (...) arrays
        Radians between neighbouring rays.
    """
    step_across = np.maximum(range_m * across, 1e-6)
    step_up = np.maximum(range_m * up, 1e-6)
    span = np.sqrt(np.float32(np.sqrt(12) * noise.range / PRECISION) * np.sqrt(step_up * step_across))
    return span / step_up, span / step_across


def _cell_size(scan: Scan, noise: Noise) -> tuple[int, int]:
    """Rows and columns of a cell, from the windows that a sample of the returns needs."""
    range_m, across, up = sample_pitch(scan, scan.range > 0)
    if range_m.size == 0:
        return 1, 1
    rows, columns = (
        int(np.clip(np.median(size) / CELLS_PER_WINDOW, 1, min(MAX_CELL_PIXELS, max(1, pixels // 4))))
        for size, pixels in zip(window_pixels(range_m, across, up, noise), scan.shape, strict=True)
    )
    return rows, columns
