"""The twin's column: the compiled simulator behind the board that has no firmware."""

from __future__ import annotations

from typing import Any

import numpy as np

from upright.rig.makes import make_rig
from upright.rigs import Board, Fault, TwinPort

KNOWN, TRUTH = make_rig("furuta"), make_rig("furuta", 3)


class TracedPort(TwinPort):
    """A twin's board that notes what it truly puts out and does."""

    def __init__(self, rig: Any, at: str = "") -> None:
        super().__init__(rig, at)
        self.trace: list[tuple[float, ...]] = []
        self.strength, self.obeys, self.ticks_long, self.true_time = 1.0, True, 1, 0.0

    def write(self, command: float) -> None:
        if self.obeys:
            super().write(self.strength * command)

    def enable(self, on: bool) -> None:
        if self.obeys:
            super().enable(on)

    def advance(self) -> float:
        for _ in range(self.ticks_long - 1):  # its timer is slow, and it counts its ticks all the same
            super().advance()
            self._periods -= 1
        t = super().advance()
        self.true_time += self.ticks_long * self.rig.period
        self.trace.append((t, float(self._commands[-1, 0]), *self.x[0::2].tolist()))
        return t


class TwinHazards:
    """A twin that is broken."""

    def __init__(self, truth: Any = TRUTH) -> None:
        self.port = TracedPort(truth)
        self.rig: Any = Board(self.port)
        self.encoders = self.port.encoders

    def lift(self, tilt: float, arm: float = 0.0) -> None:
        self.port.hold("inverted", [arm, 0.0, tilt, 0.0])

    def hold_fast(self) -> None:
        self.port.hold(next(iter(self.port.rig.plant.equilibria)))

    def let_go(self) -> None:
        self.port.let_go()

    def tap(self, speed: float) -> None:
        self.port.push([0.0, speed])

    def silence(self, seconds: float) -> None:
        self.rig.alone(seconds)

    def faults(self) -> Fault:
        return self.rig.sample.faults

    def history(self) -> np.ndarray:
        return np.array(self.port.trace)

    def close(self) -> None:
        self.rig.close()
