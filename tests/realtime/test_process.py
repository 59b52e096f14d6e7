"""Is the rig at zero whoever dies, and is the log whole up to there?"""

from __future__ import annotations

import multiprocessing
import os
import signal
import subprocess
import sys
import threading
from functools import partial
from pathlib import Path

import pytest

from tests.realtime.rigs import LAW, put_out, witnessed
from upright.laws import as_values
from upright.logs import read_log
from upright.realtime.process import run_in_process
from upright.realtime.session import RunOrder

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


def order(folder, **more):
    (folder / "out").write_bytes(bytes(24))
    given = {"seconds": 0.5, "log": folder / "run.mcap", "check": False, "fifo": False}
    return RunOrder(make=partial(witnessed, folder / "out"), law=as_values(LAW), **(given | more))


def until(done, seconds=30.0):
    """Wait for what happens in another process."""
    clock = threading.Event()
    for _ in range(round(seconds / 0.02)):
        if done():
            return True
        clock.wait(0.02)
    return done()


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
    def kill(state):
        if state.phase == "running" and state.tick > 1700:
            for child in multiprocessing.active_children():
                if child.name == "upright loop":
                    os.kill(child.pid, signal.SIGKILL)
        return ""

    end = run_in_process(order(tmp_path, seconds=60.0), watch=kill)
    assert "killed" in end.stopped
    # the twin died with the process that moved it; a board's own watchdog is tested by the conformance suite
    log = tmp_path / "run.mcap"
    assert until(lambda: log.exists() and len(read_log(log)) > 300)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_a_loop_that_is_asked_to_end_zeroes_first(tmp_path):
    def end_it(state):
        if state.phase == "running" and state.tick > 1700:
            for child in multiprocessing.active_children():
                if child.name == "upright loop":
                    os.kill(child.pid, signal.SIGTERM)
        return ""

    end = run_in_process(order(tmp_path, seconds=60.0), watch=end_it)
    assert "a signal" in end.stopped
    assert put_out(tmp_path / "out")[:2] == (0.0, 0)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_an_orphan_zeroes_its_rig_and_ends(tmp_path):
    (tmp_path / "out").write_bytes(bytes(24))
    (tmp_path / "parent.py").write_text(PARENT, encoding="utf-8")
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(ROOT), *filter(None, sys.path)])}
    parent = subprocess.Popen([sys.executable, str(tmp_path / "parent.py"), str(tmp_path)], env=environment, cwd=ROOT)
    try:
        assert until(lambda: put_out(tmp_path / "out")[1] == 1 and put_out(tmp_path / "out")[2] > 3000)
    finally:
        parent.kill()
        parent.wait()
    assert until(lambda: put_out(tmp_path / "out")[:2] == (0.0, 0), 5.0)
    writes = put_out(tmp_path / "out")[2]
    threading.Event().wait(0.2)
    assert put_out(tmp_path / "out")[2] == writes  # nobody drives it any more
    log = read_log(tmp_path / "run.mcap")
    assert until(lambda: not read_log(tmp_path / "run.mcap").complaint, 10.0)
    assert len(log) > 300
