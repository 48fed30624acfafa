"""The parts of paper 1's experiment: labels of clusters, controls, the paper's table."""

import numpy as np
import pytest

from laserimg.classify import class_table
from laserimg.scan import Scan
from laserimg.simulate.measure import Simulated
from paper_one.controls import by_shape, by_size, shape_numbers
from paper_one.objects import FEW, FRAGMENT, MIXED, OTHER, Truth, collected, things_measured, truth_of
from paper_one.plan import Plan
from paper_one.run import left_out, run_of
from paper_one.tables import paper_table

PLAN = Plan(900, least_points=10)
NAMES = [
    ("", "ground"), ("Building", "facade"), ("Building", "window"), ("Car", "car"),
    ("Car", "car"), ("Tree", "hedge"),
]  # fmt: skip


def truth(*runs: tuple[int, int], seen: int = 20) -> Truth:
    """Truth of a cluster with so many points of each thing, of things with `seen` returns."""
    things = np.concatenate([np.full(count, thing) for thing, count in runs])
    return truth_of(things, np.full(len(NAMES), seen), NAMES, PLAN)


@pytest.mark.parametrize(
    ("runs", "wanted"),
    [
        ([(3, 20)], Truth("Car", "car")),
        ([(5, 18), (0, 2)], Truth("Tree", "hedge")),
        ([(5, 17), (0, 2)], Truth("Tree", "hedge", MIXED)),  # 89 % one thing
        ([(3, 9), (4, 11)], Truth("Car", "car", MIXED)),  # two cars
        ([(1, 12), (2, 10)], Truth("Building", "facade")),  # a wall and its window
        ([(2, 12)], Truth("Building", "facade", FRAGMENT)),  # a window alone
        ([(1, 12), (2, 10), (3, 3)], Truth("Building", "facade", MIXED)),
        ([(1, 8), (2, 8), (3, 9)], Truth("Building", "facade", MIXED)),  # the class has the majority
        ([(3, 11)], Truth("Car", "car")),
        ([(3, 9)], Truth("Car", "car", FEW)),
        ([(0, 15), (3, 5)], Truth("", "ground", OTHER)),
        ([(-1, 15)], Truth("", "ground", OTHER)),  # no votes
    ],
)
def test_a_cluster_is_what_most_of_its_points_hit(runs, wanted):
    assert truth(*runs) == wanted


def test_a_cluster_with_less_than_half_of_its_thing_is_a_fragment():
    assert truth((3, 12), seen=24) == Truth("Car", "car")
    assert truth((3, 12), seen=25) == Truth("Car", "car", FRAGMENT)


def test_mixed_pixels_have_no_vote():
    """Two points show the car; one lies between things, one beam is off every thing, one has no return."""
    shape = (2, 3)
    directions = np.tile(np.array([1, 0, 0], np.float32), (*shape, 1))
    scan = Scan(np.array([[5.0, 5.1, 6.5], [5.0, 0.0, 8.0]], np.float32), directions)
    truth_m = np.array([[5.0, 5.0, 8.0], [0.0, 8.0, 8.1]], np.float32)
    thing = np.array([[3, 3, 0], [-1, 0, 0]], np.int32)
    simulation = Simulated(scan, thing, truth_m, np.zeros((*shape, 3), np.float32))
    assert things_measured(simulation, PLAN).tolist() == [3, 3, -1, -1, -1, 0]
    assert truth((3, 12), (-1, 12)) == Truth("Car", "car")


@pytest.fixture(scope="module")
def small():
    """A plan for two scans or a few more."""
    pytest.importorskip("embreex")
    return Plan(901, images={"Building": 2, "Car": 2, "Human": 2, "Tree": 2, "Pole": 2})


def test_a_run_classifies_the_images_of_the_plan(small):
    run = run_of(small)
    assert dict(zip(*np.unique(run.labels, return_counts=True), strict=True)) == small.images
    assert {len(taken) for taken in run.taken_for.values()} == {10}
    assert len({(one.scan, one.points.tobytes()) for one in run.found}) == 10
    assert all(len(one.points) >= small.least_points for one in run.found)


def test_a_class_that_never_appears_stops_the_run(small):
    with pytest.raises(SystemExit, match=r"seed 901: 1 Ship missing after 1 scans"):
        collected(Plan(901, ("park",), most_scans=1, images={"Ship": 1}))


def test_shape_numbers_tell_line_plane_and_ball():
    rng = np.random.default_rng(0)
    line, plane, ball = (
        rng.normal(0, spread, (2000, 3)) for spread in ([0.01, 0.01, 1], [1, 1, 0.01], [1, 1, 1])
    )
    kinds = np.array([shape_numbers(cloud)[3:6] for cloud in (line, plane, ball)])
    assert kinds.argmax(axis=1).tolist() == [0, 1, 2]
    assert (kinds.max(axis=1) > 0.85).all()
    assert np.allclose(kinds.sum(axis=1), 1)


def test_controls_tell_poles_from_boxes():
    rng = np.random.default_rng(1)
    poles = [rng.uniform([0, 0, 0], [0.1, 0.1, height], (100, 3)) for height in rng.uniform(2, 5, 12)]
    boxes = [rng.uniform([0, 0, 0], [4, 2, height], (100, 3)) for height in rng.uniform(1, 2, 12)]
    labels = np.repeat(["Pole", "Car"], 12)
    assert (by_size(poles + boxes, labels) == labels).all()
    assert (by_shape(poles + boxes, labels) == labels).all()


def test_an_object_that_has_no_part_is_neither_classified_nor_learnt_from():
    vectors = np.array([[1, 0], [1, 0.1], [0, 1], [0.1, 1], [1, 0.05], [1, 0.02]])
    labels = np.array(["a", "a", "b", "b", "b", "b"])
    among = np.array([True, True, True, True, False, False])
    assert left_out(vectors, labels, among).tolist() == ["a", "a", "b", "b", "", ""]
    assert left_out(vectors, labels, ~among | True).tolist() != ["a", "a", "b", "b", "b", "b"]


def test_the_table_reads_as_the_papers():
    """The paper's table of 3DHOG, from a confusion that its sums allow."""
    correct = {"Building": 102, "Car": 99, "Human": 124, "Tree": 129, "Pole": 27}
    wrong = {
        ("Building", "Human"): 1, ("Car", "Building"): 2, ("Car", "Human"): 2, ("Car", "Tree"): 1,
        ("Tree", "Building"): 1, ("Tree", "Pole"): 1, ("Pole", "Tree"): 1,
    }  # fmt: skip
    counts = {**{(name, name): count for name, count in correct.items()}, **wrong}
    truths, found = (np.repeat(part, list(counts.values())) for part in zip(*counts, strict=True))
    lines = list(paper_table(class_table(truths, found)))
    assert lines[0] == "|  | Building | Car | Human | Tree | Pole | Total |"
    assert lines[2:] == [
        "| Images | 103 | 104 | 124 | 131 | 28 | 490 |",
        "| Detected | 105 | 99 | 127 | 131 | 28 |  |",
        "| Correct | 102 | 99 | 124 | 129 | 27 | 481 |",
        "| Precision | 97.1% | 100.0% | 97.6% | 98.5% | 96.4% |  |",
        "| Recall | 99.0% | 95.2% | 100.0% | 98.5% | 96.4% | 98.2% |",
    ]
