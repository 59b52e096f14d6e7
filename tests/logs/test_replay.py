"""Does a replay find every command that is not the law's, to the last bit, and name the first?"""

from __future__ import annotations

import io
import math
import shutil
import sys
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from tests.logs.runs import HEADER
from upright.errors import BadInput
from upright.laws import Law, Rule, as_values, at_work, state_feedback
from upright.logs import RunLog
from upright.logs.layout import RunFile
from upright.logs.replay import replay
from upright.logs.whole import RunEvent, log_of

LAW = state_feedback([-1.2, -0.3, 9.1, 1.1], 1e-3, memory=0.5, limit=0.5, command_resolution=0.001)


def damped(t, y, r, z, p):
    speed = (y[1] - z[0]) / 1e-3
    return (-p[0] * y[1] - p[1] * speed + 0.01 * t,), (y[1],)


def run(
    law: Law | Rule = LAW,
    *,
    rows: int = 400,
    modes: Callable[[int], int] = lambda k: 2,
    change: Callable[[int, float], float] = lambda k, u: u,
    lose: range = range(0),
) -> RunLog:
    """Log of a loop that asks its law in mode 2 only, from its first sample there on; rows in `lose` are dropped."""
    rng = np.random.default_rng(3)
    stream = io.BytesIO()
    file = RunFile(stream, replace(HEADER, law=as_values(law), driven=(2,)))
    step, begin, before = at_work(law), 0.0, 0
    for k in range(rows):
        t, counts = k * 1e-3 + 5.0, rng.integers(-200, 200, 2).tolist()
        y = tuple(count * 2 * math.pi / 4096 for count in counts)
        if modes(k) == 2 and before != 2:
            step, begin = at_work(law), t
        before = modes(k)
        u = step(t - begin, y)[0] if before == 2 else 0.0
        if k in lose:
            continue
        if lose and k == lose.stop:
            file.event(t, "dropped", "some", dropped=len(lose))
        file.row((t, k, *counts, *y, change(k, u), u, before, 0))
    file.finish()
    return log_of(stream.getvalue(), "run.mcap")


def test_a_reference_that_somebody_changed_is_replayed_from_its_column():
    law = state_feedback([-1.2, -0.3, 9.1, 1.1], 1e-3, memory=0.5, k_pf=-1.2)
    wanted = np.where(np.arange(300) < 120, 0.0, 0.25) + 0.1 * np.sin(0.3 * np.arange(300))
    step, rng, stream = at_work(replace(law, references=wanted)), np.random.default_rng(8), io.BytesIO()
    file = RunFile(stream, replace(HEADER, law=as_values(law), references=(("reference", "rad"),), driven=(2,)))
    for k, r in enumerate(wanted.tolist()):
        counts = rng.integers(-200, 200, 2).tolist()
        y = tuple(count * 2 * math.pi / 4096 for count in counts)
        mode = 0 if k == 200 else 2  # off and on again: the law begins anew where it is then
        if k == 201:
            step = at_work(replace(law, references=wanted[k:]))
        u = step(k * 1e-3, y)[0] if mode else 0.0
        file.row((k * 1e-3, k, *counts, *y, r, u, u, mode, 0))
    file.finish()
    log = log_of(stream.getvalue(), "run.mcap")
    assert replay(log).identical
    assert replay(log).starts == 2
    assert not replay(replace(log, header=replace(log.header, references=()))).identical


@pytest.mark.parametrize("law", [LAW, Rule(function=damped, initial=[0.0], parameters=[0.3, 1e-3], limit=0.4)])
def test_a_law_gives_its_own_commands_again(law):
    found = replay(run(law))
    assert found.identical
    assert (found.rows.size, found.starts, found.differing, found.first) == (400, 1, 0, None)


@pytest.mark.parametrize("law", [LAW, Rule(function=damped, initial=[0.0], parameters=[0.3, 1e-3])])
def test_one_bit_of_one_command_is_found(law):
    found = replay(run(law, change=lambda k, u: math.nextafter(u, 1.0) if k == 123 else u))
    assert (found.differing, found.first.row, found.first.t) == (1, 124, 123 * 1e-3 + 5.0)
    assert found.first.logged == math.nextafter(found.first.replayed, 1.0)
    assert found.largest == found.first.logged - found.first.replayed


def test_another_law_is_told_by_its_distance():
    found = replay(run(), replace(LAW, limit=0.25))
    assert found.largest == 0.25
    assert not found.identical


def test_the_law_begins_anew_where_it_commands_again():
    log = run(modes=lambda k: 2 if 50 <= k < 150 or k >= 300 else 0)
    found = replay(log)
    assert found.identical
    assert found.starts == 2
    assert found.rows.tolist() == [*range(50, 150), *range(300, 400)]


def test_what_lies_behind_dropped_rows_is_passed_over():
    found = replay(run(lose=range(100, 110)))
    assert found.identical
    assert (found.rows.size, found.passed_over) == (100, 290)


@pytest.mark.parametrize(
    ("log", "sentence"),
    [
        (lambda: run(modes=lambda k: 0), "no row in .* in which its law"),
        (lambda: run(rows=0), "no row in"),
        (lambda: replace_law(run(), {}), "says nothing of its law"),
        (lambda: replace_law(run(), as_values(state_feedback([1.0, 2.0], 1e-3))), "reads 1 signals"),
        (lambda: replace_law(run(), {"kind": "rule", "text": "def f(t,y,r,z,p):\n return (1/0,),z"}), "fails at row 1"),
        (
            lambda: replace_law(run(), {"kind": "rule", "text": "def f(t,y,r,z,p):\n return (1,2),z"}),
            "gives 2 commands",
        ),
        (lambda: replace_law(run(), rule("if t < 0: q = 1", "q")), "fails at row 1, 5 s: cannot access local|local"),
        (lambda: replace_law(run(), rule("pass", "1, (2,)")), "fails at row 1, 5 s"),
        (lambda: replace_law(run(), rule("pass", "-" * 900 + "1")), "values are no law's"),
    ],
)
def test_what_cannot_be_replayed_gets_a_sentence(log, sentence):
    with pytest.raises(BadInput, match=sentence):
        replay(log())


ENDLESS = ("while True: pass", "for a in range(10**12): pass", "x = 9\n for a in (1, 1, 1, 1): x = x**x")
"""The last is no loop: one power in it has more digits than there is memory, and nothing interrupts it."""


@pytest.mark.parametrize("line", ENDLESS)
def test_a_rule_without_an_end_is_stopped(line, monkeypatch):
    monkeypatch.setattr("upright.logs.replay.PATIENCE", (0.3, 0.001))
    log = run(rows=100)
    with pytest.raises(BadInput, match=r"was stopped: it gave no commands for 100 rows within 0\.4 s"):
        replay(replace_law(log, rule(line, "1")))


@pytest.mark.skipif(sys.platform != "linux", reason="no other system holds a process to an amount of memory")
@pytest.mark.parametrize("line", ["a = [0] * 10**9", "a = [1]\n for b in range(30): a = [*a, *a]"])
def test_a_rule_that_takes_all_memory_gets_a_sentence(line, monkeypatch):
    """Both ask for 8 GB, at once and by and by."""
    monkeypatch.setattr("upright.logs.replay.MEMORY", 1 << 29)
    with pytest.raises(BadInput, match="fails at row 1, 5 s"):
        replay(replace_law(run(), rule(line, "1")))


@pytest.mark.skipif(shutil.which("true") is None, reason="no program here that does nothing")
@pytest.mark.parametrize("program", ["true", "false"])
def test_a_rule_that_ends_its_process_gets_a_sentence(program, monkeypatch):
    """Such as one that takes all memory there is; here a program runs it that does nothing, well or not."""
    monkeypatch.setattr("sys.executable", shutil.which(program))
    with pytest.raises(BadInput, match="ended the process that it ran in"):
        replay(replace_law(run(), rule("pass", "1")))


def rule(line: str, commands: str) -> dict[str, str]:
    """Values of a rule of two lines."""
    return {"kind": "rule", "text": f"def f(t, y, r, z, p):\n {line}\n return ({commands},), z"}


def replace_law(log: RunLog, law) -> RunLog:
    return replace(log, header=replace(log.header, law=law))


@pytest.mark.parametrize(
    "text",
    [
        "other gains",
        "other gains: 3",
        "other gains: {}",
        'other gains: {"C": [[1, 2], [3]], "D": 0}',
        "x: " + "[" * 700,
    ],
)
def test_other_gains_that_a_log_does_not_tell_cannot_be_replayed(text):
    log = run()
    event = RunEvent(t=5.1, kind="law", text=text, row=100)
    with pytest.raises(BadInput, match=r"other gains at 5\.1 s"):
        replay(replace(log, events=(event,)))
