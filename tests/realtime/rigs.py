"""Rigs that other processes make: a twin whose output stands in a file, where whoever outlives the process reads it."""

from __future__ import annotations

import mmap
import struct
from dataclasses import replace
from pathlib import Path

from upright.experiments.makes import make_rig
from upright.gains import feedback, filtered, place
from upright.realtime.session import Stage
from upright.rigs import Board, Limits, TwinPort
from upright.rigs.supervisor import Duty, Supervisor

RIG = make_rig("furuta")
MODEL = RIG.linear("inverted")
SAMPLED = MODEL.to_sampled(RIG.period, RIG.delay / RIG.period)
LAW = feedback(
    filtered(SAMPLED, 0.5), place(MODEL.A, MODEL.B, [-4.1484 + 1.6341j, -4.1484 - 1.6341j, -16.8545, -3.2220]).K
)
LIMITS = Limits(travel=(6.0, 1e9), speed=(1e9, 1e9), start=(6.0, 1e9), command=RIG.limit, watchdog=1.0)
_OUT = struct.Struct("<dqq")  # command, power stage, writes


class WitnessedPort(TwinPort):
    """A twin that shows what it puts out in a file."""

    def __init__(self, path: Path):
        super().__init__(RIG)
        self._file = open(path, "r+b")  # noqa: SIM115
        self._memory = mmap.mmap(self._file.fileno(), _OUT.size)
        self._writes = 0

    def open(self):
        """A twin that is taken for a rig by the clock on the wall."""
        return replace(super().open(), virtual=False)

    def write(self, command):
        super().write(command)
        self._show()

    def enable(self, on):
        super().enable(on)
        self._show()

    def _show(self):
        self._writes += 1
        self._memory[:] = _OUT.pack(self._command, int(self._enabled), self._writes)


def put_out(path: Path) -> tuple[float, int, int]:
    """What the file says: command, power stage, number of writes."""
    return _OUT.unpack(path.read_bytes())


def witnessed(path: Path) -> Stage:
    """A stage whose output can be read after the death of its process."""
    port = WitnessedPort(path)
    duty = Duty(limits=LIMITS, model=RIG, at="inverted", zero="hanging", lean=0.5, near=0.2)
    return Stage(
        supervisor=Supervisor(Board(port), duty), bring=lambda: port.hold("inverted", [0.0, 0.0, 0.05, 0.0]),
        let_go=port.let_go, units=("rad", "rad"),
    )  # fmt: skip
