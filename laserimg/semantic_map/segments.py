"""What stands on the ground of a scan, cut into clusters, and how a classifier sees them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from laserimg.classify.recipe import SIZE_WEIGHT, Recipe, descriptors, size_numbers
from laserimg.classify.views import ObjectImages, crop_of_pixels
from laserimg.clusters import LINK, linked
from laserimg.ground import Ground, ground_of_scan
from laserimg.regions import Partition, Region, regions_of
from laserimg.scan import Float32Array, Scan
from laserimg.semantic_map.object_labels import object_labels
from laserimg.thinning import evenly

# Clusters of fewer returns are crumbs: on simulated streets they are one in three, and 1 % of the returns.
MIN_POINTS = 30

_MAX_SIZED = 4000
# Images described at a time: 64 of them stay in the processor's cache.
_CHUNK = 64


@dataclass(frozen=True, eq=False, slots=True)
class Segments:
    """A scan without its ground, in clusters.

    Parameters
    ----------
    ground : Ground or None
        None where the scan shows no ground.
    labels : (H, W) array of int32
        Cluster of every pixel, from 1; 0 for none.
    clusters : list of Region
        In the order of their numbers.
    """

    ground: Ground | None
    labels: NDArray[np.int32]
    clusters: list[Region]


def segments_of(scan: Scan, ratio: float = LINK) -> Segments:
    """Take the ground out of a scan and cut the rest into clusters (paper 1, section 4.1).

    Clusters are those of `object_labels`, of which most are one object each; where no ground is seen, heights
    are unknown, and they are radially bounded nearest neighbours on the lattice, as `laserimg.clusters` has
    them.

    Parameters
    ----------
    scan : Scan
    ratio : float
        Radius of the nearest neighbours in metres at a range of 1 m.
    """
    ground = ground_of_scan(scan)
    above = scan.valid if ground is None else scan.valid & ~ground.mask
    if ground is None:
        labels, range_m = linked(scan.range, scan.directions, above, scan.wraps, ratio)
    else:
        labels, range_m = object_labels(scan, above, ground.height, ratio)
    large = np.bincount(labels.ravel()) >= MIN_POINTS
    large[0] = False
    labels = (np.cumsum(large, dtype=np.int32) * large)[labels]
    return Segments(ground, labels, regions_of(Partition(labels, range_m, above), scan.wraps))


def described_clusters(scan: Scan, clusters: Sequence[Region], recipe: Recipe) -> Float32Array:
    """Return the vectors (n, recipe.length) of clusters, as `classify.describe_images` gives each.

    A cluster of which nothing can be described, such as a single row of returns, has zeros and its size.
    """
    vectors = np.zeros((len(clusters), recipe.length), np.float32)
    for first in range(0, len(clusters), _CHUNK):
        part = clusters[first : first + _CHUNK]
        crops = [crop_of_pixels(scan, cluster.pixels) for cluster in part]
        found = descriptors(_stacked(crops), recipe)
        length = np.linalg.norm(found, axis=1, keepdims=True)
        vectors[first : first + len(part), : found.shape[1]] = found / np.where(length > 0, length, 1)
    if recipe.size:
        sizes = [size_numbers(world_points(scan, cluster.pixels)) for cluster in clusters]
        vectors[:, -3:] = SIZE_WEIGHT * np.reshape(sizes, (-1, 3))
    return vectors


def world_points(scan: Scan, pixels: NDArray[np.intp]) -> NDArray[np.float64]:
    """Return an even selection of 4000 or fewer of some pixels' points, turned so that z is up."""
    chosen = pixels[evenly(len(pixels), _MAX_SIZED)]
    points = scan.range.ravel()[chosen, None] * scan.directions.reshape(-1, 3)[chosen]
    return points.astype(np.float64) @ scan.world_from_scan[:3, :3].T


def _stacked(crops: Sequence[ObjectImages]) -> ObjectImages:
    values = [crop.reflectance for crop in crops if crop.reflectance is not None]
    return ObjectImages(
        np.concatenate([crop.range for crop in crops]),
        np.concatenate([crop.directions for crop in crops]),
        np.concatenate(values) if values else None,
    )
