"""Pictures of the experiment: confusion matrices, and the crops that were taken for something else."""

import cv2
import numpy as np

from laserimg.classify.picture import confusion_picture
from paper_one.objects import Found
from paper_one.run import Run
from paper_one.tables import pooled

TILE_PX = 128
_MARGIN_PX, _TEXT_PX = 8, 34
_FONT = cv2.FONT_HERSHEY_SIMPLEX


def confusion_sheet(runs: list[Run], names: list[str]) -> np.ndarray:
    """Return the confusion matrices of several ways of classifying, over all seeds, side by side."""
    parts = []
    for name in names:
        picture = confusion_picture(pooled(runs, name))
        title = np.full((40, picture.shape[1], 3), 255, np.uint8)
        cv2.putText(title, name, (20, 28), _FONT, 0.7, (30, 30, 30), 1, cv2.LINE_AA)
        parts.append(np.concatenate([title, picture]))
    return np.concatenate(parts, axis=1)


def errors_sheet(runs: list[Run], name: str, across: int = 6) -> np.ndarray:
    """Return range and reflectance of every object that was taken for another class."""
    tiles = [
        _tile(one, str(taken))
        for run in runs
        for one, taken in zip(run.found, run.taken_for[name], strict=True)
        if one.truth.label != taken
    ]
    if not tiles:
        return np.full((TILE_PX, TILE_PX, 3), 255, np.uint8)
    blank = np.full_like(tiles[0], 255)
    tiles += [blank] * (-len(tiles) % across)
    rows = [np.concatenate(tiles[i : i + across], axis=1) for i in range(0, len(tiles), across)]
    return np.concatenate(rows)


def _tile(one: Found, taken: str) -> np.ndarray:
    """What the classifier sees of an object: both crops at 64 x 64, near and bright light, outside blue."""
    images = one.images
    assert images.reflectance is not None
    known = images.known[0]
    shown = [_stretched(-images.range[0], known), _stretched(images.reflectance[0], known)]
    gap = np.full((TILE_PX, _MARGIN_PX, 3), 255, np.uint8)
    body = np.concatenate([gap, shown[0], gap[:, :2], shown[1], gap], axis=1)
    text = np.full((_TEXT_PX, body.shape[1], 3), 255, np.uint8)
    lines = (
        f"{one.truth.label} ({one.truth.kind}) as {taken}",
        f"{one.scan}, {one.range_m:.0f} m, {len(one.points)} points",
    )
    for row, words in enumerate(lines):
        cv2.putText(text, words, (_MARGIN_PX, 13 + 15 * row), _FONT, 0.38, (30, 30, 30), 1, cv2.LINE_AA)
    return np.concatenate([text, body, np.full((_MARGIN_PX, body.shape[1], 3), 255, np.uint8)])


def _stretched(values: np.ndarray, known: np.ndarray) -> np.ndarray:
    low, high = np.quantile(values[known], [0.02, 0.98])
    grey = np.clip((values - low) / max(float(high - low), 1e-9), 0, 1) * 255
    colour = np.where(known[..., None], grey[..., None], np.array([40.0, 60.0, 120.0])).astype(np.uint8)
    return np.asarray(cv2.resize(colour, (TILE_PX, TILE_PX), interpolation=cv2.INTER_NEAREST))
