"""Scans to files, by the suffix of the file."""

from collections.abc import Sequence
from pathlib import Path

from laserimg.errors import ScanError
from laserimg.formats.npz import write_npz
from laserimg.formats.pcd import write_pcd
from laserimg.formats.ptx import write_ptx
from laserimg.formats.range_image import write_range_image
from laserimg.scan import Scan

_ONE_SCAN = {".npz": write_npz, ".pcd": write_pcd, ".png": write_range_image}
SUFFIXES = (".npz", ".ptx", ".pcd", ".png")


def write_scans(scans: Sequence[Scan], path: Path) -> list[Path]:
    """Write scans in the format of the suffix, and return the files written.

    A PTX file holds any number; of other formats each scan gets its own file, ``NAME_1``, ``NAME_2``
    and so on when there are several.

    Raises
    ------
    ScanError
        Naming the file, if the format cannot hold the scan.
    """
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise ScanError(f"{path}: cannot write {suffix or 'without suffix'}; known: {' '.join(SUFFIXES)}")
    if suffix == ".ptx":
        write_ptx(scans, path)
        return [path]
    several = len(scans) > 1
    files = [path.with_stem(f"{path.stem}_{k}") if several else path for k in range(1, len(scans) + 1)]
    for scan, file in zip(scans, files, strict=True):
        try:
            _ONE_SCAN[suffix](scan, file)
        except ScanError as error:
            raise ScanError(f"{file}: {error}") from error
    return files
