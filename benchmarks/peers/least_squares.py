"""scipy's least squares over the equations by hand.

Intervals from J'J take the residuals as white; those of `robust` take blocks of half a second as independent, which an
expert adds (Newey and West's idea).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.signal import savgol_filter
from scipy.stats import t as student

from benchmarks.peers.by_hand import ROUNDED, STEPS, furuta, pendulum
from benchmarks.peers.task import Answer, Samples, Task, spent

Array = NDArray[np.float64]

HORIZONS = (2.0, 8.0, 1e9)
"""Seconds of a free swing that are fitted first, next and last: forty swings at once end in a wrong valley."""


def started(task: Task, run: Samples) -> Array:
    """Start of a run as a user reads it off: angles, and speeds from a smoothed difference where it begins moving."""
    if task.plant == "furuta":
        return run.y[0].copy()
    width = max(7, int(0.05 / (run.t[1] - run.t[0])) | 1)
    angle, speed = (savgol_filter(run.y[:, 0], width, 4, deriv=d, delta=run.t[1] - run.t[0])[0] for d in (0, 1))
    return np.array([angle, speed, *([0.0] if task.offset else [])])


def simulated(task: Task, p: Array, start: Array, run: Samples) -> Array:
    """Angles of a run at numbers in the order of the task's guesses."""
    dt = float(run.t[1] - run.t[0])
    if task.plant == "furuta":
        known = np.array([task.known[n] for n in ("m_p", "l_cg", "r", "g")])
        return furuta(p, known, start, run.u, dt, STEPS, ROUNDED, 0.0)
    m_p, l_cg = task.known["m_p"], task.known["l_cg"]
    numbers = np.array([p[0] + m_p * l_cg**2, *p[1:]])
    mgl = m_p * task.known["g"] * l_cg
    return pendulum(numbers, start[:2], mgl, run.t.size, dt, task.steps) + start[2:].sum()


def residual(task: Task, run: Samples, scale: Array) -> Callable[[Array], Array]:
    """Residuals of numbers in units of their guesses, then the start."""
    size = scale.size

    def of(x: Array) -> Array:
        p = np.maximum(x[:size] * scale, 0)
        return ((simulated(task, p, x[size:], run) - run.y) / run.y.std(axis=0)).ravel()

    return of


def fitted(task: Task, run: Samples, *, block: float = 0.0) -> tuple[Array, Array, Array]:
    """Numbers, start, and halves of their 95 % intervals; residuals are independent from block to block [s]."""
    scale = np.array(list(task.guesses.values()))
    x = np.concatenate([np.ones(scale.size), started(task, run)])
    lower = np.concatenate([np.zeros(scale.size), np.full(x.size - scale.size, -np.inf)])
    dt = float(run.t[1] - run.t[0])
    for seconds in HORIZONS if task.plant == "pendulum" else HORIZONS[-1:]:
        part = run.part(0, min(run.t.size, round(seconds / dt)))
        found = least_squares(
            residual(task, part, scale), x, bounds=(lower, np.inf), x_scale="jac", diff_step=1e-4, max_nfev=80
        )
        x = found.x
    count = found.fun.size - x.size
    inverse = np.linalg.pinv(found.jac.T @ found.jac)
    covariance = inverse * (found.fun @ found.fun) / count
    if block:
        starts = np.arange(0, found.fun.size, max(1, round(block / dt)) * run.y.shape[1])
        slopes = np.add.reduceat(found.jac * found.fun[:, None], starts, axis=0)
        covariance = inverse @ (slopes.T @ slopes) @ inverse
        count = starts.size - x.size
    half = student.ppf(0.975, max(count, 1)) * np.sqrt(np.maximum(np.diag(covariance), 0.0))[: scale.size]
    return x[: scale.size] * scale, x[scale.size :], half * scale


def predict(task: Task, p: Array, run: Samples, start: Array) -> Array:
    """A run that was not fitted, its start refitted to what does not count."""
    scale = np.ones(p.size)
    of = residual(task, run.before, scale)
    found = least_squares(lambda s: of(np.concatenate([p, s])), start, x_scale="jac", diff_step=1e-5, max_nfev=60)
    return simulated(task, p, found.x, run)


def robust(task: Task) -> Answer:
    """The whole task, with a sandwich of half seconds."""
    return answer(task, block=0.5)


def answer(task: Task, *, block: float = 0.0) -> Answer:
    """The whole task; the compiled equations are warm."""
    simulated(task, np.array(list(task.guesses.values())), started(task, task.fitted), task.fitted.part(0, 50))
    begin = spent()
    p, start, half = fitted(task, task.fitted, block=block)
    seconds = spent() - begin
    names = list(task.guesses)
    starts = {label: start if run.score_from else started(task, run) for label, run in task.held_out.items()}
    return Answer(
        values=dict(zip(names, p.tolist(), strict=True)),
        intervals={n: (v - h, v + h) for n, v, h in zip(names, p.tolist(), half.tolist(), strict=True)},
        predicted={label: predict(task, p, run, starts[label]) for label, run in task.held_out.items()},
        seconds=seconds, says="nothing; a standard error is one's own line",
    )  # fmt: skip
