"""Is a non-ideal rig the plain one with a ripple of its drive and a slope, and its linear model without them?"""

from __future__ import annotations

import numpy as np
import pytest

from upright.errors import ImpossiblePhysics
from upright.physics import CartPendulum, Furuta
from upright.physics.nonideal import NonidealCartPendulum, NonidealFuruta
from upright.simulation import simulate

ROD = {"m_p": 0.2, "l_cg": 0.3, "J_p": 2e-3}


def test_the_ripple_of_a_nonideal_drive_is_a_force_along_its_way():
    """From rest: the driven body is pushed by F_r sin(n_r x + phi_r), and down the slope by its share of all weight."""
    plain, ripple = {**ROD, "m_c": 0.5}, {"F_r": 0.7, "n_r": 20.0, "phi_r": 0.4, "slope": 0.03}
    for x in (0.0, 0.05, -0.11):
        force = 0.7 * np.sin(20.0 * x + 0.4) + 0.7 * 9.81 * 0.03
        start, dt = [x, 0.0, 0.5, 0.0], 1e-4
        nonideal = simulate(NonidealCartPendulum(**plain, **ripple), {}, start, [0.0], dt, samples=2)
        pushed = simulate(CartPendulum(**plain), {}, start, [force], dt, samples=2)
        # over a tenth of a millisecond the ripple's phase moves by 1e-7
        assert nonideal[1, :, 0] == pytest.approx(pushed[1, :, 0], rel=1e-6, abs=1e-12)
    arm, ripple = {**ROD, "r": 0.2, "J_d": 0.02}, {"T_r": 0.05, "n_r": 7.0, "phi_r": -0.3}
    for psi in (0.0, 0.3):
        start = [psi, 0.0, 0.5, 0.0]
        nonideal = simulate(NonidealFuruta(**arm, **ripple), {}, start, [0.0], 1e-4, samples=2)
        torque = 0.05 * np.sin(7.0 * psi - 0.3)
        pushed = simulate(Furuta(**arm), {}, start, [torque], 1e-4, samples=2)
        assert nonideal[1, :, 0] == pytest.approx(pushed[1, :, 0], rel=1e-6, abs=1e-12)


def test_the_linear_model_of_a_nonideal_rig_is_that_of_a_level_one_without_ripple():
    cart = NonidealCartPendulum(**ROD, m_c=0.5, b_1=0.3, F_r=0.7, n_r=20.0, slope=0.03).linear("inverted")
    assert pytest.approx(CartPendulum(**ROD, m_c=0.5, b_1=0.3).linear("inverted").A) == cart.A
    arm = NonidealFuruta(**ROD, r=0.2, J_d=0.02, T_r=0.05, n_r=7.0, tilt_x=0.02, tilt_y=-0.01).linear("inverted")
    assert pytest.approx(Furuta(**ROD, r=0.2, J_d=0.02).linear("inverted").A) == arm.A


@pytest.mark.parametrize(
    ("ideal", "nonideal", "own"),
    [(Furuta, NonidealFuruta, {"r": 0.2, "J_d": 0.02}), (CartPendulum, NonidealCartPendulum, {"m_c": 0.5})],
)
def test_where_nothing_is_said_the_drive_does_not_ripple_and_the_frame_is_level(ideal, nonideal, own):
    """Both move alike, to rounding, under a push and a fall."""
    plain, worn = ideal(**ROD, **own), nonideal(**ROD, **own)
    more = {n: v for n, v in worn.parameters().items() if n not in plain.names()}
    assert {n: v for n, v in more.items() if v} == {"n_r": 1.0}  # which divides
    push = 0.05 * np.ones(200)
    one, other = (simulate(p, {}, p.state("inverted", theta=3.0), push, 1e-3, samples=200) for p in (plain, worn))
    np.testing.assert_allclose(other, one, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize(
    ("plant", "name", "value"),
    [(NonidealFuruta, "T_r", -1e-9), (NonidealFuruta, "n_r", 0.0), (NonidealCartPendulum, "F_r", -1e-9),
     (NonidealCartPendulum, "n_r", 0.0), (NonidealCartPendulum, "slope", 0.51), (NonidealCartPendulum, "slope", -0.51)],
)  # fmt: skip
def test_a_ripple_has_a_size_and_a_length_and_a_rail_is_no_wall(plant, name, value):
    own = {"r": 0.2, "J_d": 0.02} if plant is NonidealFuruta else {"m_c": 0.5}
    with pytest.raises(ImpossiblePhysics, match=name):
        plant(**ROD, **own, **{name: value})
