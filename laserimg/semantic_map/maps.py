"""From scans to one map: ground, clusters, class of each (paper 1)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from laserimg.scan import Scan
from laserimg.semantic_map.cloud import Cloud, cloud_of, joined, shades
from laserimg.semantic_map.clusters import Cluster, classified
from laserimg.semantic_map.models import MapModels
from laserimg.semantic_map.segments import Segments, segments_of

GROUND_NUMBER, LOOSE_NUMBER = 0, -1


@dataclass(frozen=True, eq=False, slots=True)
class ScanMap:
    """The map of one scan, pixel by pixel.

    Parameters
    ----------
    scan : Scan
    segments : Segments
    clusters : list of Cluster
        In the order of the numbers in `segments`.
    shade : (H, W) array of uint8
        How bright every pixel is drawn.
    """

    scan: Scan
    segments: Segments
    clusters: list[Cluster]
    shade: NDArray[np.uint8]

    def numbers(self) -> NDArray[np.int32]:
        """Return the cluster (H, W) of every pixel, from 1; 0 ground, -1 loose or no return."""
        labels = self.segments.labels
        number = np.where(labels > 0, labels, np.int32(LOOSE_NUMBER))
        if self.segments.ground is not None:
            number[self.segments.ground.mask] = GROUND_NUMBER
        return number

    def in_world(self) -> "MappedScan":
        """Return what a map of several scans keeps of this one."""
        cloud = cloud_of(self.scan, self.numbers(), self.shade)
        pose = self.scan.world_from_scan
        return MappedScan(self.scan.source, self.scan.index, pose, self.clusters, cloud)


@dataclass(frozen=True, eq=False, slots=True)
class MappedScan:
    """One scan of a map: its points in the world and its clusters.

    Parameters
    ----------
    source : str
        File it came from.
    index : int
        Its number in that file.
    world_from_scan : (4, 4) array
    clusters : list of Cluster
    cloud : Cloud
        Its clusters are numbered from 1 in the order of `clusters`.
    """

    source: str
    index: int
    world_from_scan: NDArray[np.float64]
    clusters: list[Cluster]
    cloud: Cloud


@dataclass(frozen=True, eq=False, slots=True)
class SemanticMap:
    """The map of one or several scans.

    Parameters
    ----------
    scans : sequence of MappedScan
        At least one.
    labels : tuple of str
        Classes of the classifier.
    """

    scans: Sequence[MappedScan]
    labels: tuple[str, ...]

    @property
    def clusters(self) -> list[Cluster]:
        """All clusters; number n of the map is at place n - 1."""
        return [cluster for one in self.scans for cluster in one.clusters]

    def first_numbers(self) -> list[int]:
        """Return the number of each scan's first cluster."""
        counts = [1, *(len(one.clusters) for one in self.scans[:-1])]
        return np.cumsum(counts).tolist()

    def cloud(self) -> Cloud:
        """Return the points of all scans."""
        return joined([one.cloud for one in self.scans], self.first_numbers())


def map_scan(scan: Scan, models: MapModels, margin: float | None = None) -> ScanMap:
    """Return the map of one scan.

    Parameters
    ----------
    scan : Scan
    models : MapModels
    margin : float, optional
        Best decision value less the second, below which a cluster is "unknown"; by default the model's.

    Raises
    ------
    ModelError
        If the classifier needs reflectance and the scan has none.
    """
    model = models.of(scan)
    segments = segments_of(scan)
    return ScanMap(scan, segments, classified(scan, segments, model, margin), shades(scan))
