"""How long does one free swing take? 10,000 RK4 steps of the Furuta pendulum, 10 s at 1 kHz."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks import baseline, problem
from benchmarks.measure import Contender, Line, Target, compare, library


@functools.cache
def truth() -> np.ndarray:
    """States (steps + 1, 4) by DOP853 at a tolerance of 1e-12: nobody's RK4."""
    import math

    from scipy.integrate import solve_ivp

    k = tuple(map(float, problem.lumps(problem.RIG)))
    t = np.linspace(0, problem.STEPS * problem.PERIOD, problem.STEPS + 1)

    def slope(_t: float, x: Any) -> Any:
        return (x[2], x[3], *problem.accelerations(math, x[1], x[2], x[3], 0.0, k))

    return solve_ivp(slope, (t[0], t[-1]), problem.RELEASE, "DOP853", t_eval=t, rtol=1e-12, atol=1e-12).y.T


def error(states: Any) -> float:
    """Largest difference from the truth, rad or rad/s."""
    return float(np.abs(np.asarray(states) - truth()).max())


def in_c(*, lanes: bool, friction: bool = False) -> Contender:
    """Hand-written C, one rig."""
    c = baseline.compiled(lanes=lanes)
    names = {False: "C, scalar", True: "C, scalar, own sin/cos and fast-math"}
    return Contender(
        name=names[lanes] + (", tanh friction" if friction else ""),
        run=lambda: c.trajectory(
            problem.RIG, problem.RELEASE, h=problem.PERIOD, steps=problem.STEPS, friction=friction
        ),
        error=None if friction else error,
    )


def ours(*, stick_slip: bool) -> Contender:
    """The kernel."""
    from benchmarks import ours

    return Contender(
        name="upright, exact stick-slip" if stick_slip else "upright, no dry friction",
        run=ours.trajectory(stick_slip=stick_slip),
        error=None if stick_slip else error,
        target=None if stick_slip else Target(most=1.3),
    )


def run(*, quick: bool, progress: Callable[[str], None]) -> list[Line]:
    """All contenders; the scalar C is the reference."""
    builders: dict[str, Callable[[], Contender]] = {
        "C, scalar": lambda: in_c(lanes=False),
        "C, scalar, own sin/cos and fast-math": lambda: in_c(lanes=True),
        "C, scalar, tanh friction": lambda: in_c(lanes=False, friction=True),
        "upright, no dry friction": lambda: ours(stick_slip=False),
        "upright, exact stick-slip": lambda: ours(stick_slip=True),
        "JAX, jit + scan": library("jax", "JAX, jit + scan", "trajectory", error=error),
        "CasADi, mapaccum": library("casadi", "CasADi, mapaccum", "trajectory", error=error),
        "MuJoCo, rollout": library("mujoco", "MuJoCo, rollout", "trajectory", error=error),
        "scipy, solve_ivp 1e-8": library("scipy", "scipy, solve_ivp 1e-8", "trajectory", error=error),
        "python-control, 1e-8": library("control", "python-control, 1e-8", "trajectory", error=error),
    }
    return compare(builders, rounds=3 if quick else 31, progress=progress)
