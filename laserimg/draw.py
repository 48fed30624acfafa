"""Pictures for people: a scan with its detections and rejections."""

import cv2
import numpy as np
from numpy.typing import NDArray

from laserimg.boxes import split_at_seam
from laserimg.captions import caption_places
from laserimg.geometry.pitch import angular_pitch
from laserimg.images import make_image
from laserimg.pipeline import Finding, Result
from laserimg.scan import Scan

Picture = NDArray[np.uint8]

GREEN, RED, WHITE, BLACK = (60, 220, 60), (235, 70, 70), (255, 255, 255), (0, 0, 0)
MIN_WIDTH, MAX_WIDTH = 1400, 2800
# Beyond this many, the reasons would hide the picture; the table has them all.
MAX_REASONS = 12
_FONT, _SIZE = cv2.FONT_HERSHEY_SIMPLEX, 0.5
_PADDING, _BELOW_LINE = 2, 6


def picture_scale(scan: Scan) -> tuple[float, float]:
    """Return how many picture pixels a grid pixel takes, across and up, so that shapes look right."""
    across, up = (float(np.median(pitch)) for pitch in angular_pitch(scan))
    width = scan.shape[1]
    wide = min(max(width, MIN_WIDTH), MAX_WIDTH) / width
    return wide, wide * np.clip(up / max(across, 1e-6), 0.25, 4)


def backdrop(scan: Scan, kind: str = "normals") -> Picture:
    """Return an image of the scan as a large RGB picture with square pixels.

    Parameters
    ----------
    scan : Scan
    kind : str
        Any kind that `laserimg.images.make_image` knows.

    Returns
    -------
    (h, w, 3) array of uint8
        RGB.
    """
    image = make_image(scan, kind)
    if image.ndim == 2:
        image = np.repeat(image[..., None], 3, axis=2)
    across, up = picture_scale(scan)
    size = (round(scan.shape[1] * across), round(scan.shape[0] * up))
    return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_NEAREST), np.uint8)


def overlay(result: Result, kind: str = "normals") -> Picture:
    """Return the picture of a scan with its detections in green and what was rejected by little in red.

    Every detection carries its class, score and size in metres; the best rejected ones their reason.
    """
    scan = result.evidence.scan
    picture = backdrop(scan, kind)
    scale = picture_scale(scan)
    near = [finding for finding in result.rejected if finding.is_near]
    for finding in near:
        _draw_box(picture, finding, scan, scale, RED, 1)
    for finding in result.detections:
        _draw_box(picture, finding, scan, scale, GREEN, 3)
    captions = [(finding, caption(finding), GREEN) for finding in result.detections]
    reasons = [(finding, f"{finding.label}: {finding.reason}", RED) for finding in near[:MAX_REASONS]]
    _draw_captions(picture, scale, [*captions, *reasons])
    return picture


def caption(finding: Finding) -> str:
    """Return class, score and sizes of a finding in a line.

    The sizes are width, depth and height in metres.
    """
    text = f"{finding.label} {finding.score:.2f}"
    if finding.size is not None:
        text += f"  {finding.size.width:.2f} x {finding.size.depth:.2f} x {finding.size.height:.2f} m"
    return text


def _draw_box(
    picture: Picture, finding: Finding, scan: Scan, scale: tuple[float, float], colour: tuple, thickness: int
) -> None:
    for x, y, w, h in split_at_seam(finding.box, scan.shape[1]) if scan.wraps else [finding.box]:
        first = (round(x * scale[0]), round(y * scale[1]))
        last = (round((x + w) * scale[0]), round((y + h) * scale[1]))
        cv2.rectangle(picture, first, last, BLACK, thickness + 2)
        cv2.rectangle(picture, first, last, colour, thickness)


def _draw_captions(
    picture: Picture, scale: tuple[float, float], captions: list[tuple[Finding, str, tuple]]
) -> None:
    across, up = scale
    boxes = [tuple(np.multiply(finding.box, (across, up, across, up)).tolist()) for finding, _, _ in captions]
    sizes = [_text_size(text) for _, text, _ in captions]
    places = caption_places(boxes, sizes, picture.shape[:2])
    for (left, top, width, height), (_, text, colour) in zip(places, captions, strict=True):
        cv2.rectangle(picture, (left, top), (left + width - 1, top + height - 1), BLACK, -1)
        where = left + _PADDING, top + height - _BELOW_LINE
        cv2.putText(picture, text, where, _FONT, _SIZE, colour, 1, cv2.LINE_AA)


def _text_size(text: str) -> tuple[int, int]:
    (width, height), _ = cv2.getTextSize(text, _FONT, _SIZE, 1)
    return width + 2 * _PADDING, height + _BELOW_LINE + _PADDING
