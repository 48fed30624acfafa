"""The clusters of one scan with their classes, sizes and reasons."""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from laserimg.classify.model import ObjectModel
from laserimg.ground import Ground
from laserimg.measure import QUANTILE, MetricBox, metric_box
from laserimg.regions import Region
from laserimg.scan import Scan
from laserimg.semantic_map.reasons import reasons
from laserimg.semantic_map.segments import Segments, described_clusters

# The ground takes the foot of what stands on it: what begins no higher than this over it stands there.
STANDS_WITHIN_M = 0.45


@dataclass(frozen=True, eq=False, slots=True)
class Cluster:
    """A cluster of one scan and what it is taken for.

    Parameters
    ----------
    number : int
        Of the object, from 1: clusters of several scans may be one.
    label : str
        Class, or "unknown".
    confidence : float
        0 to 1.
    decisions : (k,) array
        Of the classifier, for each of its classes.
    reason : str
    size : MetricBox
        Its height counts from the ground if it stands there.
    position : (3,) array
        Median point in the world, metres.
    points : int
        Returns in it.
    """

    number: int
    label: str
    confidence: float
    decisions: NDArray[np.float64]
    reason: str
    size: MetricBox
    position: NDArray[np.float64]
    points: int


def classified(
    scan: Scan, segments: Segments, model: ObjectModel, margin: float | None = None
) -> list[Cluster]:
    """Return the clusters of a scan with their classes, in the order of `segments`.

    Parameters
    ----------
    scan : Scan
    segments : Segments
    model : ObjectModel
    margin : float, optional
        In place of the model's.
    """
    vectors = described_clusters(scan, segments.clusters, model.recipe)
    decisions = model.decide(vectors)
    verdicts = model.classify(vectors, margin)
    why = reasons(model, vectors, decisions, [verdict.label for verdict in verdicts])
    found = []
    for place, region in enumerate(segments.clusters):
        box = measured(scan, region, segments.ground)
        position = scan.world_from_scan @ [box.x, box.y, box.z, 1.0]
        verdict = verdicts[place]
        found.append(
            Cluster(place + 1, *verdict, decisions[place], why[place], box, position[:3], len(region.pixels))
        )
    return found


def measured(scan: Scan, region: Region, ground: Ground | None) -> MetricBox:
    """Return the box of a cluster, with its height over the uneven ground in place of a floor."""
    box = metric_box(scan, region, None)
    if ground is None:
        return box
    low, high = np.quantile(ground.height.ravel()[region.pixels], [QUANTILE, 1 - QUANTILE])
    if low > STANDS_WITHIN_M:
        return replace(box, height_above_floor=float(low))
    return replace(box, height_above_floor=0.0, height=float(max(high, 0.0)))


def objects_of(clusters: Iterable[Cluster], labels: Iterable[str]) -> dict[str, int]:
    """Return how many objects each class has."""
    found = {(cluster.label, cluster.number) for cluster in clusters}
    return {label: sum(name == label for name, _ in found) for label in labels}
