"""One HTML page with the map in 3D: nothing is loaded from elsewhere, all points are inside it."""

import base64
import json
from collections import Counter
from importlib.resources import files
from typing import Any

import numpy as np
from numpy.typing import NDArray

from laserimg.semantic_map.cloud import Cloud
from laserimg.semantic_map.clusters import objects_of
from laserimg.semantic_map.colours import GROUND, LOOSE, palette
from laserimg.semantic_map.maps import SemanticMap
from laserimg.semantic_map.record import facts_of

# 10 bytes a point, in base64: 400,000 points are 5.3 MB.
MAX_POINTS = 400_000
# Objects that carry their name, the largest first.
_NAMED = 60
_QUANTILES = (0.01, 0.99)


def page(whole: SemanticMap, cloud: Cloud, title: str, max_points: int = MAX_POINTS) -> str:
    """Return the page.

    Parameters
    ----------
    whole : SemanticMap
    cloud : Cloud
        Its points.
    title : str
    max_points : int
        Points are thinned to about so many: those whose neighbours are nearest go first.
    """
    from jinja2 import Environment

    thin = thinned(cloud, max_points)
    parts = {name: _text(name) for name in ("page.html", "page.css", "page.js")}
    packed, frame = pack(thin)
    facts = json.dumps(_facts(whole, thin, title, frame), separators=(",", ":"), ensure_ascii=False)
    return (
        Environment(autoescape=False)
        .from_string(parts["page.html"])
        .render(
            title=_escaped(title),
            style=parts["page.css"],
            script=parts["page.js"],
            # Nothing in it may end the element it stands in.
            facts=facts.replace("<", "\\u003c"),
            points=base64.b64encode(packed).decode("ascii"),
        )
    )


def thinned(cloud: Cloud, max_points: int) -> Cloud:
    """Return about `max_points` points of a cloud, each kept as often as the area it stands for asks.

    A point that stays for several that go stands for their area. Points in the order of a scan are
    kept at even distances.
    """
    count = len(cloud.points)
    if count <= max_points:
        return cloud
    area = cloud.spacing.astype(np.float64) ** 2
    share = area * max_points / area.sum()
    for _ in range(8):
        # Shares above 1 leave something for the others.
        share = np.minimum(share * (max_points / np.minimum(share, 1).sum()), 1)
    kept = np.diff(np.floor(np.cumsum(share)), prepend=0) > 0
    spacing = cloud.spacing[kept] / np.sqrt(share[kept]).astype(np.float32)
    return Cloud(cloud.points[kept], cloud.origin, cloud.cluster[kept], cloud.shade[kept], spacing)


def pack(cloud: Cloud) -> tuple[bytes, dict[str, Any]]:
    """Return points as bytes, and the frame that turns them back into metres.

    All x, y, z as 16 bits between the corners of the cloud's box, then all clusters as 16 bits (0
    loose, 1 ground, 2 the first; from the 65,535th on loose), then brightness, then spacing as 8 bits each,
    little-endian.
    """
    low, high = cloud.points.min(axis=0), cloud.points.max(axis=0)
    span = np.maximum(high - low, np.float32(1e-3))
    largest = max(float(np.quantile(cloud.spacing, 0.999)), 1e-3)
    places = np.rint((cloud.points - low) / span * 65535).astype("<u2")
    size = np.clip(np.rint(cloud.spacing / largest * 255), 1, 255).astype(np.uint8)
    cluster = np.where(cloud.cluster < 65535, cloud.cluster + 1, 0).astype("<u2")
    parts = (places, cluster, cloud.shade, size)
    frame = {"count": len(places), "low": low.tolist(), "span": span.tolist(), "largest_m": largest}
    return b"".join(part.tobytes() for part in parts), frame


def _facts(whole: SemanticMap, cloud: Cloud, title: str, frame: dict[str, Any]) -> dict[str, Any]:
    low, high = np.quantile(cloud.points[::7], _QUANTILES, axis=0)
    middle = np.array([*(low + high)[:2] / 2, low[2] + 1])
    colours = palette(whole.labels)
    count = objects_of(whole.clusters, colours)
    legend = [[label, str(count[label])] for label in colours if count[label]]
    return {
        **frame,
        "title": title,
        "middle": middle.tolist(),
        "radius": float(np.hypot(*(high - low)[:2]) / 2),
        "scanners": [(one.world_from_scan[:3, 3] - cloud.origin).tolist() for one in whole.scans],
        "colours": {label: list(colour) for label, colour in colours.items()},
        "legend": [*legend, [GROUND, ""], [LOOSE, ""]],
        "clusters": _clusters(whole, cloud.origin),
        "named": _named(whole),
    }


def _clusters(whole: SemanticMap, origin: NDArray[np.float64]) -> list[dict[str, Any]]:
    told, seen = [], Counter(cluster.number for cluster in whole.clusters)
    for cluster in whole.clusters:
        at = cluster.position - origin
        told.append(
            {
                "class": cluster.label,
                "confidence": round(cluster.confidence, 3),
                "at": at.round(2).tolist(),
                "top": [*at[:2].round(2).tolist(), round(float(at[2]) + cluster.size.height / 2, 2)],
                "reach_m": round(max(cluster.size.length, cluster.size.height), 2),
                "facts": facts_of(cluster, seen[cluster.number]),
                "why": cluster.reason,
            }
        )
    return told


def _named(whole: SemanticMap) -> list[int]:
    """Return the clusters that carry a name: the largest of each object, largest first."""
    clusters = whole.clusters
    largest: dict[int, int] = {}
    for place in np.argsort([-cluster.points for cluster in clusters], kind="stable").tolist():
        largest.setdefault(clusters[place].number, place)
    return list(largest.values())[:_NAMED]


def _text(name: str) -> str:
    return files("laserimg.semantic_map.page").joinpath(name).read_text(encoding="utf-8")


def _escaped(text: str) -> str:
    from html import escape

    return escape(text)
