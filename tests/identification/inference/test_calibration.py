"""Bands of a mass that rolls freely under a known command: a linear problem, so every step is a textbook's.

``x = x_0 + v_0 t + (g/m) F`` with F the double integral of a command held over each sample.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy import stats

from upright.identification import GreyBox, Parameter, Run
from upright.identification.inference.covariance import Optimum, assess
from upright.identification.inference.scoring import predict, score_run
from upright.identification.inference.unseen.bands import calibrated, recalibrated, sensitivity
from upright.identification.model.bands import Bands, Spread
from upright.identification.problem.residuals import Problem, formulate
from upright.identification.problem.simulated import with_noise
from upright.identification.search.descent import descend
from upright.physics import find
from upright.signals.memory import automatic_span, long_run, lost_share, memory

CART = find("rectilinear-1")
DT, N, MASS, GAIN = 0.01, 400, 2.0, 3.0


def cart(*, estimate: bool = True) -> GreyBox:
    """The mass is known, the gain asked."""
    numbers = [
        Parameter(name="m_1", value=MASS, unit="kg"),
        Parameter(name="k_1", value=0.0, unit="N/m"),
        Parameter(name="actuator.gain", value=GAIN, unit="N/V", estimate=estimate),
    ]
    return GreyBox(plant=CART, parameters={p.name: p for p in numbers})


def command(index: int) -> np.ndarray:
    t = DT * np.arange(N)
    return np.sign(np.sin((2.0 + index) * t + index))


def twice_integrated(u: np.ndarray) -> np.ndarray:
    """Position of a unit mass that a force held over each sample moves from rest."""
    v = np.concatenate([[0.0], np.cumsum(u[:-1]) * DT])
    return np.concatenate([[0.0], np.cumsum(v[:-1] * DT + u[:-1] * DT**2 / 2)])


def rolled(index: int, **about: Any) -> Run:
    """A run that no gain explains: it wanders, and a seventh of its samples lie far off; another gain in each run."""
    t, u = DT * np.arange(N), command(index)
    y = 0.1 + 0.2 * t + GAIN * (1 + 0.02 * index) / MASS * twice_integrated(u)
    chance = np.random.default_rng(index)
    burst = np.where(np.arange(N) % 50 < 7, 0.3, 0.0) * (-1.0) ** np.arange(N)
    y += 0.02 * np.sin(7.0 * t + index) * t + 1e-3 * chance.normal(size=N) + burst
    base = {"label": f"run {index}", "role": "fit", "t": t, "u": u[:, None], "y": y[:, None], "measured": ("x_1",)}
    return Run(**{**base, **about})


def columns(index: int) -> np.ndarray:
    """Slopes (N, 3) by gain, first position and first speed."""
    return np.column_stack([twice_integrated(command(index)) / MASS, np.ones(N), DT * np.arange(N)])


@cache
def fitted(runs: int, horizon: float | None = None) -> Optimum:
    problem = formulate(cart(), [rolled(i, horizon=horizon) for i in range(runs)])
    x = descend(problem.normal, problem.start, problem.lower, problem.upper, tolerance=1e-12, limit=30).x
    return assess(problem, x)


def follower(problem: Problem, index: int, upto: int, slope: np.ndarray) -> np.ndarray:
    """The slope by gain of a run whose first state is fitted, with what is known of it, to its first samples."""
    track, w = problem.tracks[index], problem.tracks[index].weights[0]
    own = [u for u in problem.unknowns if index in u.runs]
    prior = np.diag([problem.noise / u.prior[1] for u in own])
    A = np.concatenate([w * slope[:upto, 1:], prior])
    b = np.concatenate([w * slope[:upto, 0], np.zeros(2)])
    assert track.first == 0
    return slope[:, 0] - slope[:, 1:] @ np.linalg.lstsq(A, b, rcond=None)[0]


@dataclass(frozen=True)
class Expected:
    variance: float
    quantile: float
    spread: float


def left_out_in_turn(best: Optimum, pieces: int) -> Expected:
    """Every block's step by solving the whole least-squares problem again with a hundredth of that block's weight."""
    problem, runs = best.problem, len(best.problem.tracks)
    size = 1 + 2 * runs
    rows, target, place = [], [], []
    for i, track in enumerate(problem.tracks):
        J = np.zeros((N, size))
        J[:, [0, 1 + 2 * i, 2 + 2 * i]] = columns(i)
        rows.append(track.weights[0] * J)
        target.append(track.weights[0] * track.run.y[:, 0])
        place += [(i, cut) for cut in np.array_split(np.arange(N), pieces)]
    r, P = problem.prior_rows(np.zeros(size))
    A, b = np.concatenate([*rows, P]), np.concatenate([*target, -r])
    x = np.linalg.lstsq(A, b, rcond=None)[0]
    assert x == pytest.approx(best.x, abs=1e-5)
    steps = []
    for i, cut in place:
        weight = np.ones(len(A))
        weight[i * N + cut] = 0.1  # of the residual
        steps.append(np.linalg.lstsq(weight[:, None] * A, weight * b, rcond=None)[0] - x)
    B = len(steps)
    few = stats.t.ppf(0.95, max(B - 1, 2)) / 1.645
    moved = np.array(steps)
    C = best.sandwich + few**2 * (B - 1) ** 2 / B * (1 + 1 / B) * moved.T @ moved
    errors = [columns(i) @ x[[0, 1 + 2 * i, 2 + 2 * i]] - t.run.y[:, 0] for i, t in enumerate(problem.tracks)]
    spread = float(np.sqrt(np.mean(np.concatenate(errors) ** 2)))
    missed = []
    for (i, cut), step in zip(place, steps, strict=True):
        own = [0, 1 + 2 * i, 2 + 2 * i]
        slope = columns(i)
        if pieces == 1:  # a run that is left out says how it began
            slope = np.column_stack([follower(problem, i, N, slope), np.zeros((N, 2))])
        error = errors[i][cut] + slope[cut] @ step[own]
        variance = np.einsum("ti,ij,tj->t", slope[cut], C[np.ix_(own, own)], slope[cut])
        missed.append(np.abs(error) / np.sqrt(spread**2 + variance))
    return Expected(
        variance=float(C[0, 0]), quantile=float(np.quantile(np.concatenate(missed), 0.9)), spread=spread
    )  # fmt: skip


@pytest.mark.parametrize(("runs", "pieces"), [(1, 4), (2, 2), (3, 2), (5, 1)])
def test_bands_are_calibrated_on_blocks_predicted_by_fits_of_the_others(runs: int, pieces: int) -> None:
    """Four blocks at least, a run whole where there are so many runs."""
    best = fitted(runs)
    expected, bands = left_out_in_turn(best, pieces), calibrated(best)
    assert bands is not None
    assert bands.names == ("actuator.gain",)
    # a step takes the whole gradient of a block away and 99 % of its weight
    assert bands.covariance[0, 0] == pytest.approx(expected.variance, rel=0.05)
    assert 1.7 < expected.quantile < 4.9
    assert bands.quantile == pytest.approx(expected.quantile, rel=0.02)
    (spread,) = bands.spreads["x_1"]
    assert (spread.start, spread.end, spread.horizon) == (*(pytest.approx(expected.spread, rel=1e-3),) * 2, 0.0)


def test_a_run_of_few_samples_is_one_block_and_one_block_calibrates_nothing() -> None:
    short = rolled(0).samples(slice(199))
    problem = formulate(cart(), [short])
    best = assess(problem, descend(problem.normal, problem.start, problem.lower, problem.upper).x)
    bands = calibrated(best)
    assert bands is not None
    assert bands.quantile == 1.645
    assert bands.covariance[0, 0] == pytest.approx(best.sandwich[0, 0], rel=1e-9)


def test_the_errors_of_restarted_runs_grow_with_their_age() -> None:
    """Through the mean squares of an early and a late half of the windows, ``start^2 + growth age^2``."""
    best = fitted(2, 0.5)
    bands = calibrated(best)
    assert bands is not None
    told = [score_run(best.problem, i, best.x) for i in range(2)]
    missed = np.concatenate([s.simulated[:, 0] - s.y[:, 0] for s in told]) ** 2
    age = np.concatenate([np.tile(DT * np.arange(1, 51), len(s.t) // 50) for s in told])
    early = age <= 0.25 + 1e-9
    ends = [(np.mean(age[side] ** 2), np.mean(missed[side])) for side in (early, ~early)]
    growth = (ends[1][1] - ends[0][1]) / (ends[1][0] - ends[0][0])
    assert growth > 0
    start = np.mean(missed) - growth * np.mean(age**2)
    least = min((1e-3 * np.std(t.run.y)) ** 2 for t in best.problem.tracks)
    (spread,) = bands.spreads["x_1"]
    assert spread.horizon == 0.5
    assert spread.end == pytest.approx(np.sqrt(max(start, least) + growth * 0.25), rel=1e-6)
    assert spread.start == pytest.approx(np.sqrt(max(start, least)), rel=1e-6)


@pytest.mark.parametrize(("resolution", "least"), [(0.0, 1e-3), (0.3, 0.3 / 12**0.5)])
def test_nothing_is_promised_finer_than_a_count_or_a_line(resolution: float, least: float) -> None:
    """Of a run that is met exactly: rounding's deviation, or a thousandth of how much the signal varies."""
    run = rolled(0, resolution=(resolution,))
    y = (0.1 + 0.2 * run.t + GAIN / MASS * twice_integrated(command(0)))[:, None]
    problem = formulate(cart(), [replace(run, y=y)])
    bands = calibrated(assess(problem, problem.place({"run 0: initial.x_1": 0.1, "run 0: initial.x_1_dot": 0.2})))
    assert bands is not None
    expected = least if resolution else least * float(np.std(y))
    assert bands.spreads["x_1"][0].end == pytest.approx(expected, rel=1e-3)


PROMISE = Bands(
    quantile=2.0,
    spreads={"x_1": (Spread(horizon=0.0, start=0.01, end=0.01), Spread(horizon=0.5, start=0.02, end=0.1))},
    names=("m_1", "actuator.gain"), covariance=np.array([[0.04, 0.01], [0.01, 0.09]]),
)  # fmt: skip
KNOWN = {"m_1": MASS, "k_1": 0.0, "actuator.gain": GAIN}


def uncertain(by_gain: np.ndarray) -> np.ndarray:
    """Variance of a position, of its slopes by mass and by gain."""
    slope = np.column_stack([-GAIN / MASS * by_gain, by_gain])
    return np.einsum("ti,ij,tj->t", slope, PROMISE.covariance, slope)


@pytest.mark.parametrize("seconds", [0.0, 1.0])
def test_a_band_is_the_root_of_two_variances_and_the_run_says_how_it_began(seconds: float) -> None:
    """From its samples before those that are scored, where some are scored only."""
    run = rolled(1, role="predict", score_from=seconds)
    told = predict(KNOWN, cart(estimate=False), [run], bands=PROMISE)["run 1"]
    problem = formulate(cart(estimate=False), [run], thin=False)
    problem.tracks[0] = replace(problem.tracks[0], first=0)
    slope = columns(1)
    own = problem.unknowns
    w = problem.tracks[0].weights[0]
    upto = round(seconds / DT) or N
    A = np.concatenate([w * slope[:upto, 1:], np.diag([problem.noise / u.prior[1] for u in own])])
    b = np.concatenate([np.outer(w * slope[:upto, 0], [1, 0, 0]), problem.noise * np.eye(2, 3, 1)])
    follow = np.linalg.lstsq(A, b, rcond=None)[0]  # the gain, and an error of one sigma of each measured first state
    by_gain = slope[:, 0] - slope[:, 1:] @ follow[:, 0]
    began = np.sum((slope[:, 1:] @ follow[:, 1:]) ** 2, axis=1)
    assert told.band["x_1"] == pytest.approx(2.0 * np.sqrt(0.01**2 + uncertain(by_gain) + began), rel=1e-4)


@pytest.mark.parametrize("off", [0.02, 0.2, 0.5])
def test_a_prediction_with_a_gain_that_is_one_sigma_off_misses_by_one_sigma_at_most(off: float) -> None:
    """However badly that explains the run, and then its first state is taken as it was measured."""
    run = rolled(1, role="predict")
    run = replace(run, y=(0.1 + 0.2 * run.t + GAIN * (1 + off) / MASS * twice_integrated(command(1)))[:, None])
    spread = {"x_1": (Spread(horizon=0.0, start=1e-9, end=1e-9),)}
    bands = replace(PROMISE, spreads=spread, names=("actuator.gain",), covariance=np.array([[(GAIN * off) ** 2]]))
    told = predict(KNOWN, cart(estimate=False), [run], bands=bands)["run 1"]
    missed, sigma = np.abs(told.simulated - told.y)[:, 0], told.band["x_1"] / bands.quantile
    assert np.all(missed <= 1.001 * sigma)
    assert missed.max() > 0.9 * sigma.max()


def test_a_band_of_a_restarted_run_widens_with_the_age_of_its_windows() -> None:
    """Nothing is sought in it: each window starts where it was measured, and its command acts from there on."""
    run = rolled(1, role="predict", horizon=0.5)
    told = predict(KNOWN, cart(estimate=False), [run], bands=PROMISE)["run 1"]
    u = command(1)
    windows = [twice_integrated(u[i : i + 51])[1:] / MASS for i in range(0, N - 50, 50)]
    age = DT * np.arange(1, 51)
    left = 0.02**2 + (0.1**2 - 0.02**2) * (age / 0.5) ** 2
    width = [2.0 * np.sqrt(left + uncertain(w)) for w in windows]
    assert told.band["x_1"] == pytest.approx(np.concatenate(width), rel=1e-4)


def test_windows_are_laid_end_to_end_and_scored_from_where_it_is_asked() -> None:
    """Every sample but the first once, each with the time and the reading that it had in the run."""
    run = rolled(1, role="predict", horizon=0.5, score_from=2.0)
    run = replace(run, t=run.t + 5.0)
    problem = formulate(cart(), [run], thin=False)
    told = score_run(problem, 0, problem.start)
    assert told.t == pytest.approx(5.0 + DT * np.arange(1, 351))
    assert told.y[:, 0] == pytest.approx(run.y[1:351, 0])
    assert (told.horizon, told.score_from, told.role, told.measured) == (0.5, 2.0, "predict", ("x_1",))
    late = told.t >= 7.0 - 1e-9
    missed, moved = told.y[late] - told.simulated[late], told.y[late] - told.y[late].mean()
    expected = 100 * (1 - np.linalg.norm(missed) / np.linalg.norm(moved))
    assert told.fit_percent["x_1"] == pytest.approx(expected)
    start = np.array([problem.tracks[0].x0[i] for i in range(7)])
    lasting = (start[:, :1] + start[:, 1:] * DT * np.arange(1, 51)).reshape(-1, 1)
    naive = 100 * (1 - np.linalg.norm(told.y[late] - lasting[late]) / np.linalg.norm(moved))
    assert told.naive["x_1"] == pytest.approx(naive)


def test_slopes_of_the_outputs_are_in_their_own_unit() -> None:
    best = fitted(2)
    met = sensitivity(best.problem, 1, best.x)
    assert met.slope[:, 0] == pytest.approx(columns(1), abs=1e-6)
    assert met.age == pytest.approx(DT * np.arange(N))
    expected = columns(1) @ best.x[[0, 3, 4]] - best.problem.tracks[1].run.y[:, 0]
    assert met.error[:, 0] == pytest.approx(expected, abs=1e-6)


def test_a_filtered_run_is_met_as_far_ahead_as_it_is_judged() -> None:
    run = rolled(0, horizon=(0.1, 0.3), restart="kalman")
    asked = formulate(with_noise(cart(), [run]), [run])
    told, problem = score_run(asked, 0, asked.start, 0.1), asked.ahead(0.1)
    met = sensitivity(problem, 0, problem.start)
    assert met.error == pytest.approx(told.simulated - told.y, abs=1e-9)
    assert met.age == pytest.approx(np.full(len(told.t), 0.1))
    assert (told.horizon, set(told.ahead)) == (0.1, {0.1, 0.3})
    ahead = problem.simulate(0, problem.start[:, None] + np.array([[1e-3, -1e-3], [0, 0], [0, 0]]), 1)[0, :, 0]
    assert met.slope[:, 0, 0] == pytest.approx((ahead[:, 0] - ahead[:, 1]) / 2e-3, rel=1e-3, abs=1e-9)


@pytest.mark.parametrize(("half", "quantile"), [(0.5, 5.0), (1e3, 1.645), (np.nan, 5.0)])
def test_bands_of_runs_left_out_are_neither_narrower_than_normal_nor_wider_than_five(
    half: float, quantile: float
) -> None:
    run = rolled(1)
    told = predict(KNOWN, cart(estimate=False), [run], bands=PROMISE)["run 1"]
    far = replace(told, simulated=told.y + 100.0, band={"x_1": np.full(N, half)})
    assert recalibrated(PROMISE, [far]).quantile == quantile
    bare = replace(told, band={})
    assert recalibrated(PROMISE, [bare]) is PROMISE


@pytest.mark.parametrize("runs", [1, 3])
def test_the_sandwich_is_that_of_the_textbook(runs: int) -> None:
    """Newey and West's sum of the scores for each run, between inverses; White's and the variance beside it."""
    best = fitted(runs)
    problem, size = best.problem, 1 + 2 * runs
    _, P = problem.prior_rows(best.x)
    A, meat, cost, independent, longest = P.T @ P, np.zeros((size, size)), 0.0, 0.0, 0.0
    for i, track in enumerate(problem.tracks):
        J = np.zeros((N, size))
        J[:, [0, 1 + 2 * i, 2 + 2 * i]] = track.weights[0] * columns(i)
        r = J @ best.x - track.weights[0] * track.run.y[:, 0]
        scores = J * r[:, None]
        own = scores[:, [0, 1 + 2 * i, 2 + 2 * i]]
        span = automatic_span(own)
        meat += long_run(scores, span) / (1 - lost_share(own, span))
        A += J.T @ J
        cost, independent, longest = cost + r @ r, independent + N / span, max(longest, memory(r[:, None], DT))
    inverse = np.linalg.inv(A)
    meat *= independent / max(independent - size, independent / 2)
    expected = inverse @ (meat + P.T @ P * problem.noise**2) @ inverse
    assert np.allclose(best.sandwich, expected, rtol=1e-3, atol=1e-6 * np.abs(expected).max())
    assert best.variance == pytest.approx(cost / (runs * N - size), rel=1e-6)
    assert best.white == pytest.approx(np.diag(inverse) * best.variance, rel=1e-4)
    assert best.samples == pytest.approx(independent)
    assert best.memory == pytest.approx(longest)
    assert np.allclose(best.matrix, A, rtol=1e-4, atol=1e-4 * np.abs(A).max())
    assert not best.pinned.any()
    assert np.all(np.diag(best.covariance) >= np.diag(best.sandwich) * (1 - 1e-12))
    if runs > 1:
        assert best.covariance[0, 0] >= spread_of_runs(best, inverse)


def spread_of_runs(best: Optimum, inverse: np.ndarray) -> float:
    """Variance of the gain by how far each run's gradient pulls it."""
    runs = len(best.problem.tracks)
    pulls = []
    for i, track in enumerate(best.problem.tracks):
        J = np.zeros((N, len(best.x)))
        J[:, [0, 1 + 2 * i, 2 + 2 * i]] = track.weights[0] * columns(i)
        pulls.append(inverse @ J.T @ (J @ best.x - track.weights[0] * track.run.y[:, 0]))
    return float(np.sum(np.array(pulls)[:, 0] ** 2)) * runs / (runs - 1)
