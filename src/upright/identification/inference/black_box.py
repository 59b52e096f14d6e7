"""What a model without physics predicts of a run: a linear difference equation, fitted to the same runs.

``y[k] = c + sum_i A_i y[k - i] + B_i w[k - i]`` (ARX) with `w` the means over each step of the commands and of
held coordinates. It is fitted by least squares one step ahead; of several orders that one is taken which
predicts the fitted runs best over the requested horizon. A model with physics that cannot beat it has missed something.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upright.identification.inference.scoring import fit_percent
from upright.identification.model.fit import RunScore
from upright.identification.model.runs import Run

Array = NDArray[np.float64]

ORDERS = (2, 3, 4, 6)
STEPS = 20
"""Steps in one period of the motion, or in a horizon that is shorter than that."""

ROWS = 5000
"""Rows that an equation is fitted to; a longer run is thinned."""


@dataclass(frozen=True, kw_only=True)
class Paced:
    """A run at the pace of the equation: all samples are kept, `stride` of them are one step."""

    y: Array
    w: Array
    stride: int


def black_box(fitted: Sequence[Run], run: Run, period: float) -> dict[str, float]:
    """Fit percent of every free signal of a run, predicted without physics; empty where nothing alike was fitted.

    Parameters
    ----------
    fitted : sequence of Run
        What the equation may see; those with other signals, held coordinates or steps are passed over.
    run : Run
        Restarted over its shortest horizon, or simulated from its first samples.
    period : float
        Of the motion [s].
    """
    horizon = next(iter(run.horizons), None)
    target = min(period, horizon or period) / STEPS
    stride = max(1, round(target / run.period))
    step = stride * run.period
    paced = [s for other in fitted if _alike(other, run) and (s := _sampled(other, step))]
    predicted = _sampled(run, step)
    ahead = None if horizon is None else max(1, round(horizon / step))
    best: tuple[float, dict[int, float]] | None = None
    for order in ORDERS:
        long = [s for s in paced if len(s.y) > 4 * order * s.stride]
        if not long or predicted is None or len(predicted.y) <= 2 * order * stride:
            continue
        weights = _fit(long, order)
        within = float(np.mean([[*_percents(weights, order, s, ahead).values()] for s in long]))
        if best is None or within > best[0]:
            skip = run.score_from / run.period
            best = within, _percents(weights, order, predicted, ahead, skip, exactly=run.filtered)
    names = [run.measured[k] for k in run.free]
    return {} if best is None else {names[k]: p for k, p in best[1].items()}


def _alike(one: Run, other: Run) -> bool:
    same = (
        one.measured == other.measured and one.held.keys() == other.held.keys() and one.u.shape[1] == other.u.shape[1]
    )
    return same and one.loop is None


def _sampled(run: Run, step: float) -> Paced | None:
    """Signals and what drives them; None where the run's samples do not fit the step."""
    stride = max(1, round(step / run.period))
    if abs(stride * run.period / step - 1) > 0.01 or len(run.t) < 2 * stride:
        return None
    held = [k for k in range(len(run.measured)) if k not in run.free]
    driving = np.hstack([run.u, run.y[:, held]])
    total = np.vstack([np.zeros((1, driving.shape[1])), np.cumsum(driving, axis=0)])
    end = np.minimum(np.arange(len(run.t)) + stride, len(run.t))
    return Paced(y=run.y[:, run.free], w=(total[end] - total[: len(run.t)]) / stride, stride=stride)


def _past(s: Paced, at: NDArray[np.int64], order: int, y: Array) -> Array:
    """Regressors (rows, 1 + order (outputs + inputs)) of one step after `at`; `y` (order, rows, outputs)."""
    w = [s.w[at - i * s.stride] for i in range(order)]
    return np.hstack([np.ones((len(at), 1)), *y, *w])


def _fit(paced: Sequence[Paced], order: int) -> Array:
    rows: list[Array] = []
    after: list[Array] = []
    for s in paced:
        first, last = (order - 1) * s.stride, len(s.y) - s.stride
        at = np.arange(first, last, max(1, (last - first) * len(paced) // ROWS))
        rows.append(_past(s, at, order, np.array([s.y[at - i * s.stride] for i in range(order)])))
        after.append(s.y[at + s.stride])
    return np.asarray(np.linalg.lstsq(np.vstack(rows), np.vstack(after), rcond=None)[0], dtype=np.float64)


def _percents(
    weights: Array, order: int, s: Paced, ahead: int | None, skip: float = 0.0, *, exactly: bool = False
) -> dict[int, float]:
    """Fit percent by output over windows laid end to end, `exactly` so many steps ahead, or from the first samples."""
    at, measured, predicted = _forecast(weights, order, s, ahead, exactly=exactly)
    if not at.size:
        return dict.fromkeys(range(s.y.shape[1]), -1000.0)
    counted = at >= skip
    if exactly:
        counted[:-1] = False
    if not counted.any():
        return {}
    with np.errstate(all="ignore"):
        return {k: fit_percent(measured[counted][:, k], predicted[counted][:, k]) for k in range(s.y.shape[1])}


def _forecast(
    weights: Array, order: int, s: Paced, ahead: int | None, *, exactly: bool = False, first: int = 0
) -> tuple[NDArray[np.int64], Array, Array]:
    """Samples (steps, windows), and what was measured and predicted there (steps, windows, outputs)."""
    first = max(first, (order - 1) * s.stride)
    steps = (len(s.y) - 1 - first) // s.stride if ahead is None else ahead
    apart = s.stride * (1 if exactly else steps)
    origins = np.arange(first, len(s.y) - steps * s.stride, max(apart, 1))
    recent = np.array([s.y[origins - i * s.stride] for i in range(order)])
    at = origins[None, :] + s.stride * np.arange(1, steps + 1)[:, None]
    measured, predicted = (np.empty((steps, len(origins), s.y.shape[1])) for _ in range(2))
    with np.errstate(all="ignore"):  # an unstable equation runs away, and its score says so
        for j in range(steps):
            predicted[j] = _past(s, at[j] - s.stride, order, recent) @ weights
            measured[j] = s.y[at[j]]
            recent = np.concatenate([predicted[j][None], recent[:-1]])
    return at, measured, predicted


def black_box_run(training: Run, run: Run, period: float) -> RunScore | None:
    """A run as the equation predicts it that was fitted to the `training`; None where there is too little to fit.

    Parameters
    ----------
    training : Run
        With the same signals.
    run : Run
        Predicted from its samples before ``score_from`` on, or over its shortest horizon, at the pace of the equation.
    period : float
        Of the motion [s].
    """
    horizon = next(iter(run.horizons), None)
    stride = max(1, round(min(period, horizon or period) / STEPS / run.period))
    known, rest = _sampled(training, stride * run.period), _sampled(run, stride * run.period)
    ahead = None if horizon is None else max(1, round(horizon / (stride * run.period)))
    begin = int(np.searchsorted(run.t, run.t[0] + run.score_from - 1e-9))
    if known is None or rest is None:
        return None
    candidates: list[tuple[float, int, Array]] = []
    for order in ORDERS:
        if len(known.y) > 4 * order * stride and begin >= (order - 1) * stride and len(run.t) - begin > 2 * stride:
            weights = _fit([known], order)
            within = float(np.mean([*_percents(weights, order, known, ahead).values()]))
            candidates.append((within, order, weights))
    if not candidates:
        return None
    _, order, weights = max(candidates, key=lambda c: c[0])
    at, measured, predicted = _forecast(weights, order, rest, ahead, first=begin)
    y, simulated = (np.moveaxis(a, 1, 0).reshape(-1, rest.y.shape[1]) for a in (measured, predicted))
    names = tuple(run.measured[k] for k in run.free)
    return RunScore(
        role="predict", fit_percent={n: fit_percent(y[:, k], simulated[:, k]) for k, n in enumerate(names)},
        horizon=horizon, t=run.t[at.T.reshape(-1)], y=y, simulated=simulated, measured=names,
    )  # fmt: skip
