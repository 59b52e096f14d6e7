"""A rig made of the compiled simulator: encoders with counts, converter, drive with its delay and lag; time is virtual.

The motion is that of `control.trial`, one period at a time. A hand may hold it, push it and let it go, and its encoders
can be broken in all the ways that encoders break, so that whatever watches a rig can be seen to work.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from upright.basis import SIMULATED
from upright.control.trial import steps_in_period
from upright.errors import BadInput, nearest
from upright.records import Array
from upright.rig import Rig
from upright.rigs.board import Board
from upright.rigs.driver import Connection, Driver
from upright.rigs.protocol import Capabilities, Mode
from upright.simulation import choose
from upright.simulation.simulator import Simulator

_LAGS = 40
"""Time constants of the drive after which it has forgotten a command."""


class BrokenEncoders:
    """What encoders show of true counts, channel by channel, from the moment that they break; sound at first."""

    def __init__(self, channels: int) -> None:
        self._factor = [1.0] * channels
        self._bits = [0] * channels
        self._slip = [0.0] * channels
        self._true: list[float] = []
        self._shown: list[float] = [0.0] * channels

    def dead(self, channel: int) -> None:
        """Its counter stands still."""
        self._factor[channel] = 0.0

    def scaled(self, channel: int, factor: float) -> None:
        """It shows a factor times the motion; -1 with its channels swapped."""
        self._factor[channel] = factor

    def lost(self, channel: int, counts: int) -> None:
        """So many counts are missed at once."""
        self._shown[channel] -= counts

    def slipping(self, channel: int, counts: float) -> None:
        """It loses so many counts more with every sample, as a coupling that slips or a zero that drifts."""
        self._slip[channel] = counts

    def wrapped(self, channel: int, bits: int) -> None:
        """Its counter has only so many bits, and nobody unwraps it."""
        self._bits[channel] = bits

    def show(self, true: list[float]) -> tuple[int, ...]:
        """Counts as shown, of true ones with their fractions."""
        if not self._true:
            self._true, self._shown = list(true), list(true)
        for i, now in enumerate(true):
            self._shown[i] += self._factor[i] * (now - self._true[i]) - self._slip[i]
            self._true[i] = now
        out = [math.floor(s + 0.5) for s in self._shown]
        return tuple(_wrap(n, bits) if bits else n for n, bits in zip(out, self._bits, strict=True))


def _wrap(count: int, bits: int) -> int:
    half = 1 << (bits - 1)
    return (count + half) % (2 * half) - half


class TwinPort:
    """The board of a twin, at rest at an equilibrium when it is made.

    Its drive does not trip: moments at which one went on or off belong to a record.

    Parameters
    ----------
    rig : Rig
        As it truly is.
    at : str, optional
        Equilibrium; the first of the plant when empty.
    full_scale : float, optional
        Of the converter [command unit]; twice the drive's limit when omitted.
    """

    def __init__(self, rig: Rig, at: str = "", full_scale: float | None = None) -> None:
        self.rig = rig
        drive = {n: v for n, v in rig.drive.items() if n not in ("actuator.start", "actuator.end")}
        values = {**rig.plant.parameters(), **drive}
        derived = rig.plant.derived_for(values)
        flavour = choose(derived, values)
        flavour = replace(flavour, carried=bool(flavour.dahl or flavour.relaxation))
        self._stepper = Simulator(derived=derived, flavour=flavour, dt=rig.period, substeps=steps_in_period(rig))
        self._table = self._stepper.table(values, 1)
        reach = math.ceil(rig.delay / rig.period) + math.ceil(_LAGS * rig.lag / rig.period) + 2
        self._commands = np.zeros((reach + 1, 1))
        self._start = np.array([reach], dtype=np.int64)
        self._full_scale = full_scale or 2.0 * rig.limit
        self._per = np.array(rig.per_unit) * rig.shown
        self.x: Array = np.array(self.rig.plant.state(at or next(iter(rig.plant.equilibria))), dtype=np.float64)
        self._carried = np.zeros(self._stepper.carried)
        self._felt = self.x[0::2].copy()
        self._origin = (0,) * len(rig.per_unit)
        self.encoders = BrokenEncoders(len(rig.per_unit))
        self._held, self._enabled, self._command, self._periods = False, False, 0.0, 0

    def open(self) -> Capabilities:
        """What there is."""
        rig = self.rig
        # a converter without steps still puts out whole numbers: 24 bits are finer than any drive follows
        steps = round(self._full_scale / rig.converter) if rig.converter else 1 << 23
        return Capabilities(
            name=f"the twin of {rig.name}", coordinates=rig.outputs, counts=rig.per_unit,
            command_unit=rig.unit, full_scale=steps * rig.converter if rig.converter else self._full_scale, steps=steps,
            period=rig.period, modes=frozenset({Mode.HOST, Mode.MCU}), virtual=True, hardware=False,
        )  # fmt: skip

    def write(self, command: float) -> None:
        """Put a command out."""
        self._command = command

    def enable(self, on: bool) -> None:
        """Switch the power stage; what is off drives nothing."""
        self._enabled = on

    def advance(self) -> float:
        """Move for a period."""
        self._commands[:-1] = self._commands[1:]
        self._commands[-1] = self._command if self._enabled else 0.0
        if not self._held:
            x0 = np.concatenate([self.x, self._carried])[:, None]
            after = self._stepper.run(self._table, x0, self._commands, samples=2, start=self._start)[1, :, 0]
            self.x, self._carried = after[: self.x.size].copy(), after[self.x.size :].copy()
        self._periods += 1
        return self._periods * self.rig.period

    def read(self) -> tuple[int, ...]:
        """Counts, with whatever is wrong with the encoders."""
        q, mounting = self.x[0::2], self.rig.mounting
        if mounting is not None:
            half = np.array(mounting.play) / 2
            self._felt = np.minimum(np.maximum(self._felt, q - half), q + half)
            q = mounting.turned(self._felt)
        true: list[float] = (q * self._per).tolist()
        return tuple(n - zero for n, zero in zip(self.encoders.show(true), self._origin, strict=True))

    def zero(self) -> None:
        """Count from here on."""
        self._origin = tuple(n + zero for n, zero in zip(self.read(), self._origin, strict=True))

    def close(self) -> None:
        """Nothing is held open."""

    def hold(self, at: str, away: ArrayLike = 0.0) -> None:
        """A hand holds it somewhere: deviation of the states from an equilibrium, shape (states,)."""
        self.x = np.asarray(self.rig.plant.state(at), dtype=np.float64) + np.asarray(away, dtype=np.float64)
        self._carried = np.zeros(self._stepper.carried)
        self._held = True

    def let_go(self) -> None:
        """The hand is taken away."""
        self._held = False

    def push(self, speeds: ArrayLike) -> None:
        """A tap adds to the speeds of the coordinates [rad/s or m/s]."""
        self.x = self.x.copy()
        self.x[1::2] += np.asarray(speeds, dtype=np.float64)


def _open(to: Connection) -> Board:
    zero = to.zero if to.zero is not None and to.zero in to.model.plant.equilibria else ""
    return Board(TwinPort(_wired(to.truth, to.board), zero))


def _wired(rig: Rig, board: Mapping[str, Any]) -> Rig:
    """The rig with the faults of its wiring that [board] lists: by ``drive`` or coordinate, times what is right.

    Raises
    ------
    BadInput
        When one names nothing of the rig, or is no factor.
    """
    names = [c.name for c in rig.plant.coordinates]
    for name, factor in board.items():
        if name not in ("drive", *names):
            raise BadInput(f"[board] of a twin has factors of drive, {', '.join(names)}; {nearest(name, names)}")
        if isinstance(factor, bool) or not isinstance(factor, int | float) or not math.isfinite(factor):
            raise BadInput(f"[board] {name} of a twin is a factor such as -1 or 0.5, got {factor!r}.")
    shown = [s * float(board.get(n, 1.0)) for n, s in zip(names, rig.shown, strict=True)]
    return replace(rig, gain=rig.gain * float(board.get("drive", 1.0)), scales=tuple(shown)) if board else rig


DRIVER = Driver(name="twin", order=10, open=_open, performed=SIMULATED)
