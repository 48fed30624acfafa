"""Where the rays without return pointed: from the grid they stand in."""

import numpy as np
from numpy.typing import NDArray

from laserimg.projection import directions_from_angles

FloatArray = NDArray[np.floating]
BoolArray = NDArray[np.bool_]

# Nearer to the image plane than this the tangent of a ray says nothing.
_PINHOLE_MIN_X = 0.1


def complete_directions(directions: FloatArray, known: BoolArray) -> NDArray[np.float32]:
    """Return unit vectors for every pixel: the given ones where known, the grid's elsewhere.

    A grid of rays is separable in one of three ways: azimuth by column and elevation by row (a
    spinning or panning scanner), the same about the y axis (a fan that tilts), or the tangents of
    a pinhole. The way that fits the known rays best gives the others; rows and columns without any
    are put between their neighbours.

    Parameters
    ----------
    directions : (H, W, 3) array
        Unit vectors where `known`.
    known : (H, W) array of bool
        At least one must be known.
    """
    given = np.asarray(directions, np.float32)
    if known.all():
        return given
    models = [_about_z(given, known), _about_y(given, known), _pinhole(given, known)]
    fitting = [model for model in models if model is not None]
    best = min(fitting, key=lambda model: float(np.abs(model[known] - given[known]).mean()))
    return np.where(known[..., None], given, best)


def _about_z(directions: FloatArray, known: BoolArray) -> NDArray[np.float32]:
    used = np.where(known[..., None], directions, 0).astype(np.float64)
    x, y, _ = used.sum(axis=0).T
    azimuth = _between(np.arctan2(y, x), _any(known, 0), turn=2 * np.pi)
    sine = used[..., 2].sum(axis=1) / np.maximum(known.sum(axis=1), 1)
    elevation = _between(np.arcsin(np.clip(sine, -1, 1)), _any(known, 1))
    return directions_from_angles(azimuth, np.clip(elevation, -np.pi / 2, np.pi / 2))


def _about_y(directions: FloatArray, known: BoolArray) -> NDArray[np.float32]:
    """The model about z, with rows and columns exchanged and the axes moved on by one."""
    turned = _about_z(directions.transpose(1, 0, 2)[..., [2, 0, 1]], known.T)
    return turned.transpose(1, 0, 2)[..., [1, 2, 0]]


def _pinhole(directions: FloatArray, known: BoolArray) -> NDArray[np.float32] | None:
    if float(directions[known][:, 0].min()) < _PINHOLE_MIN_X:
        return None
    tangents = np.zeros_like(directions[..., 1:], dtype=np.float64)
    np.divide(directions[..., 1:], directions[..., :1], out=tangents, where=known[..., None])
    across = tangents[..., 0].sum(axis=0) / np.maximum(known.sum(axis=0), 1)
    up = tangents[..., 1].sum(axis=1) / np.maximum(known.sum(axis=1), 1)
    across, up = _between(across, _any(known, 0)), _between(up, _any(known, 1))
    rays = np.ones(directions.shape)
    rays[..., 1], rays[..., 2] = across[None, :], up[:, None]
    return (rays / np.linalg.norm(rays, axis=-1, keepdims=True)).astype(np.float32)


def _any(known: BoolArray, axis: int) -> BoolArray:
    return np.logical_or.reduce(known, axis=axis)


def _between(values: NDArray[np.float64], known: BoolArray, turn: float | None = None) -> NDArray[np.float64]:
    """Fill in the unknown values of a steady sequence, beyond its ends by its median step."""
    places = np.flatnonzero(known)
    steady = values[places] if turn is None else np.unwrap(values[places], period=turn)
    every = np.arange(len(values))
    filled = np.interp(every, places, steady)
    if len(places) > 1:
        step = float(np.median(np.diff(steady) / np.diff(places)))
        filled += step * (np.minimum(every - places[0], 0) + np.maximum(every - places[-1], 0))
    return filled
