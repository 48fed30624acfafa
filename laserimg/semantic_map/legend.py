"""Text on pictures: the strip with the classes, their colours and counts."""

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from laserimg.semantic_map.colours import Colour

Picture = NDArray[np.uint8]

BACKGROUND: Colour = (22, 26, 33)
INK: Colour = (225, 228, 232)
FONT = cv2.FONT_HERSHEY_DUPLEX
_ROW_PX, _SWATCH_PX, _GAP_PX = 34, 16, 26
_SCALE = 0.52


def with_legend(picture: Picture, title: str, entries: Sequence[tuple[str, Colour]]) -> Picture:
    """Return a picture with a strip below it: title, then name and colour of every entry.

    Parameters
    ----------
    picture : (h, w, 3) array of uint8
        RGB.
    title : str
    entries : sequence of (name, colour)
    """
    rows = _rows(title, entries, picture.shape[1])
    strip = np.full((_ROW_PX * len(rows) + 8, picture.shape[1], 3), BACKGROUND, np.uint8)
    for place, row in enumerate(rows):
        for left, name, colour in row:
            _draw_entry(strip, (left, 4 + _ROW_PX * place), name, colour)
    return np.concatenate([picture, strip])


def text_width(text: str, scale: float = _SCALE) -> int:
    """Return the width of a text in pixels."""
    return cv2.getTextSize(text, FONT, scale, 1)[0][0]


def draw_text(
    picture: Picture, text: str, place: tuple[int, int], scale: float = _SCALE, ink: Colour = INK
) -> None:
    """Draw a text from its lower left corner, with a dark rim that keeps it legible on any ground."""
    cv2.putText(picture, text, place, FONT, scale, BACKGROUND, 4, cv2.LINE_AA)
    cv2.putText(picture, text, place, FONT, scale, ink, 1, cv2.LINE_AA)


def _rows(title: str, entries: Sequence[tuple[str, Colour]], width: int) -> list[list]:
    """Put the entries into rows that fit; the title comes first and has no colour."""
    rows: list[list] = [[]]
    left = 12
    for name, colour in [(title, None), *entries]:
        needs = text_width(name) + (_SWATCH_PX + 8 if colour is not None else 0)
        if rows[-1] and left + needs > width - 12:
            rows.append([])
            left = 12
        rows[-1].append((left, name, colour))
        left += needs + _GAP_PX
    return rows


def _draw_entry(strip: Picture, corner: tuple[int, int], name: str, colour: Colour | None) -> None:
    left, top = corner
    if colour is not None:
        low = (left + _SWATCH_PX, top + 9 + _SWATCH_PX)
        cv2.rectangle(strip, (left, top + 9), low, colour, -1, cv2.LINE_AA)
        left += _SWATCH_PX + 8
    cv2.putText(strip, name, (left, top + 23), FONT, _SCALE, INK, 1, cv2.LINE_AA)
