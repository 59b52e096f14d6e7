"""Does what a client does to a run reach the loop, the next tick, and only what the supervisor accepts?"""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from tests.realtime.rigs import LAW, MODEL, RIG, SAMPLED, staged
from upright.gains import feedback, filtered, place
from upright.laws import as_values
from upright.logs import read_log
from upright.logs.replay import replay
from upright.realtime.desk import ROW, ROWS, Desk
from upright.realtime.session import RunOrder, RunState, carry_out
from upright.rigs import Fault, Mode, TwinPort
from upright.rigs.law import RunningLaw

FASTER = feedback(filtered(SAMPLED, 0.5), place(MODEL.A, MODEL.B, [-6 + 2j, -6 - 2j, -20, -5]).K)


def carried(tmp_path, act, seconds=0.3, port=None):
    """End of a run in virtual time, and its rows; `act` is called with the desk and the tick before each."""
    desk, port, ticks = Desk(), port or TwinPort(RIG), iter(range(10**6))

    def heed(stage):
        act(desk, next(ticks))
        return desk.heed(replace(stage, tap=port.push))

    order = RunOrder(make=lambda: staged(port), law=as_values(LAW), seconds=seconds, log=tmp_path / "run.mcap",
                     check=False)  # fmt: skip
    end = carry_out(order, law=LAW, show=desk.put, stopped=lambda: "Enough." if desk.stopping else "", heed=heed)
    return end, desk.since(0)[1]


def test_every_tick_of_a_run_is_on_the_desk_as_it_is_in_the_log(tmp_path):
    end, rows = carried(tmp_path, lambda desk, tick: None)
    log = read_log(tmp_path / "run.mcap")
    assert rows["tick"].tolist() == list(range(1, end.ticks + 1))
    assert rows["command"].tolist() == log.columns[log.header.command].tolist()
    # a row of the log has the sample that was answered, the desk the one that came of it
    assert rows["counts"][:-1, 0].tolist() == log.columns["psi_counts"][1:].tolist()
    assert rows["counts"][:-1, 1].tolist() == log.columns["theta_counts"][1:].tolist()


def test_a_tap_adds_to_a_speed_at_the_next_tick(tmp_path):
    """1 rad/s turns the pendulum a period later by so many counts as pass in a period."""
    _, still = carried(tmp_path / "a", lambda desk, tick: None, 0.2)
    _, tapped = carried(tmp_path / "b", lambda desk, tick: desk.tap(1, 1.0) if tick == 100 else None, 0.2)
    apart = (tapped["counts"][:, 1] - still["counts"][:, 1]).tolist()
    assert not any(apart[:100])
    assert sum(apart[100:110]) > 0
    assert apart[109] == pytest.approx(10 * RIG.period * RIG.per_unit[1], rel=0.1, abs=1.0)


def test_two_taps_between_ticks_are_both_felt(tmp_path):
    desk, felt = Desk(), []
    stage = SimpleNamespace(tap=felt.append, units=("rad", "rad"))
    desk.tap(1, 0.25)
    desk.tap(1, 0.5)
    desk.heed(stage)
    desk.heed(stage)
    assert felt == [[0.0, 0.75]]


def test_other_gains_answer_the_next_sample_as_if_they_had_read_all_before(tmp_path):
    """The command after the change is that of the new law run over the same readings from the start."""
    changed = 200
    _, rows = carried(tmp_path, lambda desk, tick: desk.change(FASTER) if tick == changed else None)
    q = np.vstack([rows["counts"][:, :2] / RIG.per_unit])
    slow, fast = (
        RunningLaw(replace(law, command_resolution=RIG.converter, limit=RIG.limit, target=[0.0, np.pi]), RIG.period)
        for law in (LAW, FASTER)
    )
    # the answer to the sample of row k stands in row k + 1
    before, after = ([law.step(y) for y in q.tolist()] for law in (slow, fast))
    assert rows["command"][changed + 1 :].tolist() == pytest.approx(after[changed:-1], abs=RIG.converter)
    assert np.abs(np.array(before[50 : changed - 1]) - rows["command"][51:changed]).max() <= RIG.converter
    assert np.abs(np.array(before) - after)[changed] > 2 * RIG.converter


def test_a_log_whose_gains_were_changed_twice_is_replayed_to_the_last_bit(tmp_path):
    def act(desk, tick):
        if tick in (20, 200):
            assert desk.change(FASTER if tick == 20 else LAW)

    carried(tmp_path, act)
    log = read_log(tmp_path / "run.mcap")
    assert replay(log).identical
    assert replay(log).rows.size == len(log)
    unchanged = replace(log, events=tuple(event for event in log.events if event.kind != "law"))
    assert replay(unchanged).differing > 100


@pytest.mark.parametrize(
    ("law", "why"),
    [(replace(LAW, D=1e9 * LAW.D), "absurd"), (replace(LAW, C=-LAW.C, D=-LAW.D), "falls"),
     (feedback(filtered(SAMPLED, 0.0), [[1.0, 1.0, 1.0, 1.0]]), "other numbers")],
    ids=["absurd", "falls", "other shape"],
)  # fmt: skip
def test_gains_that_are_no_good_are_refused_and_the_run_goes_on(tmp_path, law, why):
    answers = []

    def act(desk, tick):
        if tick == 100:
            assert desk.change(law)
        if tick == 102:
            answers.append(desk.answered)

    end, rows = carried(tmp_path, act)
    assert (end.stopped, len(rows)) == ("", end.ticks)
    number, at, sentence = answers[0]
    assert (number, at) == (1, 101)
    assert why in sentence


def test_a_change_waits_for_the_answer_to_the_one_before():
    desk = Desk()
    assert desk.change(LAW)
    assert not desk.change(FASTER)
    assert not Desk().change(replace(LAW, A=np.zeros((80, 80)), B=np.zeros((80, 3)), C=np.zeros((1, 80))))


def test_numbers_that_are_none_are_refused(tmp_path):
    sentences = []

    def act(desk, tick):
        if tick == 50:
            desk.change(LAW)
            desk._law[3] = np.nan
        if tick == 52:
            sentences.append(desk.answered[2])

    assert carried(tmp_path, act, 0.1)[0].stopped == ""
    assert "finite" in sentences[0]


def test_a_stop_ends_the_run_at_zero_and_is_not_taken_back(tmp_path):
    port = TwinPort(RIG)
    end, rows = carried(tmp_path, lambda desk, tick: desk.stop() if tick == 60 else None, port=port)
    assert end.stopped == "Enough."
    assert len(rows) <= 61
    assert (port._command, port._enabled) == (0.0, False)


def test_a_reader_that_is_slow_misses_rows_and_reads_none_that_is_torn():
    desk = Desk()
    for k in range(3 * ROWS):
        desk.put(RunState(phase="running", tick=k + 1, counts=(k, -k), mode=Mode.HOST, faults=Fault.STOP))
    head, rows = desk.since(10)
    assert head == 3 * ROWS
    assert rows["number"].tolist() == list(range(3 * ROWS - ROWS // 2, 3 * ROWS))
    assert (rows["tick"] == rows["number"] + 1).all()
    assert (rows["counts"][:, 1] == -rows["number"]).all()
    end = (head - 1) % ROWS * ROW.itemsize + ROW.itemsize
    desk._ring[end - 8 : end] = bytes(8)  # as while the newest is written
    assert desk.since(head - 3)[1]["number"].tolist() == [head - 3, head - 2]


def test_before_the_loop_there_are_no_rows():
    desk = Desk()
    desk.put(RunState(phase="waiting"))
    assert desk.since(0)[1].size == 0
