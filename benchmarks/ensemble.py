"""How long do 10,000 closed loops take? Each 2 s: encoder, filtered difference, saturation, two RK4 steps per ms."""

from __future__ import annotations

import functools
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks import baseline, problem
from benchmarks.measure import Contender, Line, Target, compare, library

EARLY = 200  # samples after which two correct programs still agree: later a flipped count amplifies rounding


@functools.cache
def rigs(*, friction: bool) -> tuple[np.ndarray, np.ndarray]:
    """Parameters (10, n) and initial states (4, n)."""
    p, x0 = problem.ensemble()
    return (p if friction else problem.without_dry_friction(p)), x0


def seconds_of(c: baseline.Furuta) -> float:
    """CPU seconds of a tenth of the ensemble, the best of five, so that the yardstick is the fastest C there is."""
    p, x0 = rigs(friction=False)
    n, loop, taken = problem.LOOPS // 10, problem.loop_numbers(), []
    for _ in range(5):
        start = time.process_time()
        c.ensemble(p[:, :n], x0[:, :n], loop, samples=problem.SAMPLES, friction=False)
        taken.append(time.process_time() - start)
    return min(taken)


@functools.cache
def early(*, friction: bool) -> np.ndarray:
    """States (4, 100) by scalar C after `EARLY` samples."""
    p, x0 = rigs(friction=friction)
    c = baseline.compiled(lanes=False)
    return c.ensemble(p[:, :100], x0[:, :100], problem.loop_numbers(), samples=EARLY, friction=friction)


def in_c(*, lanes: bool, friction: bool, share: float = 1.0) -> Contender:
    """Hand-written C over the first `share` of the loops."""
    c = baseline.fastest_lanes(seconds_of) if lanes else baseline.compiled(lanes=False)
    p, x0 = rigs(friction=friction)
    n = round(problem.LOOPS * share)
    p, x0, loop = np.ascontiguousarray(p[:, :n]), np.ascontiguousarray(x0[:, :n]), problem.loop_numbers()
    few, truth = (p[:, :100], x0[:, :100]), early(friction=friction)
    name = f"C, {f'SIMD by hand, {baseline.LANES} lanes' if lanes else 'scalar'}{', tanh friction' if friction else ''}"
    return Contender(
        name=name,
        run=lambda: c.ensemble(p, x0, loop, samples=problem.SAMPLES, friction=friction),
        share=share,
        error=lambda _: float(np.abs(c.ensemble(*few, loop, samples=EARLY, friction=friction) - truth).max()),
        note=scaled(share),
    )


def ours(*, stick_slip: bool) -> Contender:
    """The kernel."""
    from benchmarks import ours

    def difference(_: Any) -> float:
        p, x0 = rigs(friction=False)
        last = ours.ensemble(p[:, :100], x0[:, :100], samples=EARLY, stick_slip=False)()
        return float(np.abs(last - early(friction=False)).max())

    return Contender(
        name="upright, exact stick-slip" if stick_slip else "upright, no dry friction",
        run=ours.ensemble(*rigs(friction=stick_slip), samples=problem.SAMPLES, stick_slip=stick_slip),
        error=None if stick_slip else difference,
        target=Target(most=2.0 if stick_slip else 1.25),
    )


def slow(name: str, what: str, *size: int, share: float) -> Callable[[], Contender]:
    """One of `benchmarks.libraries`, over a `share` of the whole."""
    return library(name, what, "ensemble", *size, share=share, note=scaled(share))


def scaled(share: float) -> str:
    """Say so where only a part was run."""
    return "" if share == 1 else f"scaled from 1/{1 / share:,.0f} of the work"


def run(*, quick: bool, progress: Callable[[str], None]) -> list[Line]:
    """All contenders; C in lanes is the reference."""
    one, few, many = 1 / problem.LOOPS, 20, 500 if quick else problem.LOOPS
    lanes = f"C, SIMD by hand, {baseline.LANES} lanes"
    builders: dict[str, Callable[[], Contender]] = {
        lanes: lambda: in_c(lanes=True, friction=False),
        f"{lanes}, tanh friction": lambda: in_c(lanes=True, friction=True),
        "upright, no dry friction": lambda: ours(stick_slip=False),
        "upright, exact stick-slip": lambda: ours(stick_slip=True),
        "C, scalar": lambda: in_c(lanes=False, friction=False, share=0.02 if quick else 1.0),
        "JAX, elementwise scan": slow("jax", "JAX, elementwise scan", many, share=many * one),
        "CasADi, fold + map": slow("casadi", "CasADi, fold + map", few, share=few * one),
        "MuJoCo, controller in Python": slow("mujoco", "MuJoCo, controller in Python", share=one),
        "python-control, discrete system": slow(
            "control", "python-control, discrete system", problem.SAMPLES, share=one
        ),
        "scipy, solve_ivp per sample": slow(
            "scipy", "scipy, solve_ivp per sample", EARLY, share=one * EARLY / problem.SAMPLES
        ),
    }
    return compare(builders, rounds=1 if quick else 9, progress=progress)
