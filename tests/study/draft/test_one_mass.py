"""Does an unedited draft of a driven pendulum need one mass alone?

All forces of a rig may be multiplied by one number and nothing moves differently. So its log holds every ratio: with
``alpha = J_d + m_p r^2, beta = m_p r l_cg, delta = m_p g l_cg`` (PHYSICS) the arm is ``r = g beta/delta``, whatever the
mass; of a cart ``beta = m_p l_cg`` and m_c/m_p follows from what the pendulum does to it. The twins' numbers are known.
"""

from __future__ import annotations

import numpy as np
import pytest

import upright as up
from upright.identification.estimate import identify
from upright.simulation import simulate

DT = 5e-3
NUMBERS = {"m_p": 0.23, "l_cg": 0.14, "J_p": 9e-4, "b_1": 5e-3, "b_1c": 2e-3, "b_2": 2e-4}
RIGS = {
    "furuta": (up.Furuta(**NUMBERS, r=0.21, J_d=6e-3), 0.07),
    "cart-pendulum": (up.CartPendulum(**{**NUMBERS, "b_1": 2.0, "b_1c": 0.1}, m_c=0.7), 2.5),
}


def log_of(plant, gain):
    """At rest, driven by fourteen steps, read by encoders."""
    lengths = np.array([0.6, 0.9, 0.4, 1.1, 0.7, 0.5, 1.3] * 2)
    u = np.concatenate(
        [
            np.zeros(200),
            *(np.full(round(s / DT), v) for s, v in zip(lengths, [3, -4, 2, -3, 5, -2, 1] * 2, strict=True)),
        ]
    )
    x = simulate(plant, {"actuator.gain": gain}, [0.0] * 4, u[:, None], DT, samples=u.size, substeps=4)[:, ::2, 0]
    steps = np.array([2 * np.pi / 4096 if plant.coordinates[0].unit == "rad" else 5e-5, 2 * np.pi / 4096])
    first, theta = (np.round(x / steps) * steps).T
    return {"t": DT * np.arange(u.size), plant.coordinates[0].name: first, "theta": theta, "u": u}


@pytest.mark.parametrize("name", RIGS)
def test_every_ratio_is_known_and_the_fit_is_trusted(name, drafted):
    plant, gain = RIGS[name]
    _, study = drafted(**log_of(plant, gain))
    assert [run.role for run in study.runs] == ["fit", "predict"]  # a third of a driven log tests the rest
    fit = identify(study.model, study.runs)
    assert fit.trusted
    assert fit.verdict.startswith("Does it predict? Yes.")
    moment = plant.m_p * plant.l_cg
    length = plant.l_cg + plant.J_p / moment
    expected = {
        "J_A/(m_p l_cg)": length, "actuator.gain/(m_p l_cg)": gain / moment, "b_1/(m_p l_cg)": plant.b_1 / moment,
    }  # fmt: skip
    known = {n: e for a in fit.assumptions for n, e in a.ratios.items()}
    for ratio, value in expected.items():
        low, high = known[ratio].interval
        assert low <= value <= high
        assert known[ratio].status == "well determined"
    if name == "furuta":
        arm = fit.estimates["r"]
        assert arm.interval[0] <= plant.r <= arm.interval[1]
        assert (arm.status, arm.rests_on) == ("well determined", ())
