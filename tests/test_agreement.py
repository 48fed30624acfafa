"""Candidates that several cascades of one class find."""

from dataclasses import dataclass

import numpy as np
import pytest

from analytic import ray_grid
from laserimg.detectors.agreement import Agreement
from laserimg.detectors.candidate import Candidate
from laserimg.errors import ConfigError
from laserimg.evidence import Evidence
from laserimg.geometry.pitch import angular_pitch
from laserimg.rules.file import parse_rules
from laserimg.sources import detectors_for
from window_models import blob_model

WIDTH = 72


@dataclass(frozen=True)
class Finds:
    """A window detector that finds the same boxes everywhere."""

    name: str
    boxes: tuple
    images: frozenset = frozenset()

    def __call__(self, evidence):
        return [Candidate("bin", box, score, "cascade", self.name) for box, score in self.boxes]


def agreed(least, *windows, wraps=False):
    scan = ray_grid(np.arange(WIDTH) * (5.0 if wraps else 1.0), np.arange(10.0, -10, -1), wraps)
    found = Agreement(windows, least)(Evidence(scan, {}, angular_pitch(scan), None, None, ()))
    return [(one.box, one.score) for one in found]


DEPTH = Finds("bin.depth", (((10, 5, 10, 10), 3.0), ((40, 5, 10, 10), 9.0)))
NORMALS = Finds("bin.normals", (((12, 5, 10, 10), 4.0),))
THIRD = Finds("bin.up", (((11, 6, 10, 10), 1.0), ((40, 6, 10, 10), 1.0)))


def test_a_place_counts_that_enough_cascades_find_with_the_surest_box_and_all_scores():
    assert agreed(2, DEPTH, NORMALS) == [((12, 5, 10, 10), 7.0)]
    assert agreed(2, DEPTH, NORMALS, THIRD) == [((40, 5, 10, 10), 10.0), ((12, 5, 10, 10), 8.0)]
    assert agreed(3, DEPTH, NORMALS, THIRD) == [((12, 5, 10, 10), 8.0)]


def test_a_cascade_does_not_agree_with_itself():
    twice = Finds("bin.depth", (((10, 5, 10, 10), 3.0), ((11, 5, 10, 10), 2.0)))
    assert agreed(2, twice, THIRD) == [((10, 5, 10, 10), 4.0)]
    assert agreed(2, twice, Finds("bin.normals", ())) == []


def test_cascades_agree_across_the_seam():
    left, right = Finds("a", (((-3, 5, 10, 10), 2.0),)), Finds("b", (((WIDTH - 2, 5, 10, 10), 1.0),))
    assert agreed(2, left, right, wraps=True) == [((-3, 5, 10, 10), 3.0)]
    assert agreed(2, left, right) == []


def test_rules_say_how_many_must_agree_and_more_than_there_are_is_an_error():
    rules = "format = 1\n[blob]\nfrom = ['cascade', 'hog']\nagree = {}\n"
    models = [blob_model(), blob_model()]
    label = models[0].card.label
    both = detectors_for(parse_rules(rules.format(2).replace("blob", label)), models)
    assert [type(one) for one in both] == [Agreement]
    with pytest.raises(ConfigError, match=f"{label}: 3 detectors must agree, there are 2"):
        detectors_for(parse_rules(rules.format(3).replace("blob", label)), models)
