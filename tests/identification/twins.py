"""Rigs whose numbers are known: simulated runs with the noise asked for."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from upright.identification import GreyBox, Parameter, Run
from upright.physics import Furuta, Pendulum
from upright.simulation import simulate

PENDULUM = {"m_p": 0.2, "l_cg": 0.3, "J_p": 2e-3, "b_2": 2e-3, "b_2c": 2e-3, "b_2q": 1e-3}
FURUTA = {
    "m_p": 0.2, "r": 0.12, "l_cg": 0.15, "J_p": 1e-4, "J_d": 0.008,
    "b_1": 5e-3, "b_2": 2e-4, "b_1c": 1e-3, "b_2c": 2e-4,
}  # fmt: skip


def rig(plant: type, values: Mapping[str, float], guesses: Mapping[str, float], **known: float) -> GreyBox:
    """A rig that knows `values` except those with a guess."""
    names = plant.names()
    unit = {n: plant.quantity(n).unit if n in names else "1" for n in (*values, *guesses, *known)}
    parameters = {n: Parameter(name=n, value=v, unit=unit[n]) for n, v in {**values, **known}.items()}
    parameters |= {n: Parameter(name=n, value=g, unit=unit[n], estimate=True) for n, g in guesses.items()}
    return GreyBox(plant=plant, parameters=parameters)


def swing(
    values: Mapping[str, float] = PENDULUM, *, angle: float = 1.5, seconds: float = 10.0, dt: float = 0.01, **run: Any
) -> Run:
    """Free swing of a pendulum from `angle`, without noise."""
    n = round(seconds / dt) + 1
    x = simulate(Pendulum(**values), {}, [angle, 0.0], None, dt, samples=n, substeps=2)
    fields = {"label": "swing", "role": "fit", "measured": ("theta",), "u": np.zeros((n, 1))} | run
    return Run(t=np.arange(n) * dt, y=x[:, [0], 0], **fields)


def shaken(values: Mapping[str, float] = FURUTA, *, seconds: float = 6.0, dt: float = 2e-3, **run: Any) -> Run:
    """A Furuta pendulum released from 1.5 rad while its arm is shaken, without noise."""
    n = round(seconds / dt) + 1
    t = np.arange(n) * dt
    u = (0.04 * np.sin(2 * np.pi * 0.7 * t) + 0.03 * np.sin(2 * np.pi * 1.9 * t))[:, None]
    x = simulate(Furuta(**values), {}, [0.0, 0.0, 1.5, 0.0], u, dt, samples=n, substeps=2)
    fields = {"label": "shaken", "role": "fit", "measured": ("psi", "theta"), "u": u} | run
    return Run(t=t, y=x[:, [0, 2], 0], **fields)


def noisy(run: Run, sigma: float, seed: int, memory: float = 0.0) -> Run:
    """The run with Gaussian noise of standard deviation `sigma`, first-order autocorrelation `memory`."""
    from dataclasses import replace

    from scipy.signal import lfilter

    generator = np.random.default_rng(seed)
    e = generator.normal(size=(run.y.shape[0] + 500, run.y.shape[1]))
    e = lfilter([np.sqrt(1 - memory**2)], [1.0, -memory], e, axis=0)[500:]
    return replace(run, y=run.y + sigma * e)
