"""TOML files that people write: read with the line of every mistake."""

import re
import tomllib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from laserimg.errors import ConfigError, LaserImgError
from laserimg.files import read_bytes

# Nobody writes more by hand; it bounds the time that a broken file can cost.
MAX_BYTES = 256 << 10
# A statement over more lines than this is not followed; mistakes in it name its table.
MAX_STATEMENT_LINES = 200

Keys = tuple[str, ...]

_PLACE = re.compile(r" \(at (?:line (?P<line>\d+), column \d+|end of document)\)$")
_PLAIN_WORDS = {
    "Cannot overwrite a value": "a key is given twice",
    "Cannot mutate immutable namespace": "a key is given twice",
}


@dataclass(frozen=True, slots=True)
class Statement:
    """One table header or one key with its value, with the lines it stands on.

    Parameters
    ----------
    keys : tuple of str
        Full path of the table or key, with the number, from 0, of each table of an array.
    table : tuple of str
        The table it is in; a header is in its own.
    first, last : int
        Lines from 0; `last` is the one after.
    """

    keys: Keys
    table: Keys
    first: int
    last: int

    @property
    def is_header(self) -> bool:
        """Whether this is a table header."""
        return self.keys == self.table


@dataclass(frozen=True, slots=True)
class TomlDocument:
    """A parsed TOML text that can say where in it a key stands.

    Parameters
    ----------
    name : str
        The file's name in messages.
    text : str
    data : dict
        The parsed tables.
    error_type : type of LaserImgError
        What `error` makes.
    """

    name: str
    text: str
    data: dict[str, Any]
    error_type: type[LaserImgError] = ConfigError

    def line(self, keys: Sequence[str]) -> int:
        """Return the line, from 1, of a key or of the nearest table around it.

        Examples
        --------
        >>> text = "[[a]]\\nb = 1\\n[[a]]\\nb = 2\\n[[a.c]]\\nd = 3"
        >>> parse_toml(text, "a.toml").line(("a", "1", "c", "0", "d"))
        6
        """
        wanted, found = tuple(keys), statements(self.text)
        inside = [s for s in found if wanted and s.keys[: len(wanted)] == wanted]
        around = sorted((s for s in found if s.keys == wanted[: len(s.keys)]), key=lambda s: -len(s.keys))
        return next((s.first + 1 for s in inside + around), 1)

    def error(self, keys: Sequence[str], message: str) -> LaserImgError:
        """Return an error that names file and line of a key."""
        return self.error_type(f"{self.name}:{self.line(keys)}: {message}")

    def unknown(self, keys: Sequence[str], known: Iterable[str], what: str = "key") -> LaserImgError:
        """Return the error about a name that nobody knows, with the nearest that is known."""
        return self.error(keys, unknown_name(keys[-1], known, what))


def unknown_name(name: str, known: Iterable[str], what: str = "key") -> str:
    """Return the sentence about an unknown name.

    Examples
    --------
    >>> unknown_name("heigth", ["width", "height"])
    "unknown key 'heigth', did you mean 'height'?"
    >>> unknown_name("colour", ["width", "height"])
    "unknown key 'colour'; known are width, height"
    """
    choices = list(known)
    near = get_close_matches(name, choices, 1)
    hint = f", did you mean '{near[0]}'?" if near else f"; known are {', '.join(choices) or 'none'}"
    return f"unknown {what} '{name}'{hint}"


def parse_toml(text: str, name: str, error_type: type[LaserImgError] = ConfigError) -> TomlDocument:
    """Parse a TOML text.

    Raises
    ------
    error_type
        If it is not TOML; names file and line.
    """
    try:
        return TomlDocument(name, text, tomllib.loads(text), error_type)
    except tomllib.TOMLDecodeError as error:
        raise error_type(_syntax_message(name, text, str(error))) from None
    except (RecursionError, ValueError):
        # Thousands of nested brackets, integers of thousands of digits.
        raise error_type(f"{name}: not a TOML file that anybody wrote") from None


def read_toml(path: Path, error_type: type[LaserImgError] = ConfigError) -> TomlDocument:
    """Read a TOML file.

    Raises
    ------
    error_type
        If the file is missing, unreadable, not UTF-8, or not TOML.
    """
    try:
        text = read_bytes(path, MAX_BYTES).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise error_type(f"{path}: not UTF-8 text: {error.reason} at byte {error.start}") from None
    except LaserImgError as error:
        raise error_type(f"{path}: {error}") from None
    return parse_toml(text, str(path), error_type)


def _syntax_message(name: str, text: str, message: str) -> str:
    place = _PLACE.search(message)
    words = message[: place.start()] if place else message
    line = (place and place["line"]) or text.count("\n") + 1
    return f"{name}:{line}: {_PLAIN_WORDS.get(words, words)}"


def statements(text: str) -> list[Statement]:
    """Return the headers and keys of a valid TOML text in their order.

    The lines of a statement are joined until they are TOML by themselves; so strings and arrays
    over several lines need no rules of their own here.
    """
    found: list[Statement] = []
    arrays: dict[Keys, int] = {}
    table: Keys = ()
    pending: list[str] = []
    for number, line in enumerate(text.split("\n")):
        if not pending and (not line.strip() or line.lstrip().startswith("#")):
            continue
        pending.append(line.removesuffix("\r"))
        parsed = _loads("\n".join(pending))
        if parsed is None and len(pending) < MAX_STATEMENT_LINES:
            continue
        if parsed is None:
            break
        if pending[0].lstrip().startswith("["):
            table = keys = _numbered(_path(parsed), arrays, pending[0].lstrip().startswith("[["))
        else:
            keys = table + _written_keys(pending[0])
        found.append(Statement(keys, table, number + 1 - len(pending), number + 1))
        pending = []
    return found


def _loads(text: str) -> dict[str, Any] | None:
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError:
        return None


def _written_keys(line: str) -> Keys:
    """Return the keys before the equals sign, which may be dotted and quoted."""
    for place in (match.start() for match in re.finditer("=", line)):
        parsed = _loads(line[:place] + "=1")
        if parsed is not None:
            return _path(parsed)
    return ()


def _numbered(path: Keys, arrays: dict[Keys, int], begins: bool) -> Keys:
    """Return the path of a header with the numbers of the tables of arrays it goes through, or begins."""
    keys: Keys = ()
    for depth, key in enumerate(path, 1):
        keys += (key,)
        if begins and depth == len(path):
            arrays[keys] = arrays.get(keys, -1) + 1
        if keys in arrays:
            keys += (str(arrays[keys]),)
    return keys


def _path(parsed: Any) -> Keys:
    """Return the keys from table to table, each the only one in it."""
    keys: Keys = ()
    while parsed and isinstance(parsed, dict | list):
        if isinstance(parsed, list):
            parsed = parsed[0]
        else:
            key, parsed = next(iter(parsed.items()))
            keys += (key,)
    return keys
