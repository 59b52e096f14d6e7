"""python-control: nonlinear input/output systems and `input_output_response`."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks import problem
from benchmarks.libraries.with_scipy import TOLERANCE


def trajectory() -> Callable[[], np.ndarray]:
    """One free swing of 10 s, sampled at 1 kHz."""
    import control

    k = tuple(map(float, problem.lumps(problem.RIG)))
    t = np.linspace(0, problem.STEPS * problem.PERIOD, problem.STEPS + 1)

    def slope(_t: float, x: Any, u: Any, _p: Any) -> tuple[float, ...]:
        _, theta, v, w = x.tolist()
        return (v, w, *problem.accelerations(math, theta, v, w, float(u[0]), k))

    rig = control.nlsys(slope, None, inputs=1, outputs=4, states=4)
    torque = np.zeros_like(t)
    return lambda: control.input_output_response(rig, t, torque, problem.RELEASE, solve_ivp_kwargs=TOLERANCE).states.T


def ensemble(samples: int) -> Callable[[], np.ndarray]:
    """One closed loop as a discrete system of eight states, stepped by python-control."""
    import control

    p, x0 = problem.ensemble(1)
    k, c = tuple(map(float, problem.lumps(p[:, 0]))), problem.loop_numbers()

    def update(_t: float, state: Any, _u: Any, _p: Any) -> tuple[float, ...]:
        state = state.tolist()
        u, seen = problem.controller(math, state[:4], state[4:], c)
        u = min(max(u, -problem.LIMIT), problem.LIMIT)
        x = tuple(state[:4])
        for _ in range(problem.SUBSTEPS):
            x = problem.rk4(math, x, u, problem.PERIOD / problem.SUBSTEPS, k)
        return (*x, *seen)

    loop = control.nlsys(update, None, inputs=1, outputs=8, states=8, dt=problem.PERIOD)
    t = np.arange(samples + 1) * problem.PERIOD
    start = np.array([*x0[:, 0], *problem.at_rest(math, x0[:, 0])])
    return lambda: control.input_output_response(loop, t, np.zeros_like(t), start).states[:4, -1:]
