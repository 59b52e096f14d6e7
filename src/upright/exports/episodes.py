"""Many short runs of an identified rig side by side, each on another rig that the fit allows, step by step.

What a learner of a policy calls an environment: between two calls the command is held, and whoever ended begins anew.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from upright.errors import BadInput, nearest
from upright.exports.steps import substeps
from upright.laws.linear import Array
from upright.rig import Rig
from upright.rig.drive import GAIN, full_command
from upright.simulation import Simulator, choose

TASKS = ("balance", "swing_up")
NEAR = 0.05
"""Largest deviation of a state at the start [SI], that of the public CartPole-v1."""
FALLEN = math.radians(12)
"""Deviation at which a balanced pendulum counts as fallen, that of the public CartPole-v1."""
DRAWS = 1024
"""Rigs drawn from a fit's covariance, one of which every episode gets."""
EFFORT = 0.01
"""What full command costs of the reward of a swing-up, which is at most 1."""


class Episodes:
    """Runs of one rig in lanes.

    Parameters
    ----------
    rig : Rig
        Whose draws are the rigs that its fit allows; a rig without draws is the same at every reset.
    task : {"balance", "swing_up"}
        From close to the equilibrium until it falls, or from hanging.
    at : str
        Equilibrium to hold; the last that the plant names when empty.
    period : float
        For which a command is held [s].
    limit : float, optional
        Command that an action of 1 stands for; the rig's when omitted.
    travel : float, optional
        How far the driven body may go either way; the rig's when omitted, where it has one.

    Raises
    ------
    BadInput
        When the rig has no pendulum that could stand, or what its drive does cannot be stepped.
    """

    def __init__(
        self, rig: Rig, lanes: int, *, task: str = "balance", at: str = "", period: float = 0.02,
        limit: float | None = None, travel: float | None = None, threads: int = 1,
    ) -> None:  # fmt: skip
        if task not in TASKS:
            raise BadInput(f"a task is balance or swing_up, got '{task}'; {nearest(task, TASKS)}")
        if not 1e-4 <= period <= 1.0:
            raise BadInput(f"the period of an environment must be from 1e-4 to 1 s, got {period:g} s; 0.02 s is usual.")
        if lanes < 1:
            raise BadInput(f"an environment needs at least one rig, got {lanes}.")
        points, hardware = rig.plant.equilibria, rig.hardware
        at = at or list(points)[-1]
        if at not in points:
            raise BadInput(f"'{rig.name}' has no equilibrium '{at}'; {nearest(at, points)}")
        names = tuple(c.name for c in rig.plant.coordinates)
        self.target = np.array([rig.plant.equilibrium(at)[n] for n in names])
        self.turning = np.array([len({rig.plant.equilibrium(p)[n] for p in points}) > 1 for n in names])
        if not self.turning.any() or not rig.plant.inputs:
            raise BadInput(
                f"an environment needs a drive and a pendulum that hangs or stands, and a '{rig.name}' has none; "
                "simulate it with upright.simulate."
            )
        if hardware.value("relaxation", 0.0):
            raise BadInput(
                "an environment cannot simulate braking that builds up (actuator.relaxation), since it starts anew at "
                "every step; identify without it, or set it to 0 in the fit."
            )
        for what, value in (("limit", limit), ("travel", travel)):
            if value is not None and not 0 < value < 1e9:
                raise BadInput(f"the {what} of an environment must be above 0 and below 1e9, got {value:g}.")
        most = limit or min(hardware.value("limit", math.inf), full_command({**rig.more, GAIN: rig.gain}))
        if not math.isfinite(most):
            raise BadInput(
                "an environment needs the largest command: pass a limit, or state [actuator] limit in the study."
            )
        self.rig, self.lanes, self.task, self.period, self.limit, self.threads = rig, lanes, task, period, most, threads
        driven = names.index(rig.plant.inputs[0].on)
        self.travel = np.where(np.arange(len(names)) == driven, travel or hardware.value("travel", math.inf), math.inf)
        hanging = rig.plant.equilibrium(next(iter(points)))
        self.begin = self.target if task == "balance" else np.array([hanging[n] for n in names])
        self.x = np.zeros((2 * len(names), lanes))
        self.done = np.ones(lanes, dtype=np.bool_)
        self.steps = np.zeros(lanes, dtype=np.int64)
        self._commands = np.zeros((lanes, self._remembered + 1, len(rig.plant.inputs)))
        self._start = np.arange(lanes, dtype=np.int64) * (self._remembered + 1) + self._remembered
        self.params = self.simulator.table(self._values, lanes)

    @cached_property
    def _values(self) -> Mapping[str, float]:
        """The rig as identified; joints that deflect before they slide do so at once, as nothing remembers it."""
        rig, presliding = self.rig, {j.presliding for j in self.rig.plant.joints}
        values = {n: 0.0 if n in presliding else v for n, v in rig.plant.parameters().items()}
        drive = {f"actuator.{n}": rig.hardware.value(n, 0.0) for n in ("delay", "lag", "offset")}
        return {**values, **rig.more, **drive, GAIN: rig.gain, "actuator.limit": self.limit}

    @cached_property
    def simulator(self) -> Simulator:
        """What steps them; its steps are short enough for the fastest mode of the rig."""
        derived = self.rig.plant.derived_for(self._values)
        return Simulator(
            derived=derived, flavour=choose(derived, self._values), dt=self.period,
            substeps=substeps(self.rig, self.period),
        )  # fmt: skip

    @cached_property
    def _remembered(self) -> int:
        """Commands that delay and lag of the drive still hold: a lag has forgotten after 40 time constants."""
        late, lag = (self._values[f"actuator.{n}"] / self.period for n in ("delay", "lag"))
        return math.ceil(late) + math.ceil(40 * lag) + 2 if late or lag else 0

    @cached_property
    def _pool(self) -> tuple[NDArray[np.intp], Array]:
        """Rows of the parameters in which the rigs that the fit allows differ, and their values, one rig a column."""
        names = [*self.rig.plant.names(), GAIN]
        rows = [[getattr(plant, n) for n in self.rig.plant.names()] + [gain] for plant, gain in self.rig.draws]
        values = np.array(rows, dtype=np.float64).reshape(len(rows), len(names)).T
        differ = [i for i, row in enumerate(values) if row.size and np.ptp(row) > 0]
        places = np.array([self.simulator.names.index(names[i]) for i in differ], dtype=np.intp)
        return places[:, None], values[differ]

    def reset(self, which: NDArray[np.bool_], rng: np.random.Generator) -> None:
        """Begin anew in some lanes, each with a rig drawn from those that the fit allows."""
        lanes = np.flatnonzero(which)
        if not lanes.size:
            return
        rows, values = self._pool
        if rows.size:
            drawn = rng.integers(values.shape[1], size=lanes.size)
            self.params[rows, lanes] = values.take(drawn, axis=1)
        near = rng.uniform(-NEAR, NEAR, (len(self.x), lanes.size))
        near[::2] += self.begin[:, None]
        self.x[:, lanes] = near
        self.steps[lanes] = 0
        if self._remembered:
            self._commands[lanes] = 0.0
        self.done[lanes] = False

    def step(self, action: Array) -> tuple[Array, NDArray[np.bool_]]:
        """Hold the commands, `action` (lanes, inputs) times the limit, for a period: rewards, and who has fallen."""
        if self._remembered:
            self._commands[:, :-1] = self._commands[:, 1:]
        action = np.clip(action, -1.0, 1.0)
        self._commands[:, -1] = self.limit * action
        u = self._commands.reshape(-1, self._commands.shape[2])
        x = self.simulator.run(
            self.params, self.x, u, samples=2, start=self._start, threads=self.threads, memory=self._memory
        )[1]  # fmt: skip
        fallen = np.zeros(self.lanes, dtype=np.bool_)
        if not math.isfinite(x.sum()):
            fallen = ~np.isfinite(x).all(axis=0)
            x[:, fallen] = self.x[:, fallen]
        self.x[:] = x
        self.steps += 1
        for i, far in enumerate(self._borders):
            if far < math.inf:
                fallen |= np.abs(x[2 * i] - self.target[i]) > far
        if self.task == "balance":
            return np.ones(self.lanes), fallen
        upright = 0.5 + 0.5 * np.cos(x[::2][self.turning] - self.target[self.turning, None]).mean(axis=0)
        return upright - EFFORT * np.mean(action**2, axis=1), fallen

    @cached_property
    def _borders(self) -> list[float]:
        """Deviation of each coordinate beyond which an episode ends."""
        fall = np.where(self.turning & (self.task == "balance"), FALLEN, math.inf)
        return np.minimum(self.travel, fall).tolist()

    @cached_property
    def _memory(self) -> Array:
        return np.empty(2 * len(self.x) * (self.lanes if self.lanes == 1 else -(-self.lanes // 16) * 16))

    @property
    def observation(self) -> NDArray[np.float32]:
        """What a learner sees, shape (lanes, numbers): deviations from the target, then the speeds.

        Of what turns over, sine and cosine.
        """
        out, k = np.empty((len(self.names), self.lanes), dtype=np.float32), 0
        for i, turns in enumerate(self.turning.tolist()):
            off = (self.x[2 * i] - self.target[i]).astype(np.float32)
            for value in (np.sin(off), np.cos(off)) if turns else (off,):
                out[k], k = value, k + 1
        out[k:] = self.x[1::2]
        return out.T

    @cached_property
    def names(self) -> list[str]:
        """What the numbers of an observation are."""
        out: list[str] = []
        for c, turns in zip(self.rig.plant.coordinates, self.turning.tolist(), strict=True):
            out += [f"sin {c.name}", f"cos {c.name}"] if turns else [c.name]
        return [*out, *(f"{c.name}_dot" for c in self.rig.plant.coordinates)]
