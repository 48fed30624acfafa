"""Reading checked values from the elements of an OpenCV storage file."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from difflib import get_close_matches
from xml.etree.ElementTree import Element, SubElement

from laserimg.errors import ModelError

# What OpenCV's storage parser takes for numbers; Python's float() also takes "nan" and "1_0".
_INTEGER = re.compile(r"[-+]?\d{1,10}")
_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")
_FLOAT32_MAX = 3.4e38
_INT32_MAX = 2**31 - 1


@contextmanager
def at(place: str) -> Iterator[None]:
    """Name the place in front of a `ModelError` raised inside the block."""
    try:
        yield
    except ModelError as error:
        raise ModelError(f"{place}: {error}") from None


def child(parent: Element, tag: str) -> Element:
    """Return the child element with this tag.

    Raises
    ------
    ModelError
        If there is none; names a similar tag.
    """
    element = parent.find(tag)
    if element is None:
        near = get_close_matches(tag, [str(other.tag) for other in parent], 1)
        raise ModelError(f"<{tag}> is missing" + (f", there is <{near[0]}>" if near else ""))
    return element


def items(parent: Element, tag: str) -> list[Element]:
    """Return the ``<_>`` elements of the list with this tag; an empty list is an error."""
    found = child(parent, tag).findall("_")
    if not found:
        raise ModelError(f"<{tag}> is empty")
    return found


def word(parent: Element, tag: str) -> str:
    """Return the text of the child with this tag, without blanks around it and quotes."""
    return (child(parent, tag).text or "").strip().strip('"')


def integer(parent: Element, tag: str) -> int:
    """Return the one integer of the child with this tag."""
    values = integers(child(parent, tag))
    if len(values) != 1:
        raise ModelError(f"<{tag}> must hold one integer, holds {len(values)}")
    return values[0]


def number(parent: Element, tag: str) -> float:
    """Return the one number of the child with this tag."""
    values = numbers(child(parent, tag))
    if len(values) != 1:
        raise ModelError(f"<{tag}> must hold one number, holds {len(values)}")
    return values[0]


def integers(element: Element) -> list[int]:
    """Return the integers of an element, each within 32 bits."""
    return [as_integer(token, element.tag) for token in (element.text or "").split()]


def numbers(element: Element) -> list[float]:
    """Return the numbers of an element, each finite as a 32-bit float."""
    return [as_number(token, element.tag) for token in (element.text or "").split()]


def as_integer(token: str, tag: str) -> int:
    """Return the integer that a token of the element `tag` stands for."""
    if not _INTEGER.fullmatch(token) or abs(int(token)) > _INT32_MAX:
        raise ModelError(f"<{tag}> holds '{token[:20]}', which is not a 32-bit integer")
    return int(token)


def as_number(token: str, tag: str) -> float:
    """Return the finite number that a token of the element `tag` stands for."""
    if not _NUMBER.fullmatch(token) or not abs(float(token)) < _FLOAT32_MAX:
        raise ModelError(f"<{tag}> holds '{token[:20]}', which is not a finite number")
    return float(token)


def add(parent: Element, tag: str, *values: object) -> Element:
    """Append a child holding the values, so that they read back exactly."""
    element = SubElement(parent, tag)
    element.text = " ".join(map(str, values)) or None
    return element
