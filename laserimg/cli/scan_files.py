"""The scan files that a command's arguments name."""

from collections.abc import Iterable
from pathlib import Path

# The points that `laserimg map` writes; importing their name from there takes half a second.
_MAP = "map.ply"


def scan_files(paths: Iterable[Path], out: Path | None = None) -> tuple[list[Path], list[str]]:
    """Return the scan files that arguments name, each once, and a line for each argument that names none.

    Parameters
    ----------
    paths : iterable of Path
    out : Path, optional
        The folder of the results. What an earlier run wrote there is no scan to read: what lies below it, if
        it is below a folder that is named, and a map.
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
        files.update({file: None for file in found if out is None or not _is_result(file, path, out)})
    return list(files), errors


def _is_result(file: Path, named: Path, out: Path) -> bool:
    file, named, out = file.absolute(), named.absolute(), out.absolute()
    if file == named:
        return False
    return file == out / _MAP or (out in file.parents and out not in (named, *named.parents))
