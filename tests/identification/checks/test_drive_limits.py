"""Is a limit of a drive found where a run reaches it, and left out, not guessed, where none does?"""

import math
from dataclasses import replace

import numpy as np
import pytest

from tests.identification.twins import noisy, rig
from upright.identification import Fit, Run
from upright.identification.estimate import identify
from upright.physics import find
from upright.simulation import simulate

PLANT, DT = find("rectilinear-1"), 2e-3
CART = {"m_1": 1.5, "k_1": 60.0, "c_1": 3.0}
SERVO = {"actuator.gain": 20.0, "actuator.slope": 8.0, "actuator.force_limit": 12.0}


def fitted(volts: float) -> Fit:
    t = np.arange(3001) * DT
    u = volts * np.sign(np.sin(2 * math.pi * 0.9 * t))[:, None]
    x = simulate(PLANT(**CART), SERVO, [0.0, 0.0], u, DT, samples=t.size, substeps=2)
    run = Run(label="square wave", role="fit", t=t, u=u, y=x[:, [0], 0], measured=("x_1",), unknown=("initial",))
    guesses = {"k_1": 80.0, "c_1": 2.0, "actuator.gain": 15.0, "actuator.force_limit": 20.0}
    cart = rig(PLANT, CART, guesses, **{"actuator.slope": SERVO["actuator.slope"]})
    return identify(replace(cart, substeps=2), [noisy(run, 2e-5, seed=1)])


def test_a_force_limit_that_is_reached_is_found():
    fit = fitted(0.9)  # asks for 18 N and more
    e = fit.estimates["actuator.force_limit"]
    assert e.value == pytest.approx(12.0, rel=0.01)
    assert e.interval[0] <= 12.0 <= e.interval[1]


def test_a_force_limit_that_no_run_reaches_is_left_out():
    fit = fitted(0.3)  # 6 N, and no more than 10 N with what the speed adds
    e = fit.estimates["actuator.force_limit"]
    assert (e.status, e.value) == ("left out", math.inf)
    assert any("no fitted run reaches it" in w for w in fit.warnings)
    for name, truth in {**CART, **SERVO}.items():
        if name in fit.model.estimated and name != "actuator.force_limit":
            assert fit.estimates[name].value == pytest.approx(truth, rel=0.01)
