"""All that is known of a scan before any candidate: images, floor, regions."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from laserimg.geometry.floor import Floor
from laserimg.regions import Partition, Region
from laserimg.scan import BoolArray, Float32Array, Scan

Image = NDArray[np.uint8]
Box = tuple[float, float, float, float]


@dataclass(frozen=True, eq=False, slots=True)
class Evidence:
    """A scan with its images, floor and regions.

    Parameters
    ----------
    scan : Scan
    images : mapping of str to (H, W) or (H, W, 3) array of uint8
        By kind, as `laserimg.images` makes them.
    pitch : tuple of two (H, W) arrays of float32
        Radians between neighbouring rays, across and up.
    floor : Floor or None
    partition : Partition
    regions : tuple of Region
        The regions of the partition, in order.
    """

    scan: Scan
    images: Mapping[str, Image]
    pitch: tuple[Float32Array, Float32Array]
    floor: Floor | None
    partition: Partition
    regions: tuple[Region, ...]


@dataclass(frozen=True, eq=False, slots=True)
class Window:
    """The pixels of a box in the grid, across the seam too.

    Parameters
    ----------
    rows : slice
    columns : (n,) array of int
        Already modulo the width; a box wider than a full turn sees columns twice.
    """

    rows: slice
    columns: NDArray[np.intp]

    @classmethod
    def of(cls, box: Box, shape: tuple[int, int], wraps: bool) -> "Window":
        """Return the pixels whose centre lies in a box, clipped to the grid."""
        x, y, w, h = box
        height, width = shape
        top = min(max(0, round(y)), height)
        rows = slice(top, max(top, min(height, round(y + h))))
        first, last = round(x), round(x + w)
        if not wraps:
            first, last = max(0, first), min(width, last)
        return cls(rows, np.arange(first, max(first, last)) % width)

    def cut(self, grid: NDArray) -> NDArray:
        """Return these pixels of a (H, W[, C]) array as a copy."""
        return grid[self.rows][:, self.columns]

    def pixels(self, width: int) -> NDArray[np.intp]:
        """Return the positions of these pixels in a flattened grid, (rows, columns)."""
        return np.arange(self.rows.start, self.rows.stop)[:, None] * width + self.columns

    def holds(self, pixels: NDArray[np.intp], shape: tuple[int, int]) -> BoolArray:
        """Return which flattened positions lie in the window."""
        rows, columns = np.divmod(pixels, shape[1])
        inside = np.zeros(shape[1], np.bool_)
        inside[self.columns] = True
        return inside[columns] & (rows >= self.rows.start) & (rows < self.rows.stop)
