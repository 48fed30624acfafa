"""laserimg: a laser scan is an image.

    import laserimg as li

    detect = li.Pipeline.from_folder("cascades", rules="rules.toml")  # both default to the shipped ones
    for scan in li.open_scans("office.pcd"):
        result = detect(scan)
        for d in result.detections:
            print(d.label, d.score, d.box, d.size)  # pixels; metres
        for r in result.rejected:
            print(r.label, r.reason)  # "score 0.08 < 0.30"

Importing the package loads nothing heavy: names are looked up when first used (PEP 562).
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

_HOME = {
    "LaserImgError": "laserimg.errors",
    "Pipeline": "laserimg.pipeline",
    "Scan": "laserimg.scan",
    "open_scans": "laserimg.readers",
}

__all__ = [*_HOME, "__version__"]

if TYPE_CHECKING:
    from laserimg.errors import LaserImgError as LaserImgError
    from laserimg.pipeline import Pipeline as Pipeline
    from laserimg.readers import open_scans as open_scans
    from laserimg.scan import Scan as Scan


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'laserimg' has no attribute {name!r}")
    return getattr(import_module(_HOME[name]), name)


def __dir__() -> list[str]:
    return sorted(__all__)
