import os
import pickle
import signal

import pytest

from killed_workers import process_number, slow_first, square_or_die
from laserimg.errors import MissingExtraError
from laserimg.workers import in_order, unordered

needs_signals = pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="no SIGKILL here")


@pytest.mark.parametrize("jobs", [1, 3])
def test_every_item_is_done_once(jobs):
    results = list(unordered(square_or_die, range(12), jobs, died=lambda _: -1))
    assert sorted(results) == [n * n for n in range(12)]


@needs_signals
def test_a_killed_worker_costs_its_item_alone():
    results = list(unordered(square_or_die, range(30), 2, died=lambda item: -item))
    assert sorted(results) == sorted([-13, *(n * n for n in range(30) if n != 13)])


@needs_signals
def test_an_only_item_may_die():
    assert list(unordered(square_or_die, [13], 2, died=lambda item: -item)) == [-13]


def test_one_job_works_here_and_several_elsewhere():
    assert set(unordered(process_number, range(3), 1, died=int)) == {os.getpid()}
    assert os.getpid() not in set(unordered(process_number, range(3), 2, died=int))


def test_nothing_to_do():
    assert list(unordered(square_or_die, [], 4, died=int)) == []


def test_a_missing_extra_comes_home_from_a_worker():
    error = pickle.loads(pickle.dumps(MissingExtraError("simulated scans", "simulate")))
    assert str(error) == 'simulated scans need an extra: pip install "laserimg[simulate]"'


@pytest.mark.parametrize("jobs", [1, 2])
def test_results_come_in_the_order_of_their_items_and_each_is_told(jobs):
    told = []
    assert in_order(slow_first, range(5), jobs, int, told.append) == [0, 10, 20, 30, 40]
    assert told == [1, 2, 3, 4, 5]


def test_no_items_have_no_results():
    assert in_order(slow_first, [], 2, int) == []
