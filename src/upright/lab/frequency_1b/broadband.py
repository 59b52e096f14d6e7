"""How is a rig asked at many frequencies at once? A periodic multisine, or a sweep up and down, on a twin.

Quicker than sines one after the other, at a price: each frequency moves the rig less, so dry friction weighs more, and
what it adds at one frequency stands under the answer at another.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from upright.control import Rig
from upright.errors import BadInput
from upright.identification.frequency.spectra import chirp, multisine, odd_lines, response_of
from upright.lab.frequency_1b.sweeps import EVERY, REACH, SHARE, Sweep
from upright.records import Provenance, Record

Array = NDArray[np.float64]

LENGTH = 4096
"""Logged samples in one period of a multisine."""
LINES = 20
PERIODS = 10
SWEEP = 40.0
"""Time for one sweep, up or down [s]."""


def ask(rig: Rig, guess: Rig, kind: str, *, low: float, high: float, seed: int = 0) -> Sweep:
    """Log and response of a twin, from rest.

    Parameters
    ----------
    rig, guess : Rig
        The twin, and the rig as designed, from which the command is shaped.
    kind : {"multisine", "sweep"}
    low, high : float
        [rad/s]
    seed : int
        Of the phases.
    """
    if kind not in ("multisine", "sweep"):
        raise BadInput(f"a rig is asked by 'sines', a 'multisine' or a 'sweep', not by '{kind}'.")
    tick = rig.period * EVERY
    if kind == "multisine":
        base = 2 * math.pi / (LENGTH * tick)
        lines = odd_lines(low, high, LINES, base)
        level = _level(guess, np.asarray(lines * base, dtype=np.float64))
        wave = multisine(lines, level, LENGTH, seed=seed)
        u = np.tile(wave, PERIODS)
    else:
        one = chirp(low, high, SWEEP, tick)
        w = low * (high / low) ** (np.arange(one.size) / one.size)
        one = one * _level(guess, w)
        u = np.concatenate([one, one[::-1]] * 3)
    goal = np.array([REACH.get(c.name, 0.3) for c in rig.plant.coordinates])
    most = SHARE * rig.limit / float(np.abs(u).max())
    scale = min(most, 1.0 if kind == "sweep" else 0.3)
    for _ in range(6):  # probes: friction makes the motion less than in proportion
        y = _moved(rig, scale * u)
        over = float(np.max(np.ptp(y[y.shape[0] // 3 :], axis=0) / (2.5 * goal)))
        scale = min(scale / float(np.clip(over, 0.4, 2.5)), most)
    u = np.round(scale * u / rig.converter) * rig.converter if rig.converter else scale * u
    y = _moved(rig, u)
    names = tuple(c.name for c in rig.plant.coordinates)
    record = Record(
        t=np.arange(u.size, dtype=np.float64) * tick, signals={"u": u, **{n: y[:, j] for j, n in enumerate(names)}},
        units={"u": rig.unit, **{c.name: c.unit for c in rig.plant.coordinates}}, inputs=("u",), outputs=names,
        provenance=Provenance(reader="twin", rig=f"digital twin of {rig.name}, seed {rig.seed}",
                              notes=("This log was simulated; no rig was touched.",)),
    )  # fmt: skip
    response = response_of(
        [record], command="u", outputs=names, kind=kind, hold=tick, quantum=rig.quantum.tolist(), band=(low, high)
    )
    return Sweep(dwells=(), response=response, seconds=float(np.ptp(record.t)), log=record)


def _level(guess: Rig, omega: Array) -> Array:
    """Relative command at each frequency: as much as the most mobile coordinate stands."""
    goal = np.array([REACH.get(c.name, 0.3) for c in guess.plant.coordinates])
    seen = np.abs(guess.linear(next(iter(guess.plant.equilibria))).response(omega)[:, :, 0])
    return np.minimum(guess.limit, np.min(goal / seen, axis=1))


def _moved(rig: Rig, u: Array) -> Array:
    """What the encoders show (N, coordinates), the command held for a logged sample."""
    from upright.simulation import simulate

    held = np.repeat(u, EVERY)
    x = simulate(rig.plant, rig.drive, rig.plant.state(), held, rig.period, samples=u.size, every=EVERY)[:, 0::2, 0]
    return np.round(x * rig.shown / rig.quantum) * rig.quantum
