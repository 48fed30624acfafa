"""What stands beside a scan: limits of the range (masks, nothing is removed), and whether to use colours."""

import json
from pathlib import Path

from laserimg.errors import ConfigError
from laserimg.files import stem
from laserimg.formats.toml import read_toml

FOLDER_FILE = "laserimg.toml"
_MAX_M = 1e6
_KEYS = ("min_range", "max_range")
_COLOUR = "colour"


def range_limits(path: Path) -> tuple[float | None, float | None]:
    """Return `min_range` and `max_range` in metres for a scan file; None where nothing is said.

    The side file ``NAME.json`` holds before ``laserimg.toml`` in the same folder.

    Raises
    ------
    ConfigError
        Naming the file, if ``laserimg.toml`` is malformed.
    """
    said = _from_folder(path.parent / FOLDER_FILE) | _from_side_file(path)
    return said.get("min_range"), said.get("max_range")


def own_colours(path: Path) -> bool:
    """Tell whether the points' own colours are to stand for reflectance: ``colour`` is true.

    The side file ``NAME.json`` holds before ``laserimg.toml`` in the same folder.

    Raises
    ------
    ConfigError
        Naming the file, if ``colour`` is neither true nor false.
    """
    folder = path.parent / FOLDER_FILE
    said, place = (side_file(path) or {}).get(_COLOUR), path.with_name(f"{stem(path)}.json")
    if said is None and folder.is_file():
        said, place = read_toml(folder).data.get(_COLOUR), folder
    if said not in (None, True, False):
        raise ConfigError(f"{place}: colour must be true or false, got {str(said)[:40]}")
    return bool(said)


def side_file(path: Path) -> dict | None:
    """Return the JSON object ``NAME.json`` beside a scan file, or None.

    A list, a COCO file of boxes or anything else that describes no scan is not a side file.
    """
    beside = path.with_name(f"{stem(path)}.json")
    try:
        content = json.loads(beside.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return None
    return content if isinstance(content, dict) and "annotations" not in content else None


def _from_folder(path: Path) -> dict[str, float]:
    if not path.is_file():
        return {}
    document = read_toml(path)
    content = dict(document.data)
    if content.pop("format", 1) != 1:
        raise document.error(["format"], "format must be 1")
    content.pop(_COLOUR, None)
    for key in content:
        if key not in _KEYS:
            raise document.unknown([key], ("format", _COLOUR, *_KEYS))
    return {key: _metres(f"{path}:{document.line([key])}", key, value) for key, value in content.items()}


def _from_side_file(path: Path) -> dict[str, float]:
    content = side_file(path) or {}
    beside = path.with_name(f"{stem(path)}.json")
    return {key: _metres(str(beside), key, content[key]) for key in _KEYS if key in content}


def _metres(place: str, key: str, value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 <= value <= _MAX_M:
        raise ConfigError(
            f"{place}: {key} must be a number of metres from 0 to {_MAX_M:.0f}, got {str(value)[:40]}"
        )
    return float(value)
