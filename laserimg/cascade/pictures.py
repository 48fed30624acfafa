"""Pictures for the report of a training: features on the mean positive, and samples that go wrong."""

import cv2
import numpy as np
from numpy.typing import NDArray

from laserimg.cascade.model import Cascade, Stage
from laserimg.cascade.windows import Windows
from laserimg.samples.sheet import contact_sheet

Pixels = NDArray[np.uint8]
# Pixels of the picture per pixel of the window.
_ZOOM = 6
# Blue, green, red of parts that count as dark and as bright.
_DARK, _BRIGHT = (60, 60, 200), (80, 170, 60)


def stage_picture(cascade: Cascade, stage: Stage, mean: Pixels, at_most: int = 12) -> Pixels:
    """Return the stage's features, each on the mean positive, side by side as (rows, columns, 3)."""
    features = cascade.pool[stage.features[:at_most]]
    lbp = cascade.pool.mode == "lbp"
    tiles = []
    for rects, weights, tilted in zip(features.rects, features.weights, features.tilted, strict=True):
        size = (mean.shape[1] * _ZOOM, mean.shape[0] * _ZOOM)
        large = cv2.resize(mean, size, interpolation=cv2.INTER_NEAREST)
        tile = np.asarray(cv2.cvtColor(large, cv2.COLOR_GRAY2BGR), np.uint8)
        shapes = _lbp_cells(rects[0]) if lbp else list(zip(rects, weights, strict=True))
        for rect, weight in shapes:
            if weight:
                _draw(tile, rect, _DARK if weight < 0 else _BRIGHT, bool(tilted))
        tiles.append(np.pad(tile, ((4, 4), (4, 4), (0, 0)), constant_values=255))
    return np.concatenate(tiles, axis=1)


def worst_misses(cascade: Cascade, positives: Pixels, at_most: int = 60) -> Pixels | None:
    """Return a sheet of positives that are rejected, those of the earliest stages first."""
    left, missed = positives, []
    for stage in cascade.stages:
        sums = stage.sums(cascade.pool, Windows.of(left, cascade.pool.mode))
        passed = stage.passed(sums)
        missed += list(left[~passed][np.argsort(sums[~passed], kind="stable")])
        left = left[passed]
    return contact_sheet(np.stack(missed[:at_most]), columns=20) if missed else None


def worst_false_alarms(cascade: Cascade, negatives: Pixels, at_most: int = 60) -> Pixels | None:
    """Return a sheet of negatives that pass all stages, the surest first."""
    if len(negatives) == 0 or len(cascade) == 0:
        return None
    sums = cascade.stages[-1].sums(cascade.pool, Windows.of(negatives, cascade.pool.mode))
    return contact_sheet(negatives[np.argsort(-sums, kind="stable")[:at_most]], columns=20)


def _lbp_cells(rect: NDArray) -> list[tuple[NDArray, float]]:
    x, y, w, h = rect
    cells = [(np.array([x + w * i, y + h * j, w, h]), 1.0) for j in range(3) for i in range(3)]
    cells[4] = (cells[4][0], -1.0)
    return cells


def _draw(tile: Pixels, rect: NDArray, colour: tuple[int, int, int], tilted: bool) -> None:
    x, y, w, h = (int(value) for value in rect)
    corners = [(x, y), (x + w, y), (x + w, y + h), (x, y + h)]
    if tilted:
        corners = [(x, y), (x + w, y + w), (x + w - h, y + w + h), (x - h, y + h)]
    points = (np.array(corners) * _ZOOM).astype(np.int32)
    # A tint, so that the face stays visible, and a clear border.
    tint = tile.copy()
    cv2.fillPoly(tint, [points], colour)
    cv2.addWeighted(tint, 0.35, tile, 0.65, 0, dst=tile)
    cv2.polylines(tile, [points], True, colour, 1)
