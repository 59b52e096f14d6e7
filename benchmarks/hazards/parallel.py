"""Many twins in loops of their own, a tick of all of them at a time: hours of virtual time in minutes.

Each lane is the twin of `rigs/twin.py` with its law: encoders with play and off centre, converter, delay and lag. The
kernel steps all lanes in one call, which reads each lane's commands from a stretch of its own of one signal.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from upright.control.trial import steps_in_period
from upright.laws import Law
from upright.records import Array
from upright.rig import Rig
from upright.simulation import choose
from upright.simulation.simulator import Simulator

_LAGS = 40


class Twins:
    """Twins of one plant's class, upright and at rest in the middle when they are made, a lane each.

    Parameters
    ----------
    rigs : sequence of Rig
        As they truly are; of one plant's class and one period.
    law : Law
        On deviations from what is held.
    limit : float
        Largest command that the supervisor lets pass.
    """

    def __init__(self, rigs: Sequence[Rig], law: Law, limit: float) -> None:
        first, lanes = rigs[0], len(rigs)
        self.rigs, self.law, self.limit, self.period = tuple(rigs), law, limit, first.period
        tables = [{**r.plant.parameters(), **{k: v for k, v in r.drive.items() if not k.endswith((".start", ".end"))}}
                  for r in rigs]  # fmt: skip
        values = {name: np.array([t[name] for t in tables]) for name in tables[0]}
        derived = first.plant.derived_for(tables[0])
        flavour = choose(derived, values)
        self._stepper = Simulator(derived=derived, flavour=flavour, dt=first.period, substeps=steps_in_period(first))
        self._table = self._stepper.table(values, lanes)
        self._rows = max(math.ceil(r.delay / r.period) + math.ceil(_LAGS * r.lag / r.period) for r in rigs) + 3
        self._commands = np.zeros((lanes, self._rows))
        self._start = np.arange(1, lanes + 1, dtype=np.int64) * self._rows - 1
        self._point = first.plant.state("inverted")
        self.x: Array = np.repeat(self._point[:, None], lanes, axis=1)
        self._memory = np.empty(2 * (self.x.shape[0] + self._stepper.carried) * (lanes + 16))
        self.resolution = 1.0 / np.array(first.per_unit)[:, None]
        self.factor, self.slipped = np.ones((2, lanes)), np.zeros((2, lanes))
        """What a broken encoder shows of a motion, and by how much it has slipped."""
        self.supply = np.ones(lanes)
        """Share of its gain that each drive has."""
        half = [np.zeros(2) if r.mounting is None else np.array(r.mounting.play) / 2 for r in rigs]
        self._half = np.array(half).T
        none = {"off_centre": (0.0, 0.0), "phase": (0.0, 0.0), "turn": (1.0, 1.0)}
        mounts = [none if r.mounting is None else vars(r.mounting) for r in rigs]
        self._error, self._phase, turn = (np.array([m[k] for m in mounts]).T for k in ("off_centre", "phase", "turn"))
        self._per = math.tau / turn
        self._felt = self.x[0::2].copy()
        self._true: Array | None = None
        self._shown: Array = self._felt
        self._z = np.zeros((len(law.A), lanes))
        A, B, C, D = (m.reshape(m.shape[:2]) for m in (law.A, law.B, law.C, law.D))
        self._both = np.block([[A, B], [C, D]])
        self._begin = None if law.begin is None else np.asarray(law.begin)[:, : law.readings]
        self.away = self._read()
        self.references = np.zeros((self._both.shape[1] - len(A) - 2, lanes))

    def turned(self, motion: Array) -> Array:
        """What sound encoders show of a motion [rad or m]."""
        return motion + self._error * (np.sin(motion * self._per + self._phase) - np.sin(self._phase))

    def _read(self) -> Array:
        q = self.x[0::2]
        self._felt = np.minimum(np.maximum(self._felt, q - self._half), q + self._half)
        true = self.turned(self._felt) - self._point[0::2, None]
        if self._true is None:
            self._true, self._shown = true, true.copy()
        self._shown = self._shown + self.factor * (true - self._true)
        self._true = true
        return np.floor((self._shown + self.slipped) / self.resolution + 0.5) * self.resolution

    def lift(self, tilts: Sequence[float]) -> None:
        """A hand holds each pendulum leaning [rad], and the law begins."""
        self.x[2] = self._point[2] + np.asarray(tilts)
        self.away = self._read()

    def away_truly(self) -> Array:
        """Coordinates less what is held, shape (2, lanes)."""
        return self.x[0::2] - self._point[0::2, None]

    def command(self) -> Array:
        """The law's answer to what is shown now, shape (lanes,), rounded and limited."""
        n = len(self._z)
        w = np.vstack([self.away, self.references])
        if self._begin is not None:
            self._z, self._begin = self._z + self._begin @ self.away, None
        both = self._both @ np.vstack([self._z, w])
        self._z = both[:n]
        step = self.rigs[0].converter
        u = np.floor(both[n] / step + 0.5) * step if step else both[n]
        return np.clip(u, -self.limit, self.limit)

    def advance(self, command: Array, push: Array | None = None) -> None:
        """A period under these commands; before it, speeds that pushes add, shape (2, lanes)."""
        self._commands[:, :-1] = self._commands[:, 1:]
        self._commands[:, -1] = command * self.supply
        if push is not None:
            self.x[1::2] += push
        self.x = self._stepper.run(
            self._table, self.x, self._commands.reshape(-1, 1), samples=2, start=self._start, memory=self._memory
        )[1].copy()
        self.away = self._read()
