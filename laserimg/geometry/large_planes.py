"""Large planes: walls, ceilings and facades, found on a thinned lattice of returns."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from laserimg.geometry.planes import Plane, planes_through, refit_plane
from laserimg.scan import BoolArray, Float32Array

# A desk top is 1.3 m2, a car's side 2 m2, a door 2 m2 and a garage door 5 m2.
MIN_AREA_M2 = 3.0
TOLERANCE_M = 0.05

_MIN_PIXELS = 20
_TRIALS = 300
_SAMPLE = 1000
_ATTEMPTS = 12
# Rays that coincide count as this far apart.
_MIN_PITCH_RAD = 1e-5
# Returns that see a plane at a lower angle than this (sine) say little about it.
_MIN_GRAZE = 0.15
# Triples are drawn from a window of this size, so that most of them lie on one surface.
_WINDOW_RAD = 0.3


@dataclass(frozen=True, eq=False, slots=True)
class LargePlane:
    """A plane and the pixels of the lattice that belong to its large patches.

    Parameters
    ----------
    plane : Plane
        Its normal points to the scanner.
    mask : (H, W) array of bool
    """

    plane: Plane
    mask: BoolArray


def large_planes(
    points: Float32Array, takes_part: BoolArray, pitch: tuple[float, float], wraps: bool = False
) -> list[LargePlane]:
    """Return the planes that have a connected patch of at least `MIN_AREA_M2`, largest first.

    A consensus search with a fixed seed, in which a return counts with the area it stands for
    (range squared times the solid angle of its pixel), so that a far wall weighs as much as a
    near one; each plane found is refitted and its patches are taken out of the search.

    Parameters
    ----------
    points : (H, W, 3) array of float32
        Metres from the scanner; a thinned lattice will do.
    takes_part : (H, W) array of bool
        Returns to search, usually without the floor.
    pitch : (float, float)
        Median angle in radians between neighbours of this lattice, across and up.
    wraps : bool
        The columns close a full turn: a patch may lie on both sides of the seam.
    """
    pixels = np.flatnonzero(takes_part)
    if len(pixels) < 3:
        return []
    pitch = max(pitch[0], _MIN_PITCH_RAD), max(pitch[1], _MIN_PITCH_RAD)
    random = np.random.default_rng(0)
    normals, offsets = _drawn(points, takes_part, pixels, pitch, random)
    chosen = random.choice(pixels, min(_SAMPLE, len(pixels)), replace=False)
    sample = points.reshape(-1, 3)[chosen]
    squared = np.einsum("ij,ij->i", sample, sample)
    area = squared * np.float32(pitch[0] * pitch[1] * len(pixels) / len(sample))
    near = np.abs(sample @ normals.T - offsets) <= TOLERANCE_M
    near &= np.sqrt(squared)[:, None] * np.float32(_MIN_GRAZE) <= np.abs(offsets)
    votes_for = near.astype(np.float32)  # as numbers, or every count of votes would convert them
    free, found = takes_part.copy(), []
    for _ in range(_ATTEMPTS):
        still_free = free.ravel()[chosen]
        votes = (area * still_free) @ votes_for
        best = int(np.argmax(votes)) if len(votes) else 0
        if len(votes) == 0 or votes[best] < MIN_AREA_M2 / 2:
            break
        plane = Plane(normals[best].astype(np.float64), float(offsets[best]))
        for tolerance in (3 * TOLERANCE_M, 2 * TOLERANCE_M, TOLERANCE_M):
            plane = refit_plane(plane, sample[still_free], tolerance, rounds=1)
        votes_for[:, best] = 0
        large = _patches(plane, points, free, pitch, wraps)
        if large is not None:
            found.append(large)
            free &= ~large.mask
    return found


def _drawn(
    points: Float32Array,
    takes_part: BoolArray,
    pixels: NDArray[np.intp],
    pitch: tuple[float, float],
    random: np.random.Generator,
) -> tuple[Float32Array, Float32Array]:
    """Return normals (n, 3) and offsets (n,) of planes through triples of near pixels."""
    height, width = takes_part.shape
    row, column = np.divmod(random.choice(pixels, _TRIALS), width)
    reach_across, reach_up = (max(2, round(_WINDOW_RAD / 2 / step)) for step in pitch)
    triples = [(row, column)]
    for _ in range(2):
        rows = np.clip(row + random.integers(-reach_up, reach_up + 1, _TRIALS), 0, height - 1)
        columns = (column + random.integers(-reach_across, reach_across + 1, _TRIALS)) % width
        triples.append((rows, columns))
    good = np.logical_and.reduce([takes_part[rows, columns] for rows, columns in triples])
    corners = np.stack([points[rows[good], columns[good]] for rows, columns in triples], axis=1)
    normals, offsets = planes_through(corners.astype(np.float64))
    return normals.astype(np.float32), offsets.astype(np.float32)


def _patches(
    plane: Plane, points: Float32Array, free: BoolArray, pitch: tuple[float, float], wraps: bool
) -> LargePlane | None:
    """Keep the large connected patches of the free points near a plane."""
    plane = plane if plane.offset_m < 0 else Plane(-plane.normal, -plane.offset_m)
    mask = free & (np.abs(plane.distance(points)) <= TOLERANCE_M)
    patch = np.asarray(cv2.connectedComponents(mask.view(np.uint8), connectivity=8)[1], np.int32)
    if wraps:
        patch = _joined_at_seam(patch)
    inside = patch[mask]
    if len(inside) == 0:
        return None
    on_plane = points[mask]
    squared = np.einsum("ij,ij->i", on_plane, on_plane)
    graze = np.maximum(abs(plane.offset_m) / np.sqrt(squared), _MIN_GRAZE)
    area = squared / graze * (pitch[0] * pitch[1])
    large = np.bincount(inside, weights=area, minlength=int(patch.max()) + 1) >= MIN_AREA_M2
    large &= np.bincount(inside, minlength=len(large)) >= _MIN_PIXELS
    large[0] = False
    return LargePlane(plane, large[patch]) if large.any() else None


def _joined_at_seam(patch: NDArray[np.int32]) -> NDArray[np.int32]:
    """Give patches (H, W) that touch across the first and the last column one number."""
    first, last = patch[:, 0].tolist(), patch[:, -1].tolist()
    beside = (
        zip(first, last, strict=True),
        zip(first[1:], last, strict=False),
        zip(first, last[1:], strict=False),
    )
    pairs = {(one, other) for pairs in beside for one, other in pairs if one and other}
    if not pairs:
        return patch
    number = np.arange(int(patch.max()) + 1, dtype=np.int32)
    for one, other in pairs:
        number[number == number[other]] = number[one]
    return number[patch]
