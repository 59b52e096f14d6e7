"""Do the ports of vendors' boards do what the protocol asks, with a kit that only writes down what it is told?"""

from __future__ import annotations

import sys
from types import ModuleType, SimpleNamespace

import pytest

from upright.rig.makes import make_rig
from upright.rigs import Capabilities, Mode
from upright.rigs.driver import Connection
from upright.rigs.vendor.nidaqmx import NidaqmxPort
from upright.rigs.vendor.quanser import QuanserPort

ABOUT = Capabilities(
    name="bench", coordinates=("psi", "theta"), counts=(2000.0, 2000.0), command_unit="V", full_scale=10.0,
    steps=32768, period=1e-3, modes=frozenset({Mode.HOST, Mode.MCU}), virtual=True, hardware=False,
)  # fmt: skip
"""As a file may have it, wrong about what only the board knows."""


class Task:
    """Of NI-DAQmx: one channel, and what was written to it."""

    made: list[Task] = []

    def __init__(self):
        self.written, self.counter, self.closed = [], 0, False
        self.channel, self.range, self.set_up = "", (), {}
        channels = SimpleNamespace(
            add_ci_lin_encoder_chan=self._add, add_ao_voltage_chan=self._add, add_do_chan=self._add
        )
        self.ci_channels = self.ao_channels = self.do_channels = channels
        Task.made.append(self)

    def _add(self, channel, min_val=None, max_val=None, **set_up):
        self.channel, self.range, self.set_up = channel, (min_val, max_val), set_up

    def start(self):
        pass

    def read(self):
        return float(self.counter)

    def write(self, value):
        self.written.append(value)

    def close(self):
        self.closed = True


@pytest.fixture
def daqmx(monkeypatch):
    kit, constants = ModuleType("nidaqmx"), ModuleType("nidaqmx.constants")
    vars(kit)["Task"] = Task
    vars(constants).update(EncoderType=SimpleNamespace(X_4=1), LengthUnits=SimpleNamespace(TICKS=2))
    monkeypatch.setitem(sys.modules, "nidaqmx", kit)
    monkeypatch.setitem(sys.modules, "nidaqmx.constants", constants)
    Task.made = []
    return NidaqmxPort(ABOUT, "Dev1")


def test_a_daqmx_board_is_hardware_without_a_loop_of_its_own_and_opens_at_zero(daqmx):
    about = daqmx.open()
    # something moves, by the clock on the wall, and only a host can hold it
    assert (about.hardware, about.virtual, about.modes) == (True, False, frozenset({Mode.HOST}))
    channels = {task.channel: task for task in Task.made}
    assert list(channels) == ["Dev1/ctr0", "Dev1/ctr1", "Dev1/ao0", "Dev1/port0/line0"]
    assert channels["Dev1/ao0"].written == [0.0]
    assert channels["Dev1/ao0"].range == (-10.0, 10.0)
    assert channels["Dev1/port0/line0"].written == [False]


def test_a_daqmx_board_counts_every_edge_by_ones_from_zero(daqmx):
    """As NI-DAQmx names it: quadrature decoding X4 in ticks, one a pulse, whose first reading is 0."""
    daqmx.open()
    edges = {"decoding_type": 1, "units": 2, "dist_per_pulse": 1.0, "initial_pos": 0.0}
    assert [task.set_up for task in Task.made] == [edges, edges, {}, {}]


def test_a_daqmx_board_is_let_go_at_zero_and_off(daqmx):
    daqmx.open()
    daqmx.enable(True)
    daqmx.write(-3.0)
    daqmx.close()
    daqmx.close()
    analog, digital = Task.made[2:]
    assert analog.written == [0.0, -3.0, 0.0]
    assert digital.written == [False, True, False]
    assert all(task.closed for task in Task.made)


def test_counters_of_32_bits_run_over_without_a_jump(daqmx):
    daqmx.open()
    psi, theta = Task.made[:2]
    psi.counter, theta.counter = 2**32 - 5, 100
    daqmx.zero()
    assert daqmx.read() == (0, 0)
    psi.counter, theta.counter = 7, 2**32 - 100  # on by 12, and back by 200
    assert daqmx.read() == (12, -200)


class Card:
    """Of Quanser's kit: calls in their order."""

    def __init__(self):
        self.calls = []

    def __getattr__(self, name):
        def called(*given):
            self.calls.append((name, *(list(g) if hasattr(g, "typecode") else g for g in given)))
            if name == "read_encoder":
                given[2][:] = type(given[2])("i", [3, -4])

        return called


def test_a_quanser_board_opens_at_zero_and_its_watchdog_runs_while_its_drive_is_on(monkeypatch):
    """One that nobody feeds while a person is waited for has expired by the time that the drive goes on."""
    card, kit = Card(), ModuleType("quanser.hardware")
    vars(kit)["HIL"] = lambda: card
    monkeypatch.setitem(sys.modules, "quanser", ModuleType("quanser"))
    monkeypatch.setitem(sys.modules, "quanser.hardware", kit)
    port = QuanserPort(ABOUT, "q2_usb", watchdog=0.03)
    about = port.open()
    assert (about.hardware, about.virtual, about.modes) == (True, False, frozenset({Mode.HOST}))
    zero, off = ("write_analog", [0], 1, [0.0]), ("write_digital", [0], 1, [0])
    assert card.calls == [("open", "q2_usb", "0"), zero, off]
    card.calls.clear()
    port.enable(True)
    port.write(-2.5)
    watched = [("watchdog_clear",), ("watchdog_start", 0.03), ("write_digital", [0], 1, [1])]
    assert card.calls == [*watched, ("watchdog_reload",), ("write_analog", [0], 1, [-2.5])]
    assert port.read() == (3, -4)
    card.calls.clear()
    port.close()
    port.close()
    assert card.calls == [("watchdog_reload",), zero, off, ("watchdog_stop",), ("close",)]


def test_a_board_s_converter_is_of_ten_volts_and_sixteen_bits_where_its_file_does_not_say():
    """And an encoder that counts the other way has counts below zero; the rest of [board] is the port's affair."""
    rig = make_rig("furuta")
    plain = Connection(kind="nidaqmx", model=rig, truth=rig, board={"device": "Dev1"})
    about, rest = plain.capabilities()
    assert (about.name, about.coordinates, about.counts) == ("nidaqmx", ("psi", "theta"), rig.per_unit)
    assert (about.full_scale, about.steps, about.period) == (10.0, 2**15, rig.period)  # to either side
    assert (about.command_unit, about.modes, rest) == ("V", frozenset({Mode.HOST}), {"device": "Dev1"})
    turned = Connection(kind="quanser", name="bench 3", model=rig, truth=rig, board={"full_scale": 12, "steps": 2048.0},
                        reversed=frozenset({"theta"}))  # fmt: skip
    about, rest = turned.capabilities()
    assert about.name == "bench 3"
    assert about.counts == (rig.per_unit[0], -rig.per_unit[1])
    assert (about.full_scale, about.steps, rest) == (12.0, 2048, {})
