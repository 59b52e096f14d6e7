"""Are all lines to a board alike, and do ports that cannot be had say so?"""

from __future__ import annotations

import os
import sys
import time

import pytest

from benchmarks.boards import rig_on
from upright.errors import BadInput, RigStopped
from upright.rigs.line import PySerialLine, TerminalLine, open_line

needs_linux = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="a pty of Linux")


@pytest.mark.parametrize("make", [TerminalLine, PySerialLine])
def test_a_rig_answers_over_every_line(host, make):
    if make is PySerialLine:
        pytest.importorskip("serial")
    rig = rig_on(make(host().port))
    assert "host" in rig.open().name
    rig.clear_fault()
    assert [rig.exchange(0.0).tick for _ in range(3)] == [1, 2, 3]
    rig.close()
    with pytest.raises(RigStopped, match="another line"):
        rig.open()


def test_firmware_by_the_clock_on_the_wall_paces_its_host(host):
    rig = host(lockstep=False).rig()
    assert not rig.open().virtual
    began = time.monotonic()
    ticks = [rig.exchange(0.0) for _ in range(31)]
    passed = time.monotonic() - began
    assert ticks[-1].tick - ticks[0].tick >= 30
    # every tick came after the exchange that it answers, however busy the machine; 1 us is how its lateness is told
    assert ticks[-1].time - ticks[0].time <= passed + 2e-6


@needs_linux
def test_a_port_has_one_host_at_a_time(host):
    board = host()
    first = TerminalLine(board.port)
    with pytest.raises(RigStopped, match="Another program"):
        TerminalLine(board.port)
    first.close()
    first.close()
    TerminalLine(board.port).close()


@needs_linux
def test_a_port_that_is_none_is_refused_in_a_sentence(tmp_path):
    with pytest.raises(BadInput, match="plugged in"):
        open_line(str(tmp_path / "ttyACM0"))
    (tmp_path / "log.csv").write_text("t,u\n", encoding="utf-8")
    with pytest.raises(BadInput, match="no serial port"):
        open_line(str(tmp_path / "log.csv"))


@needs_linux
def test_a_cable_that_is_pulled_is_told():
    board, end = os.openpty()
    line = TerminalLine(os.ttyname(end))
    os.close(end)
    os.close(board)
    with pytest.raises(RigStopped, match="is gone"):
        line.read(0.1)
    line.close()


def test_without_pyserial_it_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "serial", None)
    with pytest.raises(BadInput, match=r"pip install 'upright\[rig\]'"):
        PySerialLine("COM4")
