"""Reading `rules.toml`."""

from hashlib import sha256
from math import isfinite
from pathlib import Path
from typing import Any, cast

from laserimg.errors import ConfigError, LaserImgError
from laserimg.files import atomic_write
from laserimg.formats.toml import TomlDocument, parse_toml, read_toml
from laserimg.rules.model import (
    DETECTORS,
    KEYS,
    MAX_AGREE,
    MAX_METRES,
    MAX_POINTS,
    ON_FAIL,
    QUANTITIES,
    SHARES,
    SOURCES,
    ClassRules,
    Interval,
    OnFail,
    Quantity,
    Rules,
    Source,
)

FORMAT = 1
OPEN = "-"
SHIPPED = Path(__file__).with_name("default.toml")


def load_rules(path: Path | None = None) -> Rules:
    """Read a rule file, or the rules that ship with laserimg.

    Raises
    ------
    ConfigError
        If the file is missing or says something that is no rule; names file, line and the
        nearest known name.

    Examples
    --------
    >>> load_rules()["wastebasket"].limits["width"]
    Interval(low=0.2, high=0.4)
    """
    return _rules(read_toml(path or SHIPPED))


def parse_rules(text: str, name: str = "rules.toml") -> Rules:
    """Read rules from the text of a rule file.

    Parameters
    ----------
    text : str
    name : str
        The file's name in messages.

    Raises
    ------
    ConfigError
        As `load_rules`.
    """
    return _rules(parse_toml(text, name))


def write_rules(path: Path, text: str) -> None:
    """Write the text of a rule file whole or not at all, with its line ends as they are."""
    with atomic_write(path) as temporary:
        temporary.write_bytes(text.encode())


def _rules(document: TomlDocument) -> Rules:
    _check_format(document)
    classes = tuple(
        _class_rules(document, label, table) for label, table in document.data.items() if label != "format"
    )
    return Rules(classes, document.name, sha256(document.text.encode()).hexdigest())


def _check_format(document: TomlDocument) -> None:
    value = document.data.get("format")
    if value is None:
        raise document.error((), f"the file must begin with format = {FORMAT}")
    if type(value) is not int or value != FORMAT:
        raise document.error(("format",), f"format is {value!r}, this version reads format = {FORMAT}")


def _class_rules(document: TomlDocument, label: str, table: Any) -> ClassRules:
    if not isinstance(table, dict):
        where = "belongs into a class, under a line such as [wastebasket]"
        if label not in KEYS:
            raise document.unknown((label,), ["format", *KEYS])
        raise document.error((label,), f"'{label}' {where}")
    if not label.strip() or not label.isprintable():
        raise document.error((label,), f"a class needs a name that can be read, not {label!r}")
    for key in table:
        if key not in KEYS:
            raise document.unknown((label, key), KEYS)
    limits = {
        name: _interval(document, (label, name), value, QUANTITIES[name])
        for name, value in table.items()
        if name in QUANTITIES
    }
    shares = {
        name: _share(document, (label, name), table.get(name, default)) for name, default in SHARES.items()
    }
    return ClassRules(
        label,
        _sources(document, (label, "from"), table.get("from", list(DETECTORS))),
        limits,
        agree=_agree(document, label, table.get("agree", 1)),
        on_fail=_on_fail(document, label, table.get("on_fail", "reject")),
        line=document.line((label,)),
        **shares,
    )


def _interval(document: TomlDocument, keys: tuple[str, str], value: Any, quantity: Quantity) -> Interval:
    if not isinstance(value, list) or len(value) != 2:
        example = "[0.20, 0.60]" if quantity.unit else "[30, 5000]"
        text = f'{quantity.name} must be [lowest, highest], such as {example}; "{OPEN}" leaves a side open'
        raise document.error(keys, text)
    try:
        return Interval(*(_limit(limit, quantity) for limit in value))
    except LaserImgError as error:
        raise document.error(keys, f"{quantity.name}: {error}") from None


def _limit(value: Any, quantity: Quantity) -> float | None:
    if value == OPEN:
        return None
    if isinstance(value, bool) or not isinstance(value, int | float if quantity.unit else int):
        what = "a number of metres" if quantity.unit else "a whole number"
        raise ConfigError(f'{_short(value)} is not {what} or "{OPEN}"')
    if isinstance(value, float) and not isfinite(value):
        raise ConfigError(f"{value} is not a limit")
    if value < 0 and not quantity.signed:
        raise ConfigError(f"{_short(value)} is below 0")
    if abs(value) > (MAX_METRES if quantity.unit else MAX_POINTS):
        raise ConfigError(f"{_short(value)} is more than any scan holds")
    return float(value) if quantity.unit else value


def _share(document: TomlDocument, keys: tuple[str, str], value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 <= value < 1:
        text = f"{keys[-1]} must be a number from 0 to below 1, such as 0.9, not {_short(value)}"
        raise document.error(keys, text)
    return float(value)


def _sources(document: TomlDocument, keys: tuple[str, str], value: Any) -> tuple[Source, ...]:
    if not isinstance(value, list) or not value or not all(isinstance(name, str) for name in value):
        raise document.error(keys, f'from must be a list such as ["cascade", "regions"], not {_short(value)}')
    for name in value:
        if name not in SOURCES:
            raise document.unknown((*keys, name), SOURCES, "source")
    if len(set(value)) != len(value):
        raise document.error(keys, "from names a source twice")
    return cast("tuple[Source, ...]", tuple(value))


def _agree(document: TomlDocument, label: str, value: Any) -> int:
    if type(value) is not int or not 1 <= value <= MAX_AGREE:
        text = f"agree must be a whole number from 1 to {MAX_AGREE}, not {_short(value)}"
        raise document.error((label, "agree"), text)
    return value


def _on_fail(document: TomlDocument, label: str, value: Any) -> OnFail:
    if value not in ON_FAIL:
        raise document.error(
            (label, "on_fail"), f'on_fail must be "reject", "demote" or "doubt", not {_short(value)}'
        )
    return value


def _short(value: Any) -> str:
    text = str(value).lower() if isinstance(value, bool) else repr(value)
    return text if len(text) <= 40 else f"{text[:36]} ..."
