"""Two carts on springs (ECP 210, San Diego): of three steps each is predicted in a free run from a fit of the others.

Everybody has the same equations, known numbers, guesses and samples (every 2 ms). The drive brakes while it has volts,
and its braking takes some 50 ms to build up. Nobody measured the gain, so masses, springs and frictions are per N/V.
Dry friction leaves the carts anywhere near where the springs are slack. All but OE and ARX refit two zeros of each
run, of the predicted one as well, and upright the start. SciPy and lmfit round dry friction over 0.2 mm/s and take
16 steps a sample for it; over 2 mm/s they lose up to a point.

OE is a linear transfer function of fourth order with one denominator, its simulation error minimised by SciPy from an
ARX start, as `oe` of MATLAB does. It has no friction and no braking. ARX minimises the error of one step.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numba import njit  # type: ignore[import-untyped]
from scipy.optimize import least_squares
from scipy.signal import lfilter

from benchmarks.peers.task import STUDIES, Array, spent
from upright.identification import identify
from upright.study import load_study

STUDY = "ecp210_two_carts"
ASKED = ("m_1", "m_2", "k_1", "k_12", "c_1", "c_2", "f_1c", "f_2c", "actuator.damping", "actuator.relaxation")
ROUNDED, STEPS = 2e-4, 16
"""Speed over which dry friction changes its sign, as a user writes it [m/s], and steps in a sample."""
ORDER, DECIMATIONS = 4, (1, 5, 10, 20)
"""Of the linear models; samples between two that they may look at."""


@dataclass(frozen=True, kw_only=True)
class Run:
    """Command (N,) [V] and positions (N, 2) [m] every `dt` seconds, from rest."""

    u: Array
    y: Array
    dt: float


Predictor = Callable[[Run], Array]
Way = Callable[[int], Predictor]
"""A peer: the run that it does not see, and how it then predicts it."""


@njit(cache=True)
def _slope(x: Array, p: Array, u: float) -> Array:
    m_1, m_2, k_1, k_12, c_1, c_2, f_1c, f_2c, damping, relaxation = p
    x1, x2, v1, v2, braking = x
    link = k_12 * (x2 - x1)
    a1 = (u - braking - k_1 * x1 + link - c_1 * v1 - f_1c * math.tanh(v1 / ROUNDED)) / m_1
    a2 = (-link - c_2 * v2 - f_2c * math.tanh(v2 / ROUNDED)) / m_2
    return np.array([v1, v2, a1, a2, ((damping * v1 if u != 0 else 0.0) - braking) / relaxation])


@njit(cache=True)
def moved(p: Array, start: Array, u: Array, dt: float) -> Array:
    """Positions (N, 2) of carts that are at rest at `start`, by the classical Runge-Kutta method; `p` as `ASKED`."""
    y, h = np.empty((u.size, 2)), dt / STEPS
    x = np.array([start[0], start[1], 0.0, 0.0, 0.0])
    for i in range(u.size):
        y[i] = x[:2]
        for _ in range(STEPS):
            k1 = _slope(x, p, u[i])
            k2 = _slope(x + h / 2 * k1, p, u[i])
            k3 = _slope(x + h / 2 * k2, p, u[i])
            x = x + h / 6 * (k1 + 2 * k2 + 2 * k3 + _slope(x + h * k3, p, u[i]))
    return y


def simulated(p: Array, zeros: Array, run: Run) -> Array:
    """Positions of a run as its encoders show them: `zeros` are their readings where the springs are slack."""
    return moved(p, run.y[0] - zeros, run.u, run.dt) + zeros


def missed(p: Array, zeros: Array, run: Run) -> Array:
    """Predicted less measured in units of each cart's spread."""
    return ((simulated(p, zeros, run) - run.y) / run.y.std(axis=0)).ravel()


def runs(data: Path) -> tuple[list[Run], Array, list[str]]:
    """The three runs, the guesses, and what the runs are called."""
    study = load_study(STUDIES / f"{STUDY}.toml", data=data)
    found = [Run(u=np.ravel(r.u), y=r.y, dt=float(np.median(np.diff(r.t)))) for r in study.runs]
    return found, np.array([study.model.parameters[n].value for n in ASKED]), [run.label for run in study.runs]


def _residual(fitted: list[Run], guesses: Array) -> Callable[[Array], Array]:
    """Of numbers in units of their guesses, then of two zeros of each run in millimetres."""

    def of(x: Array) -> Array:
        p = np.maximum(x[: guesses.size] * guesses, 1e-9)
        zeros = 1e-3 * x[guesses.size :].reshape(-1, 2)
        return np.concatenate([missed(p, z, run) for z, run in zip(zeros, fitted, strict=True)])

    return of


def with_scipy(fitted: list[Run], guesses: Array) -> Array:
    """Numbers by `least_squares` with bounds."""
    x = np.concatenate([np.ones(guesses.size), np.zeros(2 * len(fitted))])
    low = np.concatenate([np.full(guesses.size, 1e-4), np.full(2 * len(fitted), -20.0)])
    of = _residual(fitted, guesses)
    found = least_squares(of, x, bounds=(low, 20.0), x_scale="jac", diff_step=1e-4, max_nfev=100)
    return found.x[: guesses.size] * guesses


def with_lmfit(fitted: list[Run], guesses: Array) -> Array:
    """Numbers by `lmfit.minimize`, bounds as lmfit transforms them."""
    import lmfit

    parameters = lmfit.Parameters()
    for k in range(guesses.size):
        parameters.add(f"p_{k}", value=1.0, min=1e-4, max=20.0)
    for k in range(2 * len(fitted)):
        parameters.add(f"zero_{k}", value=0.0)
    of = _residual(fitted, guesses)
    found = lmfit.minimize(
        lambda p: of(np.array([v.value for v in p.values()])), parameters, method="leastsq", epsfcn=1e-8, max_nfev=5000
    )
    return np.array([v.value for v in found.params.values()])[: guesses.size] * guesses


def with_upright(data: Path, left_out: int) -> Predictor:
    """What the public study predicts of a run from the others, dry friction the same in all as for everybody."""
    text = (STUDIES / f"{STUDY}.toml").read_text(encoding="utf-8")
    study = load_study(Path("carts.toml"), data=data, text=text.replace(', "friction"]', "]"))
    fit = identify(study.model, [replace(r, role="predict") if k == left_out else r for k, r in enumerate(study.runs)])
    score = fit.runs[study.runs[left_out].label]
    return lambda run: run.y + (score.simulated - score.y)  # in the readings' own zeros


def physical(p: Array) -> Predictor:
    """Positions of a run by these numbers, its two zeros refitted."""

    def predicted(run: Run) -> Array:
        zeros = least_squares(lambda z: missed(p, 1e-3 * z, run), np.zeros(2)).x
        return simulated(p, 1e-3 * zeros, run)

    return predicted


def _coarse(run: Run, step: int) -> tuple[Array, Array]:
    """Command and positions from where the run begins, every `step` samples."""
    return run.u[::step], (run.y - run.y[0])[::step]


def _arx(fitted: list[Run], step: int) -> Array:
    """Coefficients of one denominator and of a numerator for each cart (3 ORDER,), by least squares of one step."""
    rows: list[Array] = []
    aims: list[Array] = []
    for run in fitted:
        u, y = _coarse(run, step)
        at = np.arange(ORDER, u.size)
        past = np.stack([u[at - k] for k in range(1, ORDER + 1)], axis=1)
        for j in range(2):
            own = np.stack([-y[at - k, j] for k in range(1, ORDER + 1)], axis=1)
            columns = [own, *(past if i == j else np.zeros_like(past) for i in range(2))]
            size = y[:, j].std()
            rows.append(np.hstack(columns) / size)
            aims.append(y[at, j] / size)
    return np.linalg.lstsq(np.concatenate(rows), np.concatenate(aims), rcond=None)[0]


def _linear(x: Array, u: Array) -> Array:
    """Positions (N, 2) by such coefficients, from rest."""
    denominator = np.concatenate([[1.0], x[:ORDER]])
    with np.errstate(over="ignore", invalid="ignore"):
        y = [lfilter(np.concatenate([[0.0], b]), denominator, u) for b in x[ORDER:].reshape(2, ORDER)]
    return np.nan_to_num(np.column_stack(y), nan=1e3, posinf=1e3, neginf=-1e3).clip(-1e3, 1e3)


def _refined(x: Array, fitted: list[Run], step: int) -> Array:
    """Coefficients whose free runs miss least (OE), from a start."""

    def residual(x: Array) -> Array:
        parts = [(_linear(x, u) - y) / y.std(axis=0) for u, y in (_coarse(run, step) for run in fitted)]
        return np.concatenate(parts).ravel()

    return least_squares(residual, x, x_scale="jac", max_nfev=200).x


def linear(fitted: list[Run], *, output_error: bool) -> Predictor:
    """ARX, or OE from it, with the decimation by which a fit of the first run predicts the second best."""

    def solved(some: list[Run], step: int) -> Array:
        x = _arx(some, step)
        return _refined(x, some, step) if output_error else x

    def by(x: Array, step: int) -> Predictor:
        def predicted(run: Run) -> Array:
            y = _linear(x, run.u[::step])
            t = np.arange(run.u.size)
            return np.column_stack([np.interp(t, t[::step], column) for column in y.T]) + run.y[0]

        return predicted

    first, second = fitted
    step = max(DECIMATIONS, key=lambda n: sum(percent(second, by(solved([first], n), n)(second))))
    return by(solved(fitted, step), step)


def percent(run: Run, predicted: Array) -> list[float]:
    """Fit percent of each cart, 100 (1 - |y - y_hat| / |y - mean y|)."""
    off, span = np.linalg.norm(run.y - predicted, axis=0), np.linalg.norm(run.y - run.y.mean(axis=0), axis=0)
    return (100 * (1 - off / span)).tolist()


def table(data: Path, progress: Callable[[str], None]) -> list[str]:
    """Rows of the page."""
    every, guesses, labels = runs(data)
    moved(guesses, every[0].y[0], every[0].u[:10], every[0].dt)  # compiles

    def others(left_out: int) -> list[Run]:
        return [run for k, run in enumerate(every) if k != left_out]

    ways: dict[str, Way] = {
        "upright": lambda k: with_upright(data, k),
        "scipy least_squares": lambda k: physical(with_scipy(others(k), guesses)),
        "lmfit": lambda k: physical(with_lmfit(others(k), guesses)),
        "OE": lambda k: linear(others(k), output_error=True),
        "ARX": lambda k: linear(others(k), output_error=False),
        "the guesses": lambda _: physical(guesses),
    }
    out = [f"| | {' | '.join(labels)} | seconds for one |", f"|---|{'--:|' * (len(every) + 1)}"]
    for name, way in ways.items():
        progress(f"carts: {name}")
        begin = spent()
        predictors = [way(k) for k in range(len(every))]
        seconds = (spent() - begin) / len(every)
        cells = [_cell(percent(run, predict(run))) for run, predict in zip(every, predictors, strict=True)]
        out.append(f"| {name} | {' | '.join(cells)} | {seconds:.2g} |")
    return out


def _cell(percents: list[float]) -> str:
    return " / ".join(f"{p:.1f}" if p > -100 else "< -100" for p in percents)
