"""One object seen from several places is one object, with one class."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from laserimg.classify.scores import UNKNOWN
from laserimg.semantic_map.clusters import Cluster
from laserimg.semantic_map.maps import MappedScan

# Clusters of different scans are one object if they share this part of the smaller one's cells, of so many
# metres: scanners on two sides of a car share its roof and bonnet.
CELL_M = 0.5
SHARED = 0.3


def fused(scans: Sequence[MappedScan]) -> list[MappedScan]:
    """Return the scans of a map with clusters of the same object told so.

    The clusters of an object get its number and its class: the one with the highest sum of confidences, of
    all clusters that are not "unknown"; each keeps the sentence of its own view.

    Parameters
    ----------
    scans : sequence of MappedScan
        Their poses must fit each other to about `CELL_M`.
    """
    clusters = [cluster for one in scans for cluster in one.clusters]
    if not clusters:
        return list(scans)
    scan_of = np.repeat(np.arange(len(scans)), [len(one.clusters) for one in scans])
    number = object_numbers(_cells(scans), scan_of)
    named = iter(_with_classes(clusters, number))
    return [replace(one, clusters=[next(named) for _ in one.clusters]) for one in scans]


def object_numbers(cells: NDArray[np.intp], scan_of: NDArray[np.intp]) -> NDArray[np.intp]:
    """Return the object of every cluster, from 1, in the order of their first clusters.

    Parameters
    ----------
    cells : (n, 2) array of int
        Which cluster has returns in which cell; each pair once.
    scan_of : (k,) array of int
        Scan of every cluster: those of one scan are never joined directly.

    Examples
    --------
    >>> cells = np.array([[0, 7], [0, 8], [1, 9], [2, 8], [2, 9], [2, 5]])
    >>> object_numbers(cells, np.array([0, 0, 1])).tolist()
    [1, 1, 1]
    >>> object_numbers(cells[:4], np.array([0, 0, 1])).tolist()
    [1, 2, 1]
    """
    count = len(scan_of)
    cluster, cell = cells.T
    cell = np.unique(cell, return_inverse=True)[1]
    occupied = coo_array((np.ones(len(cells), np.int32), (cluster, cell))).tocsr()
    shared = (occupied @ occupied.T).tocoo()
    size = np.bincount(cluster, minlength=count)
    one, other = shared.row, shared.col
    joined = (scan_of[one] != scan_of[other]) & (shared.data >= SHARED * np.minimum(size[one], size[other]))
    links = coo_array((joined[joined], (one[joined], other[joined])), (count, count))
    return connected_components(links, directed=False)[1].astype(np.intp) + 1


def _cells(scans: Sequence[MappedScan]) -> NDArray[np.intp]:
    """Return the pairs (n, 2) of clusters, counted over all scans, and cells with returns of theirs."""
    origin, first, parts = scans[0].cloud.origin, 0, []
    for one in scans:
        cloud = one.cloud
        own = cloud.cluster > 0
        place = np.floor((cloud.points[own] + (cloud.origin - origin)) / CELL_M).astype(np.int64)
        # 20 bits an axis: half a million cells to either side.
        x, y, z = (place + (1 << 19)).T
        key = ((x << 20) + y << 20) + z
        parts.append(np.unique(np.column_stack([cloud.cluster[own] - 1 + first, key]), axis=0))
        first += len(one.clusters)
    return np.concatenate(parts).astype(np.intp)


def class_of(members: list[Cluster]) -> tuple[str, float]:
    """Return the class of an object and its confidence: the mean over the clusters that are not unknown."""
    known = [member for member in members if member.label != UNKNOWN] or members
    total = {member.label: 0.0 for member in known}
    for member in known:
        total[member.label] += member.confidence
    label = max(total, key=lambda name: total[name])
    return label, total[label] / len(known)


def _with_classes(clusters: list[Cluster], number: NDArray[np.intp]) -> list[Cluster]:
    named: list[Cluster] = []
    for cluster, own in zip(clusters, number, strict=True):
        members = [clusters[place] for place in np.flatnonzero(number == own)]
        label, confidence = class_of(members)
        named.append(replace(cluster, number=int(own), label=label, confidence=confidence))
    return named
