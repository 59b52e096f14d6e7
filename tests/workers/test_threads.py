"""Do threads that share work change nothing but the time, and do none share it where the cores belong to others?"""

import os
import threading

import numpy as np
import pytest

from tests.identification.twins import FURUTA, rig, shaken
from upright.identification.problem.residuals import formulate
from upright.physics import Furuta
from upright.workers import Workers, cores, one_core, share, spread


@pytest.fixture
def two_cores(monkeypatch):
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {0, 1}, raising=False)


@pytest.mark.usefixtures("two_cores")
def test_two_items_are_under_way_at_once_and_come_back_in_their_order():
    together = threading.Barrier(2)

    def task(item):
        together.wait(timeout=30)  # neither goes on before the other has begun
        return item, cores()

    # who shares work already shares no more
    assert list(share(task, ["first", "second"])) == [("first", 1), ("second", 1)]
    assert cores() == 2


@pytest.mark.usefixtures("two_cores")
def test_an_error_of_an_item_reaches_who_wants_it():
    with pytest.raises(ZeroDivisionError):
        list(share(lambda n: 1 / n, [1, 0, 2]))


@pytest.mark.usefixtures("two_cores")
def test_what_numpy_was_to_keep_to_itself_threads_keep_too():
    with np.errstate(divide="raise"), pytest.raises(FloatingPointError):
        list(share(lambda n: np.ones(1) / n, [np.ones(1), np.zeros(1)]))


@pytest.mark.usefixtures("two_cores")
def test_a_process_or_thread_whose_cores_are_for_others_computes_by_itself_one_after_another():
    begun = []

    def task(item):
        begun.append(item)
        return threading.get_ident()

    with one_core():
        each = share(task, [1, 2, 3])
        assert next(each) == threading.get_ident()
        each.close()
    assert begun == [1]
    assert spread(_cores, [0, 1], workers=Workers(number=2)).all() == [1, 1]


def _cores(_item, _progress):
    return cores()


def test_normal_equations_of_several_runs_are_the_same_to_the_last_bit(monkeypatch):
    runs = [shaken(label=f"run {k}", seconds=4.0 + k) for k in range(3)]
    guesses = {"J_d": 0.009, "b_1": 6e-3, "b_2c": 3e-4}
    known = {n: v for n, v in FURUTA.items() if n not in guesses}
    answers, counts = [], []
    for number in (1, 2, 3):
        monkeypatch.setattr(os, "sched_getaffinity", lambda _, number=number: set(range(number)), raising=False)
        problem = formulate(rig(Furuta, known, guesses), runs)
        answers.append(problem.normal(problem.start))
        counts.append(problem.evaluations)
    for other in answers[1:]:
        assert other.cost == answers[0].cost
        np.testing.assert_array_equal(other.matrix, answers[0].matrix)
        np.testing.assert_array_equal(other.gradient, answers[0].gradient)
    assert counts == [3, 3, 3]
