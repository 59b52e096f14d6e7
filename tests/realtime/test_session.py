"""Does a run show, log and count every tick as what it was?"""

from __future__ import annotations

import math
import signal
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from tests.realtime.rigs import LAW, RIG, staged
from upright.errors import BadInput, RigStopped
from upright.laws import as_values
from upright.logs import read_log
from upright.realtime.pace import Virtual
from upright.realtime.session import PATIENCE, RunOrder, RunState, carry_out, refused
from upright.rigs import Board, Fault, Mode, TwinPort
from upright.rigs.supervisor import Supervisor

TICKS = 12


def run_of(folder, *, stage=None, port=None, seconds=(TICKS - 0.5) * RIG.period, check=False, **how):
    """End, states shown and log of a short run."""
    shown = []
    order = RunOrder(
        make=stage or partial(staged, port or TwinPort(RIG)), law=as_values(LAW), seconds=seconds,
        log=folder / "run.mcap", check=check, rig_text="a rig",
    )  # fmt: skip
    end = carry_out(order, law=LAW, show=shown.append, **how)
    return end, shown, read_log(folder / "run.mcap") if (folder / "run.mcap").exists() else None


def anywhere():
    """A stage without a start window and without a bank of filters."""
    port = TwinPort(RIG)
    whole = staged(port)
    duty = replace(whole.supervisor.duty, near=math.inf, watch=False)
    return replace(whole, supervisor=Supervisor(Board(port), duty))


def test_every_tick_is_shown_and_logged_as_it_was(tmp_path):
    end, shown, log = run_of(tmp_path, check=True)
    assert (end.ticks, end.late, end.rows, end.dropped, end.stopped) == (TICKS, 0, TICKS, 0, "")
    assert shown[0].phase == "testing: a small pulse"
    assert shown[1].phase == "waiting"
    waiting = [s.time for s in shown if s.phase == "waiting"]
    assert waiting[-1] - waiting[0] == pytest.approx(0.3, abs=0.01)  # it must be quiet there for as long
    running = [s for s in shown if s.phase == "running"]
    assert len(running) == len(log) == TICKS
    first = running[0].tick
    assert [s.tick for s in running] == list(range(first, first + TICKS))
    assert np.diff([s.time for s in running]) == pytest.approx(RIG.period)
    assert {(s.mode, s.faults, s.late) for s in running} == {(Mode.HOST, 0, 0)}
    # a state is the answer to the row before it: readings in rad, less what is held
    columns = {name: np.asarray(log.columns[name]) for name in log.columns}
    counts = np.column_stack([columns["psi_counts"], columns["theta_counts"]])
    readings = np.column_stack([columns["psi"], columns["theta"]])
    assert readings == pytest.approx(counts * RIG.resolution)
    assert [s.readings for s in running[:-1]] == pytest.approx((readings - end.target)[1:])
    assert [s.command for s in running] == pytest.approx(columns["u"])
    assert [s.applied for s in running] == pytest.approx(columns["u_applied"])
    assert columns["u_applied"] == pytest.approx(columns["u"], abs=RIG.limit / 2**14)
    assert np.abs(columns["u"]).min() > 0.1  # 0.05 rad off, it pushes
    assert [kind for _, kind, _ in end.events] == ["self-test", "start", "stop"]
    assert [event.kind for event in log.events][-3:] == ["self-test", "start", "stop"]


class Late(Virtual):
    """A clock by which every tick is late, and the one before it was passed over."""

    def wait(self):
        self.late, self.passed = self.late + 2, self.passed + 1
        return 0.0


def test_a_run_lasts_to_the_tick_that_ends_its_seconds_and_at_least_one_by_the_clock_given(tmp_path):
    """Ten whole periods are ten ticks, and no eleventh by rounding; what may start anywhere is not waited for."""
    for seconds, ticks in ((10 * RIG.period, 10), (0.0, 1)):
        end, shown, _ = run_of(
            tmp_path, stage=anywhere, seconds=seconds, pace=lambda about: (Late(), f"slow at {about.period:g} s")
        )
        assert {s.phase for s in shown} == {"running"}
        assert (end.ticks, end.late, end.warning) == (ticks, 2 * ticks, f"slow at {RIG.period:g} s")
        assert end.due == end.late  # all that were due
        (tmp_path / "run.mcap").unlink()


class Skipping(Board):
    """A board that paces the loop by its own clock and loses every second sample."""

    def open(self):
        return replace(super().open(), paced=True)

    def exchange(self, command):
        super().exchange(command)
        return super().exchange(command)


def test_samples_that_a_pacing_rig_lost_are_late_ticks(tmp_path):
    port = TwinPort(RIG)

    def stage():
        whole = staged(port)
        return replace(whole, supervisor=Supervisor(Skipping(port), replace(whole.supervisor.duty, watch=False)))

    end, shown, _ = run_of(tmp_path, stage=stage)
    assert end.ticks == TICKS
    assert (end.late, end.due) == (TICKS, 2 * TICKS)  # one lost before each
    assert shown[-1].late == TICKS


def test_a_rig_that_nobody_brings_to_its_start_is_given_up_after_the_patience(tmp_path, monkeypatch):
    monkeypatch.setattr("upright.realtime.session.PATIENCE", 0.5)
    end, shown, log = run_of(tmp_path, stage=lambda: replace(staged(TwinPort(RIG)), bring=lambda: None, advice="lift"))
    assert "It was not brought where it is to be stabilised within 0.5 s" in end.stopped
    assert log is None
    assert end.ticks == 0
    assert PATIENCE == 120.0
    assert {s.phase for s in shown} == {"lift"}
    assert shown[-1].time - shown[0].time == pytest.approx(0.5, abs=0.01)


def test_a_wish_while_waiting_and_one_at_a_tick_end_a_run_with_its_word(tmp_path):
    end, *_ = run_of(tmp_path, stopped=lambda: "Enough.")
    assert (end.stopped, end.ticks, end.faults) == ("Enough.", 0, Fault.STOP)
    running = []
    order = RunOrder(make=anywhere, law=as_values(LAW), seconds=1.0, log=tmp_path / "run.mcap", check=False)
    end = carry_out(order, law=LAW, show=running.append, stopped=lambda: "Enough now." if len(running) == 7 else "")
    assert (end.stopped, end.ticks, end.rows, end.faults) == ("Enough now.", 7, 7, Fault.STOP)


class Repeating(Board):
    """A board whose every second answer is the sample before."""

    def __init__(self, port):
        super().__init__(port)
        self.asked, self.begun = 0, False

    def start(self, mode, law=None):
        super().start(mode, law)
        self.begun = True

    def exchange(self, command):
        self.asked += self.begun
        return self.sample if self.asked % 2 == 1 and self.asked > 1 else super().exchange(command)


def test_a_sample_that_comes_again_is_answered_but_not_logged_again(tmp_path):
    port = TwinPort(RIG)

    def stage():
        whole = staged(port)
        duty = replace(whole.supervisor.duty, near=math.inf, watch=False)
        return replace(whole, supervisor=Supervisor(Repeating(port), duty))

    end, _, log = run_of(tmp_path, stage=stage)
    assert end.ticks == TICKS
    ticks = np.asarray(log.columns["tick"])
    assert end.rows == ticks.size < TICKS
    assert np.all(np.diff(ticks) == 1)


def test_a_run_is_tested_zeroed_and_put_before_others_where_nobody_says_otherwise(tmp_path):
    """As docs/howto/rigs.md tells what happens in a run, step by step."""
    order = RunOrder(make=anywhere, law=as_values(LAW), seconds=1.0, log=tmp_path / "run.mcap")
    assert (order.check, order.zero, order.fifo, order.mode) == (True, True, True, Mode.HOST)
    assert (order.rig_text, order.references, order.accepted) == ("", (), "")


def test_a_run_that_has_not_begun_has_done_nothing():
    assert RunState(phase="waiting") == RunState(
        phase="waiting", time=0.0, tick=0, late=0, mode=Mode.IDLE, faults=Fault(0), command=0.0, applied=0.0,
        readings=(),
    )  # fmt: skip
    end = refused(BadInput("no rig here."))
    assert (end.ticks, end.late, end.rows, end.dropped, end.seconds) == (0, 0, 0, 0, 0.0)
    assert end.stopped == "no rig here."


def test_a_wire_that_is_cut_is_a_fault_of_the_link(tmp_path):
    class Cut(TwinPort):
        """It answers for 2.6 s, then nobody does."""

        left = 3000

        def advance(self):
            self.left -= 1
            if self.left < 0:
                raise RigStopped("The rig did not answer for 1 s.")
            return super().advance()

    port = Cut(RIG)
    end, _, _ = run_of(tmp_path, port=port, seconds=60.0)
    assert end.stopped == "The rig did not answer for 1 s."
    assert end.faults == Fault.LINK
    assert end.ticks > 100
    assert not port._enabled
    assert port._command == 0.0


def test_the_state_of_a_run_counts_from_its_first_tick(tmp_path):
    _, states, _ = run_of(tmp_path, seconds=0.5)
    running = [s for s in states if s.phase == "running"]
    assert [s.tick for s in running] == list(range(1, len(running) + 1))
    assert [s.time for s in running] == pytest.approx([k * RIG.period for k in range(1, len(running) + 1)])


@pytest.fixture
def heard():
    """Ctrl-C interrupts, also where the tests were started by a shell that ignores it in the background."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("heard")
def test_a_second_interrupt_while_the_rig_is_zeroed_does_not_lose_the_end(tmp_path):
    class Impatient(TwinPort):
        """Somebody presses Ctrl-C twice: in the loop, and while the power stage is switched off for it."""

        pressed = 0

        def advance(self):
            if self._enabled and self._periods > 2000 and not self.pressed:
                self.pressed = 1
                signal.raise_signal(signal.SIGINT)
            return super().advance()

        def enable(self, on):
            super().enable(on)
            if self.pressed == 1 and not on:
                self.pressed = 2
                signal.raise_signal(signal.SIGINT)

    port = Impatient(RIG)
    end, _, _ = run_of(tmp_path, port=port, seconds=60.0)
    assert port.pressed == 2
    assert "Ctrl-C" in end.stopped
    assert end.log_message == ""
    assert end.rows > 100
