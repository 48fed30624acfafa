"""From the planes of cells to a normal for every return."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Self

import cv2
import numpy as np

from laserimg.geometry.cells import pad_cells
from laserimg.geometry.pitch import Floats
from laserimg.geometry.windows import Indices
from laserimg.normals.cells import Cells
from laserimg.normals.local import local_planes
from laserimg.normals.noise import Noise
from laserimg.normals.planes import NEIGHBOURS
from laserimg.scan import BoolArray, Float32Array, Scan

# Few enough for the processor's cache.
BLOCK_PIXELS = 1 << 17
# A return lies on a plane when it misses it by no more than this many standard deviations.
ON_PLANE = 4.0
# Length of the mean of 3 x 3 unit normals that are one surface, flat or curved: two halves 16
# degrees apart, or one of nine 26 degrees off.
SAME_SURFACE = 0.99
# Normals of neighbouring cells further apart than 40 degrees make a crease.
CREASE = np.cos(np.radians(40.0))


def normals_of_pixels(
    scan: Scan, inverse_range: Float32Array, noise: Noise, cells: Cells, planes: Float32Array
) -> Iterator[tuple[slice, Float32Array]]:
    """Give every return the normal of a plane that it lies on; yield them by blocks of rows.

    Inside a surface the planes of cells are blended. At its borders a return takes the plane of
    its cell or of one beside it. What lies on none of them gets a fit of its own.

    Yields
    ------
    rows : slice
    normals : (h, W, 3) array of float32
    """
    mosaic = _Mosaic.of(cells, planes)
    for block in _row_blocks(scan.shape, cells.rows):
        returned = scan.range[block] > 0
        *blend, expected = mosaic.blend(block, scan.shape)
        normals = np.asarray(cv2.merge(_unit(blend, returned)), np.float32)
        settled = mosaic.one_surface(block, scan.shape) & _near(expected, inverse_range[block], noise)
        # On a flat mask, as on two axes it takes ten times as long.
        block_rows, columns = np.divmod(np.flatnonzero(returned & ~settled), scan.shape[1])
        rows = block_rows + block.start
        rays = scan.directions[rows, columns].T.copy()
        chosen = mosaic.choose(rays, inverse_range[rows, columns], noise, rows, columns)
        rest = ~chosen.any(axis=0)
        chosen[:, rest] = local_planes(scan, inverse_range, noise, rows[rest], columns[rest])
        normals[block_rows, columns] = (chosen / -np.linalg.norm(chosen, axis=0)).T
        yield block, normals


def _row_blocks(shape: tuple[int, int], multiple: int) -> list[slice]:
    """Rows of whole cells, about `BLOCK_PIXELS` at a time."""
    step = max(1, BLOCK_PIXELS // (shape[1] * multiple)) * multiple
    return [slice(first, min(first + step, shape[0])) for first in range(0, shape[0], step)]


def _unit(planes: list[Float32Array], returned: BoolArray) -> list[Floats]:
    """Normals of planes a = n / d, turned to the scanner; 0 where nothing returned."""
    length = np.sqrt(planes[0] * planes[0] + planes[1] * planes[1] + planes[2] * planes[2])
    scale = returned / np.minimum(-length, np.float32(-1e-12))
    return [plane * scale for plane in planes]


def _near(expected: Float32Array, inverse_range: Float32Array, noise: Noise) -> BoolArray:
    limit = np.minimum(inverse_range * np.float32(ON_PLANE * noise.range), np.float32(0.5)) * inverse_range
    return np.abs(inverse_range - expected) <= limit


@dataclass(frozen=True, eq=False, slots=True)
class _Mosaic:
    """Planes of cells with one cell more on every side, so that each has 8 neighbours.

    Parameters
    ----------
    cells : Cells
    planes : (3, h + 2, w + 2) array of float32
    inverse_range : (h + 2, w + 2) array of float32
        Of each plane, the mean over the directions of its cell.
    agree : (h, w) array of uint8
        1 where the planes of the 3 x 3 cells around are one surface.
    nearer : eight ((h + 2) * (w + 2),) arrays of int8
        For each neighbour whose plane meets the cell's in a crease, whether at its middle its own
        plane has the larger inverse range, 1 or 0; -1 without a crease.
    """

    cells: Cells
    planes: Float32Array
    inverse_range: Float32Array
    agree: np.ndarray
    nearer: list[np.ndarray]

    @classmethod
    def of(cls, cells: Cells, planes: Float32Array) -> Self:
        """Pad the planes and compare each with those around it."""
        padded = np.stack([pad_cells(plane, cells.wraps) for plane in planes])
        normals = padded / np.maximum(np.sqrt((padded * padded).sum(axis=0)), 1e-12)
        means = np.stack([cv2.blur(part, (3, 3))[1:-1, 1:-1] for part in normals])
        agree = (means * means).sum(axis=0) >= SAME_SURFACE**2
        middles = np.stack([pad_cells(part, cells.wraps) for part in cells.directions])
        nearer = [_nearer_there(padded, normals, middles, _offset(padded, side)) for side in NEIGHBOURS]
        return cls(cells, padded, (padded * middles).sum(axis=0), agree.view(np.uint8), nearer)

    def blend(self, block: slice, shape: tuple[int, int]) -> list[Float32Array]:
        """Interpolate planes and their inverse range between cells, for a block of rows of pixels."""
        rows, columns = self.cells.rows, self.cells.columns
        around = slice(block.start // rows, -(-block.stop // rows) + 2)
        large = [
            cv2.resize(layer[around], None, fx=columns, fy=rows, interpolation=cv2.INTER_LINEAR)
            for layer in (*self.planes, self.inverse_range)
        ]
        down, right = slice(rows, rows + block.stop - block.start), slice(columns, columns + shape[1])
        return [np.asarray(a, np.float32)[down, right] for a in large]

    def one_surface(self, block: slice, shape: tuple[int, int]) -> BoolArray:
        """Mask of the pixels in cells that agree with those around them."""
        rows, columns = self.cells.rows, self.cells.columns
        agree = self.agree[block.start // rows : -(-block.stop // rows)]
        large = cv2.resize(agree, None, fx=columns, fy=rows, interpolation=cv2.INTER_NEAREST)
        return np.asarray(large, np.uint8)[: block.stop - block.start, : shape[1]].view(np.bool_)

    def choose(
        self,
        directions: Float32Array,
        inverse_range: Float32Array,
        noise: Noise,
        rows: Indices,
        columns: Indices,
    ) -> Float32Array:
        """Return the plane that each of n returns lies on, (3, n); 0 if it lies on none.

        It is the plane of its cell, unless the return is beyond the crease where that plane meets
        a neighbour's: the two planes tell where that is, without the noise of the return. A return
        off the plane of its cell takes the one that passes nearest.
        """
        flat = self.planes.reshape(3, -1)
        home = (rows // self.cells.rows + 1) * self.planes.shape[2] + columns // self.cells.columns + 1
        own, miss = _along_and_miss(flat.take(home, axis=1), directions, inverse_range, noise)
        off = miss > ON_PLANE**2
        chosen, best = np.where(off, 0, home), np.full(len(home), ON_PLANE**2, np.float32)
        for side, nearer in zip(NEIGHBOURS, self.nearer, strict=True):
            cell = home + _offset(self.planes, side)
            other, miss = _along_and_miss(flat.take(cell, axis=1), directions, inverse_range, noise)
            takes = (((other > own) == nearer.take(home)) | off) & (miss < best)
            np.copyto(chosen, cell, where=takes)
            np.copyto(best, miss, where=takes)
        planes = flat.take(chosen, axis=1)
        return planes * ((chosen > 0) & ((planes * directions).sum(axis=0) > 0))


def _offset(padded: Float32Array, side: tuple[int, int]) -> int:
    """Steps to a neighbour in the flat array."""
    return side[0] * padded.shape[2] + side[1]


def _nearer_there(
    planes: Float32Array, normals: Float32Array, middles: Float32Array, offset: int
) -> np.ndarray:
    """Whether the plane `offset` cells on is there the nearer, 1 or 0; -1 if the two make no crease."""
    planes, normals, middles = (part.reshape(3, -1) for part in (planes, normals, middles))
    count = planes.shape[1] - abs(offset)
    here, there = (slice(start, start + count) for start in (max(-offset, 0), max(offset, 0)))
    found = np.full(planes.shape[1], -1, np.int8)
    nearer = ((planes[:, there] - planes[:, here]) * middles[:, there]).sum(axis=0) > 0
    crease = (normals[:, there] * normals[:, here]).sum(axis=0) < CREASE
    found[here] = np.where(crease, nearer, -1)
    return found


def _along_and_miss(
    planes: Float32Array, directions: Float32Array, inverse_range: Float32Array, noise: Noise
) -> tuple[Float32Array, Float32Array]:
    """Inverse range of n planes along n rays, and the square of the deviations by which returns miss it."""
    x, y, z = planes
    along = x * directions[0] + y * directions[1] + z * directions[2]
    miss = inverse_range - along
    return along, miss * miss / noise.variance(inverse_range, x * x + y * y + z * z)
