"""Is the rig at zero whoever dies, and is the log whole up to there?"""

from __future__ import annotations

import math
import multiprocessing
import os
import signal
import subprocess
import sys
import threading
from dataclasses import replace
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import pytest

from tests.realtime.rigs import BLANK, LAW, RIG, put_out, staged, witnessed
from upright.errors import BadInput, RigStopped, UprightError
from upright.laws import as_values, of_values
from upright.logs import read_log
from upright.realtime.desk import Desk
from upright.realtime.pace import Virtual, WallClock
from upright.realtime.priority import LoopPriority
from upright.realtime.process import _child, _Window, deaf_parent, run_in_process
from upright.realtime.session import RunEnd, RunOrder, RunState, carry_out
from upright.rigs import Board, Fault, Mode, TwinPort
from upright.rigs.supervisor import Supervisor

ROOT = Path(__file__).parents[2]
PARENT = """
import sys
from functools import partial
from pathlib import Path
from tests.realtime.rigs import LAW, witnessed
from upright.laws import as_values
from upright.realtime.process import run_in_process
from upright.realtime.session import RunOrder

if __name__ == "__main__":
    folder = Path(sys.argv[1])
    order = RunOrder(make=partial(witnessed, folder / "out"), law=as_values(LAW), seconds=60.0,
                     log=folder / "run.mcap", check=False, fifo=False)
    run_in_process(order)
"""
DOOMED = """
import multiprocessing, os, signal, sys, threading
from functools import partial
from pathlib import Path
from tests.realtime.rigs import LAW, FatalBaggage, fatal, witnessed
from upright.laws import as_values
from upright.realtime.process import run_in_process
from upright.realtime.session import RunOrder

def die(after):
    while not multiprocessing.active_children():
        os.sched_yield()
    threading.Event().wait(after)
    os.kill(os.getpid(), signal.SIGKILL)

if __name__ == "__main__":
    out, event, parent = Path(sys.argv[1]) / "out", sys.argv[2], os.getpid()
    make, paced = partial(witnessed, out, parent), False
    if event == "unpacked":
        make = partial(witnessed, out, parent, FatalBaggage())
    elif event.startswith("after"):
        paced = True
        threading.Thread(target=die, args=(float(event.split()[1]),)).start()
    else:
        make = partial(fatal, out, parent, int(event.split()[1]), event.endswith("deaf"))
    order = RunOrder(make=make, law=as_values(LAW), seconds=0.5, log=out.with_name("run.mcap"), check=False, fifo=False)
    run_in_process(order, paced=paced)
"""


def order(folder, **more):
    (folder / "out").write_bytes(BLANK)
    given = {"seconds": 0.5, "log": folder / "run.mcap", "check": False, "fifo": False}
    return RunOrder(make=partial(witnessed, folder / "out"), law=as_values(LAW), **(given | more))


def ours():
    """Environment of a program that sees the tests as this one does, and prints only what it says itself."""
    kept = {name: value for name, value in os.environ.items() if name != "PYTHONWARNDEFAULTENCODING"}
    return kept | {"PYTHONPATH": os.pathsep.join([str(ROOT), *filter(None, sys.path)])}


def until(done, seconds=30.0):
    """Wait for what happens in another process."""
    clock = threading.Event()
    for _ in range(round(seconds / 0.02)):
        if done():
            return True
        clock.wait(0.02)
    return done()


def stands_still(out):
    """Whether nothing is written for 200 ticks."""
    before = put_out(out)[2]
    threading.Event().wait(0.2)
    return put_out(out)[2] == before


@pytest.mark.slow
def test_a_run_by_the_clock_ends_at_zero_with_a_whole_log(tmp_path):
    end = run_in_process(order(tmp_path))
    assert not end.stopped
    assert put_out(tmp_path / "out")[:2] == (0.0, 0)
    assert len(read_log(tmp_path / "run.mcap")) == end.ticks > 500
    # by the clock on the wall: no tick before its time, and what took longer was late
    assert 0.5 * (1 - 1e-3) <= end.seconds <= (end.ticks + end.late + 5) * 0.884e-3


@pytest.mark.slow
def test_a_wish_stops_it(tmp_path):
    end = run_in_process(
        order(tmp_path, seconds=60.0), watch=lambda s: "enough" if s.phase == "running" and s.tick > 1700 else ""
    )
    assert "Stopped by hand" in end.stopped
    assert put_out(tmp_path / "out")[:2] == (0.0, 0)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_a_loop_that_is_killed_leaves_its_rows_and_a_sentence(tmp_path):
    seen = []

    def kill(state):
        if state.phase == "running" and state.tick > 1700:
            seen.append(state)
            for child in multiprocessing.active_children():
                if child.name == "upright loop":
                    os.kill(child.pid, signal.SIGKILL)
        return ""

    end = run_in_process(order(tmp_path, seconds=60.0), watch=kill)
    assert "killed" in end.stopped
    # of the loop: not of the board, which was on before, nor of the wait for a person
    assert float(end.stopped.split(") ")[1].split(" s")[0]) == pytest.approx(end.ticks * RIG.period, rel=0.01)
    assert 1700 < end.ticks < seen[0].tick + 2000
    # the twin died with the process that moved it; a board's own watchdog is tested by the conformance suite
    log = tmp_path / "run.mcap"
    assert until(lambda: log.exists() and len(read_log(log)) > 300)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
@pytest.mark.parametrize("name", ["SIGTERM", "SIGHUP", "SIGQUIT", "SIGTSTP"])
def test_a_loop_that_is_asked_to_end_or_to_stand_still_zeroes_first(tmp_path, name):
    """Boards without a watchdog keep what they were last given: no closed terminal or Ctrl-Z may leave one driven."""

    def end_it(state):
        if state.phase == "running" and state.tick > 1700:
            for child in multiprocessing.active_children():
                if child.name == "upright loop":
                    os.kill(child.pid, getattr(signal, name))
        return ""

    end = run_in_process(order(tmp_path, seconds=60.0), watch=end_it)
    assert "a signal" in end.stopped
    assert put_out(tmp_path / "out")[:2] == (0.0, 0)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_an_orphan_zeroes_its_rig_and_ends(tmp_path):
    (tmp_path / "out").write_bytes(BLANK)
    (tmp_path / "parent.py").write_text(PARENT, encoding="utf-8")
    parent = subprocess.Popen([sys.executable, str(tmp_path / "parent.py"), str(tmp_path)], env=ours(), cwd=ROOT)
    try:
        assert until(lambda: put_out(tmp_path / "out")[1] == 1 and put_out(tmp_path / "out")[2] > 3000)
    finally:
        parent.kill()
        parent.wait()
    assert until(lambda: put_out(tmp_path / "out")[:2] == (0.0, 0), 5.0)
    # the zero is written again while the loop disarms and closes; then nobody drives it any more
    assert until(lambda: stands_still(tmp_path / "out"), 5.0)
    assert put_out(tmp_path / "out")[:2] == (0.0, 0)
    log = read_log(tmp_path / "run.mcap")
    assert until(lambda: not read_log(tmp_path / "run.mcap").complaint, 10.0)
    assert len(log) > 300


class CountedPort(TwinPort):
    """A twin whose parent is gone from one of its calls on; counts what drives it from then on."""

    def __init__(self, last):
        super().__init__(RIG)
        self.calls, self.armed, self.driven, self._last = 0, 0, 0, last

    @property
    def orphaned(self):
        return self.calls >= self._last

    def write(self, command):
        self.calls += 1
        super().write(command)
        self.driven += self.orphaned and command != 0.0

    def enable(self, on):
        self.calls += 1
        super().enable(on)
        self.armed = self.armed or on * self.calls
        self.driven += self.orphaned and on

    def advance(self):
        self.calls += 1
        return super().advance()

    def read(self):
        self.calls += 1
        return super().read()


def started(folder, last):
    """The port of a run whose parent is gone after so many calls."""
    port = CountedPort(last)
    run = RunOrder(
        make=partial(staged, port), law=as_values(LAW), seconds=0.01, log=folder / f"{last}.mcap", check=False
    )
    carry_out(run, law=of_values(run.law), stopped=lambda: "The parent is gone." if port.orphaned else "")
    return port


ARM = 3
"""Calls of the port by which a board arms: it reads, writes zero, and switches on."""


def test_a_parent_that_is_gone_before_the_drive_is_on_leaves_it_off(tmp_path):
    """At 25 instants from the first call to the last one before the rig is armed."""
    armed = started(tmp_path, 10**9).armed
    assert armed > 1000  # the instants reach from the opening through the rest to the aiming
    for k in range(25):
        assert started(tmp_path, 1 + k * (armed - ARM - 1) // 24).driven == 0


def orphaned(folder, event):
    """What is put out after the parent's death at an event, once all of its processes have ended."""
    (folder / "out").write_bytes(BLANK)
    (folder / "doomed.py").write_text(DOOMED, encoding="utf-8")
    parent = subprocess.Popen(
        [sys.executable, str(folder / "doomed.py"), str(folder), event], env=ours(), cwd=ROOT, stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    )  # fmt: skip
    said, _ = parent.communicate(timeout=240)  # ends with the last process that holds the other end
    assert parent.returncode == -signal.SIGKILL, said
    return put_out(folder / "out")


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
@pytest.mark.parametrize("event", ["unpacked", pytest.param("call 2000 deaf", marks=pytest.mark.slow)])
def test_a_dead_parent_never_leaves_the_drive_on(tmp_path, event):
    command, enabled, _, driven = orphaned(tmp_path, event)
    assert (command, enabled, driven) == (0.0, 0, 0)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
@pytest.mark.parametrize("event", [f"after {0.06 * k:.2f}" for k in range(1, 26)])
def test_a_parent_may_die_at_any_instant_of_the_start(tmp_path, event):
    command, enabled, _, driven = orphaned(tmp_path, event)
    assert (command, enabled) == (0.0, 0)
    assert driven <= 1  # the tick that was on its way


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
@pytest.mark.parametrize("event", ["call 3200", "call 3200 deaf"])
def test_a_drive_that_is_on_goes_off_with_the_parent(tmp_path, event):
    command, enabled, writes, driven = orphaned(tmp_path, event)
    assert (command, enabled) == (0.0, 0)
    assert writes > 1000
    assert driven <= 1


@pytest.mark.skipif(sys.platform != "linux", reason="Linux alone signals the death of a parent")
def test_the_kernel_has_been_told_to_end_the_loop_with_its_parent():
    """As it says itself: PR_GET_PDEATHSIG of prctl(2) is 2."""
    asked = "from upright.realtime.process import end_with_parent; import ctypes; end_with_parent()"
    told = "signal = ctypes.c_int(); ctypes.CDLL(None).prctl(2, ctypes.byref(signal)); print(signal.value)"
    ran = subprocess.run([sys.executable, "-c", f"{asked}; {told}"], capture_output=True, text=True, check=True)
    assert int(ran.stdout) == signal.SIGTERM


def test_a_parent_is_missed_when_it_has_not_looked_for_two_seconds():
    """As docs/howto/rigs.md says; in eighths of a second, which are exact."""
    looks, now = SimpleNamespace(value=0), [100.0]
    deaf = deaf_parent(looks, lambda: now[0])
    for _ in range(5):
        looks.value += 1
        assert not deaf()
        now[0] += 2.0
        assert not deaf()
    now[0] += 0.125
    assert deaf()
    looks.value += 1
    assert not deaf()


def memory():
    """What parent and child share, with room for eight readings and a phase of 200 letters."""
    return multiprocessing.RawArray("d", 17), multiprocessing.RawArray("c", 201)


def test_the_state_that_the_parent_sees_is_the_one_that_the_child_put_there():
    shared = memory()
    child, parent = _Window(*shared), _Window(*shared)
    states = [
        RunState(phase="testing: a small pulse"),
        RunState(phase="running", time=1.5, tick=7, late=2, mode=Mode.HOST, faults=Fault.STOP | Fault.LINK,
                 command=-0.25, applied=-0.125, readings=(0.5, -0.75)),
        RunState(phase="running", time=2.5, tick=8, mode=Mode.MCU, readings=tuple(0.5 * k for k in range(8))),
        RunState(phase="running", readings=(1.0,)),
        RunState(phase="w" * 200),
    ]  # fmt: skip
    for state in states:
        child.put(state)
        assert parent.get() == state
    child.put(RunState(phase="l" * 250))
    assert parent.get().phase == "l" * 200


def test_a_state_that_is_being_written_is_awaited():
    """Its first number is odd meanwhile, and another one when it was written between two looks."""
    shared, phase = memory()
    _Window(shared, phase).put(RunState(phase="running", tick=7))

    class Writing:
        """Numbers that are being written at the first look and have changed once more at the next."""

        numbers = iter((1.0, 1.0, 2.0, 4.0, 4.0, 4.0))

        def __getitem__(self, _):
            return next(self.numbers)

        def __iter__(self):
            return iter(shared)

    assert _Window(Writing(), phase).get().tick == 7
    assert next(Writing.numbers, None) is None


def anywhere(port):
    """A stage that starts where it is, without a bank of filters."""
    whole = staged(port)
    duty = replace(whole.supervisor.duty, near=math.inf, watch=False)
    return replace(whole, supervisor=Supervisor(Board(port), duty))


def child(folder, monkeypatch, *, make=None, parent=None, stop=0, paced=False, desk=None, **more):
    """Answer of a loop's process that is this one, the signals that it turned, and the pace that it took."""
    said, turned, paces = [], {}, []
    pipe = SimpleNamespace(send=said.append, close=lambda: said.append("closed"))
    run = RunOrder(
        make=make or partial(anywhere, TwinPort(RIG)), law=as_values(LAW), seconds=5 * RIG.period,
        log=folder / "run.mcap", check=False, zero=False, fifo=False, **more,
    )  # fmt: skip

    def carried(order, *, pace, **more):
        return carry_out(order, pace=lambda about: paces.append(pace(about)) or (Virtual(), paces[-1][1]), **more)

    standing = LoopPriority(priority="ordinary", locked=True, warning="Buy a clock.")
    monkeypatch.setattr("signal.signal", turned.setdefault)
    for name, stand_in in (("step_forward", lambda fifo: standing), ("end_with_parent", lambda: None),
                           ("carry_out", carried)):  # fmt: skip
        monkeypatch.setattr(f"upright.realtime.process.{name}", stand_in)
    shared, flags = memory(), [SimpleNamespace(value=stop), SimpleNamespace(value=0)]
    _child(os.getppid() if parent is None else parent, run, *shared, *flags, pipe, paced, desk)
    return said, turned, paces


def test_a_loop_answers_with_its_end_and_leaves_ctrl_c_to_its_parent(tmp_path, monkeypatch):
    said, turned, paces = child(tmp_path, monkeypatch)
    assert isinstance(said[0], RunEnd)
    assert (said[0].ticks, said[0].stopped, said[0].warning) == (5, "", "")
    assert said[1:] == ["closed"]
    assert isinstance(paces[0][0], Virtual)
    assert turned.pop(signal.SIGINT) == signal.SIG_IGN
    assert turned
    assert signal.SIG_IGN not in turned.values()


@pytest.mark.parametrize("virtual", [True, False])
def test_a_paced_loop_waits_for_the_clock_on_the_wall_unless_its_rig_has_a_time_of_its_own(
    tmp_path, monkeypatch, virtual
):
    class Port(TwinPort):
        def open(self):
            return replace(super().open(), virtual=virtual)

    said, _, paces = child(tmp_path, monkeypatch, make=partial(anywhere, Port(RIG)), paced=True)
    assert isinstance(paces[0][0], Virtual if virtual else WallClock)
    assert said[0].warning == "Buy a clock."
    if not virtual:
        assert paces[0][0].period == RIG.period


@pytest.mark.parametrize("wall", [True, False])
def test_a_twin_that_somebody_looks_at_waits_for_the_clock_on_the_wall(tmp_path, monkeypatch, wall):
    _, _, paces = child(tmp_path, monkeypatch, paced=True, wall=wall)
    assert isinstance(paces[0][0], WallClock if wall else Virtual)


def test_a_loop_shows_every_tick_on_its_desk_and_hears_a_tap_from_there(tmp_path, monkeypatch):
    desk, felt = Desk(), []
    desk.tap(1, 0.5)
    said, _, _ = child(tmp_path, monkeypatch, desk=desk, make=lambda: replace(anywhere(TwinPort(RIG)), tap=felt.append))
    assert said[0].ticks == 5
    assert desk.since(0)[1]["tick"].tolist() == [1, 2, 3, 4, 5]
    assert felt == [[0.0, 0.5]]


def test_a_loop_that_is_stopped_on_its_desk_before_it_begins_drives_nothing(tmp_path, monkeypatch):
    desk, port = Desk(), CountedPort(0)
    desk.stop()
    end = child(tmp_path, monkeypatch, desk=desk, make=partial(anywhere, port))[0][0]
    assert (end.stopped, end.ticks, end.faults) == ("Stopped by hand.", 0, Fault.STOP)
    assert (port.armed, port.driven) == (0, 0)
    assert desk.since(0)[1].size == 0


def never():
    raise AssertionError("something was opened")


@pytest.mark.skipif(sys.platform == "win32", reason="ids of processes of POSIX")
def test_a_loop_whose_parent_is_gone_opens_nothing(tmp_path, monkeypatch):
    assert child(tmp_path, monkeypatch, make=never, parent=os.getpid())[0] == []


def test_a_loop_that_is_asked_to_stop_says_that_it_was_by_hand(tmp_path, monkeypatch):
    end = child(tmp_path, monkeypatch, stop=1)[0][0]
    assert (end.stopped, end.ticks, end.faults) == ("Stopped by hand.", 0, Fault.STOP)


@pytest.mark.parametrize(
    ("error", "answer"),
    [(BadInput("No rig."), BadInput), (RigStopped("No rig."), RigStopped), (UprightError("No rig."), RigStopped),
     (ValueError("No rig."), str)],
)  # fmt: skip
def test_a_loop_that_fails_hands_its_error_over_and_a_bug_as_its_trace(tmp_path, monkeypatch, error, answer):
    def make():
        raise error

    said = child(tmp_path, monkeypatch, make=make)[0][0]
    assert type(said) is answer
    assert "No rig." in str(said)


def test_a_run_that_cannot_be_sent_is_refused_before_a_process_is_started(tmp_path):
    with pytest.raises(BadInput, match=r"cannot be sent to a process of its own .* run it inline"):
        run_in_process(order(tmp_path, seconds=lambda: 1.0))
