"""The width of beams: which of them see several surfaces, and the thin rays that stand for such a beam."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from laserimg.scan import BoolArray, Float32Array

# A disc of even power in seven parts of the same area: the middle, and six around it at the root mean
# square of their distances from it, in radii.
AROUND = 6
AROUND_RADIUS = float(np.sqrt((1 + 1 / (AROUND + 1)) / 2))


class Beam(NamedTuple):
    """A beam: its diameter at the scanner, and how it grows.

    Parameters
    ----------
    window_m : float
        Diameter where it leaves the scanner.
    divergence_rad : float
        Full angle.
    height : float
        Diameter across the rows of the grid, as a share of that along them: laser diodes shine in ellipses.
    """

    window_m: float
    divergence_rad: float
    height: float = 1.0


def near_edges(distance: Float32Array, jump_m: float, wraps: bool) -> BoolArray:
    """Return the beams beside which the surface bends or ends.

    On a plane the inverse of the range is linear in the direction, so that its second differences are 0
    however steep the plane is. Where they are not, by more than a jump would make them, an edge is near.

    Parameters
    ----------
    distance : (H, W) array of float32
        Metres of the middle of each beam; infinity where it meets nothing.
    jump_m : float
        Smaller steps are not looked at.
    wraps : bool

    Returns
    -------
    (H, W) array of bool
    """
    inverse = np.reciprocal(distance)
    found = np.zeros(inverse.shape, bool)
    found[1:-1] |= _bent(inverse[:-2], inverse[1:-1], inverse[2:], jump_m)
    found[:, 1:-1] |= _bent(inverse[:, :-2], inverse[:, 1:-1], inverse[:, 2:], jump_m)
    if wraps:
        for before, at, after in ((-2, -1, 0), (-1, 0, 1)):
            found[:, at] |= _bent(inverse[:, before], inverse[:, at], inverse[:, after], jump_m)
    return found


def within_reach(
    edges: BoolArray, distance: Float32Array, directions: Float32Array, beam: Beam, wraps: bool
) -> BoolArray:
    """Return `edges` and the beams that reach one of them: many where rows or columns are close together.

    Parameters
    ----------
    edges : (H, W) array of bool
    distance : (H, W) array of float32
        Metres, as for `near_edges`: near the scanner a beam's window counts for more than its divergence.
    directions : (H, W, 3) array of float32
    beam : Beam
    wraps : bool

    Returns
    -------
    (H, W) array of bool
    """
    along = _spread(edges, distance, directions, beam, wraps)
    flat = beam._replace(
        window_m=beam.window_m * beam.height, divergence_rad=beam.divergence_rad * beam.height
    )
    return _spread(along.T, distance.T, directions.transpose(1, 0, 2), flat, False).T


def _spread(
    edges: BoolArray, distance: Float32Array, directions: Float32Array, beam: Beam, wraps: bool
) -> BoolArray:
    """Edges, and as many beams before and after them in the row as the outer rays of a beam cover."""
    (height, width), (row, column) = edges.shape, np.nonzero(edges)
    before = column - (column == width - 1)
    pitch = np.linalg.norm(directions[row, before + 1] - directions[row, before], axis=1)
    radius = AROUND_RADIUS / 2 * (beam.divergence_rad + beam.window_m / distance[row, column])
    half = width // 2
    more = np.minimum(radius / np.maximum(pitch, 1e-6), half).astype(np.intp)
    if not more.any():
        return edges
    low, high = column - more, column + more + 1
    if not wraps:
        low, high = np.maximum(low, 0), np.minimum(high, width)
    ends = np.zeros((height, 2 * width + 1), np.int32)
    np.add.at(ends, (row, low + half), 1)
    np.add.at(ends, (row, high + half), -1)
    covered = np.cumsum(ends, axis=1, dtype=np.int32) > 0
    found = covered[:, half : half + width]
    found[:, width - half :] |= covered[:, :half]
    found[:, : width - half] |= covered[:, half + width : 2 * width]
    return found


def _bent(before: Float32Array, at: Float32Array, after: Float32Array, jump_m: float) -> BoolArray:
    nearest = np.maximum(np.maximum(before, after), at)
    return np.abs(before - 2 * at + after) > np.float32(jump_m) * nearest**2


def rays_around(
    origin: NDArray[np.float64],
    directions: Float32Array,
    along_row: Float32Array,
    beam: Beam,
    turns: Float32Array,
) -> tuple[Float32Array, Float32Array]:
    """Return the six rays around the middle of each beam, one beam after the other.

    Parameters
    ----------
    origin : (3,) array
    directions : (n, 3) array of float32
    along_row : (n, 3) array of float32
        From each beam to the next of its row, of any length.
    beam : Beam
    turns : (n,) array of float32
        Radians to turn the six about the middle, so that they are not the same for all beams.

    Returns
    -------
    starts, directions : (6 n, 3) arrays of float32
    """
    right, up = _crosswise(directions, along_row)
    angle = turns[:, None] + np.arange(AROUND, dtype=np.float32) * np.float32(2 * np.pi / AROUND)
    up *= np.float32(beam.height)
    aside = np.cos(angle)[..., None] * right[:, None] + np.sin(angle)[..., None] * up[:, None]
    aside *= np.float32(AROUND_RADIUS / 2)
    starts = np.asarray(origin, np.float32) + np.float32(beam.window_m) * aside
    along = directions[:, None] + np.float32(beam.divergence_rad) * aside
    along /= np.sqrt(np.einsum("ijk,ijk->ij", along, along))[..., None]
    return starts.reshape(-1, 3), along.reshape(-1, 3)


def _crosswise(directions: Float32Array, along_row: Float32Array) -> tuple[NDArray, NDArray]:
    """Unit vectors across each direction, along the row and across it; where beams of a row coincide, any."""
    along = np.einsum("ij,ij->i", along_row, directions)[:, None]
    right = along_row - along * directions
    length = np.linalg.norm(right, axis=1, keepdims=True)
    lost = length[:, 0] < 1e-6
    right[lost] = np.cross(directions[lost], np.roll(directions[lost], 1, axis=1))
    right /= np.where(lost[:, None], np.linalg.norm(right, axis=1, keepdims=True), length)
    return right, np.cross(right, directions)
