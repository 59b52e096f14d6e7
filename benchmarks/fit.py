"""How long does a fit take? Eight unknowns of a Furuta rig from 10 s at 1 kHz, started 30 % off.

Unknown are J_d, l_cg, J_p, both viscous and both Coulomb frictions and the angle of release; a torque of
0.02 sin(2 pi 0.7 t) N m is known, both angles are encoder counts. Every fit goes over 1 s first, then over 10 s.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from benchmarks import baseline, problem
from benchmarks.measure import Contender, Line, Target, compare, spread

SIMPLEX = {"xatol": 1e-6, "fatol": 1e-10, "adaptive": True, "maxfev": 20_000, "maxiter": 20_000}


def relative_error(unknown: np.ndarray) -> float:
    """Largest relative error of the eight."""
    return float(np.abs(unknown / problem.TRUTH - 1).max())


def simplex(swing: Callable[[np.ndarray, int], np.ndarray], measured: np.ndarray) -> tuple[np.ndarray, list[int]]:
    """Nelder-Mead on the logarithms; eight estimates and the evaluations over each horizon."""
    from scipy.optimize import minimize

    z, used = np.zeros(len(problem.START)), []
    for steps in problem.HORIZONS:

        def cost(z: np.ndarray, steps: int = steps) -> float:
            total = float(((swing(problem.START * np.exp(z), steps) - measured[: steps + 1]) ** 2).sum())
            return total if math.isfinite(total) else 1e30

        first = np.vstack([z, z + 0.1 * np.eye(len(z))])
        found = minimize(cost, z, method="Nelder-Mead", options={**SIMPLEX, "initial_simplex": first})
        z = found.x
        used.append(int(found.nfev))
    return problem.START * np.exp(z), used


def in_c() -> Callable[[np.ndarray, int], np.ndarray]:
    """Angles by scalar C, Coulomb friction smoothed."""
    c = baseline.compiled(lanes=False)

    def swing(unknown: np.ndarray, steps: int) -> np.ndarray:
        p, x0 = problem.rig(unknown)
        return c.trajectory(p, x0, h=problem.PERIOD, steps=steps, friction=True, torque=problem.TORQUE)[:, :2]

    return swing


def with_solve_ivp() -> Callable[[np.ndarray, int], np.ndarray]:
    """Angles by solve_ivp at 1e-6, as most would write it; the torque is the smooth sine."""
    from scipy.integrate import solve_ivp

    def swing(unknown: np.ndarray, steps: int) -> np.ndarray:
        p, x0 = problem.rig(unknown)
        k = tuple(map(float, problem.lumps(p)))
        t = np.linspace(0, steps * problem.PERIOD, steps + 1)

        def slope(t: float, x: np.ndarray) -> tuple[float, ...]:
            _, theta, v, w = x.tolist()
            torque = 0.02 * math.sin(2 * math.pi * 0.7 * t)
            return (v, w, *problem.accelerations(math, theta, v, w, torque, k, friction=True))

        return solve_ivp(slope, (t[0], t[-1]), x0, t_eval=t, rtol=1e-6, atol=1e-6).y[:2].T

    return swing


def estimated_over_solve_ivp(evaluations: list[int]) -> Line:
    """Cost of an evaluation over each horizon, times how many the simplex needed over the same cost in C."""
    swing, taken = with_solve_ivp(), []
    for steps in problem.HORIZONS:
        each = []
        for _ in range(3):
            start = time.process_time()
            swing(problem.TRUTH, steps)
            each.append(time.process_time() - start)
        taken.append(float(np.median(each)))
    seconds = float(np.dot(taken, evaluations))
    costs = " and ".join(f"{n:,} x {1e3 * s:.1f} ms" for n, s in zip(evaluations, taken, strict=True))
    return Line(
        contender="simplex over solve_ivp",
        seconds=spread([seconds]),
        note=f"estimated: {costs}; --full runs it",
    )


def ours(*, whole: bool) -> Contender:
    """The search of the package, alone or with all that follows it."""
    from benchmarks import ours

    if whole:
        note = "the same with standard errors, correlations, verdict"
        target = Target(most=0.1, of="seconds")
        return Contender(name="upright, identify", run=ours.fit(), error=relative_error, target=target, note=note)
    return Contender(
        name="upright, search",
        run=ours.search(),
        error=relative_error,
        target=Target(most=0.020, of="seconds"),
        note="Levenberg-Marquardt, exact stick-slip; release angle starts from the first sample",
    )


def run(*, quick: bool, full: bool, progress: Callable[[str], None]) -> list[Line]:
    """Ours, the simplex over compiled C, the simplex over solve_ivp."""
    swing, evaluations = in_c(), [0, 0]
    measured = problem.counts(swing(problem.TRUTH, problem.STEPS))

    def simplex_in_c() -> np.ndarray:
        found, evaluations[:] = simplex(swing, measured)
        return found

    builders: dict[str, Callable[[], Contender]] = {
        "upright, search": lambda: ours(whole=False),
        "upright, identify": lambda: ours(whole=True),
        "simplex over scalar C": lambda: Contender(
            name="simplex over scalar C", run=simplex_in_c, error=relative_error, note="tanh friction"
        ),
    }
    lines = compare(builders, rounds=1 if quick else 21, progress=progress)
    if full:
        slow = with_solve_ivp()
        return lines + compare(
            {
                "simplex over solve_ivp": lambda: Contender(
                    name="simplex over solve_ivp",
                    run=lambda: simplex(slow, measured)[0],
                    error=relative_error,
                    note="tanh friction",
                )
            },
            rounds=1,
            progress=progress,
        )
    lines.append(estimated_over_solve_ivp(evaluations))
    first: Any = next((line.seconds for line in lines if line.seconds), None)
    return [with_ratio(line, first[0]) if line.ratio is None and line.seconds else line for line in lines]


def with_ratio(line: Line, first: float) -> Line:
    """Line whose ratio is taken from medians, because it was not part of the rounds."""
    ratio = line.seconds[0] / first if line.seconds else 1.0
    return replace(line, ratio=spread([ratio]))
