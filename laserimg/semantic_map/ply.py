"""The points of a map as a coloured PLY file, which every viewer of point clouds opens."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from laserimg.files import atomic_write
from laserimg.semantic_map.cloud import Cloud
from laserimg.semantic_map.colours import GROUND, LOOSE, palette
from laserimg.semantic_map.maps import SemanticMap

_RECORD = [
    ("x", "<f8"), ("y", "<f8"), ("z", "<f8"), ("red", "u1"), ("green", "u1"), ("blue", "u1"),
    ("class", "u1"), ("cluster", "<i4"),
]  # fmt: skip
_TYPES = {"<f8": "double", "u1": "uchar", "<i4": "int"}


def write_ply(path: Path, whole: SemanticMap, cloud: Cloud) -> None:
    """Write all points in world coordinates, in the colours of their classes.

    Beside the colour every point has `class`, a number that a comment of the header names, and
    `cluster`, the id in `map.json`; 0 is the ground and -1 what belongs to no cluster.
    """
    colours = palette(whole.labels)
    code = {label: number for number, label in enumerate(colours)}
    class_of = np.array([code[LOOSE], code[GROUND], *(code[c.label] for c in whole.clusters)], np.uint8)
    records = np.empty(len(cloud.points), _RECORD)
    for axis, name in enumerate("xyz"):
        records[name] = cloud.points[:, axis] + cloud.origin[axis]
    records["class"] = class_of[cloud.cluster + 1]
    shown = np.array(list(colours.values()), np.uint16)[records["class"]] * cloud.shade[:, None].astype(
        np.uint16
    )
    for axis, name in enumerate(("red", "green", "blue")):
        records[name] = shown[:, axis] // 255
    records["cluster"] = cloud.cluster
    with atomic_write(path) as temporary:
        temporary.write_bytes(_header(len(records), code) + records.tobytes())


def _header(count: int, code: Mapping[str, int]) -> bytes:
    lines = [
        "ply",
        "format binary_little_endian 1.0",
        *(f"comment class {number} {label}" for label, number in code.items()),
        f"element vertex {count}",
        *(f"property {_TYPES[kind]} {name}" for name, kind in _RECORD),
        "end_header",
    ]
    return ("\n".join(lines) + "\n").encode("ascii", "replace")
