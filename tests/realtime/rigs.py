"""Rigs that other processes make: a twin whose output stands in a file, where whoever outlives the process reads it."""

from __future__ import annotations

import mmap
import os
import signal
import struct
from dataclasses import replace
from pathlib import Path

from upright.gains import feedback, filtered, place
from upright.realtime.session import Stage
from upright.rig.makes import make_rig
from upright.rigs import Board, Limits, TwinPort
from upright.rigs.supervisor import Duty, Supervisor

RIG = make_rig("furuta")
MODEL = RIG.linear("inverted")
SAMPLED = MODEL.to_sampled(RIG.period, RIG.delay / RIG.period)
LAW = feedback(
    filtered(SAMPLED, 0.5), place(MODEL.A, MODEL.B, [-4.1484 + 1.6341j, -4.1484 - 1.6341j, -16.8545, -3.2220]).K
)
LIMITS = Limits(travel=(6.0, 1e9), speed=(1e9, 1e9), start=(6.0, 1e9), command=RIG.limit, watchdog=1.0)
_OUT = struct.Struct("<dqqq")  # command, power stage, writes, of these orphaned drives
BLANK = bytes(_OUT.size)


class WitnessedPort(TwinPort):
    """A twin that shows what it puts out in a file; with the id of its parent, also what it puts out after its death.

    It counts as driven when its power stage is switched on, or a command that is not zero is put out under power.
    """

    def __init__(self, path: Path, parent: int = 0):
        super().__init__(RIG)
        self._file = open(path, "r+b")  # noqa: SIM115
        self._memory = mmap.mmap(self._file.fileno(), _OUT.size)
        self._writes, self._orphaned, self._parent = 0, 0, parent

    def open(self):
        """A twin that is taken for a rig by the clock on the wall."""
        return replace(super().open(), virtual=False)

    def write(self, command):
        super().write(command)
        self._show(self._enabled and command != 0.0)

    def enable(self, on):
        super().enable(on)
        self._show(on)

    def _show(self, driven):
        self._writes += 1
        self._orphaned += bool(driven and self._parent and os.getppid() != self._parent)
        self._memory[:] = _OUT.pack(self._command, int(self._enabled), self._writes, self._orphaned)


class FatalPort(WitnessedPort):
    """Kills its parent at one of its calls; deaf to SIGTERM where `deaf`, as on a system that sends none."""

    def __init__(self, path: Path, parent: int, fatal: int, deaf: bool):
        super().__init__(path, parent)
        self._fatal, self._calls = fatal, 0
        if deaf:
            signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGTERM])

    def _called(self):
        self._calls += 1
        if self._calls == self._fatal:
            kill_parent()

    def write(self, command):
        self._called()
        super().write(command)

    def enable(self, on):
        self._called()
        super().enable(on)

    def advance(self):
        self._called()
        return super().advance()

    def read(self):
        self._called()
        return super().read()


def kill_parent():
    """Comes back when it is dead."""
    parent = os.getppid()
    os.kill(parent, signal.SIGKILL)
    while os.getppid() == parent:
        os.sched_yield()


class FatalBaggage:
    """Kills the parent as it is unpacked: after the loop's process began, and before anything of upright runs in it."""

    def __reduce__(self):
        return kill_parent, ()


def put_out(path: Path) -> tuple[float, int, int, int]:
    """What the file says: command, power stage, number of writes, and of those that drove after the parent's death."""
    return _OUT.unpack(path.read_bytes())


def staged(port: TwinPort) -> Stage:
    """A run that holds it upright."""
    duty = Duty(limits=LIMITS, model=RIG, at="inverted", zero="hanging", lean=0.5, near=0.2)
    return Stage(
        supervisor=Supervisor(Board(port), duty), bring=lambda: port.hold("inverted", [0.0, 0.0, 0.05, 0.0]),
        let_go=port.let_go, units=("rad", "rad"),
    )  # fmt: skip


def witnessed(path: Path, parent: int = 0, *_baggage: object) -> Stage:
    """A stage whose output can be read after the death of its process."""
    return staged(WitnessedPort(path, parent))


def fatal(path: Path, parent: int, call: int, deaf: bool) -> Stage:
    """A stage whose port kills its parent at a call."""
    return staged(FatalPort(path, parent, call, deaf))
