"""Points sorted into cells of elevation, azimuth and log range, and the neighbours of such cells."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.intp]
Keys = NDArray[np.int64]
Pairs = tuple[Indices, Indices]


@dataclass(frozen=True, eq=False, slots=True)
class PolarCells:
    """Points in the order of their cells.

    Parameters
    ----------
    points, length : (n, 3) and (n,) arrays
    start, count : (m,) arrays
        First point and number of points of every cell.
    place : (3, m) array
        Row, column and shell: elevation, azimuth and log range in sides of a cell, from 0.
    """

    points: Array
    length: Array
    start: Indices
    count: Indices
    place: Keys


def polar_cells(points: Array, length: Array, side: float) -> tuple[Indices, PolarCells]:
    """Return the order that sorts points by cells, and the points in it.

    With differences e, a and l of elevation, azimuth and log range, two points are no farther apart
    than the larger range times the root of e^2 + a^2 + l^2, in one cell `side` times the root of 3.
    """
    elevation = np.arcsin(np.clip(points[:, 2] / length, -1, 1))
    azimuth = np.arctan2(points[:, 1], points[:, 0])
    parts = [elevation, azimuth, np.log(length)]
    place = np.stack([((part - part.min()) / side).astype(np.int64) for part in parts])
    key = strides_of(place) @ place
    order = np.argsort(key)
    start = starts_of(key[order])
    count = np.diff(start, append=len(order))
    return order, PolarCells(points.take(order, axis=0), length[order], start, count, place[:, order[start]])


def strides_of(place: Keys) -> Keys:
    """Return what makes one number of a place; one step past a border gives no other place's number."""
    rows, columns = place.max(axis=1)[1:] + 2
    return np.array([rows * columns, columns, 1])


def starts_of(*ordered: NDArray) -> Indices:
    """Return where runs of equal values begin, in any of the arrays."""
    first = np.ones(len(ordered[0]), np.bool_)
    first[1:] = np.any([values[1:] != values[:-1] for values in ordered], axis=0)
    return np.flatnonzero(first)


def hash_table(key: Keys) -> NDArray[np.int32]:
    """Return a table of the places of keys.

    Later ones overwrite earlier ones of the same hash, so that `a_step_apart` misses a few pairs, in a
    third of the time of a binary search that misses none.
    """
    table = np.zeros(1 << (len(key).bit_length() + 3), np.int32)
    table[_hash(key, table)] = np.arange(len(key), dtype=np.int32)
    return table


def _hash(key: Keys, table: NDArray[np.int32]) -> Keys:
    """Return slots of the table by Fibonacci hashing."""
    shift = np.uint64(65 - len(table).bit_length())
    return ((key.view(np.uint64) * np.uint64(0x9E3779B97F4A7C15)) >> shift).view(np.int64)


def a_step_apart(key: Keys, table: NDArray[np.int32], step: int) -> Pairs:
    """Return the pairs of places whose keys differ by the step."""
    wanted = key + step
    other = table[_hash(wanted, table)]
    one = np.flatnonzero(key[other] == wanted)
    return one, other[one].astype(np.intp)


def neighbouring_groups(block: Keys, strides: Keys) -> Pairs:
    """Return the pairs of groups that lie in one block or in two that touch.

    Parameters
    ----------
    block : (n,) array
        Number of the block of each group, ascending.
    strides : (3,) array
        As `strides_of` gives them.
    """
    pairs = []
    for row, column in ((0, 0), (0, 1), (1, -1), (1, 0), (1, 1)):
        step = row * strides[0] + column * strides[1]
        # Blocks one shell nearer, at the same range and one farther stand one after the other.
        first = np.searchsorted(block, block + step - 1)
        last = np.searchsorted(block, block + step + 1, side="right")
        if step == 0:
            first = np.arange(1, len(block) + 1)
        one, place, _ = products(last - first, np.ones_like(first))
        pairs.append((one, first[one] + place))
    one, other = (np.concatenate(part) for part in zip(*pairs, strict=True))
    return one, other


def products(n: Indices, m: Indices) -> tuple[Indices, Indices, Indices]:
    """Return, for each i, every pair of a number below n[i] and one below m[i]: i, the one and the other."""
    size = n * m
    i = np.repeat(np.arange(len(size)), size)
    step = np.arange(len(i)) - np.repeat(np.cumsum(size) - size, size)
    return i, step // m[i], step % m[i]
