"""The tools that compare ways of searching with cascades, and of combining them."""

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np

from analytic import ray_grid
from combined_cascades import combined
from laserimg.boxes import as_boxes
from laserimg.detectors.candidate import Candidate
from laserimg.detectors.search import Searched
from laserimg.evidence import Evidence
from laserimg.geometry.pitch import angular_pitch
from metric_or_plain import Tally, line, tally

SCAN = ray_grid(np.arange(72) * 1.0, np.arange(10.0, -10, -1), False)
EVIDENCE = Evidence(SCAN, {}, angular_pitch(SCAN), None, None, ())  # type: ignore[arg-type]
OBJECT, NEUTRAL, NOTHING = (10.0, 5.0, 10.0, 10.0), (30.0, 5.0, 8.0, 8.0), (50.0, 5.0, 8.0, 8.0)


@dataclass(frozen=True)
class Finds:
    """A window detector that finds the same boxes everywhere."""

    name: str
    boxes: tuple

    @property
    def model(self):
        return SimpleNamespace(name=self.name)

    def found(self, searched):
        return [Candidate("bin", box, score, "cascade", self.name) for box, score in self.boxes]

    def __call__(self, evidence):
        return self.found(Searched(evidence))


def tallied(*boxes):
    window = Finds("bin.depth", tuple((box, 1.0) for box in boxes))
    found = tally(window, Searched(EVIDENCE), as_boxes([OBJECT]), as_boxes([NEUTRAL]))  # type: ignore[arg-type]
    assert found.seconds >= 0
    return replace(found, seconds=0.0)


def test_an_object_is_hit_once_and_what_nobody_asks_for_is_not_false():
    assert tallied() == Tally(0.0, 0, 0, 1, 1)
    assert tallied(OBJECT, OBJECT, NEUTRAL, NOTHING) == Tally(0.0, 1, 1, 1, 1)
    assert tallied(OBJECT) + tallied(NOTHING, NOTHING) == Tally(0.0, 1, 2, 2, 2)


def test_a_line_tells_times_hits_and_false_positives_of_both_ways():
    both = {"metric": Tally(2.0, 3, 10, 4, 2), "plain": Tally(5.0, 1, 40, 4, 2)}
    words = line("bin.depth", "depth_relative", both).split()  # type: ignore[arg-type]
    assert words == ["bin.depth", "depth_relative", "2", "4", "2.5", "x", "0.750", "0.250", "5.0", "20.0"]


def test_cascades_are_taken_alone_together_and_as_a_vote():
    depth = Finds("bin.depth", ((OBJECT, 3.0), (NOTHING, 9.0)))
    ways = combined((depth, Finds("bin.up", ((OBJECT, 4.0),))), EVIDENCE)  # type: ignore[arg-type]
    boxes = {name: sorted(one.box for one in found) for name, found in ways.items()}
    assert boxes == {
        "bin.depth": [OBJECT, NOTHING],
        "bin.up": [OBJECT],
        "all, each box": [OBJECT, OBJECT, NOTHING],
        "all, of a place the surest": [OBJECT, NOTHING],
        "agree = 2": [OBJECT],
    }
