"""One HTML page on a training: stages, rates, features, and the samples that go wrong."""

import base64
import math
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from laserimg.cascade.checkpoint import StageRecord
from laserimg.cascade.model import Cascade
from laserimg.cascade.pictures import stage_picture, worst_false_alarms, worst_misses

Pixels = NDArray[np.uint8]
_WIDTH, _HEIGHT, _EDGE = 460, 300, 46

_TEMPLATE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>Cascade {{ title }}</title>
<style>
body { font: 15px/1.45 sans-serif; max-width: 72em; margin: 2em auto; padding: 0 1em; color: #222 }
table { border-collapse: collapse; margin: 1em 0 } td, th { padding: .2em .8em; text-align: right }
th { border-bottom: 1px solid #888 }
img { image-rendering: pixelated; max-width: 100% }
figure { margin: 0 0 1.2em 0 } figcaption { color: #555 }
</style></head><body>
<h1>{{ title }}</h1>
<p>{{ facts }}</p>
<p>{{ end }}</p>
<table><tr>{% for name in head %}<th>{{ name }}</th>{% endfor %}</tr>
{% for row in rows %}<tr>{% for cell in row %}<td>{{ cell }}</td>{% endfor %}</tr>
{% endfor %}</table>
<h2>Hits over false alarms per window</h2>
{{ curve | safe }}
<p>A point a stage. {{ curve_text }}</p>
{% if misses %}<h2>Positives rejected</h2>
<figure><img src="{{ misses }}" alt="rejected positives">
<figcaption>{{ miss_text }}</figcaption></figure>{% endif %}
{% if alarms %}<h2>Negatives that pass all stages</h2>
<figure><img src="{{ alarms }}" alt="false alarms">
<figcaption>Surest first.</figcaption></figure>{% endif %}
<h2>Features</h2>
<p>On the mean positive; green parts count as bright, red ones as dark. At most twelve a stage.</p>
{% for stage in stages %}<figure><img src="{{ stage.picture }}" alt="features">
<figcaption>stage {{ loop.index0 }}, {{ stage.trees }} trees</figcaption></figure>
{% endfor %}</body></html>
"""
_HEAD = (
    *("stage", "trees", "hit rate", "false alarm", "positives left"),
    *("windows searched", "false alarms before it", "expected after it", "mining s", "training s"),
)


@dataclass(frozen=True, eq=False, slots=True)
class ReportData:
    """What the page shows.

    Attributes
    ----------
    cascade : Cascade
    records : sequence of StageRecord
    positives : (n, height, width) uint8
    validation : (m, height, width) uint8, optional
        Positives that were not trained on.
    negatives : (k, height, width) uint8
        Negatives that pass all stages.
    title, end : str
        Name of the run, and why it ended.
    """

    cascade: Cascade
    records: Sequence[StageRecord]
    positives: Pixels
    validation: Pixels | None
    negatives: Pixels
    title: str
    end: str


def training_page(data: ReportData) -> str:
    """Return the page; it loads nothing from elsewhere."""
    from jinja2 import Environment

    cascade = data.cascade
    judged = data.positives if data.validation is None else data.validation
    kind = "positives, those trained on" if data.validation is None else "positives kept aside"
    mean = np.rint(data.positives.mean(axis=0)).astype(np.uint8)
    stages = [
        {"picture": _uri(stage_picture(cascade, stage, mean)), "trees": len(stage.trees)}
        for stage in cascade.stages
    ]
    pool = cascade.pool
    return (
        Environment(autoescape=True)
        .from_string(_TEMPLATE)
        .render(
            title=data.title,
            facts=f"{pool.mode}, {pool.width}x{pool.height} pixels, {len(cascade)} stages, "
            f"{sum(len(stage.trees) for stage in cascade.stages)} trees, {len(data.positives)} positives",
            end=data.end,
            head=_HEAD,
            rows=[_row(record) for record in data.records],
            curve=_curve([record.rate for record in data.records], hit_rates(cascade, judged)),
            curve_text=f"Hits: share of {len(judged)} {kind}. False alarms: expected after the stage.",
            misses=_uri(worst_misses(cascade, judged)),
            miss_text=f"{len(judged) - int(cascade.passes(judged).sum())} of {len(judged)} {kind}; "
            "those rejected by the first stages first.",
            alarms=_uri(worst_false_alarms(cascade, data.negatives)),
            stages=stages,
        )
    )


def hit_rates(cascade: Cascade, positives: Pixels) -> list[float]:
    """Return the share of positives that pass the first stage, the first two, and so on."""
    shares, left = [], positives
    for stage in cascade.stages:
        left = left[Cascade(cascade.pool, (stage,)).passes(left)]
        shares.append(len(left) / max(len(positives), 1))
    return shares


def _row(record: StageRecord) -> tuple[str, ...]:
    before = record.before
    return (
        f"{record.number}",
        f"{record.trees}",
        f"{record.hit_rate:.4f}",
        f"{record.false_alarm:.4f}",
        f"{record.positives_left}",
        f"{before.windows:,d}",
        f"{before.value:.3g} ({before.low:.2g} to {before.high:.2g})",
        f"{record.rate:.3g}",
        f"{record.mining_s:.1f}",
        f"{record.training_s:.1f}",
    )


def _curve(rates: Sequence[float], hits: Sequence[float]) -> str:
    decades = [math.floor(math.log10(max(min(rates), 1e-12))), 0]
    lowest = math.floor(min(hits) * 20) / 20
    span = max(1 - lowest, 0.05)

    def place(rate: float, hit: float) -> tuple[float, float]:
        across = (math.log10(max(rate, 1e-12)) - decades[0]) / (decades[1] - decades[0] or 1)
        up = (hit - lowest) / span
        return _EDGE + across * (_WIDTH - 2 * _EDGE), _HEIGHT - _EDGE - up * (_HEIGHT - 2 * _EDGE)

    parts = []
    for decade in range(decades[0], 1):
        x, y = place(10.0**decade, lowest)
        parts.append(f'<line x1="{x:.0f}" y1="{_EDGE}" x2="{x:.0f}" y2="{y:.0f}" stroke="#ddd"/>')
        parts.append(f'<text x="{x:.0f}" y="{y + 18:.0f}" text-anchor="middle">1e{decade}</text>')
    for step in range(6):
        hit = lowest + span * step / 5
        x, y = place(10.0 ** decades[0], hit)
        parts.append(f'<text x="{x - 4:.0f}" y="{y + 4:.0f}" text-anchor="end">{hit:.2f}</text>')
    points = [place(rate, hit) for rate, hit in zip(rates, hits, strict=True)]
    line = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
    parts.append(f'<polyline points="{line}" fill="none" stroke="#1b6ca8" stroke-width="2"/>')
    parts += [f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3" fill="#1b6ca8"/>' for x, y in points]
    return f'<svg width="{_WIDTH}" height="{_HEIGHT}" font-size="12">{"".join(parts)}</svg>'


def _uri(pixels: Pixels | None) -> str:
    if pixels is None:
        return ""
    data = cv2.imencode(".png", pixels)[1].tobytes()
    return f"data:image/png;base64,{base64.b64encode(data).decode()}"
