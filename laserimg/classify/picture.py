"""The picture of a confusion matrix."""

import cv2
import numpy as np
from numpy.typing import NDArray

from laserimg.classify.scores import UNKNOWN, ClassTable

CELL_PX = 84
_FONT = cv2.FONT_HERSHEY_SIMPLEX
_BLACK, _WHITE = (30, 30, 30), (255, 255, 255)
_RIGHT, _WRONG = np.array([60, 140, 70]), np.array([200, 80, 60])


def confusion_picture(table: ClassTable) -> NDArray[np.uint8]:
    """Return the confusion matrix as an RGB picture: rows are true classes, columns what they were taken for.

    Right cells are green and wrong ones red, the darker the larger their share of the row; the column
    "unknown" is shown if it holds something.
    """
    shown = len(table.labels) + bool(table.counts[:, -1].any())
    columns = [*table.labels, UNKNOWN][:shown]
    left = 20 + max(_width(label) for label in columns)
    picture = np.full((90 + CELL_PX * len(table.labels), left + CELL_PX * shown + 20, 3), 255, np.uint8)
    for column, label in enumerate(columns):
        scale = min(0.5, 0.5 * (CELL_PX - 6) / _width(label))
        _text(picture, label, (left + CELL_PX * column + CELL_PX // 2, 70), _BLACK, scale)
    _text(picture, "taken for", (left + CELL_PX * shown // 2, 30), _BLACK, 0.55)
    for row, label in enumerate(table.labels):
        middle = 90 + CELL_PX * row + CELL_PX // 2
        _text(picture, label, (left // 2, middle), _BLACK, 0.5)
        for column in range(shown):
            _cell(picture, table, row, column, (left + CELL_PX * column, middle - CELL_PX // 2))
    return picture


def _cell(
    picture: NDArray[np.uint8], table: ClassTable, row: int, column: int, corner: tuple[int, int]
) -> None:
    count = float(table.counts[row, column])
    share = count / max(float(table.images[row]), 1e-9)
    tint = _RIGHT if row == column else _WRONG
    colour = np.rint(255 + (tint - 255) * np.sqrt(share)).astype(int).tolist()
    x, y = corner
    cv2.rectangle(picture, (x + 1, y + 1), (x + CELL_PX - 2, y + CELL_PX - 2), colour, -1)
    if count:
        ink = _WHITE if share > 0.4 else _BLACK
        _text(picture, f"{count:.4g}", (x + CELL_PX // 2, y + CELL_PX // 2 - 8), ink, 0.6)
        _text(picture, f"{share:.1%}", (x + CELL_PX // 2, y + CELL_PX // 2 + 18), ink, 0.4)


def _width(text: str) -> int:
    return cv2.getTextSize(text, _FONT, 0.5, 1)[0][0]


def _text(
    picture: NDArray[np.uint8], text: str, middle: tuple[int, int], colour: tuple[int, ...], scale: float
) -> None:
    (width, height), _ = cv2.getTextSize(text, _FONT, scale, 1)
    place = middle[0] - width // 2, middle[1] + height // 2
    cv2.putText(picture, text, place, _FONT, scale, colour, 1, cv2.LINE_AA)
