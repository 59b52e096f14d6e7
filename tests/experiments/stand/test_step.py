"""Does the swing after a step read as the oscillator that was put in?"""

from __future__ import annotations

import math

import numpy as np
import pytest

from upright.experiments.stand.step import modes, predicted_step, reading, step_signal
from upright.experiments.stand.twin import TwinStand
from upright.rig.makes import BODIES, MAKES, make_rig


def stepped(stand, tmp_path):
    signal = step_signal(stand)
    record = stand.run(signal.samples.tolist(), tmp_path, "step")
    return signal, np.column_stack([record[name] for name in stand.names])


@pytest.mark.parametrize("kind", sorted(BODIES))
def test_a_body_on_a_spring_reads_as_its_frequency_and_damping(kind, tmp_path):
    rig = BODIES[kind].rig.changed(f_1c=0.0)
    p, inertia = rig.plant.parameters(), rig.plant.parameters()[BODIES[kind].inertia]
    signal, y = stepped(TwinStand(rig=rig), tmp_path)
    found = reading(signal, rig, y)
    omega, zeta = math.sqrt(p["k_1"] / inertia), p["c_1"] / (2 * math.sqrt(p["k_1"] * inertia))
    assert abs(found.omega_n - omega) < max(4 * found.omega_error, 1e-3 * omega)
    assert found.zeta == pytest.approx(zeta, rel=0.02)
    assert modes(rig, "rest") == {"free": pytest.approx((omega, zeta), rel=1e-9)}
    assert signal.spring
    assert reading(signal, rig, y[: signal.spans[0][0] + 20]) is None  # nothing has turned yet


def test_where_no_spring_brings_the_cart_back_it_is_put_aside_and_friction_holds_it(tmp_path):
    """A pendulum on a cart that sticks swings as one on a fixed hinge, and on a free one as two bodies do."""
    rig = make_rig("linear", 3)
    p = rig.plant.parameters()
    J, ml = p["J_p"] + p["m_p"] * p["l_cg"] ** 2, p["m_p"] * p["l_cg"]
    fixed = math.sqrt(ml * p["g"] / J)
    known = modes(rig, "hanging")
    assert known["held"][0] == pytest.approx(fixed, rel=1e-6)
    # without friction: det [[M, ml], [ml, J]] w^2 = M ml g
    M = p["m_c"] + p["m_p"]
    free = modes(rig.changed(b_1=0.0, b_2=0.0), "hanging")["free"]
    assert free == pytest.approx((math.sqrt(M * ml * p["g"] / (M * J - ml**2)), 0.0), rel=1e-6, abs=1e-6)
    stand = TwinStand(rig=rig, make=MAKES["linear"])
    signal, y = stepped(stand, tmp_path)
    assert not signal.spring
    assert 0.003 < y[-1, 0] < 0.25 * stand.travel
    found = reading(signal, rig, y)
    assert found.omega_n == pytest.approx(fixed, rel=3e-3)  # 0.1 rad of swing take 6e-4 off


@pytest.mark.parametrize("make", sorted(MAKES))
def test_a_rig_that_is_as_it_is_known_answers_as_predicted(make, tmp_path):
    stand = TwinStand(rig=make_rig(make), make=MAKES[make])
    signal, y = stepped(stand, tmp_path)
    foretold = predicted_step(signal, stand.rig, stand.resting)
    late = slice(2, None), slice(1, -1)  # whoever logs a twin shows a sample the tick after
    assert min(np.abs(y[late[0]] - foretold[k : k + len(y) - 2]).max() for k in (0, 1, 2)) < 0.02 * np.ptp(y)
    assert np.abs(y[:, 0]).max() <= 0.4 * min(stand.travel, 2.0)
    assert reading(signal, stand.rig, y) is not None
