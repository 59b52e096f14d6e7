"""Is the better prediction of a balanced QUBE-Servo by better numbers, or by numbers that suit its starts?

Two ways to tell. A twin has known numbers and encoders like the rig's, and no disturbance: nobody should beat its true
numbers, unless the smoothed starts of the test are at fault. And both fits can be asked to predict from starts of
another kind, those of upright's filter, which knows the past alone.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from scipy.linalg import solve_continuous_are

from benchmarks.peers.qube_fits import (
    AHEAD,
    ASKED,
    Array,
    Episode,
    episode,
    estimated,
    named,
    percent,
    physical,
    slopes,
    with_scipy,
)
from upright.identification import identify
from upright.study import Study

COUNTS, FINER = 2048, 10
"""Of the encoders in a turn, and integration steps in a sample."""
UPRIGHT = np.array([0.0, np.pi, 0.0, 0.0])
WEIGHTS = np.diag([5.0, 1.0, 0.1, 0.1])
"""Of the twin's state in the cost of its loop, beside 1 for a volt squared."""


def loop(p: Array, known: Array) -> Array:
    """Gains of the regulator that costs least, from slopes about upright without dry friction."""
    smooth = p * np.array([1.0, 1.0, 1.0, 1.0, 0.0, 1.0, 1.0])

    def moved(x: Array, u: float) -> Array:
        return slopes(x[:, None], smooth, known, np.array([u]))[:, 0]

    tiny = 1e-6
    A = np.stack([(moved(UPRIGHT + d, 0.0) - moved(UPRIGHT - d, 0.0)) / (2 * tiny) for d in tiny * np.eye(4)], axis=1)
    b = (moved(UPRIGHT, tiny) - moved(UPRIGHT, -tiny)) / (2 * tiny)
    return b @ solve_continuous_are(A, b[:, None], WEIGHTS, np.eye(1))


def balanced(p: Array, known: Array, seeds: range, count: int, dt: float) -> list[Episode]:
    """Episodes of a twin at once: a loop keeps it upright while the arm is sent elsewhere and the voltage is shaken."""
    k, step = loop(p, known), 2 * np.pi / COUNTS
    draws = [np.random.default_rng([24, seed]) for seed in seeds]
    sent = np.stack([np.repeat(g.uniform(-0.6, 0.6, count // 500 + 1), 500)[:count] for g in draws])
    shaken = np.stack([np.repeat(g.normal(size=count // 25 + 1), 25)[:count] for g in draws])
    x = np.repeat(UPRIGHT[:, None], len(draws), axis=1)
    u, y = np.empty((count, len(draws))), np.empty((count, 2, len(draws)))
    h = dt / FINER
    for i in range(count):
        y[i] = np.round(x[:2] / step) * step
        off = x - UPRIGHT[:, None]
        off[0] -= sent[:, i]
        u[i] = np.clip(shaken[:, i] - k @ off, -10.0, 10.0)
        for j in range(FINER):
            volts = u[max(0, i + math.floor(((j + 0.5) * h - p[6]) / dt))]
            k1 = slopes(x, p, known, volts)
            k2 = slopes(x + h / 2 * k1, p, known, volts)
            k3 = slopes(x + h / 2 * k2, p, known, volts)
            x = x + h / 6 * (k1 + 2 * k2 + 2 * k3 + slopes(x + h * k3, p, known, volts))
    return [episode(u[:, n], y[..., n], dt) for n in range(len(draws))]


def from_filter(study: Study, p: Array) -> Mapping[float, Mapping[str, float]]:
    """Fit percents of the third episode by horizon [s], from starts of a filter whose noise suits these numbers."""
    model = study.model
    fixed = {
        n: replace(q, value=float(v), estimate=False) for (n, v) in named(p).items() for q in [model.parameters[n]]
    }
    rig = replace(model, parameters={**model.parameters, **fixed})
    *fitted, third = study.runs
    return identify(rig, [*fitted, replace(third, role="predict")]).runs[third.label].ahead


def explained(study: Study, ours: Array, theirs: Array, known: Array, guesses: Array, like: Episode) -> str:
    """What the twin and the filter say of SciPy's numbers beside upright's."""
    twin = balanced(ours, known, range(3), like.u.size, like.dt)
    *fitted, last = twin
    runs = [
        replace(run, t=e.dt * np.arange(e.u.size), u=e.u[:, None], y=e.y)
        for run, e in zip(study.runs, twin, strict=True)
    ]
    wrong, right = with_scipy(fitted, known, guesses), estimated(study.model, runs[:-1])
    at, ahead = AHEAD[-1], f"{1e3 * AHEAD[-1]:.0f} ms ahead"
    true, suited, own = (percent(last, physical(p, known, last, at), at) for p in (ours, wrong, right))
    off, near = 100 * (wrong / ours - 1), 100 * np.abs(right / ours - 1)
    most = sorted(range(len(ASKED)), key=lambda i: -abs(off[i]))[:3]
    here, there = ([float(v) for v in from_filter(study, p)[at].values()] for p in (ours, theirs))
    named_off = ", ".join(f"{ASKED[i]} {off[i]:+.0f} %" for i in most)
    return (
        f"On a twin with upright's numbers, these encoders and no disturbance, the true numbers predict {ahead} to "
        f"{_cell(true)} %. SciPy's estimates from it are off ({named_off}) "
        f"and predict to {_cell(suited)} %, upright's are off by {near.max():.0f} % at most and predict to "
        f"{_cell(own)} %. "
        + (
            "So SciPy's numbers make up for what is wrong with smoothed starts; that they are ahead does not say that "
            "they are right. "
            if np.mean(suited) > np.mean(true)
            else "So the starts do not explain who is ahead. "
        )
        + f"From starts of upright's filter, which knows the past alone, upright's numbers predict the third episode "
        f"{ahead} to {_cell(here)} %, SciPy's to {_cell(there)} %."
    )


def _cell(percents: list[float]) -> str:
    return " / ".join(f"{p:.1f}" for p in percents)
