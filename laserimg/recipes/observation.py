"""Evidence of simulated scans, kept on disk: every recipe that uses a scan looks at it once."""

from pathlib import Path
from zipfile import BadZipFile

import numpy as np

from laserimg.detectors.description import IMAGES
from laserimg.errors import LabelError
from laserimg.evidence import Evidence, Image
from laserimg.files import atomic_write, sources_sha256
from laserimg.geometry.floor import Floor
from laserimg.geometry.pitch import angular_pitch
from laserimg.geometry.planes import Plane
from laserimg.images import make_images
from laserimg.pipeline import Pipeline
from laserimg.readers import read_file
from laserimg.recipes.scans import TrainingScan
from laserimg.regions import Partition, regions_of
from laserimg.rules.model import Rules
from laserimg.scan import Scan

_PIPELINE = Pipeline(Rules(()))
# Evidence that other versions of laserimg kept is made anew.
_PROGRAM = Path(__file__).parents[1]


def observed(path: Path) -> Evidence:
    """Return what the pipeline knows of a simulated scan, with the images of the second stage."""
    (scan,) = read_file(path)
    kept = path.with_suffix(".evidence")
    if not _is_ours(kept):
        _keep(kept, scan)
    with np.load(kept) as arrays:
        partition = Partition(arrays["labels"], arrays["range"], arrays["objects"])
        images = _with_planes({kind: arrays[kind] for kind in IMAGES})
        floor = _floor(arrays["floor"])
    return Evidence(
        scan, images, angular_pitch(scan), floor, partition, tuple(regions_of(partition, scan.wraps))
    )


def killed(scan: TrainingScan) -> LabelError:
    """Return what to say of a scan whose worker was killed."""
    return LabelError(f"{scan.path}: the process that looked at it was killed; fewer --jobs need less memory")


def _is_ours(path: Path) -> bool:
    try:
        with np.load(path) as arrays:
            return "program" in arrays and str(arrays["program"]) == sources_sha256(_PROGRAM)
    except (OSError, ValueError, EOFError, BadZipFile):
        return False


def _keep(path: Path, scan: Scan) -> None:
    evidence = _PIPELINE.observe(scan)
    floor = evidence.floor
    numbers = (
        []
        if floor is None
        else [*floor.plane.normal, floor.plane.offset_m, floor.share, floor.rms_m, floor.tilt_deg]
    )
    with atomic_write(path) as temporary, temporary.open("wb") as file:
        np.savez(
            file,
            program=np.array(sources_sha256(_PROGRAM)),
            labels=evidence.partition.labels,
            range=evidence.partition.range,
            objects=evidence.partition.objects,
            floor=np.array(numbers, np.float64),
            **make_images(scan, sorted(IMAGES)),  # type: ignore[arg-type]
        )


def _with_planes(images: dict[str, Image]) -> dict[str, Image]:
    planes = {
        f"{kind}.{plane}": np.ascontiguousarray(image[..., number])
        for kind, image in images.items()
        if image.ndim == 3
        for number, plane in enumerate("rgb")
    }
    return images | planes


def _floor(numbers: np.ndarray) -> Floor | None:
    if len(numbers) == 0:
        return None
    return Floor(Plane(numbers[:3], float(numbers[3])), *(float(one) for one in numbers[4:]))
