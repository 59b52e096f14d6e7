"""Does a task that eats memory, never ends, dies or fails leave a sentence, and everything else as it was?"""

from __future__ import annotations

import sys

import pytest

from tests.browser import bounded_tasks as tasks
from upright.browser.identify.bounded import Bounded
from upright.errors import BadInput, UprightError

pytestmark = pytest.mark.slow  # each begins a process, which is loaded before it does anything

AMPLE = 120.0
"""Time that no task of these takes [s]."""


def run(task, *arguments, seconds=AMPLE, **options):
    return Bounded(task, *arguments, seconds=seconds, **options).run()


def test_a_task_gives_its_text_and_its_progress():
    steps = []
    assert run(tasks.says, "Größe", progress=lambda *step: steps.append(step)) == "Größe"
    assert steps == [("the only step", 0.5)]


def test_what_a_task_refuses_comes_as_it_was_said():
    with pytest.raises(BadInput, match=r"^line 3: no number$"):
        run(tasks.refuses, "line 3: no number")


@pytest.mark.skipif(sys.platform != "linux", reason="memory is bounded where the system counts it by address space")
def test_memory_is_bounded():
    with pytest.raises(BadInput, match="takes more than 3072 MB"):
        run(tasks.eats)


def test_time_is_bounded():
    with pytest.raises(BadInput, match="took more than 1 s"):
        run(tasks.never_ends, seconds=1.0)


def test_an_interrupted_task_gives_what_it_has_and_is_interrupted_once():
    job = Bounded(tasks.ends_when_interrupted, seconds=AMPLE, grace=AMPLE, progress=lambda step, share: job.interrupt())
    assert job.run() == "the best so far"


def test_an_interrupt_leaves_every_picture_whole_however_many_are_on_their_way():
    pictures = []

    def show(picture):
        pictures.append(picture)
        job.interrupt()

    job = Bounded(tasks.draws, seconds=AMPLE, grace=AMPLE, show=show)
    assert job.run() == "drawn"
    assert {len(each) for each in pictures[:-1]} == {100_000}
    assert pictures[-1] == ["the last"]


def test_an_interrupt_that_comes_before_the_process_is_there_is_kept_for_it():
    job = Bounded(tasks.never_ends, seconds=AMPLE, grace=AMPLE)
    job.interrupt()
    with pytest.raises(BadInput, match="interrupted before there was a result"):
        job.run()


@pytest.mark.parametrize(("task", "sentence"), [(tasks.dies, "ended without an answer"), (tasks.fails, "IndexError")])
def test_a_task_that_ends_by_a_fault_is_a_sentence(task, sentence):
    with pytest.raises(UprightError, match=sentence):
        run(task)
