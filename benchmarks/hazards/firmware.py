"""The firmware's columns: the program of a board in a process with a pendulum inside, at the end of a pty.

Time is virtual and passes as it does on a bench: a tick for every exchange that is answered, and as many ticks as the
host waits for an answer that does not come. The host does not know of it and repeats what it asks as it does on a wire.
Friction is viscous, the drive has neither delay nor lag: whatever else the twin has is not simulated here.
"""

from __future__ import annotations

import math
import tempfile
import threading
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.boards import STEP, Board, build, plant, rig_on
from benchmarks.hazards import twin
from upright.rig import Rig
from upright.rigs import Fault
from upright.rigs.line import TerminalLine
from upright.rigs.wire import Kind, Parser, pack

PERIOD = 1e-3
ANSWERED_WITHIN = 1.0
"""After which the process that simulates a board will not answer any more [s of the wall]."""
POLLED = 2e-4  # s
PUT = 150
"""Ticks in which encoders have caught up with a rig that was put somewhere else."""
_PAUSE = threading.Event()
_folder = tempfile.TemporaryDirectory(prefix="upright-firmware-")


@cache
def unable(target: str, needs: str) -> str:
    """Why a target cannot be built here; builds it when it can."""
    return build(target, Path(_folder.name), needs)


def no_host() -> str:
    """Why the host's port cannot run here."""
    return unable("host", "cc")


def no_avr() -> str:
    """Why the ATmega2560's cannot."""
    return unable("avr", "avr-gcc") or unable("simrig", "cc simavr")


def simple(rig: Rig) -> Rig:
    """As far as the board's pendulum has it."""
    free = dict.fromkeys(("b_1c", "b_2c"), 0.0)
    return rig.replace(plant=rig.plant.replace(**free), period=PERIOD, delay=0.0, lag=0.0)


KNOWN, TRUTH = simple(twin.KNOWN), simple(twin.TRUTH)


class PatientLine:
    """A line on which time passes while the host waits; it may spoil bytes, lose the next requests, or be cut."""

    def __init__(self, on: FirmwareHazards, path: str) -> None:
        self.name, self.waited = "its port", 0.0
        self.spoils, self.spoiled, self.loses, self.cut = 0.0, 0, 0, False
        self.sent: list[bytes] = []
        self._on, self._line = on, TerminalLine(path)
        self._rng = np.random.default_rng(5)
        self._expected = self._greeted = False
        self._asked = self._quiet = 0.0

    def clock(self) -> float:
        return self.waited

    def write(self, data: bytes) -> None:
        self.sent.append(data)
        (asked,) = Parser().feed(data)
        self._greeted = asked.kind == Kind.HELLO
        self._expected, self._asked, self._quiet = False, self._on.look(), 0.0
        if self.loses:
            self.loses -= 1
        elif not self.cut:
            sent = self._over(data)
            self._expected = sent == data
            self._line.write(sent)

    def read(self, patience: float) -> bytes:
        data = b""
        while self._expected and data.count(0) < 2:  # one in front of a frame, and one behind it
            more = self._line.read(ANSWERED_WITHIN)
            data += more
            self._expected = bool(more)
        self._expected = False
        if not data:
            self.waited += patience
            self._quiet += patience
            self._on.look()  # what was written is heard between this and the next; simavr lets time pass by it
            self._on.pass_until(self._asked + 1e3 * self._quiet)
            return b""
        self._on.look()
        return self._over(_by_the_clock(data) if self._greeted else data)

    def close(self) -> None:
        self._line.close()

    def _over(self, data: bytes) -> bytes:
        """With one bit of each spoiled byte flipped."""
        if not self.spoils:
            return data
        bytes_ = np.frombuffer(data, dtype=np.uint8)
        hit = self._rng.random(len(data)) < self.spoils
        self.spoiled += int(hit.sum())
        return (bytes_ ^ np.where(hit, 1 << self._rng.integers(8, size=len(data)), 0).astype(np.uint8)).tobytes()


def _by_the_clock(greeting: bytes) -> bytes:
    """The greeting of a board that does not say that its time is virtual."""
    (said,) = Parser().feed(greeting)
    return pack(said.kind, said.sequence, said.session, said.body[:9] + b"\0" + said.body[10:])


class Encoders:
    """Those of a board, broken by lines to it."""

    def __init__(self, board: Board) -> None:
        self._board = board
        self._slips = (0, 0.0, 0.0)

    def slipping(self, channel: int, counts: float) -> None:
        """It loses so many counts more with every tick."""
        self._slips = channel, counts, 0.0

    def tick(self) -> None:
        """A tick of the board is over."""
        channel, rate, behind = self._slips
        if rate and abs(behind + rate) >= 1.0:
            self.lost(channel, math.trunc(behind + rate))
        self._slips = channel, rate, math.fmod(behind + rate, 1.0)

    def dead(self, channel: int) -> None:
        self._board.do(f"dead {channel}")

    def scaled(self, channel: int, factor: float) -> None:
        self._board.do(f"scale {channel} {factor}")

    def lost(self, channel: int, counts: int) -> None:
        self._board.do(f"lose {channel} {counts}")

    def at(self, channel: int, counter: int) -> None:
        """The counter's own number."""
        self._board.do(f"wrap {channel} {counter % 2**32}")


class FirmwareHazards:
    """Firmware that is broken, and its rig with it."""

    line: PatientLine

    def __init__(self, *command: str | Path, by_the_wall: bool = False) -> None:
        self._by_the_wall = by_the_wall
        self.board = Board(*command, *plant(TRUTH.plant.parameters(), TRUTH.gain))
        self.encoders = Encoders(self.board)
        self._trace: list[tuple[float, ...]] = []
        self._output = 0.0
        self.rig: Any = self.rejoin()

    def look(self) -> float:
        """Note how it truly is; its time [ms]."""
        tick, psi, _, theta, _, command, enabled, _ = self.board.state()
        if not self._trace or 1e-3 * tick > self._trace[-1][0]:
            self._trace.append((1e-3 * tick, self._output, psi, theta))
            self.encoders.tick()
        self._output = STEP * command * enabled
        return tick

    def lift(self, tilt: float, arm: float = 0.0) -> None:
        upright = TRUTH.plant.equilibrium("inverted")["theta"]
        self.board.do(f"put {arm} 0 {upright + tilt!r} 0", "hold")
        self.silence(PUT * PERIOD)

    def hold_fast(self) -> None:
        self.board.do("hold")

    def let_go(self) -> None:
        self.board.do("release")

    def tap(self, speed: float) -> None:
        self.board.do(f"kick {speed}")

    def silence(self, seconds: float) -> None:
        self.pass_until(self.look() + round(seconds / PERIOD))

    def pass_until(self, then: float) -> None:
        """Time passes until then [ms]."""
        while self.look() < then - 0.5:
            if self._by_the_wall:
                _PAUSE.wait(POLLED)
            else:
                self.board.do("run 1")

    def rejoin(self) -> Any:
        """The rig of a new host."""
        self.line = PatientLine(self, self.board.port)
        self.rig = rig_on(self.line, clock=self.line.clock, patience=1.0)
        return self.rig

    def cut(self) -> None:
        """Nothing comes through any more."""
        self.line.cut = True

    def faults(self) -> Fault:
        self.line.cut, self.line.spoils = False, 0.0
        return self.rig.exchange(0.0).faults

    def history(self) -> np.ndarray:
        return np.array(self._trace)

    def close(self) -> None:
        self.rig.close()
        self.board.close()


def host_port(*, by_the_wall: bool = False) -> FirmwareHazards:
    """The firmware as a process of this machine, a tick whenever it is told; or 1 kHz by the clock on the wall."""
    return FirmwareHazards(
        Path(_folder.name) / "rig-host", *([] if by_the_wall else ["lockstep"]), by_the_wall=by_the_wall
    )


def atmega2560() -> FirmwareHazards:
    """The ATmega2560's own program under simavr, with quadrature edges and SPI frames."""
    return FirmwareHazards(Path(_folder.name) / "simrig", Path(_folder.name) / "atmega2560-analog.elf")
