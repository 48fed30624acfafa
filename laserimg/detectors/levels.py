"""Levels: parts of an image, resized so that a detector's window fits the object."""

from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np

from laserimg.detectors.window import WindowModel
from laserimg.evidence import Box, Evidence, Image, Window
from laserimg.scan import BoolArray

# Windows that are searched grow by this factor from level to level.
SCALE_STEP = 1.2


@dataclass(frozen=True, eq=False, slots=True)
class Level:
    """A part of the grid, and the size in its pixels that the window stands for.

    Parameters
    ----------
    part : tuple
        ``x, y, w, h`` in whole pixels of the grid; may cross the seam.
    window : (float, float)
        Width and height of the window in pixels of the grid.
    wanted : (H, W) array of bool or None
        Pixels of the grid whose range fits this window size; None when all do.
    """

    part: Box
    window: tuple[float, float]
    wanted: BoolArray | None = None


# Share of a window's pixels whose range must fit its size.
_MIN_WANTED = 0.15


def search(
    model: WindowModel, image: Image, levels: Iterator[Level], wraps: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Run a window detector over some levels.

    Parameters
    ----------
    model : WindowModel
    image : (H, W) array of uint8
    levels : iterable of Level
    wraps : bool
        The columns close a full turn.

    Returns
    -------
    boxes : (n, 4) array of float64
        ``x, y, w, h`` of the windows in the grid.
    scores : (n,) array of float64
    """
    boxes, scores = [np.empty((0, 4))], [np.empty(0)]
    for level in levels:
        cut = Window.of(level.part, image.shape[:2], wraps)
        size = tuple(
            max(1, round(extent * own / wanted))
            for extent, own, wanted in zip(
                (len(cut.columns), cut.rows.stop - cut.rows.start),
                model.card.window,
                level.window,
                strict=True,
            )
        )
        found = model.hits(_resized(cut.cut(image), size))
        scale = np.array([len(cut.columns) / size[0], (cut.rows.stop - cut.rows.start) / size[1]])
        corners = found.corners * scale + (level.part[0], cut.rows.start)
        window = np.broadcast_to(np.array(model.card.window) * scale, corners.shape)
        at = np.concatenate([corners, window], axis=1)
        keep = _wanted(at, level.wanted)
        boxes.append(at[keep])
        scores.append(found.scores[keep])
    return np.concatenate(boxes), np.concatenate(scores)


def plain_levels(evidence: Evidence, model: WindowModel) -> Iterator[Level]:
    """Yield the whole image at every scale from the window's own size to the image's: plain search.

    Pixels are made square by the median pitches of the grid first; images whose pitch is coarse
    are enlarged up to twice.
    """
    across, up = (float(np.median(pitch)) for pitch in evidence.pitch)
    height, width = evidence.scan.shape
    fine = min(across, up)
    w, h = (side * fine for side in model.card.window)  # radians of the window at full size
    overlap = w * _largest(model, across, up, height) if evidence.scan.wraps else 0.0
    scale = 0.5
    while h * scale / up <= height and w * scale / across <= width:
        part = (0.0, 0.0, width + min(width - 1.0, np.ceil(overlap / across)), float(height))
        yield Level(part, (w * scale / across, h * scale / up))
        scale *= SCALE_STEP


def _largest(model: WindowModel, across: float, up: float, height: int) -> float:
    return height * up / (model.card.window[1] * min(across, up))


def metric_levels(evidence: Evidence, model: WindowModel) -> Iterator[Level]:
    """Yield parts of the image with the window size that the object would have there.

    The object's size in pixels is its size in metres over range times pitch, across and up
    separately, so that the widening of a grid at steep angles is in it. Sizes are grouped in steps
    of `SCALE_STEP`; neighbouring groups are searched too, since objects vary.
    """
    width_m, height_m = (side * (1 + 2 * model.card.margin) for side in model.card.object_size_m or (0, 0))
    valid = evidence.scan.valid
    reach = np.where(valid, evidence.scan.range, 1)
    steps = []
    for side, pitch in zip((width_m, height_m), evidence.pitch, strict=True):
        pixels = side / (reach * np.maximum(pitch, 1e-6))
        steps.append(np.rint(np.log(np.maximum(pixels, 1e-3)) / np.log(SCALE_STEP)).astype(np.int32))
    yield from _grouped(steps[0], steps[1], valid, model, evidence.scan.wraps)


def _grouped(
    across: np.ndarray, up: np.ndarray, valid: BoolArray, model: WindowModel, wraps: bool
) -> Iterator[Level]:
    """Yield a level for every pair of sizes present, and for the next larger and smaller ones."""
    pairs = {
        (a + shift, u + shift)
        for a, u in np.unique(np.stack([across[valid], up[valid]], axis=1), axis=0).tolist()
        for shift in (-1, 0, 1)
    }
    for a, u in sorted(pairs):
        window = (SCALE_STEP**a, SCALE_STEP**u)
        # An object of fewer pixels than a third of the window is not resolved.
        if window[0] < model.card.window[0] / 3 or window[1] < model.card.window[1] / 3:
            continue
        if window[1] > across.shape[0] or window[0] > across.shape[1]:
            continue
        wanted = valid & (np.abs(across - a) <= 1) & (np.abs(up - u) <= 1) & (across - a == up - u)
        for part in _parts(wanted, window, wraps):
            yield Level(part, window, wanted)


def _parts(wanted: BoolArray, window: tuple[float, float], wraps: bool) -> list[Box]:
    """Rectangles that hold every window that may have enough wanted pixels, a few for each level."""
    height, width = wanted.shape
    block = [max(1, round(side / 2)) for side in window]
    coarse = (max(1, -(-width // block[0])), max(1, -(-height // block[1])))
    padded = np.zeros((coarse[1] * block[1], coarse[0] * block[0]), np.float32)
    padded[:height, :width] = wanted
    some = cv2.resize(padded, coarse, interpolation=cv2.INTER_AREA) > 0.05
    some = cv2.dilate(some.astype(np.uint8), np.ones((3, 3), np.uint8))
    _, _, stats, _ = cv2.connectedComponentsWithStats(some, connectivity=8)
    parts = []
    for x, y, w, h, _ in stats[1:]:
        left, top = float(x * block[0]), float(max(0, y * block[1]))
        right, bottom = float((x + w) * block[0]), float(min(height, (y + h) * block[1]))
        if wraps:
            left, right = left - block[0], min(right, width) + block[0]
            right = min(right, left + width + 2 * block[0])
        else:
            left, right = max(0.0, left), min(float(width), right)
        parts.append((left, top, right - left, bottom - top))
    return parts


def _wanted(boxes: np.ndarray, wanted: BoolArray | None) -> np.ndarray:
    """Which boxes have enough wanted pixels."""
    if wanted is None or len(boxes) == 0:
        return np.ones(len(boxes), np.bool_)
    height, width = wanted.shape
    # Twice side by side: boxes across the seam, and left of column 0, need no case of their own.
    total = cv2.integral(np.tile(wanted.view(np.uint8), (1, 3))).astype(np.float64)
    x0 = np.clip(np.rint(boxes[:, 0]) + width, 0, 3 * width).astype(int)
    x1 = np.clip(np.rint(boxes[:, 0] + boxes[:, 2]) + width, 0, 3 * width).astype(int)
    y0 = np.clip(np.rint(boxes[:, 1]), 0, height).astype(int)
    y1 = np.clip(np.rint(boxes[:, 1] + boxes[:, 3]), 0, height).astype(int)
    count = total[y1, x1] - total[y0, x1] - total[y1, x0] + total[y0, x0]
    return count >= _MIN_WANTED * np.maximum((x1 - x0) * (y1 - y0), 1)


def _resized(image: Image, size: tuple[int, ...]) -> Image:
    shrinks = size[0] < image.shape[1] or size[1] < image.shape[0]
    return cv2.resize(image, size, interpolation=cv2.INTER_AREA if shrinks else cv2.INTER_LINEAR)
