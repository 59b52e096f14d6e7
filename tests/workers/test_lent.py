"""Does an executor that somebody lends do the work, and stay theirs?"""

from __future__ import annotations

import os
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context

import numpy as np
import pytest

import upright as up
from tests.workers.test_spread import seeds, walk
from upright.errors import BadInput, WorkersLost
from upright.workers import HERE, Workers, spread

ARM = up.Furuta(m_p=0.135, l_cg=0.19, r=0.16, J_d=0.011, J_p=6e-4)
RIG = up.Rig.known(ARM, gain="0.65 N m/V", limit="10 V", period="2 ms", counts=4096)


def test_threads_of_the_caller_say_the_same_to_the_last_bit_and_go_on_working():
    here = spread(walk, seeds(5)).all()
    with ThreadPoolExecutor(2) as executor:
        there = spread(walk, seeds(5), workers=Workers.of(executor)).all()
        assert all(np.array_equal(a, b) for a, b in zip(here, there, strict=True))
        assert executor.submit(int, "7").result() == 7


@pytest.mark.slow
def test_processes_of_the_caller_compute():
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as executor:
        there = spread(lambda _item, _tell: os.getpid(), range(3), workers=Workers.of(executor)).all()
    assert len(set(there)) == 1
    assert os.getpid() not in there


def test_a_chance_is_the_same_whoever_computes_it():
    K = [[-1.0, -1.5, 20.0, 2.0]]
    alone = up.chance(RIG, K, draws=40, seconds=0.5)
    with ThreadPoolExecutor(2) as executor:
        lent = up.chance(RIG, K, draws=40, seconds=0.5, workers=executor)
    assert lent.words == alone.words


def test_an_executor_that_was_shut_down_is_told_so():
    executor = ThreadPoolExecutor(1)
    executor.shutdown()
    with pytest.raises(BadInput, match="was shut down"):
        spread(walk, seeds(2), workers=Workers.of(executor))


class Broken(Executor):
    """Takes one piece of work and never another."""

    _broken = False

    def submit(self, fn, /, *args, **kwargs):  # type: ignore[override]
        if self._broken:
            raise BrokenExecutor
        self._broken = True
        failed: Future = Future()
        failed.set_exception(BrokenExecutor())
        return failed


def test_an_executor_that_breaks_is_not_asked_for_ever():
    with pytest.raises(WorkersLost, match="Broken of the caller broke"):
        spread(walk, seeds(3), workers=Workers.of(Broken()))


@pytest.mark.parametrize(("given", "meant"), [(3, Workers(number=3)), (" 3 ", Workers(number=3)), (HERE, HERE)])
def test_workers_are_a_number_or_what_they_are(given, meant):
    assert Workers.of(given) == meant


def test_workers_are_the_address_of_a_scheduler():
    assert Workers.of("tcp://host:8786") == Workers(cluster="tcp://host:8786")
    for given in (2.5, "2.5", None, "-3", 0):
        with pytest.raises(BadInput, match="--workers takes"):
            Workers.of(given)  # type: ignore[arg-type]


def test_a_cluster_is_read_under_its_former_name():
    with pytest.deprecated_call(match="say workers="), pytest.raises(BadInput, match=r"tcp://host:8786, got 'nearby'"):
        up.chance(RIG, [[0.0, 0.0, 0.0, 0.0]], cluster="nearby")
