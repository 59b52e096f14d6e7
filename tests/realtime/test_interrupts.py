"""Is a signal deaf for as long as something must come to its end, and heard as before afterwards?"""

from __future__ import annotations

import signal
import subprocess
import sys
import threading
from contextlib import nullcontext

import pytest

from upright.realtime.interrupts import ENDING, INTERRUPT, ignoring

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")


@pytest.fixture
def heard():
    """Signals that came to a handler of the test's own."""
    came = []
    before = {each: signal.signal(each, lambda number, _: came.append(number)) for each in ENDING}
    yield came
    for each, handler in before.items():
        signal.signal(each, handler)


def test_all_by_which_a_program_is_ended_or_stopped_are_ignored_meanwhile_and_heard_after(heard):
    """A terminal that closes, Ctrl-C, Ctrl-\\, Ctrl-Z and `kill`, by POSIX."""
    assert {s.name for s in ENDING} == {"SIGINT", "SIGTERM", "SIGHUP", "SIGQUIT", "SIGTSTP"}

    @ignoring(ENDING)
    def fails():
        for each in ENDING:
            signal.raise_signal(each)
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fails()
    assert heard == []
    for each in ENDING:
        signal.raise_signal(each)
    assert heard == list(ENDING)


def test_without_more_said_ctrl_c_alone_is_ignored(heard):
    assert INTERRUPT == (signal.SIGINT,)
    with ignoring():
        signal.raise_signal(signal.SIGINT)
        signal.raise_signal(signal.SIGTERM)
    assert heard == [signal.SIGTERM]


def test_a_thread_that_gets_no_signals_changes_none(heard):
    inside = []

    def work():
        with ignoring():
            inside.append(signal.getsignal(signal.SIGINT))

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert inside == [signal.getsignal(signal.SIGINT)]
    assert inside != [signal.SIG_IGN]


@pytest.mark.skipif(sys.platform != "linux", reason="looks into /proc")
def test_processes_that_a_thread_starts_meanwhile_do_not_hear_ctrl_c_and_later_ones_do():
    """What a thread blocks is blocked in what it starts (POSIX), from the first instruction on."""
    masks = []

    def work():
        for meanwhile in (True, False):
            with ignoring() if meanwhile else nullcontext():
                status = subprocess.run(["cat", "/proc/self/status"], capture_output=True, text=True, check=True).stdout
            masks.append(int(next(line for line in status.splitlines() if line.startswith("SigBlk:")).split()[1], 16))

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert [bool(mask >> (signal.SIGINT - 1) & 1) for mask in masks] == [True, False]


def test_a_handler_that_is_not_python_s_own_becomes_the_system_s(monkeypatch, heard):
    monkeypatch.setattr("signal.signal", lambda number, handler: heard.append(handler))  # which answers None
    with ignoring():
        pass
    assert heard == [signal.SIG_IGN, signal.SIG_DFL]
