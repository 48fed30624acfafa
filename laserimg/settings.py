"""What one run of detection is asked for: recorded beside its results, hashed for resume."""

import hashlib
import json
from dataclasses import asdict, dataclass
from math import inf, isfinite
from pathlib import Path
from typing import Literal

import laserimg
from laserimg.errors import ConfigError
from laserimg.files import sha256_of
from laserimg.geometry.mounting import axis_of
from laserimg.rules.model import SOURCES

Rejected = Literal["all", "near", "none"]

# Values that each choice may take.
CHOICES = {
    "partition": ("default", "reference"),
    "scale": ("metric", "plain"),
    "rejected": ("all", "near", "none"),
}


@dataclass(frozen=True, slots=True)
class Settings:
    """The configuration of a run.

    Parameters
    ----------
    rules : str or None
        Rule file; None for the shipped one.
    cascades : str or None
        Folder or file of detectors; None for the shipped ones, "none" for no detector.
    image, label : str or None
        For a cascade without a card, and the class of given candidates.
    sources : tuple of str
        Overrides where candidates come from; empty for what the rules say.
    candidates : str or None
        COCO file whose boxes replace all sources.
    partition : "default" or "reference"
    scale : "metric" or "plain"
    min_range, max_range : float or None
        Metres; None for what stands beside the file.
    up : str or None
        Axis of the scanner that points up, such as "-y"; None for the pose in the file.
    rotate : (float, float, float) or None
        Roll, pitch and yaw of the scanner in degrees, in place of the pose in the file.
    rejected : "all", "near" or "none"
        Which rejected candidates are written; "near" those that `Finding.is_near` says.
    overlays : bool
        Write a picture of every scan.
    split_seam : bool
        Write boxes across the seam as two.

    Raises
    ------
    ConfigError
        If a choice is none, or a range or angle cannot be.
    """

    rules: str | None = None
    cascades: str | None = None
    image: str | None = None
    label: str | None = None
    sources: tuple[str, ...] = ()
    candidates: str | None = None
    partition: str = "default"
    scale: str = "metric"
    min_range: float | None = None
    max_range: float | None = None
    up: str | None = None
    rotate: tuple[float, float, float] | None = None
    rejected: Rejected = "near"
    overlays: bool = True
    split_seam: bool = False

    def __post_init__(self) -> None:
        if self.up is not None and self.rotate is not None:
            raise ConfigError("give up or rotate, not both")
        if self.up is not None:
            axis_of(self.up)
        for number in (self.min_range, self.max_range, *(self.rotate or ())):
            if number is not None and not isfinite(number):
                raise ConfigError(f"ranges and angles must be finite numbers, not {number}")
        near, far = self.min_range or 0.0, inf if self.max_range is None else self.max_range
        if not 0 <= near < far:
            raise ConfigError(f"ranges must be 0 <= min < max, not {near:g} and {far:g} m")
        for name, allowed in CHOICES.items():
            if getattr(self, name) not in allowed:
                raise ConfigError(f"{name} must be one of {', '.join(allowed)}, not {getattr(self, name)!r}")
        for source in self.sources:
            if source not in SOURCES:
                raise ConfigError(f"source must be one of {', '.join(SOURCES)}, not {source!r}")


def fingerprint(settings: Settings, files: list[Path]) -> str:
    """Return a hash of the settings, the version and the contents of the files a run depends on."""
    digest = hashlib.sha256(json.dumps([asdict(settings), laserimg.__version__], sort_keys=True).encode())
    for file in files:
        digest.update(sha256_of(file).encode())
    return digest.hexdigest()
