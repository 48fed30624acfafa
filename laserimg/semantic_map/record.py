"""`map.json`: every cluster of a map."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from laserimg.semantic_map.clusters import Cluster
from laserimg.semantic_map.maps import GROUND_NUMBER, MappedScan, SemanticMap

FORMAT = 1


def record(whole: SemanticMap) -> dict[str, Any]:
    """Return a map as plain values: its scans, classes and clusters, numbered from 1."""
    clusters = []
    for place, (one, first) in enumerate(zip(whole.scans, whole.first_numbers(), strict=True)):
        for number, cluster in enumerate(one.clusters, first):
            clusters.append({"id": number, "object": cluster.number, "scan": place, **_cluster(cluster)})
    return {
        "format": FORMAT,
        "classes": list(whole.labels),
        "scans": [_scan(one) for one in whole.scans],
        "clusters": clusters,
    }


def facts_of(cluster: Cluster, views: int = 1) -> list[tuple[str, str]]:
    """Return what is measured of a cluster, for people; `views` clusters are the same object."""
    size = cluster.size
    return [
        ("size", f"{size.length:.2f} x {size.breadth:.2f} m, {size.height:.2f} m high"),
        ("stands", _stands(size.height_above_floor)),
        ("range", f"{size.range:.1f} m from the scanner"),
        ("points", f"{cluster.points:,}"),
        *([("seen", f"in {views} clusters")] if views > 1 else []),
    ]


def _stands(above_ground_m: float | None) -> str:
    if above_ground_m is None:
        return "no ground seen"
    return "on the ground" if above_ground_m == 0 else f"{above_ground_m:.2f} m above the ground"


def _scan(one: MappedScan) -> dict[str, Any]:
    return {
        "file": one.source,
        "scan": one.index,
        "world_from_scan": one.world_from_scan.tolist(),
        "points": len(one.cloud.points),
        "ground_points": int((one.cloud.cluster == GROUND_NUMBER).sum()),
        "clusters": len(one.clusters),
    }


def _cluster(cluster: Cluster) -> dict[str, Any]:
    size = cluster.size
    above = size.height_above_floor
    return {
        "class": cluster.label,
        "confidence": round(cluster.confidence, 4),
        "points": cluster.points,
        "position": _rounded(cluster.position),
        "size": {
            name: round(getattr(size, name), 3) for name in ("width", "depth", "height", "length", "breadth")
        },
        "range": round(size.range, 3),
        "height_above_ground": None if above is None else round(above, 3),
        "why": cluster.reason,
    }


def _rounded(values: NDArray[np.float64]) -> list[float]:
    return [round(float(value), 3) for value in values]
