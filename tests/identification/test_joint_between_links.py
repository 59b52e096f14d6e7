"""Is dry friction at a joint between two moving links recovered from a swing, whichever way angles are counted?"""

from __future__ import annotations

import math

import numpy as np
import pytest

from upright.identification import GreyBox, Parameter, Run, identify
from upright.physics import DoublePendulum, DoublePendulumAbsolute
from upright.simulation import simulate

LINKS = DoublePendulum(
    m_1=0.35, m_2=0.2, l_1=0.2, l_c1=0.11, l_c2=0.13, J_1=1e-3, J_2=8e-4, b_1=5e-3, b_2=2e-3, b_1c=3e-3, b_2c=8e-3
)
GUESSES = {"b_1": 2e-3, "b_2": 4e-3, "b_1c": 1e-3, "b_2c": 2e-3, "J_2": 1.5e-3, "l_c2": 0.11}


@pytest.mark.parametrize("plant", [DoublePendulum, DoublePendulumAbsolute])
def test_a_swing_of_relative_encoders_or_a_camera_tells_the_friction_between_the_links(plant):
    t, step = 5e-3 * np.arange(1201), 2 * math.pi / 16384
    x = simulate(LINKS, {}, [1.4, 0.0, -1.8, 0.0], None, 5e-3, samples=t.size, substeps=4)[:, ::2, 0]
    y = np.round((x if plant is DoublePendulum else np.cumsum(x, axis=1)) / step) * step
    truth = LINKS.parameters()
    numbers = {
        n: Parameter(name=n, value=GUESSES.get(n, v), unit=plant.quantity(n).unit, estimate=n in GUESSES, lower=0.0)
        for n, v in truth.items()
    }
    run = Run(
        label="swing", role="fit", t=t, u=np.zeros((t.size, 1)), y=y, measured=("theta_1", "theta_2"),
        resolution=(step, step),
    )  # fmt: skip
    fit = identify(GreyBox(plant=plant, parameters=numbers), [run])
    for name in GUESSES:
        e = fit.estimates[name]
        assert abs(e.value - truth[name]) < 4 * e.stderr  # one miss in 16,000
        assert e.stderr < 2e-3 * truth[name]
