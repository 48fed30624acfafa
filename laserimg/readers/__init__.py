"""Scans from files: `open_scans` finds the reader by the suffix."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from functools import cache
from glob import glob, has_magic
from importlib import import_module
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import Any

from laserimg.errors import ConfigError, LaserImgError, MissingExtraError, ScanError
from laserimg.files import is_hidden, without_compression
from laserimg.readers.limits import range_limits
from laserimg.scan import Scan

Reader = Callable[[Path], Iterator[Scan]]

# Entry points of other packages: name = suffix without dot, value = a `Reader`.
ENTRY_POINTS = "laserimg.readers"

_BUILT_IN = {
    ".3d": "uos:read_uos",
    ".asc": "ascii:read_ascii",
    ".bin": "kitti:read_kitti",
    ".csv": "ascii:read_ascii",
    ".dat": "ascii:read_ascii",
    ".e57": "e57:read_e57",
    ".feather": "argoverse:read_argoverse",
    ".npz": "npz:read_npz",
    ".pcd": "pcd:read_pcd",
    ".ply": "ply:read_ply",
    ".png": "range_image:read_range_image",
    ".pts": "ascii:read_ascii",
    ".ptx": "ptx:read_ptx",
    ".tif": "range_image:read_range_image",
    ".tiff": "range_image:read_range_image",
    ".txt": "ascii:read_ascii",
    ".xyz": "ascii:read_ascii",
}

# Suffixes that other files carry too: a folder's file counts as a scan only if this says so.
_SNIFFERS = {
    ".asc": "ascii:holds_points",
    ".csv": "ascii:holds_points",
    ".dat": "ascii:holds_points",
    ".feather": "argoverse:holds_sweep",
    ".npz": "npz:holds_range",
    ".png": "range_image:is_described",
    ".tif": "range_image:is_described",
    ".tiff": "range_image:is_described",
    ".txt": "ascii:holds_points",
}


def open_scans(path: str | Path) -> Iterator[Scan]:
    """Yield every scan of a file, of the files of a folder, or of a glob.

    Parameters
    ----------
    path : str or Path
        A folder is searched with its subfolders, for files with a known suffix, in order of name.

    Raises
    ------
    ScanError
        Naming the file, if it is missing or cannot be read as a scan.
    MissingExtraError
        If its format needs an extra that is not installed.

    Examples
    --------
    >>> next(open_scans("missing.ptx"))
    Traceback (most recent call last):
    laserimg.errors.ScanError: missing.ptx: no such file or folder
    """
    for file in find_files([path]):
        yield from read_file(file)


def find_files(paths: Iterable[str | Path]) -> list[Path]:
    """Return the scan files that files, folders and globs name, each once, in order.

    A folder gives the files in it and below it whose suffix has a reader, where other files share the
    suffix (txt, png, npz ...) only those that begin like a scan; a file is taken as it is.

    Raises
    ------
    ScanError
        If there is no such file or folder, a glob matches nothing, or a folder holds no file with a
        known suffix.
    """
    found: dict[Path, None] = {}
    for path in paths:
        found.update(dict.fromkeys(_files_of(Path(path))))
    return list(found)


def read_file(path: Path) -> Iterator[Scan]:
    """Yield the scans of one file, with source, index and the limits that stand beside it.

    Raises
    ------
    ScanError, MissingExtraError, ConfigError
        Naming the file.
    """
    try:
        reader = _reader_of(path)
        near, far = range_limits(path)
        index = -1
        for index, scan in enumerate(reader(path)):
            yield replace(scan.with_limits(near, far), source=str(path), index=index)
        if index < 0:
            raise ScanError("holds no scan")
    except (MissingExtraError, ConfigError):
        raise
    except LaserImgError as error:
        raise ScanError(f"{path}: {error}") from error


def suffixes() -> list[str]:
    """Return the suffixes that have a reader, built in or from other packages."""
    return sorted({*_BUILT_IN, *_plugins()})


def _files_of(path: Path) -> list[Path]:
    if path.is_dir():
        files = [file for file in sorted(path.rglob("*")) if _is_scan_file(file)]
    elif has_magic(str(path)) and not path.exists():
        # Path.glob takes no absolute pattern.
        names = sorted(glob(str(path), recursive=True))  # noqa: PTH207
        files = [file for file in map(Path, names) if file.is_file()]
    else:
        if not path.exists():
            raise ScanError(f"{path}: no such file or folder")
        return [path]
    if not files:
        raise ScanError(f"{path}: no scan files")
    return files


def _is_scan_file(path: Path) -> bool:
    suffix = without_compression(path).suffix.lower()
    if not path.is_file() or is_hidden(path) or suffix not in suffixes():
        return False
    return suffix not in _SNIFFERS or suffix in _plugins() or _function(_SNIFFERS[suffix])(path)


def _reader_of(path: Path) -> Reader:
    suffix = without_compression(path).suffix.lower()
    if suffix in _plugins():
        try:
            return _plugins()[suffix].load()
        except (ImportError, AttributeError) as error:
            raise ScanError(f"its reader {_plugins()[suffix].value} cannot be loaded: {error}") from error
    if suffix not in _BUILT_IN:
        raise ScanError(f"no reader for {suffix or 'a file without suffix'}; known: {' '.join(suffixes())}")
    return _function(_BUILT_IN[suffix])


def _function(place: str) -> Any:
    module, _, name = place.partition(":")
    return getattr(import_module(f"{__name__}.{module}"), name)


@cache
def _plugins() -> dict[str, EntryPoint]:
    return {f".{entry.name.lower().lstrip('.')}": entry for entry in entry_points(group=ENTRY_POINTS)}
