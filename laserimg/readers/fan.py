"""A flat fan of beams that pans or tilts: its lines are planes through one axis."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from laserimg.readers.beams import cell_index, lattice_index, usual_step
from laserimg.readers.lines import Lines

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.intp]

# The head stood still: lines nearer than this are one, if lines are usually further apart.
_SAME_LINE_RAD = np.radians(0.1)
_SAME_LINE_PART = 0.25
# A point further from its line's plane than this part of the step between lines is not of it.
_FLAT = 0.5
# Planes that miss the origin by less, in metres, pass through it.
_MISS_M = 0.02
# A plane is certain when its points spread over this part of their length to the side, and lie in
# it; the centre is sought only if most planes are.
_SPREAD = 0.02
_OFF_PLANE_M = 0.005
_MOST = 0.5


@dataclass(frozen=True, eq=False, slots=True)
class Fan:
    """Places of points in the fan.

    Parameters
    ----------
    line, beam : (N,) arrays of int
    own : (N,) array of bool
        False for further returns of a beam that has its place.
    lines_are_columns : bool
        The fan pans; else it tilts.
    """

    line: IntArray
    beam: IntArray
    own: NDArray[np.bool_]
    lines_are_columns: bool


def laser_centre(points: FloatArray, lines: Lines) -> FloatArray:
    """Return the mean centre of the laser, from the planes of its lines; the origin if they meet there.

    A laser may sit beside the axis it turns about, and a file may have its origin at the foot of
    the robot. The plane of line l, normal n_l, distance d_l, then satisfies ``n_l . axis + arm =
    d_l``; the centre of the laser in that line is ``axis + arm n_l``.

    Parameters
    ----------
    points : (N, 3) array
        Metres.
    """
    mean = lines.sums(points) / lines.counts[:, None]
    centred = points - mean[lines.of_point]
    spread, vectors = np.linalg.eigh(lines.sums(centred[:, :, None] * centred[:, None, :]))
    flat = spread[:, 0] < lines.counts * _OFF_PLANE_M**2
    certain = flat & (spread[:, 1] > _SPREAD**2 * spread[:, 2])
    normals = _one_sided(vectors[certain, :, 0], mean[certain])
    distance = np.einsum("lk,lk->l", normals, mean[certain])
    miss = float(np.median(np.abs(distance))) if certain.mean() > _MOST else 0.0
    if miss < _MISS_M:
        return np.zeros(3)
    unknowns = np.c_[normals, np.ones(len(normals))]
    solution = np.linalg.lstsq(unknowns, distance, rcond=_SPREAD)[0]
    if float(np.percentile(np.abs(unknowns @ solution - distance), 95)) > _MISS_M:
        return np.zeros(3)
    return solution[:3] + solution[3] * normals.mean(axis=0)


def fan_places(directions: FloatArray, lines: Lines) -> Fan | None:
    """Return the line and the beam of every point, or None if its lines are not flat.

    Parameters
    ----------
    directions : (N, 3) array
        Unit vectors from the laser.
    """
    scatter, vectors = np.linalg.eigh(lines.sums(directions[:, :, None] * directions[:, None, :]))
    middle = lines.sums(directions)
    pole = np.linalg.eigh(np.einsum("li,lj->ij", vectors[:, :, 0], vectors[:, :, 0]))[1][:, 0]
    pole *= np.sign(pole[np.argmax(np.abs(pole))])
    heading = np.cross(vectors[:, :, 0], pole)
    heading *= np.sign(np.einsum("lk,lk->l", heading, middle))[:, None]
    turned = _angle_about(pole, heading)
    steps = np.diff(np.sort(turned))
    off_plane = np.sqrt(np.maximum(scatter[:, 0], 0) / lines.counts)
    if float(np.median(off_plane)) > _FLAT * float(np.percentile(steps, 75)):
        return None
    line = lines.of_point
    angle = np.arctan2(directions @ pole, np.einsum("nk,nk->n", directions, heading[line]))
    angle *= np.sign(np.median(np.diff(angle)))
    step = usual_step(angle, line)
    if step == 0:
        return None
    beam, sharp = lattice_index(angle, step)
    number, own = _numbered(turned, sharp)[line], np.ones(len(beam), bool)
    if not sharp:
        beam, own = cell_index(angle, number, step)
    return Fan(number, beam, own, abs(pole[2]) > np.sqrt(0.5))


def _one_sided(normals: FloatArray, middle: FloatArray) -> FloatArray:
    """Normals all to the same side of the turning fan: of neighbours, none points against the other."""
    same = np.einsum("lk,lk->l", normals[1:], normals[:-1]) >= 0
    return normals * np.r_[1, np.cumprod(np.where(same, 1, -1))][:, None]


def _angle_about(pole: FloatArray, heading: FloatArray) -> FloatArray:
    first = np.cross(pole, np.eye(3)[np.argmin(np.abs(pole))])
    return np.arctan2(heading @ np.cross(pole, first), heading @ first)


def _numbered(turned: FloatArray, merge: bool) -> IntArray:
    """Number lines by angle about the pole.

    With `merge`, lines nearer than a standing head's jitter are one. Lines whose beams lie on no
    common lattice are interlaced: other rays, however near.
    """
    order = np.argsort(turned, kind="stable")
    around = np.diff(np.r_[turned[order], turned[order[0]] + 2 * np.pi])
    # Begin behind the widest step, so that no group lies across the cut.
    order = np.roll(order, -1 - int(np.argmax(around)))
    steps = np.roll(around, -1 - int(np.argmax(around)))[:-1]
    limit = min(_SAME_LINE_RAD, _SAME_LINE_PART * float(np.percentile(steps, 75)))
    number = np.empty(len(turned), np.intp)
    number[order] = np.r_[0, np.cumsum(steps >= limit)] if merge else np.arange(len(turned))
    return number
