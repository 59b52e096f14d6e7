"""Is a line set up for the firmware's million bits a second, and are bytes handed on as they come? A pty is enough."""

from __future__ import annotations

import os
import sys
import time
from types import ModuleType, SimpleNamespace

import pytest

from upright.errors import BadInput, RigStopped
from upright.rigs.line import PySerialLine, TerminalLine, open_line, ports

needs_linux = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="a pty of Linux")


@pytest.fixture
def pty():
    board, end = os.openpty()
    line = TerminalLine(os.ttyname(end))
    yield board, end, line
    line.close()
    os.close(end)
    os.close(board)


@needs_linux
def test_a_port_is_raw_at_a_million_bits_and_needs_no_modem(pty):
    """docs/reference/firmware.md: 1 Mbit/s; nothing is echoed, cooked or waited for."""
    import termios

    _, end, line = pty
    _, output, control, local, speed_in, speed_out, _ = termios.tcgetattr(end)
    assert (speed_in, speed_out) == (termios.B1000000, termios.B1000000)
    assert control & termios.CLOCAL
    assert control & termios.CREAD
    assert not local & (termios.ECHO | termios.ICANON | termios.ISIG)
    assert not output & termios.OPOST
    assert line.name == os.ttyname(end)


@needs_linux
def test_bytes_go_both_ways_as_they_are_and_nothing_is_waited_for_longer_than_asked(pty):
    board, _, line = pty
    every = bytes(range(256))
    line.write(every)
    assert os.read(board, 1000) == every
    os.write(board, every)
    assert line.read(1.0) == every
    began = time.monotonic()
    assert line.read(0.02) == b""
    assert 0.015 < time.monotonic() - began < 1.0
    assert line.read(-1.0) == b""
    line.close()
    line.write(b"late")  # a line that was let go takes nothing and gives nothing
    assert line.read(0.0) == b""


@needs_linux
def test_what_a_full_line_does_not_take_within_a_tenth_of_a_second_is_lost(pty):
    _, _, line = pty
    began = time.monotonic()
    line.write(bytes(1 << 20))  # more than a pty holds, and nobody reads
    assert 0.09 < time.monotonic() - began < 2.0


class Port:
    """pyserial's."""

    def __init__(self, path, baud, *, timeout, write_timeout):
        self.made, self.timeout, self.waiting, self.written, self.closed = (
            (path, baud, timeout, write_timeout),
            0,
            b"",
            b"",
            0,
        )

    @property
    def in_waiting(self):
        return len(self.waiting)

    def read(self, n):
        data, self.waiting = self.waiting[:n], self.waiting[n:]
        return data

    def write(self, data):
        if self.closed:
            raise OSError("not open")
        self.written += data

    def close(self):
        self.closed += 1


@pytest.fixture
def pyserial(monkeypatch):
    kit = ModuleType("serial")
    vars(kit)["Serial"] = Port
    monkeypatch.setitem(sys.modules, "serial", kit)
    return kit


def test_by_pyserial_the_first_byte_is_waited_for_and_all_that_came_is_taken(pyserial):
    line = PySerialLine("COM4")
    port = line._port
    assert port.made == ("COM4", 1_000_000, 0, 0.1)
    line.write(b"ab")
    assert port.written == b"ab"
    port.waiting = b"0123456789"
    assert line.read(0.25) == b"0123456789"
    assert port.timeout == 0.25
    assert line.read(-1.0) == b""
    assert port.timeout == 0.0
    line.close()
    with pytest.raises(RigStopped, match=r"The line COM4 is gone \(not open\); the firmware's watchdog stops the rig"):
        line.write(b"c")


def test_a_port_that_pyserial_cannot_open_is_refused_with_its_reason(pyserial, monkeypatch):
    def refuses(*_, **__):
        raise OSError("no such port")

    vars(pyserial)["Serial"] = refuses
    with pytest.raises(BadInput, match=r"the port COM9 cannot be opened \(no such port\); is the board plugged in"):
        PySerialLine("COM9")
    monkeypatch.setattr("upright.rigs.line.sys.platform", "win32")
    with pytest.raises(BadInput, match="the port COM9 cannot be opened"):
        open_line("COM9")


def test_ports_are_listed_with_their_vendors_and_zero_where_there_is_none(monkeypatch):
    tools, listed = ModuleType("serial.tools"), ModuleType("serial.tools.list_ports")
    vars(listed)["comports"] = lambda: [
        SimpleNamespace(device="COM1", vid=None),
        SimpleNamespace(device="COM7", vid=0x2341),
    ]
    for name, module in (
        ("serial", ModuleType("serial")),
        ("serial.tools", tools),
        ("serial.tools.list_ports", listed),
    ):
        monkeypatch.setitem(sys.modules, name, module)
    assert ports() == {"COM1": 0, "COM7": 0x2341}
    monkeypatch.setitem(sys.modules, "serial.tools.list_ports", None)
    with pytest.raises(BadInput, match=r"pyserial is needed: pip install 'upright\[rig\]'"):
        ports()
