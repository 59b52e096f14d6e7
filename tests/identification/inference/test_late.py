"""When a dead time is offered: of a cart whose residual is made of its own slopes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from upright.identification import GreyBox, Parameter, Run
from upright.identification.inference.covariance import Optimum, assess
from upright.identification.inference.neglected import lateness
from upright.identification.problem.residuals import formulate
from upright.identification.search.descent import descend
from upright.physics import find
from upright.simulation import simulate

CART = find("rectilinear-1")
DT, N = 5e-3, 1200
VALUES = {"m_1": 0.8, "k_1": 150.0, "c_1": 3.0}


def fitted(late: float, sway: float = 0.0, **known: float) -> Optimum:
    """A cart driven by a square wave that acts so many seconds late, and a sway that no dead time explains."""
    t = DT * np.arange(N)
    u = np.where(t < 0.3, 0.0, np.sign(np.sin(2.1 * t)) * (1 + 0.3 * np.sin(0.7 * t)))
    drive = {"actuator.gain": 2.0, "actuator.delay": late}
    y = simulate(CART(**VALUES), drive, [0.0, 0.0], u, DT, samples=N, substeps=2)[:, :1, 0]
    y = y + 1e-5 * np.random.default_rng(1).normal(size=y.shape) + sway * float(np.std(y)) * np.sin(1.3 * t)[:, None]
    numbers = {n: Parameter(name=n, value=v, estimate=n == "k_1", lower=0.0) for n, v in VALUES.items()}
    numbers["actuator.gain"] = Parameter(name="actuator.gain", value=2.0, estimate=True, lower=0.0)
    numbers |= {n: Parameter(name=n, value=v) for n, v in known.items()}
    run = Run(label="steps", role="fit", t=t, u=u[:, None], y=y, measured=("x_1",), unknown=(),
              initial={"x_1": 0.0, "x_1_dot": 0.0})  # fmt: skip
    problem = formulate(GreyBox(plant=CART, parameters=numbers), [run])
    problem.settle_steps(problem.start)
    return assess(problem, descend(problem.normal, problem.start, problem.lower, problem.upper).x)


@pytest.mark.parametrize("late", [0.006, 0.03])
def test_the_dead_time_is_told_in_milliseconds_with_its_interval(late: float) -> None:
    told = lateness(fitted(late))
    assert told is not None
    start, _, rest = told.sentence.removeprefix("The drive seems to act ").partition(" ms late (")
    low, high = (float(v) for v in rest.partition("):")[0].split(" to "))
    assert float(start) == pytest.approx(1e3 * late, rel=0.02)
    assert low <= float(start) <= high
    assert "of run 'steps' would be explained to" in told.sentence
    assert 'max = "200 ms" }.' in told.sentence
    assert f'delay = {{ guess = "{1e3 * late:.2g} ms"' in told.sentence


def test_what_no_dead_time_explains_offers_none() -> None:
    assert lateness(fitted(0.0)) is None
    assert lateness(fitted(0.006, sway=0.5)) is None  # nearly all that is missed is the sway


@pytest.mark.parametrize(("name", "value"), [("actuator.delay", 1e-3), ("actuator.lag", 1e-3)])
def test_a_dead_time_or_a_lag_that_is_stated_is_not_offered(name: str, value: float) -> None:
    assert lateness(fitted(0.03, **{name: value})) is None
    assert lateness(fitted(0.03, **{name: 0.0})) is not None


def test_numbers_that_stay_within_their_intervals_are_not_bent() -> None:
    best = fitted(0.03)
    told = lateness(best)
    assert told is not None
    wide = lateness(replace(best, covariance=1e6 * best.covariance))
    assert wide is not None
    assert wide.bent == ()
    assert "moves" not in wide.sentence
    sharp = lateness(replace(best, covariance=1e-12 * best.covariance))
    assert sharp is not None
    assert set(sharp.bent) == {"k_1", "actuator.gain"}
    assert sharp.sentence.endswith("and moves k_1, actuator.gain out of what the intervals say.")
    # a number that its bound holds has no interval to leave
    held = 1e-12 * best.covariance
    i = next(i for i, u in enumerate(best.problem.unknowns) if u.name == "k_1")
    held[i] = held[:, i] = 0.0
    only = lateness(replace(best, covariance=held))
    assert only is not None
    assert only.bent == ("actuator.gain",)
