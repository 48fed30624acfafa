"""The report of a training, its pictures, and the forecast."""

import re
from dataclasses import replace

import numpy as np
import pytest

from laserimg.cascade.checkpoint import StageRecord
from laserimg.cascade.estimate import forecast
from laserimg.cascade.features import Pool
from laserimg.cascade.model import Cascade, Stage, Tree
from laserimg.cascade.pictures import stage_picture, worst_false_alarms, worst_misses
from laserimg.cascade.rates import Rate
from laserimg.cascade.report import ReportData, hit_rates, training_page
from laserimg.cascade.stage import StageGoal
from laserimg.cascade.training import Plan

SIDE = 14
POOL = Pool("all", SIDE, SIDE)


def edge_stage(threshold):
    """Accepts windows that are brighter on the right by enough."""
    number = POOL.numbers(np.array([[0, 2, 3, 5, 8]]))
    leaves = np.array([-1, 1], np.float32)
    tree = Tree(
        number, np.array([threshold], np.float32), np.zeros((1, 8), np.int32), np.array([[0, -1]]), leaves
    )
    return Stage((tree,), np.float32(0.5))


def edges(strengths):
    pixels = np.full((len(strengths), SIDE, SIDE), 100, np.uint8)
    pixels[:, :, 7:] += np.asarray(strengths, np.uint8)[:, None, None]
    pixels[:, ::2, ::2] += 40
    return pixels


CASCADE = Cascade(POOL, (edge_stage(0.1), edge_stage(0.3)))
RECORDS = [
    StageRecord(n, 1, 0.99, 0.4, 4, 9, 3, Rate(50, 50 * 10 ** (n + 1), 1e-3, 1e-1), 1.5, 0.5)
    for n in range(2)
]


def test_hit_rates_fall_stage_by_stage():
    strengths = np.arange(0, 100, 5)
    pixels = edges(strengths)
    rates = hit_rates(CASCADE, pixels)
    parts = [Cascade(POOL, CASCADE.stages[:n]).passes(pixels).mean() for n in (1, 2)]
    assert rates == pytest.approx(parts) and 1 > rates[0] > rates[1] > 0


def test_misses_come_in_the_order_of_the_stages():
    pixels = edges([90, 2, 20])
    cascade = CASCADE
    assert [cascade.passes(pixels[i : i + 1]).item() for i in range(3)] == [True, False, False]
    sheet = worst_misses(cascade, pixels)
    assert (sheet[2 : 2 + SIDE, 2 : 2 + SIDE] == pixels[1]).all()
    assert (sheet[2 : 2 + SIDE, 4 + SIDE : 4 + 2 * SIDE] == pixels[2]).all()
    assert worst_misses(cascade, pixels[:1]) is None


def test_no_false_alarms_no_picture():
    assert worst_false_alarms(CASCADE, np.empty((0, SIDE, SIDE), np.uint8)) is None
    assert worst_false_alarms(CASCADE, edges([90, 80])).ndim == 2


def test_features_are_drawn_where_they_are():
    picture = stage_picture(CASCADE, CASCADE.stages[0], np.full((SIDE, SIDE), 128, np.uint8)).astype(int)
    # Six pixels for one, and a border of four.
    dark, bright, outside = (picture[4 + 6 * 6, 4 + 6 * x] for x in (4, 9, 13))
    assert dark[2] > dark[1] and bright[1] > bright[2]
    assert outside.tolist() == [128, 128, 128]


def test_the_page_stands_alone_and_says_what_happened():
    positives = edges([90, 90, 40, 10])
    data = ReportData(CASCADE, RECORDS, positives, edges([90, 10]), edges([95]), "cups & <saucers>", "Done.")
    page = training_page(data)
    assert "cups &amp; &lt;saucers&gt;" in page and "Done." in page
    assert not re.search(r'(src|href)="(?!data:)', page)
    assert page.count("data:image/png;base64,") == 4
    assert "share of 2 positives kept aside" in page and "1 of 2 positives kept aside" in page
    assert re.search(r"<td>1</td><td>1</td><td>0.9900</td><td>0.4000</td><td>3</td><td>5,000</td>", page)
    assert "positives, those trained on" in training_page(replace(data, validation=None))


def plan(**more):
    return Plan(Pool("basic", 20, 20), StageGoal(), **{"stages": 20, "negatives": 2000, **more})


def test_fewer_windows_end_the_negatives_earlier():
    ends = [forecast(plan(), windows) for windows in (10**5, 10**7, 10**9)]
    assert ends[0].stages < ends[1].stages < ends[2].stages <= 20
    assert ends[0].rate > ends[1].rate > ends[2].rate
    assert ends[0].seconds < ends[1].seconds < ends[2].seconds


def test_what_is_done_is_not_forecast():
    slow = [replace(record, before=Rate(60, 10**7, 0, 1), mining_s=10.0) for record in RECORDS]
    fast = [replace(record, mining_s=0.1) for record in slow]
    assert forecast(plan(), 10**9, slow).seconds > forecast(plan(), 10**9, fast).seconds
    assert forecast(plan(stages=2), 10**9, slow).seconds == 0
    assert forecast(plan(target=0.5), 10**9, slow).seconds == 0
