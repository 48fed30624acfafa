"""Checking what a file holds against a dataclass, in words for the person who wrote the file."""

import json
import re
from collections.abc import Sequence
from typing import TypeVar

from laserimg.formats.toml import TomlDocument, unknown_name

T = TypeVar("T")


def validated(document: TomlDocument, type_: type[T]) -> T:
    """Return the document as a dataclass, checked strictly: no unknown keys, no other types.

    The dataclass says with ``__pydantic_config__`` and annotations what is allowed.

    Raises
    ------
    document.error_type
        For the first mistake; names file, line and the nearest known key.
    """
    from pydantic import TypeAdapter, ValidationError

    # As JSON, where lists are the only tuples; dates of TOML become text.
    text = json.dumps(document.data, default=str)
    try:
        return TypeAdapter(type_).validate_json(text)
    except ValidationError as error:
        # A key that nobody knows explains the one that is missing.
        first = min(error.errors(include_url=False), key=lambda e: e["type"] != "unexpected_keyword_argument")
        keys = [str(part) for part in first["loc"]]
        if first["type"] == "unexpected_keyword_argument":
            raise document.unknown(keys, toml_keys(type_)) from None
        if first["type"] == "literal_error" and (choices := re.findall(r"'(.*?)'", first["msg"])):
            raise document.error(keys, unknown_name(str(first["input"]), choices, keys[-1])) from None
        raise document.error(keys, problem(first["type"], keys, first["msg"])) from None


def problem(kind: str, keys: Sequence[str], message: str) -> str:
    """Return what is wrong with a value, from what pydantic says of it.

    Examples
    --------
    >>> problem("float_type", ["bbox", "2"], "Input should be a valid number")
    'bbox[2] should be a valid number'
    >>> problem("missing", ["bbox", "3"], "Field required")
    'bbox holds only 3 values'
    """
    if kind.startswith("missing"):
        if keys[-1].isdigit():
            return f"{_path(keys[:-1])} holds only {keys[-1]} values"
        place = f"{_path(keys[:-1])}: " if len(keys) > 1 else ""
        return f"{place}key '{keys[-1]}' is missing"
    for subject in ("Input ", "Tuple ", "String "):
        message = message.removeprefix(subject)
    return f"{_path(keys)} {message.replace(' after validation', '')}"


def _path(keys: Sequence[str]) -> str:
    """Return keys and indices as one would write them in code."""
    return keys[0] + "".join(f"[{key}]" if key.isdigit() else f".{key}" for key in keys[1:])


def toml_keys(type_: type) -> list[str]:
    """Return the keys that a dataclass takes, with aliases in place of field names."""
    from pydantic import TypeAdapter

    return list(TypeAdapter(type_).json_schema(by_alias=True)["properties"])
