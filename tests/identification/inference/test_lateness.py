"""Is a drive that acts late noticed where nobody asked for its dead time, and only there?"""

import re
from dataclasses import replace

import numpy as np
import pytest

from upright.identification import GreyBox, Parameter, Run, identify
from upright.identification.inference.verdict.evidence import USABLE
from upright.physics import find
from upright.simulation import simulate

PLANT = find("rectilinear-1")
TRUTH = {"m_1": 0.8, "k_1": 150.0, "c_1": 3.0}
PERIOD = 2e-3


def asked(**known):
    """The cart with a weighed mass; spring, damper and gain are asked from 30 % off."""
    numbers = {n: Parameter(name=n, value=v * 1.3, unit=PLANT.quantity(n).unit, estimate=True, lower=0.0)
               for n, v in TRUTH.items()}  # fmt: skip
    numbers["m_1"] = Parameter(name="m_1", value=TRUTH["m_1"], unit="kg")
    numbers["actuator.gain"] = Parameter(name="actuator.gain", value=1.5, unit="N/V", estimate=True, lower=0.0)
    numbers |= {n: Parameter(name=n, value=v, unit="s", estimate=n == "actuator.delay") for n, v in known.items()}
    return GreyBox(plant=PLANT, parameters=numbers)


def run(late=0, friction=0.0):
    """A cart whose drive of 2 N/V gets each command so many samples late: a shift of the commands, nothing else."""
    t = PERIOD * np.arange(4000)
    u = np.where(t < 0.3, 0.0, np.sign(np.sin(2.1 * t)) * (1 + 0.3 * np.sin(0.7 * t)))
    acting = np.concatenate([np.zeros(late), u[: u.size - late]])
    cart = PLANT(**TRUTH, f_1c=friction)
    x = simulate(cart, {}, [0.0, 0.0], 2 * acting, PERIOD, samples=t.size, substeps=2)[:, 0, 0]
    y = x + 1e-4 * np.random.default_rng(1).standard_normal(t.size)
    return Run(label="steps", role="fit", t=t, u=u[:, None], y=y[:, None], measured=("x_1",))


def told(fit):
    return [w for w in fit.warnings if "late" in w]


def test_a_dead_time_that_nobody_asked_for_is_found_and_its_cost_told():
    fit = identify(asked(), [run(late=10)])
    (sentence,) = told(fit)
    low, high, after, before = map(float, re.search(
        r"late \(([\d.]+) to ([\d.]+)\).* explained to ([\d.]+) % instead of ([\d.]+) %", sentence
    ).groups())  # fmt: skip
    assert low < 10 * PERIOD * 1e3 < high
    assert before == pytest.approx(fit.runs["steps"].fit_percent["x_1"], abs=0.06)
    bent = sentence.partition("moves ")[2].partition(" out of")[0].split(", ")
    assert "k_1" in bent
    low, high = fit.estimates["k_1"].interval
    assert not low <= TRUTH["k_1"] <= high  # so that nobody may build on it
    (usable,) = [a for a in fit.answers if a.question == USABLE]
    assert usable.answer != "yes"
    assert not set(bent) & set(re.split(r"[ ,.:]+", usable.headline))
    with_it = identify(asked(**{"actuator.delay": 0.01}), [run(late=10)])
    assert after == pytest.approx(with_it.runs["steps"].fit_percent["x_1"], abs=0.06)
    assert not told(with_it)


def test_a_dead_time_that_spring_damper_and_gain_can_almost_stand_for_is_found_all_the_same():
    """Under a sine whose size hardly varies, a force that is late is one of another phase, as others would give it."""
    t = PERIOD * np.arange(2000)
    u = np.sin(13.0 * t) * (1 + 0.2 * np.sin(0.9 * t))
    x = simulate(PLANT(**TRUTH), {}, [0.0, 0.0], 2 * np.r_[np.zeros(10), u[:-10]], PERIOD, samples=t.size, substeps=2)
    y = x[:, :1, 0] + 1e-4 * np.random.default_rng(1).standard_normal((t.size, 1))
    sine = Run(label="sine", role="fit", t=t, u=u[:, None], y=y, measured=("x_1",))
    (sentence,) = told(identify(asked(), [sine]))
    low, high = map(float, re.search(r"late \(([\d.]+) to ([\d.]+)\)", sentence).groups())
    assert low < 10 * PERIOD * 1e3 < high < 1.2 * 10 * PERIOD * 1e3


@pytest.mark.parametrize("other", [run(), run(friction=0.3)], ids=["in time", "dry friction left out"])
def test_a_drive_that_acts_in_time_is_not_called_late(other):
    assert not told(identify(asked(), [other]))


def test_a_lag_that_is_known_leaves_nothing_to_offer():
    assert not told(identify(asked(**{"actuator.lag": 0.01}), [run(late=10)]))


def test_a_free_swing_has_no_drive_to_be_late():
    swing = run()
    x = simulate(PLANT(**TRUTH), {}, [0.05, 0.0], None, PERIOD, samples=swing.t.size, substeps=2)[:, :1, 0]
    free = replace(swing, u=np.zeros_like(swing.u), y=x)
    rig = asked()
    known = {n: replace(p, estimate=p.estimate and n != "actuator.gain") for n, p in rig.parameters.items()}
    assert not told(identify(replace(rig, parameters=known), [free]))
