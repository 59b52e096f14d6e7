"""A run that is left out has no say, what was computed survives Ctrl-C, and repeats and errors are what they should."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from tests.identification.twins import FURUTA, PENDULUM, noisy, rig, shaken, swing
from upright.errors import BadInput
from upright.identification import Run, RunScore
from upright.identification.estimate import identify
from upright.identification.ladder.cross_validation import HeldOut, cross_validate, leave_one_out
from upright.identification.ladder.decision import by_chance, compare_rungs, gain_scatter
from upright.identification.ladder.repeats import repeats, same
from upright.physics import Furuta, Pendulum

QUESTION = rig(Pendulum, {**PENDULUM, "b_2q": 0.0, "b_2c": 0.0}, {"J_p": 3e-3, "b_2": 1e-3})
RUNS = [
    noisy(swing({**PENDULUM, "b_2q": 0.0, "b_2c": 0.0}, angle=a, seconds=6.0, label=f"{a}"), 1e-3, seed=k)
    for k, a in enumerate((1.5, 1.0, 0.6))
]


def left(runs: list[Run]) -> dict[str, HeldOut]:
    return {one.label: one for one in leave_one_out(QUESTION, runs, {"J_p": 2.2e-3, "b_2": 1.8e-3}).all()}


def test_the_run_that_is_left_out_has_no_say():
    nonsense = np.random.default_rng(9).normal(size=RUNS[1].y.shape)
    before, after = left(RUNS), left([RUNS[0], replace(RUNS[1], y=nonsense), RUNS[2]])
    assert after["1.0"].values == before["1.0"].values
    assert after["1.5"].values != before["1.5"].values


def test_every_run_is_predicted_as_well_as_it_is_fitted_when_the_model_is_right():
    """Three numbers among 601 samples of noise change a fit by about 3/601 of what is missed."""
    crossed = cross_validate(identify(QUESTION, RUNS), RUNS)
    assert not crossed.interrupted
    for label, score in crossed.fitted.items():
        fitted, predicted = 100 - score.fit_percent["theta"], 100 - crossed.predicted[label].fit_percent["theta"]
        assert predicted == pytest.approx(fitted, rel=0.02)


def test_what_was_computed_survives_an_interruption():
    def stop(stage: str, share: float) -> None:
        if "without 1.0" in stage:
            raise KeyboardInterrupt

    crossed = cross_validate(identify(QUESTION, RUNS), RUNS, progress=stop)
    assert crossed.interrupted
    assert set(crossed.predicted) == {"1.5"}
    assert set(crossed.fitted) == {"1.5", "1.0", "0.6"}


@pytest.mark.slow
def test_a_parameter_that_one_run_alone_sees_is_named():
    """With the pendulum locked, an arm says nothing about the hinge's friction."""
    free = shaken(seconds=2.0, label="free")
    locked = replace(shaken(seconds=2.0, label="locked"), held={"theta": 0.0}, measured=("psi",), y=free.y[:, :1])
    question = rig(Furuta, FURUTA, {"J_d": 7e-3, "b_2": 1e-4})
    found = {one.label: one for one in leave_one_out(question, [free, locked], {}).all()}
    assert found["free"].blind == ("b_2",)
    assert found["locked"].blind == ()


def test_one_run_cannot_be_left_out():
    fit = identify(QUESTION, RUNS[:1])
    with pytest.raises(BadInput, match="two runs"):
        cross_validate(fit, RUNS[:1])


def step(seed: int, volts: float = 1.0, before: int = 200, sigma: float = 0.05, **more: object) -> Run:
    """A response that rises after a standstill, with white noise."""
    n, dt = 4000, 1e-3
    t = np.arange(n) * dt
    u = np.where(np.arange(n) >= before, volts, 0.0)[:, None]
    rise = np.where(np.arange(n) >= before, 1 - np.cos(5 * dt * (np.arange(n) - before)), 0.0)
    y = volts * rise + sigma * np.random.default_rng(seed).normal(size=n) + 0.3 * seed
    fields = {"label": f"step {seed}", "role": "fit", "measured": ("theta",)} | more
    return Run(t=t, u=u, y=y[:, None], **fields)  # type: ignore[arg-type]


def test_two_noisy_copies_predict_each_other_as_the_closed_form_says():
    """``1 - sqrt(2 (1 + 1/m)) sigma/spread``: noise of both, and of the m samples that the offset is taken from."""
    sigma, m = 0.05, 200
    (group,) = repeats([step(k, sigma=sigma) for k in range(4)])
    clean = step(0, sigma=0.0).y[:, 0]
    spread = math.sqrt(np.var(clean) + sigma**2)
    expected = 100 * (1 - math.sqrt(2 * (1 + 1 / m)) * sigma / spread)
    assert group.labels == tuple(f"step {k}" for k in range(4))
    # 4000 samples of noise know their own deviation to 1/sqrt(2 4000), and the offset to sigma/sqrt(m)
    assert group.ceiling["theta"] == pytest.approx(expected, abs=0.02 * (100 - expected))
    assert len(group.percents["theta"]) == 12


def test_commands_decide_what_repeats_what():
    one = step(1)
    assert same(one, step(2))
    assert same(one, step(2, before=230))  # starts later
    assert not same(one, step(2, volts=1.2))
    assert not same(one, replace(step(2), held={"psi": 0.0}))
    assert not same(one, replace(step(2), known={"m_p": 0.3}))
    free = replace(one, u=0 * one.u)
    assert not same(free, replace(free, label="other"))
    assert same(replace(free, repeats="by hand"), replace(free, label="other", repeats="by hand"))
    assert not same(replace(one, repeats="a"), step(2))


def scored(y: np.ndarray, missed: np.ndarray, label: str = "run") -> RunScore:
    t = np.arange(y.size) * 0.01
    return RunScore(role="predict", fit_percent={"theta": 0.0}, horizon=None, t=t, y=y[:, None],
                    simulated=(y - missed)[:, None], measured=("theta",))  # fmt: skip


@pytest.mark.parametrize("runs", [1, 3])
def test_half_the_error_is_a_gain_of_log_2_without_scatter(runs):
    generator = np.random.default_rng(1)
    y, e = generator.normal(size=(2, 1000))
    poorer = [scored(y, e) for _ in range(runs)]
    found = compare_rungs(poorer, [scored(y, e / 2) for _ in range(runs)], [np.zeros(1)] * runs)
    assert found.gain == pytest.approx(math.log(2), rel=1e-9)
    assert found.scatter < 1e-9
    assert found.better
    assert not compare_rungs(poorer, poorer, [np.zeros(1)] * runs).better


def test_an_error_below_rounding_is_no_error():
    y, e = np.random.default_rng(2).normal(size=(2, 1000))
    tiny = [scored(y, 1e-6 * e)]
    found = compare_rungs(tiny, [scored(y, 1e-7 * e)], [np.full(1, 1e-2)])
    assert found.gain == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("gains", [(0.1, 0.2), (0.3, -0.1, 0.2, 0.05)])
def test_the_scatter_is_students(gains):
    """One sigma of Student's distribution times the standard error of the mean, as scipy's statistics have both."""
    expected = stats.t.ppf(stats.norm.cdf(1), len(gains) - 1) * stats.sem(gains)
    assert gain_scatter(np.array(gains)) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("terms", [1, 3])
def test_terms_that_mean_nothing_lower_a_cost_by_chi_squared(terms):
    assert by_chance(terms, 0.2) == pytest.approx(0.04 * stats.chi2.ppf(0.95, terms), rel=1e-9)
    assert by_chance(0, 0.2) == 0
