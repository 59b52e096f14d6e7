"""Do bands hold a log whose friction and gain are those of another day?"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.identification.twins import FURUTA, noisy, rig
from upright.identification import GreyBox, Parameter, Run
from upright.identification.estimate import identify
from upright.identification.inference.unseen.days import FRICTION, GAIN, MANY, daily_moves, of_another_day
from upright.identification.model.bands import Bands
from upright.identification.problem.residuals import formulate
from upright.physics import Furuta
from upright.simulation import simulate

DT, N, VOLT = 5e-3, 1201, 0.05
FRICTIONS = ("b_1", "b_2", "b_1c", "b_2c")


def steps(rng: np.random.Generator) -> np.ndarray:
    """Volts (N, 1) of random height and length."""
    u = np.zeros(N)
    at = 0
    while at < N:
        length = int(rng.uniform(0.3, 1.5) / DT)
        u[at : at + length] = rng.choice([0.0, 1.0, -1.0, 0.6, -0.6])
        at += length
    return u[:, None]


def logged(name: str, role: str, seed: int, friction: float = 1.0, gain: float = 1.0) -> Run:
    """A Furuta pendulum that hangs, is let go and driven on a day of its own."""
    rng = np.random.default_rng(seed)
    u = steps(rng)
    day = FURUTA | {n: friction * FURUTA[n] for n in FRICTIONS}
    x = simulate(
        Furuta(**day), {"actuator.gain": gain * VOLT}, [0.0, 0.0, 0.8, 0.0], u, DT, samples=N, substeps=2
    )  # fmt: skip
    run = Run(
        label=name, role=role, t=np.arange(N) * DT, u=u, y=x[:, [0, 2], 0], measured=("psi", "theta"),
        source=f"{name}.csv (sha256 {seed}); 0 to 6 s",
    )  # type: ignore[arg-type]  # fmt: skip
    return noisy(run, 2e-3, seed=seed)


def driven(guesses: dict[str, float]) -> GreyBox:
    """The rig, its drive's gain asked for where other numbers are."""
    asked = rig(Furuta, FURUTA, guesses)
    off = 1.2 if guesses else 1.0
    volt = Parameter(name="actuator.gain", value=off * VOLT, unit="N m/V", estimate=bool(guesses), lower=0.0)
    return replace(asked, parameters={**asked.parameters, volt.name: volt}, substeps=2)


def test_bands_hold_logs_of_other_days_as_often_as_they_promise():
    """Friction and gain of each held-out log are drawn. 85 to 95 % was asked; ten rigs leave 3 % to chance."""
    day, guesses = np.random.default_rng(5), {"J_d": 0.006, "b_1": 6e-3, "b_1c": 1.5e-3, "b_2": 3e-4}
    inside: list[float] = []
    for seed in range(0, 20, 2):
        friction, gain = np.exp(np.array([FRICTION, GAIN]) * day.normal(size=2))
        other = logged("other", "predict", seed + 1, friction, gain)
        fit = identify(driven(guesses), [logged("one", "fit", seed), other])
        inside += fit.runs["other"].inside.values()
    assert 85 <= np.mean(inside) <= 98


def test_what_a_day_adds_is_the_mean_square_over_its_factors():
    """Of 1000 days drawn, friction and gain one at a time. Slopes would say a quarter more of the pendulum."""
    problem = formulate(driven({}), [logged("one", "predict", 1)], thin=False)
    factors = {"friction": FRICTION, "gain": GAIN}
    told = np.sum(daily_moves(problem, problem.start, factors) ** 2, axis=-1)
    rng, lanes = np.random.default_rng(0), 1000
    u, x0 = problem.tracks[0].run.u, problem.value(problem.start)
    expected = np.zeros(told.shape)
    for name, sigma in factors.items():
        drawn = np.exp(sigma * rng.normal(size=lanes))
        drawn[0] = 1.0
        values = {"actuator.gain": VOLT * (drawn if name == "gain" else np.ones(lanes))}
        values |= {n: FURUTA[n] * drawn for n in FRICTIONS if name == "friction"}
        y = simulate(Furuta(**FURUTA), values, x0, u, DT, samples=N, substeps=2)[:, [0, 2]]
        expected += np.mean((y - y[..., :1]) ** 2, axis=-1)
    assert np.sqrt(told.mean(axis=0)) == pytest.approx(np.sqrt(expected.mean(axis=0)), rel=0.1)


def test_a_log_of_its_own_has_another_friction_and_gain_unless_it_says_so_itself_or_many_were_fitted():
    run = logged("b", "predict", 1)
    names, C = ("b_1", "actuator.gain"), np.zeros((2, 2))
    bands = Bands(quantile=1.645, spreads={}, names=names, covariance=C, logs=("a.csv (sha256 0)",))
    assert of_another_day(bands, run) == {"friction": FRICTION, "gain": GAIN}
    assert of_another_day(replace(bands, names=("b_1", "J_d")), run) == {"friction": FRICTION}
    assert of_another_day(bands, replace(run, u=0 * run.u)) == {"friction": FRICTION}
    assert of_another_day(bands, replace(run, unknown=("initial", "gain"))) == {"friction": FRICTION}
    assert of_another_day(bands, replace(run, shared={"friction": "Tuesday"})) == {"gain": GAIN}
    assert not of_another_day(bands, replace(run, source="a.csv (sha256 0); 6 to 9 s"))
    assert not of_another_day(bands, replace(run, source=""))
    assert not of_another_day(replace(bands, logs=tuple(f"{k}.csv" for k in range(MANY))), run)
