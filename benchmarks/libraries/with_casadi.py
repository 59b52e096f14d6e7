"""CasADi: the step as an expression graph, repeated with mapaccum in its virtual machine."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from benchmarks import problem


def trajectory() -> Callable[[], np.ndarray]:
    """One free swing of 10 s at 1 kHz, RK4."""
    import casadi as ca

    k = tuple(map(float, problem.lumps(problem.RIG)))
    x = ca.SX.sym("x", 4)
    step = ca.Function("step", [x], [ca.vertcat(*problem.rk4(ca, ca.vertsplit(x), 0.0, problem.PERIOD, k))])
    swing = step.mapaccum(problem.STEPS)
    return lambda: np.vstack([problem.RELEASE, np.array(swing(problem.RELEASE)).T])


def ensemble(n: int) -> Callable[[], np.ndarray]:
    """n closed loops, one after the other."""
    import casadi as ca

    p, x0 = problem.ensemble(n)
    c = problem.loop_numbers()
    state, q = ca.SX.sym("state", 8), ca.SX.sym("q", 10)
    parts = ca.vertsplit(state)
    k = problem.lumps(ca.vertsplit(q))
    u, seen = problem.controller(ca, parts[:4], parts[4:], c)
    u = ca.fmin(ca.fmax(u, -problem.LIMIT), problem.LIMIT)
    x = tuple(parts[:4])
    for _ in range(problem.SUBSTEPS):
        x = problem.rk4(ca, x, u, problem.PERIOD / problem.SUBSTEPS, k)
    step = ca.Function("step", [state, q], [ca.vertcat(*x, *seen)])
    loops = step.fold(problem.SAMPLES).map(n)
    start = np.vstack([x0, *problem.at_rest(np, x0)])
    held = np.repeat(p, problem.SAMPLES, axis=1)  # fold wants the parameters of every step
    return lambda: np.array(loops(start, held))[:4]
