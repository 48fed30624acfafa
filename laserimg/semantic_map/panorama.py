"""The panorama of one scan in the colours of its classes."""

import cv2
import numpy as np
from numpy.typing import NDArray

from laserimg.geometry.pitch import sample_pitch
from laserimg.semantic_map.clusters import objects_of
from laserimg.semantic_map.colours import GROUND, LOOSE, UNDERSEGMENTED, Colour, palette
from laserimg.semantic_map.legend import BACKGROUND, INK, Picture, draw_text, text_width, with_legend
from laserimg.semantic_map.maps import ScanMap

MIN_WIDTH, MAX_WIDTH = 1600, 2400
# Clusters of at least so many picture pixels carry their class, where there is room.
_NAMED_PX = 1500
_NAME_SCALE = 0.42
# Times its height that a strip may be wide.
STRIP_ASPECT = 7.0
_GAP_PX = 3


def panorama(one: ScanMap, labels: tuple[str, ...], title: str = "") -> Picture:
    """Return the picture (h, w, 3), RGB, of a scan with its classes in colour and a legend.

    Pixels are square; a strip much wider than high is drawn as two, twice as large. Rows above the
    highest return are cut off, and those of the ground at the scanner's foot, below all clusters.

    Parameters
    ----------
    one : ScanMap
    labels : tuple of str
        Classes of the classifier.
    title : str
    """
    colours = palette(labels)
    rows = _rows(one)
    image = _coloured(one, colours)[rows]
    across, up = _scales(one)
    strips = 2 if image.shape[1] * across > STRIP_ASPECT * image.shape[0] * up else 1
    across, up = across * strips, up * strips
    size = round(image.shape[1] * across), max(1, round(image.shape[0] * up))
    picture = np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_NEAREST), np.uint8)
    _draw_names(picture, one, rows.start, (across, up))
    if strips == 2:
        half = picture.shape[1] // 2
        gap = np.full((_GAP_PX, half, 3), INK, np.uint8)
        picture = np.concatenate([picture[:, :half], gap, picture[:, half : 2 * half]])
    return with_legend(picture, title, legend_of(one.clusters, colours))


def legend_of(clusters: list, colours: dict[str, Colour]) -> list[tuple[str, Colour]]:
    """Return what the legend says: every class that occurs, with how many objects it has."""
    count = objects_of(clusters, colours)
    named = [(f"{label} ({count[label]})", colours[label]) for label in colours if count[label]]
    return [*named, (GROUND, colours[GROUND]), (LOOSE, colours[LOOSE])]


def _rows(one: ScanMap) -> slice:
    """Return the rows to show."""
    seen = np.flatnonzero(one.scan.valid.any(axis=1))
    lowest = np.flatnonzero((one.segments.labels > 0).any(axis=1))
    end = int(seen[-1]) + 1
    if len(lowest):
        end = min(end, int(lowest[-1]) + 1 + one.scan.shape[0] // 20)
    return slice(int(seen[0]), end)


def _coloured(one: ScanMap, colours: dict[str, Colour]) -> Picture:
    """Return the (H, W, 3) image of the scan's grid."""
    table = np.array([BACKGROUND, colours[LOOSE], colours[GROUND], *(colours[c.label] for c in one.clusters)])
    number = np.where(one.scan.valid, one.numbers() + 2, 0)
    shade = np.where(one.scan.valid, one.shade, np.uint8(255)).astype(np.uint16)
    return (table[number].astype(np.uint16) * shade[..., None] // 255).astype(np.uint8)


def _scales(one: ScanMap) -> tuple[float, float]:
    """Return how many picture pixels a grid pixel takes, across and up."""
    _, across, up = sample_pitch(one.scan, np.ones(one.scan.shape, np.bool_))
    width = one.scan.shape[1]
    wide = min(max(width, MIN_WIDTH), MAX_WIDTH) / width
    return wide, wide * float(np.clip(np.median(up) / max(np.median(across), 1e-6), 0.25, 4))


def _draw_names(picture: Picture, one: ScanMap, top: int, scale: tuple[float, float]) -> None:
    """Write the class of large clusters over them, the largest first, where no other name stands."""
    taken: list[NDArray] = []
    pairs = zip(one.clusters, one.segments.clusters, strict=True)
    for cluster, region in sorted(pairs, key=lambda pair: -pair[0].points):
        if cluster.points * scale[0] * scale[1] < _NAMED_PX or cluster.label == UNDERSEGMENTED:
            continue
        text = f"{cluster.label} {cluster.confidence:.2f}"
        row, column = np.divmod(region.pixels, one.scan.shape[1])
        wide = text_width(text, _NAME_SCALE)
        left = int(np.clip(np.median(column) * scale[0] - wide / 2, 2, picture.shape[1] - wide - 2))
        bottom = max(14, round((float(np.quantile(row, 0.02)) - top) * scale[1]) - 4)
        box = np.array([left - 4, bottom - 14, left + wide + 4, bottom + 4])
        if all((box[:2] > other[2:]).any() or (box[2:] < other[:2]).any() for other in taken):
            taken.append(box)
            draw_text(picture, text, (left, bottom), _NAME_SCALE)
