"""Editing the text of a rule file: one statement changes, every other byte stays."""

import re
from collections.abc import Iterable, Mapping
from typing import NamedTuple

import tomlkit
from tomlkit.items import SingleKey

from laserimg.errors import ConfigError
from laserimg.formats.toml import Statement, statements, unknown_name
from laserimg.rules.file import OPEN, parse_rules
from laserimg.rules.model import KEYS, QUANTITIES, SHARES

SIDES = {"min": 0, "max": 1}

_NUMBER = re.compile(r"-?(0|[1-9]\d*)(\.\d+)?")
_OPEN_LITERAL = f'"{OPEN}"'


class _Target(NamedTuple):
    """What a dotted name such as ``bin.height.max`` means; no key: the class, no side: the whole rule."""

    label: str
    key: str = ""
    side: str = ""


def set_rules(text: str, values: Mapping[str, str], name: str = "rules.toml") -> str:
    """Return the text of a rule file with some rules set.

    Parameters
    ----------
    text : str
        A valid rule file.
    values : mapping of str to str
        From ``CLASS.KEY``, or ``CLASS.QUANTITY.min`` or ``.max`` for one side, to the value:
        ``0.2:0.6`` for both sides of a quantity, ``0.2:`` or ``:0.6`` to leave one open; a number
        for a side, a share or ``agree``; names with commas for ``from``; a word for ``on_fail``. A class that
        the file does not have is appended.
    name : str
        The file's name in messages.

    Raises
    ------
    ConfigError
        If a name or value is none, or the file would not be valid with all of them.

    Examples
    --------
    >>> text = "format = 1\\n[bin]\\nheight = [0.2, 0.6]  # of the rim\\n"
    >>> set_rules(text, {"bin.height.max": "0.55"}).splitlines()[-1]
    'height = [0.2, 0.55]  # of the rim'
    """
    for target, value in values.items():
        text = _set(text, _target(target), value)
    parse_rules(text, name)
    return text


def unset_rules(text: str, targets: Iterable[str], name: str = "rules.toml") -> str:
    """Return the text of a rule file without some rules, sides of rules, or classes.

    A class goes with the comments between its rules; all other comments stay.

    Raises
    ------
    ConfigError
        If the file has no such rule, or would not be valid without it.
    """
    for target in targets:
        text = _unset(text, target, name)
    parse_rules(text, name)
    return text


def _target(target: str) -> _Target:
    head, _, last = target.rpartition(".")
    if last in SIDES:
        label, _, quantity = head.rpartition(".")
        if label and quantity in QUANTITIES:
            return _Target(label, quantity, last)
        raise ConfigError(unknown_name(quantity, QUANTITIES, "quantity"))
    if head and last in KEYS:
        return _Target(head, last)
    if head:
        raise ConfigError(unknown_name(last, KEYS))
    label = last if target == last and last not in ("", *KEYS) else "wastebasket"
    raise ConfigError(f"name a class and a rule, such as {label}.height")


def _set(text: str, target: _Target, value: str) -> str:
    lines, block = _lines(text), _block(text, target.label)
    literal = _number(value) if target.side else _literal(target, value)
    old = _statement(block, target)
    if old is not None:
        lines[old.first : old.last] = _with_value(lines[old.first : old.last], target, literal)
    else:
        _insert(lines, block, target, literal)
    return "\n".join(lines)


def _unset(text: str, name: str, file_name: str) -> str:
    lines, block = _lines(text), _block(text, name)
    if block:
        _remove_class(lines, block)
        return "\n".join(lines)
    if "." not in name:
        labels = dict.fromkeys(s.keys[0] for s in statements(text) if s.is_header)
        raise ConfigError(f"{file_name}: {unknown_name(name, labels, 'class')}")
    target = _target(name)
    old = _statement(_block(text, target.label), target)
    if old is None:
        raise ConfigError(f"{file_name} has no rule {name}")
    statement = lines[old.first : old.last]
    keep = target.side and _other_side(statement, target) != OPEN
    lines[old.first : old.last] = _with_value(statement, target, _OPEN_LITERAL) if keep else []
    return "\n".join(lines)


def _statement(block: list[Statement], target: _Target) -> Statement | None:
    return next((s for s in block if s.keys == (target.label, target.key)), None)


def _lines(text: str) -> list[str]:
    """Return the lines, the last of them empty; a carriage return stays at the end of its line."""
    return (text if text.endswith("\n") else text + _line_end(text) + "\n").split("\n")


def _line_end(text: str) -> str:
    return "\r" if "\r\n" in text else ""


def _block(text: str, label: str) -> list[Statement]:
    """Return the header and rules of a class; nothing if the file does not have it."""
    block = [s for s in statements(text) if s.keys[0] == label]
    if any(s.table != (label,) for s in block):
        raise ConfigError(f"write the class '{label}' as a table, under a line [{label}], to have it edited")
    return block


def _insert(lines: list[str], block: list[Statement], target: _Target, literal: str) -> None:
    end = _line_end("\n".join(lines))
    if target.side == "min":
        literal = _pair(literal, _OPEN_LITERAL)
    elif target.side == "max":
        literal = _pair(_OPEN_LITERAL, literal)
    if block:
        last = block[-1]
        indent = re.match(r"[ \t]*", lines[last.first])
        lines.insert(last.last, f"{indent[0] if indent else ''}{target.key} = {literal}{end}")
        return
    gap = [end] if lines[-2:-1] not in ([""], ["\r"]) else []
    header = f"[{SingleKey(target.label).as_string()}]{end}"
    lines[-1:-1] = [*gap, header, f"{target.key} = {literal}{end}"]


def _remove_class(lines: list[str], block: list[Statement]) -> None:
    first = block[0].first
    while first > 0 and not lines[first - 1].strip():
        first -= 1
    del lines[first : block[-1].last]


def _with_value(lines: list[str], target: _Target, literal: str) -> list[str]:
    """Return the lines of a statement with its value, or one side of it, replaced."""
    document = tomlkit.parse("\n".join(lines) + "\n")
    if target.side:
        document[target.key][SIDES[target.side]] = tomlkit.value(literal)  # type: ignore[index]
    else:
        document[target.key] = tomlkit.value(literal)
    return document.as_string().split("\n")[:-1]


def _other_side(lines: list[str], target: _Target) -> object:
    values = tomlkit.parse("\n".join(lines) + "\n").unwrap()[target.key]
    return values[1 - SIDES[target.side]]


def _literal(target: _Target, value: str) -> str:
    """Return the TOML text of a whole rule."""
    if target.key in QUANTITIES:
        return _interval(target, value)
    if target.key in (*SHARES, "agree"):
        return _number(value)
    if target.key == "from":
        return tomlkit.item([name.strip() for name in value.split(",")]).as_string()
    return tomlkit.item(value).as_string()


def _interval(target: _Target, value: str) -> str:
    sides = value.split(":")
    name = f"{target.label}.{target.key}"
    if len(sides) != 2:
        raise ConfigError(
            f"{name} takes LOWEST:HIGHEST, such as 0.2:0.6, 0.2: or :0.6, not '{value}'; "
            f"for one side set {name}.min or {name}.max"
        )
    low, high = (_OPEN_LITERAL if side in ("", OPEN) else _number(side) for side in sides)
    if low == high == _OPEN_LITERAL:
        raise ConfigError(f"{name} without a limit is no rule: unset it instead")
    return _pair(low, high)


def _pair(low: str, high: str) -> str:
    return f"[{low}, {high}]"


def _number(text: str) -> str:
    """Return a number as it was typed, if TOML takes it so."""
    literal = f"0{text}" if text.startswith(".") else text
    if not _NUMBER.fullmatch(literal):
        raise ConfigError(f"'{text}' is not a number; lengths are in metres, such as 0.55")
    return literal
