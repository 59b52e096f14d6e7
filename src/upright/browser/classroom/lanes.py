"""Many rigs under one law, each beginning, tapped and stopped by itself, stepped side by side by the compiled kernel.

The whole tick of a rig is the kernel's: encoders, law, converter, limit, delay, drive, plant. So a call takes all rigs
on by several ticks, and what is read and written between two calls is little.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upright.control.trial import steps_in_period
from upright.errors import BadInput
from upright.laws import Law
from upright.records import Array
from upright.rig import Rig
from upright.simulation import Simulator, choose
from upright.simulation.kernel.compiled import WIDTH
from upright.simulation.simulator import aligned

_FAR = 1e9
"""Beyond which nothing is counted [rad or m]: of what diverged, and of lanes that have not moved yet."""


@dataclass(frozen=True, kw_only=True, eq=False)
class LaneTicks:
    """Ticks of all rigs, one after the other.

    Attributes
    ----------
    counts : int array, shape (ticks, rigs, coordinates)
    command : array, shape (ticks, rigs)
        Of each tick, rounded and limited; NaN in a rig that diverged.
    """

    counts: NDArray[np.int64]
    command: Array


class Lanes:
    """Rigs at rest, each until it is begun.

    Parameters
    ----------
    rigs : sequence of Rig
        As they truly are: of one plant, drive and encoders, with numbers of their own.
    at, zero : str
        Equilibrium that is held, and the one at which encoders are zeroed and a rig rests.
    law : Law
        About its target as the encoders show it, with the converter and the limit of the rigs.
    ticks : int
        That a call of `go` takes.

    Attributes
    ----------
    busy : bool array, shape (rigs,)
        Which of them have begun.
    followed : array, shape (rigs, ticks)
        Reference of each at each tick of the next call.
    plays : bool
        Whether its law has a reference, through which a signal can be put out.

    Raises
    ------
    BadInput
        When the encoders differ.
    """

    def __init__(self, rigs: Sequence[Rig], at: str, zero: str, law: Law, ticks: int) -> None:
        first = rigs[0]
        if any(rig.mounting is not None or rig.per_unit != first.per_unit or np.any(rig.shown != 1.0) for rig in rigs):
            raise BadInput("the rigs of a class have the same encoders, counted and mounted as they are said to be.")
        self.at, self.ticks, self.size = at, ticks, len(rigs)
        self.tick = ticks  # with sample 0 the kernel would begin anew
        self._plant, self._zero, self._rigs = first.plant, zero, rigs
        self._per = np.array(first.per_unit)
        each = [{**rig.plant.parameters(), **rig.drive} for rig in rigs]
        values = {name: np.array([v[name] for v in each]) for name in each[0]}
        zeroed = np.array(list(self._plant.equilibrium(zero).values()))
        self._origin = zeroed
        # the kernel's coordinates are the plant's, the law's those of the encoders
        target = np.asarray(law.target, dtype=np.float64) + zeroed
        self._references = law.signal().shape[1]
        signal = np.zeros((len(rigs) * ticks, self._references)) if self._references else None
        loop = replace(law, target=target, references=signal, delay=0.0, resolution=1.0 / np.abs(self._per))
        derived = self._plant.derived_for(values)
        self._stepper = Simulator(
            derived=derived, flavour=choose(derived, values, loop=loop), dt=first.period,
            substeps=max(steps_in_period(rig) for rig in rigs), loop=loop,
        )  # fmt: skip
        self._table = self._stepper.table(values, len(rigs))
        rest = np.repeat(np.asarray(self._plant.state(zero))[:, None], len(rigs), axis=1)
        self._call = self._stepper.call(self._table, rest, samples=ticks, width=WIDTH)
        self._go = self._stepper.going_on(self._call, WIDTH)
        self._work = [aligned(self._call.room) for _ in range(self._call.blocks)]
        self._spare = aligned(self._call.room)
        self._rows, self._behind = self._stepper.rows, len(self._stepper.rows) * WIDTH
        self.followed, self.plays = np.zeros((len(rigs), ticks)), self._references > 0
        self.busy = np.zeros(len(rigs), dtype=np.bool_)
        for lane in range(len(rigs)):
            self.rest(lane)

    def begin(self, lane: int, away: Sequence[float]) -> None:
        """Let go of a rig away from what is held, under the law as it was given."""
        self._put(lane, np.asarray(self._plant.state(self.at)) + np.asarray(away))
        self.followed[lane] = 0.0
        self.busy[lane] = True

    def play(self, lane: int) -> None:
        """Put out from rest what the rig is given to follow, looking at nothing."""
        self.rest(lane)
        self._write(lane, f"lD0_{len(self._per)}", 1.0)
        self.followed[lane] = 0.0
        self.busy[lane] = True

    def rest(self, lane: int) -> None:
        """Bring a rig to rest, where nothing drives it."""
        self._put(lane, np.asarray(self._plant.state(self._zero)))
        for name in self._rows:
            if name.startswith(("lC", "lD")):
                self._write(lane, name, 0.0)
        self.busy[lane] = False

    def gains(self, lane: int, numbers: Sequence[float]) -> None:
        """Go on by these C and D of the law, row by row, with its memories as they are."""
        names = [name for of in ("lC", "lD") for name in self._rows if name.startswith(of)]
        for name, value in zip(names, numbers, strict=True):
            self._write(lane, name, value)

    def tap(self, lane: int, speeds: Sequence[float]) -> None:
        """Add to the speeds of a rig; what was stuck slips."""
        work, place = self._work[lane // WIDTH], lane % WIDTH
        for i, more in enumerate(speeds):
            at = self._rows[f"v{i}"] * WIDTH + place
            work[at] += more
            if more and f"s{i}" in self._rows:
                self._write(lane, f"s{i}", float(np.sign(work[at])))

    def follow(self, lane: int, reference: ArrayLike) -> None:
        """The law's first reference of a rig: one from now on, or that of each tick of the next call."""
        self.followed[lane] = reference

    def state(self, lane: int) -> Array:
        """Coordinates and speeds of a rig now."""
        names = [f"{c}{i}" for i in range(len(self._per)) for c in "qv"]
        work = self._work[lane // WIDTH]
        return np.array([work[self._rows[name] * WIDTH + lane % WIDTH] for name in names])

    def go(self) -> LaneTicks:
        """Take all rigs on."""
        first, last = self.tick, self.tick + self.ticks
        if self._references:
            self._call.start[: self.size] = np.arange(self.size) * self.ticks - first
            self._call.references[:, 0] = self.followed.ravel()
        for block, work in enumerate(self._work):
            if self.busy[block * WIDTH : (block + 1) * WIDTH].any():
                self._go(block, first, last, work)
        self.tick = last
        n, out = len(self._per), self._call.out[:, :, : self.size]
        q = out[:, 0 : 2 * n : 2].transpose(0, 2, 1)
        counts = np.floor(np.clip(np.nan_to_num(q), -_FAR, _FAR) * self._per + 0.5)
        zero = np.floor(self._origin * self._per + 0.5)
        return LaneTicks(counts=(counts - zero).astype(np.int64), command=out[:, 2 * n].copy())

    def _put(self, lane: int, state: Array) -> None:
        """A rig as the kernel would begin with it."""
        call = self._stepper.call(self._table[:, lane : lane + 1], state[:, None], samples=self.ticks, width=WIDTH)
        self._stepper.going_on(call, WIDTH)(0, 0, 0, self._spare)
        work, place = self._work[lane // WIDTH], lane % WIDTH
        work[place : self._behind : WIDTH] = self._spare[0 : self._behind : WIDTH]
        work[self._behind + place :: WIDTH] = 0.0  # commands still on their way

    def _write(self, lane: int, name: str, value: float) -> None:
        self._work[lane // WIDTH][self._rows[name] * WIDTH + lane % WIDTH] = value
