"""A balanced QUBE-Servo, predicted ahead of measured states by equations by hand, and who identifies it how."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.signal import savgol_filter

from benchmarks.peers.task import STUDIES, Array
from upright.identification import identify
from upright.identification.model.grey_box import GreyBox
from upright.identification.model.runs import Run
from upright.study import load_study

T = TypeVar("T")
AHEAD = (0.05, 0.2)
FITTED_AHEAD = 0.1
"""Seconds that scipy's windows last: between what is asked, and little more than a fall by e."""
APART, WIDE, BACK = 10, 15, 80
"""Samples between two starts, over which a start's speed is smoothed, and before the first start."""
ORDERS = ((8, 1), (16, 1), (4, 5), (8, 5), (16, 5))
"""Earlier samples that ARX looks back on and how many lie between two; the best on the second episode is taken."""
ASKED = ("l_cg", "J_p", "J_d", "b_1", "b_1c", "k_psi", "delay")
ROUNDED = 0.05
"""Speed over which dry friction changes its sign, as a user of SciPy writes it [rad/s]."""


@dataclass(frozen=True, kw_only=True)
class Episode:
    """Command (N,) [V], angles (N, 2) and their smoothed states (N, 4) every `dt` seconds."""

    u: Array
    y: Array
    states: Array
    dt: float

    def starts(self, ahead: int) -> NDArray[np.int64]:
        """Samples that predictions begin at, so many before the last one; what ARX looks back on comes before them."""
        return np.arange(BACK, self.u.size - ahead, APART)


def slopes(x: Array, p: Array, known: Array, u: Array) -> Array:
    """Time derivatives (4, n) of states (4, n): a Furuta pendulum whose cable pulls its arm back; theta = 0 hanging."""
    l_cg, J_p, J_d, b_1, b_1c, k_psi = p[:6]
    m_p, r, g, gain = known
    psi, theta, w1, w2 = x
    s, c = np.sin(theta), np.cos(theta)
    J_A = J_p + m_p * l_cg**2
    m11, m12 = J_d + m_p * r**2 + J_A * s**2, -m_p * r * l_cg * c
    f1 = gain * u - b_1 * w1 - b_1c * np.tanh(w1 / ROUNDED) - k_psi * psi
    f1 = f1 - 2 * J_A * s * c * w1 * w2 - m_p * r * l_cg * s * w2**2
    f2 = J_A * s * c * w1**2 - m_p * g * l_cg * s
    D = m11 * J_A - m12**2
    return np.stack([w1, w2, (J_A * f1 - m12 * f2) / D, (m11 * f2 - m12 * f1) / D])


def ahead(p: Array, known: Array, zeros: Array, run: Episode, first: NDArray[np.int64], count: int) -> Array:
    """Angles (starts, count, 2) after each start; `p` ends with a delay [s], `zeros` are theta's and the command's.

    Two Runge-Kutta steps a sample, all starts at once.
    """
    late = p[6] / run.dt
    whole, h = math.floor(late), run.dt / 2
    u = (1 - late + whole) * run.u + (late - whole) * np.concatenate([run.u[:1], run.u[:-1]]) + zeros[1]
    x = run.states[first].T + np.array([0.0, zeros[0], 0.0, 0.0])[:, None]
    out = np.empty((first.size, count, 2))
    for i in range(count):
        volts = u[first + i - whole]
        for _ in range(2):
            k1 = slopes(x, p, known, volts)
            k2 = slopes(x + h / 2 * k1, p, known, volts)
            k3 = slopes(x + h / 2 * k2, p, known, volts)
            x = x + h / 6 * (k1 + 2 * k2 + 2 * k3 + slopes(x + h * k3, p, known, volts))
        out[:, i] = x[:2].T - [0.0, zeros[0]]
    return out


def episode(u: Array, y: Array, dt: float) -> Episode:
    """An episode whose speeds are smoothed."""
    speeds = savgol_filter(y, WIDE, 2, deriv=1, delta=dt, axis=0)
    return Episode(u=u, y=y, states=np.column_stack([y, speeds]), dt=dt)


def named(values: Iterable[T]) -> dict[str, T]:
    """What is in the order of `ASKED`, by the names of the study."""
    return dict(zip(["actuator.delay" if n == "delay" else n for n in ASKED], values, strict=True))


def episodes(data: Path) -> tuple[list[Episode], Array, Array]:
    """The three episodes, the numbers that everybody is given (m_p, r, g, gain) and the guesses."""
    study = load_study(STUDIES / "qube_balance.toml", data=data)
    out = [episode(np.ravel(run.u), run.y, float(np.median(np.diff(run.t)))) for run in study.runs]
    number = {n: q.value for n, q in study.model.parameters.items()}
    known = np.array([number["m_p"], number["r"], number["g"], number["actuator.gain"]])
    return out, known, np.array([number[n] for n in named(ASKED)])


def missed(p: Array, known: Array, zeros: Array, run: Episode, seconds: float) -> Array:
    """Predicted less measured, over windows of some seconds, in units of each angle's spread."""
    count = round(seconds / run.dt)
    first = run.starts(count)
    y = ahead(p, known, zeros, run, first, count)
    at = first[:, None] + 1 + np.arange(count)
    return ((y - run.y[at]) / run.y.std(axis=0)).ravel()


def with_scipy(fitted: list[Episode], known: Array, guesses: Array) -> Array:
    """Numbers by least squares over windows, with two zeros of each episode."""

    def residual(x: Array) -> Array:
        zeros = x[guesses.size :].reshape(-1, 2)
        return np.concatenate([
            missed(x[: guesses.size] * guesses, known, z, run, FITTED_AHEAD)
            for z, run in zip(zeros, fitted, strict=True)
        ])  # fmt: skip

    x = np.concatenate([np.ones(guesses.size), np.zeros(2 * len(fitted))])
    low = np.concatenate([np.zeros(guesses.size), np.full(2 * len(fitted), -1.0)])
    high = np.concatenate([np.full(guesses.size, 10.0), np.full(2 * len(fitted), 1.0)])
    return least_squares(residual, x, bounds=(low, high), x_scale="jac", max_nfev=60).x[: guesses.size] * guesses


def with_upright(data: Path) -> Array:
    """Numbers by the public study, of its first two episodes."""
    study = load_study(STUDIES / "qube_balance.toml", data=data)
    return estimated(study.model, study.runs[:2])


def estimated(model: GreyBox, runs: Sequence[Run]) -> Array:
    """Upright's numbers from some runs."""
    fit = identify(model, runs)
    return np.array([fit.estimates[n].value for n in named(ASKED)])


def physical(p: Array, known: Array, run: Episode, seconds: float) -> Array:
    """Angles predicted so far ahead, the episode's zeros refitted."""
    zeros = least_squares(lambda z: missed(p, known, z, run, FITTED_AHEAD), np.zeros(2), x_scale=0.01).x
    count = round(seconds / run.dt)
    return ahead(p, known, zeros, run, run.starts(count), count)[:, -1]


def arx(fitted: list[Episode], order: int, step: int) -> Callable[[Episode, float], Array]:
    """Predictions of a linear equation of `order` earlier samples, `step` apart, and the mean commands between them."""

    def centred(run: Episode) -> tuple[Array, Array]:
        means = np.convolve(run.u - run.u.mean(), np.ones(step) / step)[step - 1 :]  # of the samples from each one on
        return means, run.y - run.y.mean(axis=0)

    def columns(u: Array, before: Array, at: NDArray[np.int64]) -> Array:
        return np.column_stack([before.reshape(at.size, -1), *(u[at - k * step] for k in range(order, 0, -1))])

    parts: list[tuple[Array, Array]] = []
    for run in fitted:
        u, y = centred(run)
        at = np.arange(order * step, run.u.size)
        before = np.stack([y[at - k * step] for k in range(order, 0, -1)], axis=1)
        parts.append((columns(u, before, at), y[at]))
    weights = np.linalg.lstsq(*map(np.concatenate, zip(*parts, strict=True)), rcond=None)[0]

    def predicted(run: Episode, seconds: float) -> Array:
        u, y = centred(run)
        count = round(seconds / run.dt)
        at = run.starts(count)
        before = np.stack([y[at - k * step] for k in range(order - 1, -1, -1)], axis=1)
        for i in range(step, count + 1, step):
            now = columns(u, before, at + i) @ weights
            before = np.concatenate([before[:, 1:], now[:, None]], axis=1)
        return before[:, -1] + run.y.mean(axis=0)

    return predicted


def percent(run: Episode, predicted: Array, seconds: float) -> list[float]:
    """Fit percent of each angle, 100 (1 - |y - y_hat| / |y - mean y|), of what was predicted so far ahead."""
    count = round(seconds / run.dt)
    y = run.y[run.starts(count) + count]
    off, moved = np.linalg.norm(y - predicted, axis=0), np.linalg.norm(y - y.mean(axis=0), axis=0)
    return (100 * (1 - off / moved)).tolist()
