"""One HTML page with the curves of an evaluation, nothing loaded from elsewhere."""

from collections.abc import Callable, Iterable

import numpy as np
from numpy.typing import NDArray

from laserimg.evaluate.confusion import Confusion
from laserimg.evaluate.curves import Curve
from laserimg.evaluate.scores import IOUS, Evaluation

_COLOURS = ("#1b6ca8", "#c0392b", "#1e8449", "#8e44ad", "#b9770e", "#117a65", "#7b241c", "#5d6d7e", "#212f3d")
_SIZE, _EDGE = 320, 36

_TEMPLATE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>Evaluation</title>
<style>
body { font: 15px/1.45 sans-serif; max-width: 72em; margin: 2em auto; padding: 0 1em; color: #222 }
table { border-collapse: collapse; margin: 1em 0 } td, th { padding: .25em .8em; text-align: right }
th { border-bottom: 1px solid #888 } td:first-child, th:first-child { text-align: left }
figure { display: inline-block; margin: 0 1.5em 1em 0 } figcaption { text-align: center }
</style></head><body>
<h1>Evaluation</h1>
<p>{{ detections }} against {{ truth }}</p>
<table><tr><th>class</th><th>objects</th>{% for iou in ious %}<th>AP@{{ iou }}</th>{% endfor %}
<th>hits</th><th>false</th><th>missed</th></tr>
{% for row in rows %}<tr>{% for cell in row %}<td>{{ cell }}</td>{% endfor %}</tr>
{% endfor %}</table>
<p>{% for label, colour in legend %}<b style="color: {{ colour }}">&#9632; {{ label }}</b> &nbsp; {% endfor %}
IoU 0.5</p>
{% for figure in figures %}<figure>{{ figure.svg | safe }}<figcaption>{{ figure.title }}</figcaption></figure>
{% endfor %}
<h2>Confusion</h2><p>Rows are the truth, columns what was detected, IoU 0.5.</p>
<table><tr><th></th>{% for label in confusion.labels %}<th>{{ label }}</th>{% endfor %}</tr>
{% for label, row in confusion_rows %}<tr><td>{{ label }}</td>{% for cell in row %}<td>{{ cell }}</td>
{% endfor %}</tr>
{% endfor %}</table></body></html>
"""


def evaluation_page(result: Evaluation, table: Confusion, detections: str, truth: str) -> str:
    """Return the page: scores, precision over recall, recall over false positives per image, confusion."""
    from jinja2 import Environment

    curves = {label: result.curves[label, 0.5, None] for label in result.labels}
    most = max((curve.false_positives_per_image.max(initial=0.0) for curve in curves.values()), default=0.0)
    figures = [
        {
            "title": "precision over recall",
            "svg": _figure(curves.values(), lambda c: (c.recall, c.precision), 1.0),
        },
        {
            "title": f"recall over false positives per image (to {max(most, 1):.3g})",
            "svg": _figure(
                curves.values(), lambda c: (c.false_positives_per_image, c.recall), max(most, 1.0)
            ),
        },
    ]
    return (
        Environment(autoescape=True)
        .from_string(_TEMPLATE)
        .render(
            detections=detections,
            truth=truth,
            ious=IOUS,
            rows=[_row(result, label) for label in result.labels],
            legend=list(zip(result.labels, _colours(len(result.labels)), strict=True)),
            figures=figures,
            confusion=table,
            confusion_rows=list(zip(table.labels, table.counts.tolist(), strict=True)),
        )
    )


def _row(result: Evaluation, label: str) -> list[object]:
    curves = [result.curves[label, iou, None] for iou in IOUS]
    counts = result.curves[label, 0.5, None].counts
    precision = ["-" if c.objects == 0 else f"{c.average_precision:.3f}" for c in curves]
    return [label, curves[0].objects, *precision, counts.hits, counts.false_positives, counts.misses]


def _colours(count: int) -> list[str]:
    return [_COLOURS[index % len(_COLOURS)] for index in range(count)]


def _figure(curves: Iterable[Curve], axes: Callable[[Curve], tuple[NDArray, NDArray]], widest: float) -> str:
    """Draw steps of one value over another as SVG."""
    curves = list(curves)
    side = _SIZE - 2 * _EDGE
    lines = [
        f'<rect x="{_EDGE}" y="{_EDGE}" width="{side}" height="{side}" fill="none" stroke="#999"/>',
        *(_label(at, widest) for at in (0.0, 0.5, 1.0)),
    ]
    for curve, colour in zip(curves, _colours(len(curves)), strict=True):
        across, up = axes(curve)
        points = np.stack([_EDGE + side * across / widest, _SIZE - _EDGE - side * up], axis=1)
        text = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
        lines.append(f'<polyline points="{text}" fill="none" stroke="{colour}" stroke-width="2"/>')
    return f'<svg width="{_SIZE}" height="{_SIZE}" font-size="11">{"".join(lines)}</svg>'


def _label(at: float, widest: float) -> str:
    side = _SIZE - 2 * _EDGE
    along, height = _EDGE + at * side, _SIZE - _EDGE - at * side
    return (
        f'<text x="{along:.0f}" y="{_SIZE - _EDGE + 14}" text-anchor="middle">{at * widest:.3g}</text>'
        f'<text x="{_EDGE - 5}" y="{height + 4:.0f}" text-anchor="end">{at:g}</text>'
    )
