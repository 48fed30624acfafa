"""The score from which on detections count."""

from pathlib import Path

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from laserimg.detectors.shipped import shipped_folder
from laserimg.formats.card import read_card
from laserimg.recipes import least_score
from laserimg.recipes.least_score import FALSE_PER_SCAN, chosen
from laserimg.recipes.measuring import Found
from laserimg.recipes.recipe import read_recipe
from laserimg.rules.file import load_rules

TRAINING = Path(__file__).parents[1] / "training"
SCORES = arrays(np.float64, st.integers(0, 30), elements=st.floats(0, 1))


@given(false_scores=SCORES, scans=st.integers(1, 40))
def test_the_score_is_the_least_that_leaves_few_false_ones(false_scores, scans):
    score, most = chosen(false_scores, scans), FALSE_PER_SCAN * scans
    below = (round(100 * score) - 5) / 100
    assert score == 0.95 or (false_scores > score).sum() <= most
    assert score == 0.05 or (false_scores > below).sum() > most


def test_a_score_is_chosen_by_what_is_false_in_scans(monkeypatch):
    """Nine scans may keep two false ones, two scans none; hits do not count."""
    finds = [
        Found(np.array([0.9, 0.6]), np.array([True, False])),
        Found(np.array([0.7]), np.array([True])),
    ]
    monkeypatch.setattr(least_score, "in_order", lambda *given: finds)
    recipe = read_recipe(TRAINING / "car.toml")
    assert least_score.least_score(recipe, [], load_rules()["car"], [], 1) == 0.6


def test_the_rules_that_ship_have_the_scores_that_were_chosen():
    for rules in load_rules():
        assert rules.score == read_card(shipped_folder() / f"{rules.label}.toml").scores["score"]
