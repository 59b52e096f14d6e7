"""What a fit percent is, and what a black-box (ARX) baseline reaches of processes whose best prediction is known."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.signal import lfilter

from tests.identification.twins import PENDULUM, noisy, rig, swing
from upright.identification import predict
from upright.identification.inference.black_box import black_box
from upright.identification.inference.scoring import fit_percent
from upright.identification.model.runs import Run
from upright.physics import Pendulum

DT = 0.01


@pytest.mark.parametrize(
    ("y", "simulated", "percent"),
    [
        ([1.0, 3.0], [1.0, 3.0], 100.0),
        ([1.0, 3.0], [2.0, 2.0], 0.0),  # the mean
        ([1.0, 3.0], [1.5, 2.5], 50.0),  # misses by half as much as it moves
        ([1.0, 3.0], [3.0, 1.0], -100.0),
        ([1.0, 3.0], [12.0, 14.0], -1000.0),  # eleven times as much is the least that is told
        ([1.0, 3.0], [1e9, 0.0], -1000.0),
        ([1.0, 3.0], [math.inf, 0.0], -1000.0),
        ([1.0, 3.0], [math.nan, 0.0], -1000.0),
        ([2.0, 2.0], [2.0, 2.0], 100.0),
        ([2.0, 2.0], [2.0, 2.1], 0.0),
    ],
)
def test_a_fit_percent_is_what_is_not_missed_of_how_much_a_signal_moves(
    y: list[float], simulated: list[float], percent: float
) -> None:
    assert fit_percent(y, simulated) == pytest.approx(percent)


def logged(y: np.ndarray, label: str, *, u: np.ndarray | None = None, **about: Any) -> Run:
    t = DT * np.arange(len(y))
    u = np.zeros((len(y), 1)) if u is None else u[:, None]
    return replace(Run(label=label, role="fit", t=t, u=u, y=y.reshape(len(y), -1), measured=("x",)), **about)


A, H = 0.95, 10
"""Of ``y[k+1] = A y[k] + e`` the best prediction h steps on misses ``sqrt(1 - A^2h)`` of how much it varies."""


def wandering(seed: int, **about: Any) -> Run:
    e = np.random.default_rng(seed).normal(size=20_500)
    return logged(lfilter([1.0], [1.0, -A], e)[500:], f"run {seed}", **about)


@pytest.mark.parametrize(
    ("about", "percent"),
    [
        ({"horizon": H * DT}, 100 * (1 - math.sqrt(1 - np.mean(A ** (2.0 * np.arange(1, H + 1)))))),
        ({"horizon": H * DT, "restart": "kalman"}, 100 * (1 - math.sqrt(1 - A ** (2 * H)))),
        ({"horizon": (H * DT, 0.5), "restart": "kalman"}, 100 * (1 - math.sqrt(1 - A ** (2 * H)))),
    ],
)
def test_a_process_of_first_order_is_predicted_as_well_as_can_be(about: dict[str, Any], percent: float) -> None:
    """Windows count all their steps, a filter's prediction its last."""
    found = black_box([wandering(1)], wandering(2, **about), period=0.2)
    # 20,000 samples with a memory of 1/(1 - A) = 20 leave 3 % of a variance, 1.5 % of a deviation
    assert found["x"] == pytest.approx(percent, abs=2.0)


@pytest.mark.parametrize(("period", "steps"), [(20 * DT, 1), (40 * DT, 2), (100 * DT, 5)])
def test_a_step_is_a_twentieth_of_a_period_and_is_driven_by_the_mean_of_its_commands(period: float, steps: int) -> None:
    """``y[k+s] = 0.6 y[k] + mean(u[k..k+s-1])``: exact with this stride alone, commands being white."""

    def made(seed: int) -> Run:
        u = np.random.default_rng(seed).normal(size=600)
        y = np.zeros(600)
        for k in range(600 - steps):
            y[k + steps] = 0.6 * y[k] + u[k : k + steps].mean()
        return logged(y, f"run {seed}", u=u)

    assert black_box([made(1)], made(2), period=period)["x"] == pytest.approx(100.0, abs=1e-6)
    assert black_box([made(1)], made(2), period=2.2 * period)["x"] < 90.0
    # a horizon shorter than the period makes shorter steps
    ahead = black_box([made(1)], replace(made(2), horizon=period), period=50.0)
    assert ahead["x"] == pytest.approx(100.0, abs=1e-6)


def test_only_what_is_scored_counts() -> None:
    """The first half of the run is another process, which its equation cannot know."""
    seen, asked = wandering(1), wandering(2, horizon=DT)
    wild = np.where(np.arange(20_000)[:, None] < 10_000, 100 * np.random.default_rng(5).normal(size=(20_000, 1)), 0.0)
    late = black_box([seen], replace(asked, y=asked.y + wild, score_from=100.2), period=0.2)
    assert late["x"] == pytest.approx(100 * (1 - math.sqrt(1 - A**2)), abs=2.0)
    assert black_box([seen], replace(asked, y=asked.y + wild), period=0.2)["x"] < 30.0


def test_several_runs_are_fitted_together_and_others_passed_over() -> None:
    """Runs with other inputs, held coordinates or steps cannot say anything of this one."""
    asked, seen = wandering(2, horizon=DT), wandering(1)
    expected = 100 * (1 - math.sqrt(1 - A**2))
    white = logged(10 * np.random.default_rng(7).normal(size=20_000), "white")
    two = replace(white, u=np.zeros((20_000, 2)))
    slow = replace(white, t=white.t * 1.37)
    held = replace(white, y=np.hstack([white.y, white.y]), measured=("x", "z"), held={"z": white.y[:, 0]})
    assert black_box([seen, two, slow, held], asked, period=0.2)["x"] == pytest.approx(expected, abs=2.0)
    assert black_box([two, slow, held], asked, period=0.2) == {}
    assert black_box([seen, white], asked, period=0.2)["x"] < expected - 5.0


@pytest.mark.parametrize("late", [lambda y: -y, lambda y: y[::-1], lambda y: y + 5.0], ids=["turned", "back", "aside"])
def test_what_is_scored_tells_nothing_of_the_run_s_own_numbers(late: Any) -> None:
    """They come from the samples before, so a prediction is the same whatever is read from then on."""
    run = noisy(swing(seconds=4.0), 1e-3, seed=3)
    asked = replace(run, role="predict", score_from=2.0, unknown=("initial", "friction"))
    scored = run.t - run.t[0] >= 2.0 - 1e-9
    y = run.y.copy()
    y[scored] = late(y[scored])
    one, other = (predict({}, rig(Pendulum, PENDULUM, {}), [r])["swing"] for r in (asked, replace(asked, y=y)))
    assert one.fit_percent["theta"] > 90 > other.fit_percent["theta"]
    np.testing.assert_array_equal(other.simulated, one.simulated)
    assert "friction" in one.adapted
