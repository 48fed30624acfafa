"""Pictures for people: a scan with its detections and rejections."""

import cv2
import numpy as np

from laserimg.captions import caption_places
from laserimg.evidence import Box
from laserimg.images import make_image
from laserimg.pipeline import Finding, Result
from laserimg.sheet import Picture, Sheet

GREEN, RED, BLACK = (60, 220, 60), (235, 70, 70), (0, 0, 0)
# Beyond this many, the reasons would hide the picture; the table has them all.
MAX_REASONS = 12
_FONT, _SIZE = cv2.FONT_HERSHEY_SIMPLEX, 0.5
_PADDING, _BELOW_LINE = 2, 6


def overlay(result: Result, kind: str = "normals") -> Picture:
    """Return the picture of a scan with its detections in green and what was rejected by little in red.

    Every detection carries its class, score and size in metres; the best rejected ones their reason.
    """
    scan = result.evidence.scan
    sheet = Sheet.of(scan)
    image = make_image(scan, kind)
    picture = sheet.picture(np.repeat(image[..., None], 3, axis=2) if image.ndim == 2 else image)
    near = [finding for finding in result.rejected if finding.is_near]
    for finding in near:
        _draw_box(picture, sheet.places(finding.box), RED, 1)
    for finding in result.detections:
        _draw_box(picture, sheet.places(finding.box), GREEN, 3)
    captions = [(finding, caption(finding), GREEN) for finding in result.detections]
    reasons = [(finding, f"{finding.label}: {finding.reason}", RED) for finding in near[:MAX_REASONS]]
    _draw_captions(picture, sheet, [*captions, *reasons])
    return picture


def caption(finding: Finding) -> str:
    """Return class, score and sizes of a finding in a line.

    The sizes are width, depth and height in metres.
    """
    text = f"{finding.label} {finding.score:.2f}"
    if finding.size is not None:
        text += f"  {finding.size.width:.2f} x {finding.size.depth:.2f} x {finding.size.height:.2f} m"
    return text


def _draw_box(picture: Picture, places: list[Box], colour: tuple, thickness: int) -> None:
    for x, y, w, h in places:
        first, last = (round(x), round(y)), (round(x + w), round(y + h))
        cv2.rectangle(picture, first, last, BLACK, thickness + 2)
        cv2.rectangle(picture, first, last, colour, thickness)


def _draw_captions(picture: Picture, sheet: Sheet, captions: list[tuple[Finding, str, tuple]]) -> None:
    """Write captions, each at the widest piece of its box; what lies outside the grid has none."""
    shown = []
    for finding, text, colour in captions:
        pieces = sheet.places(finding.box)
        if pieces:
            shown.append((max(pieces, key=lambda piece: piece[2]), text, colour))
    sizes = [_text_size(text) for _, text, _ in shown]
    places = caption_places([box for box, _, _ in shown], sizes, picture.shape[:2])
    for (left, top, width, height), (_, text, colour) in zip(places, shown, strict=True):
        cv2.rectangle(picture, (left, top), (left + width - 1, top + height - 1), BLACK, -1)
        where = left + _PADDING, top + height - _BELOW_LINE
        cv2.putText(picture, text, where, _FONT, _SIZE, colour, 1, cv2.LINE_AA)


def _text_size(text: str) -> tuple[int, int]:
    (width, height), _ = cv2.getTextSize(text, _FONT, _SIZE, 1)
    return width + 2 * _PADDING, height + _BELOW_LINE + _PADDING
