"""scipy.integrate.solve_ivp: adaptive Runge-Kutta 4(5) over a right-hand side in plain Python."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from benchmarks import problem

TOLERANCE = {"rtol": 1e-8, "atol": 1e-8}


def trajectory() -> Callable[[], np.ndarray]:
    """One free swing of 10 s, sampled at 1 kHz."""
    from scipy.integrate import solve_ivp

    k = tuple(map(float, problem.lumps(problem.RIG)))
    t = np.linspace(0, problem.STEPS * problem.PERIOD, problem.STEPS + 1)

    def slope(_t: float, x: np.ndarray) -> tuple[float, ...]:
        _, theta, v, w = x.tolist()
        return (v, w, *problem.accelerations(math, theta, v, w, 0.0, k))

    return lambda: solve_ivp(slope, (t[0], t[-1]), problem.RELEASE, t_eval=t, **TOLERANCE).y.T


def ensemble(samples: int) -> Callable[[], np.ndarray]:
    """One closed loop: the controller in Python, solve_ivp from sample to sample."""
    from scipy.integrate import solve_ivp

    p, x0 = problem.ensemble(1)
    k, c = tuple(map(float, problem.lumps(p[:, 0]))), problem.loop_numbers()

    def slope(_t: float, x: np.ndarray, u: float) -> tuple[float, ...]:
        _, theta, v, w = x.tolist()
        return (v, w, *problem.accelerations(math, theta, v, w, u, k))

    def run() -> np.ndarray:
        x = x0[:, 0]
        seen = problem.at_rest(math, x)
        for _ in range(samples):
            u, seen = problem.controller(math, x, seen, c)
            u = min(max(u, -problem.LIMIT), problem.LIMIT)
            x = solve_ivp(slope, (0, problem.PERIOD), x, args=(u,), **TOLERANCE).y[:, -1]
        return x[:, None]

    return run
