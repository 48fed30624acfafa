"""The scan files that a command's arguments name."""

from collections.abc import Iterable
from pathlib import Path


def scan_files(paths: Iterable[Path], out: Path | None = None) -> tuple[list[Path], list[str]]:
    """Return the scan files that arguments name, each once, and a line for each argument that names none.

    Parameters
    ----------
    paths : iterable of Path
    out : Path, optional
        The folder of the results: what an earlier run wrote there is no scan to read.
    """
    from laserimg.errors import LaserImgError
    from laserimg.readers import find_files

    files: dict[Path, None] = {}
    errors = []
    for path in paths:
        try:
            found = find_files([path])
        except LaserImgError as error:
            errors.append(str(error))
            continue
        files.update({file: None for file in found if out is None or not _is_in(file, out)})
    return list(files), errors


def _is_in(file: Path, folder: Path) -> bool:
    return folder.absolute() in file.absolute().parents
