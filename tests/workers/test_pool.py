"""Is work handed out as far ahead as it should be, begun again where workers die, and given up in time?"""

from __future__ import annotations

from concurrent.futures import BrokenExecutor, Future
from importlib import import_module

import pytest

from upright.errors import BadInput, WorkersLost
from upright.workers import Workers, spread
from upright.workers.labour import Pool


class Clerk(Pool):
    """Two workers in this process: what they are handed, they do when they are asked for results."""

    def __init__(self, deaths=(), interrupted=0):
        self.width, self.name, self.deaths, self.interrupted = 2, "2 clerks", list(deaths), interrupted
        self.begun, self.most, self.stopped, self.open = [], 0, False, []

    def executor(self):
        return self

    def submit(self, do, order, item):
        future = Future()
        self.begun.append(item)
        if len(self.begun) == self.interrupted:
            raise KeyboardInterrupt
        if len(self.begun) in self.deaths:
            future.set_exception(BrokenExecutor("died"))
        else:
            future.set_result(do(order, item))
        self.open.append(future)
        self.most = max(self.most, len(self.open))
        return future

    def stop(self, running):
        self.stopped = True


def square(item, tell):
    return item * item


@pytest.fixture
def with_clerk(monkeypatch):
    def go(items, deaths=(), interrupted=0, progress=lambda step, share: None):
        clerk = Clerk(deaths, interrupted)
        # a clerk sits in this process, whose linear algebra other tests use as well
        monkeypatch.setattr("upright.workers.labour._one_thread", lambda: None)
        monkeypatch.setattr(import_module("upright.workers.spread"), "Processes", lambda number: clerk)
        done = spread(square, items, workers=Workers(number=2), progress=progress, what="twin")
        return done, clerk

    return go


def test_results_come_in_the_order_of_the_items_whoever_did_them(with_clerk):
    steps = []
    done, clerk = with_clerk(list(range(7)), progress=lambda step, share: steps.append((step, share)))
    assert done.all() == [n * n for n in range(7)]
    assert steps[0] == ("twin 0 of 7, on 2 clerks", 0.0)
    assert steps[-1] == ("twin 7 of 7, on 2 clerks", 1.0)
    assert [share for _, share in steps] == [pytest.approx(int(s.split()[1]) / 7) for s, _ in steps]
    assert len(clerk.begun) == 7
    assert not clerk.stopped


def test_two_items_for_each_worker_are_handed_out_before_any_is_waited_for(with_clerk):
    """The first result is told after four of the seven were begun."""
    begun = []
    with_clerk(list(range(7)), progress=lambda step, share: begun.append(step))
    assert begun[1] == "twin 4 of 7, on 2 clerks"


def test_ctrl_c_keeps_what_was_done_but_not_fetched_yet(with_clerk):
    """It comes while the third item is handed out; the first two are done by then, and one of them by nobody."""
    done, clerk = with_clerk(list(range(7)), interrupted=3)
    assert done.interrupted
    assert done.so_far() == [0, 1]
    done, clerk = with_clerk(list(range(7)), deaths=[1], interrupted=3)
    assert done.so_far() == [1]
    assert clerk.stopped


def test_what_died_with_its_worker_is_begun_again(with_clerk):
    done, clerk = with_clerk(list(range(5)), deaths=(2,))
    assert done.all() == [0, 1, 4, 9, 16]
    assert len(clerk.begun) > 5


def test_an_item_that_was_begun_four_times_is_given_up(with_clerk):
    with pytest.raises(WorkersLost, match=r"to the end of twin 1 or one begun with it, and died 4 times \(2 clerks\)"):
        with_clerk([1, 2], deaths=range(1, 99))


def test_one_item_alone_is_done_here(with_clerk):
    done, clerk = with_clerk([3])
    assert (done.all(), clerk.begun) == ([9], [])


@pytest.mark.parametrize(
    ("how", "taken"),
    [
        ({"number": 1024}, True), ({"number": 1025}, False), ({"number": 0}, False),
        ({"cluster": "tcp://host:8786"}, True), ({"cluster": "tcp://host"}, False),
        ({"cluster": "http://host:1"}, False),
    ],
)  # fmt: skip
def test_workers_are_one_to_a_thousand_and_twenty_four_or_a_cluster(how, taken):
    if taken:
        assert Workers(**how).alone == (how == {"number": 1})
    else:
        with pytest.raises(BadInput):
            Workers(**how)


def test_nobody_else_works_where_nobody_is_asked():
    assert Workers().alone
    assert not Workers(number=2).alone
