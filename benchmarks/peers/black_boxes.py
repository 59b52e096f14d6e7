"""Equations without physics, free run: ARX by least squares, SINDy (pysindy), NARX (sysidentpy).

Order, threshold and decimation of each are those that simulate the end of what was fitted best.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.signal import savgol_filter

from benchmarks.peers.task import Answer, Samples, Task, fit_percent, spent

Array = NDArray[np.float64]

LARGEST = 1e3
"""Where a run that diverges is cut off [rad]."""
ORDERS, DECIMATIONS, THRESHOLDS = (2, 4, 8, 16), (1, 2, 4, 10), (0.0, 0.002, 0.01, 0.03, 0.1)


def _coarser(run: Samples, step: int) -> Samples:
    return Samples(t=run.t[::step], u=run.u[::step], y=run.y[::step], score_from=run.score_from)


def _tail(run: Samples) -> Samples:
    """What is scored of a run, from its first scored sample on: a black box has no start to refit but the past."""
    first = int(np.argmax(run.scored))
    return run.part(first, run.t.size)


def _arx(run: Samples, order: int) -> Array:
    rows = [_past(run.y, run.u, k, order) for k in range(order, run.t.size)]
    return np.linalg.lstsq(np.array(rows), run.y[order:], rcond=None)[0]


def _past(y: Array, u: Array, k: int, order: int) -> Array:
    """What sample k is computed from; a command that is always zero weighs nothing."""
    return np.concatenate([y[k - order : k].ravel(), u[k - order : k], [1.0]])


def _arx_run(weights: Array, run: Samples, order: int) -> Array:
    out = run.y.copy()
    for k in range(order, run.t.size):
        out[k] = np.clip(_past(out, run.u, k, order) @ weights, -LARGEST, LARGEST)
    return out


def _score(run: Samples, predicted: Array) -> float:
    return float(np.mean(fit_percent(run, predicted)))


def arx(task: Task) -> Answer:
    """A linear equation of the past samples and commands."""
    begin = spent()
    best: tuple[float, int, int] | None = None
    for step, order in product(DECIMATIONS, ORDERS):
        run = _coarser(task.fitted, step)
        cut = run.t.size * 2 // 3
        weights = _arx(run.part(0, cut), order)
        last = run.part(cut, run.t.size)
        score = _score(last, _arx_run(weights, last, order))
        best = max(best, (score, step, order)) if best else (score, step, order)
    assert best is not None
    _, step, order = best
    weights = _arx(_coarser(task.fitted, step), order)
    taken = spent() - begin
    return Answer(predicted=_each(task, step, lambda run: _arx_run(weights, run, order)), seconds=taken)


def _each(task: Task, step: int, run_of: Callable[[Samples], Array]) -> dict[str, Array]:
    """Each held-out run predicted on the coarser grid and put back on its own; before it is scored, as measured."""
    out: dict[str, Array] = {}
    for label, run in task.held_out.items():
        scored = _tail(run)
        coarse = _coarser(scored, step)
        values = run_of(coarse)
        filled = CubicSpline(coarse.t, values)(scored.t)
        out[label] = np.concatenate([run.y[: run.t.size - scored.t.size], filled])
    return out


def _terms(x: Array) -> Array:
    angle, speed = x[:, 0], x[:, 1]
    return np.column_stack([np.sin(angle), np.cos(angle), speed, np.tanh(speed / 0.05), speed * np.abs(speed)])


def _states(run: Samples) -> tuple[Array, Array]:
    """Angle, speed (N, 2) and acceleration (N, 1), smoothed over 0.06 s."""
    dt = float(run.t[1] - run.t[0])
    width = max(7, int(0.06 / dt) | 1)
    place, speed, push = (savgol_filter(run.y[:, 0], width, 4, deriv=d, delta=dt) for d in (0, 1, 2))
    return np.column_stack([place, speed]), push[:, None]


def _sindy_run(coefficients: Array, run: Samples) -> Array:
    out, x = np.empty_like(run.y), _states(run)[0][0]
    h = float(run.t[1] - run.t[0])

    def slope(x: Array) -> Array:
        return np.array([x[1], (coefficients @ _terms(x[None])[0])[0]])

    for k in range(run.t.size):
        out[k] = x[0]
        k1 = slope(x)
        k2 = slope(x + h / 2 * k1)
        k3 = slope(x + h / 2 * k2)
        x = np.clip(x + h / 6 * (k1 + 2 * k2 + 2 * k3 + slope(x + h * k3)), -LARGEST, LARGEST)
    return out


def sindy(task: Task) -> Answer:
    """Accelerations as a sparse sum of a pendulum's terms; the sensor's zero is not estimated."""
    import pysindy

    begin = spent()
    step = max(1, round(0.005 / float(task.fitted.t[1] - task.fitted.t[0])))
    run = _coarser(task.fitted, step)
    states, push = _states(run)
    library = _terms(states)
    size = library.std(axis=0).clip(1e-9)
    best: tuple[float, int, Array] | None = None
    for k, threshold in enumerate(THRESHOLDS):
        optimizer = pysindy.STLSQ(threshold=threshold * float(push.std()), alpha=1e-6)
        optimizer.fit(library / size, push)
        coefficients = np.asarray(optimizer.coef_) / size
        score = _score(run, _sindy_run(coefficients, run))
        if best is None or score > best[0]:
            best = score, k, coefficients
    assert best is not None
    taken = spent() - begin
    return Answer(predicted=_each(task, step, lambda held: _sindy_run(best[2], held)), seconds=taken)


def narx(task: Task) -> Answer:
    """A polynomial of degree 3 in the past samples, its terms chosen one by one (FROLS) by BIC."""
    from sysidentpy.basis_function import Polynomial
    from sysidentpy.model_structure_selection import FROLS

    begin = spent()
    step = max(1, round(0.04 / float(task.fitted.t[1] - task.fitted.t[0])))
    run = _coarser(task.fitted, step)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        model = FROLS(order_selection=True, n_info_values=15, ylag=6, info_criteria="bic", model_type="NAR",
                      basis_function=Polynomial(degree=3), err_tol=None)  # fmt: skip
        model.fit(X=None, y=run.y)
    taken = spent() - begin

    def predicted(held: Samples) -> Array:
        out = model.predict(X=None, y=held.y[: model.max_lag], forecast_horizon=held.t.size - model.max_lag)
        values = np.nan_to_num(np.asarray(out, float).ravel(), nan=LARGEST).clip(-LARGEST, LARGEST)
        return np.concatenate([values, np.full(max(0, held.t.size - values.size), LARGEST)])[: held.t.size, None]

    return Answer(predicted=_each(task, step, predicted), seconds=taken)
