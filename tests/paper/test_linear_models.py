"""The paper's linear models and transfer functions follow from the energies, once the errata are put right."""

from functools import cache

import control
import numpy as np
import pytest
import sympy as sp

from tests.paper import printed
from tests.paper.printed import J_A, p, s
from tests.paper.symbolic import linear
from upright.physics import CartPendulum, Furuta, Plant

CART = {sp.Symbol("k_x", real=True): 0}


@cache
def models(plant: type[Plant], at: str):
    return linear(plant, at, without=plant.optional)


@pytest.mark.parametrize(
    ("at", "A", "B"), [("hanging", printed.A_A1, printed.B_A1), ("inverted", printed.A_A2, printed.B_A2)]
)
def test_cart_pendulum_is_the_appendix_as_printed(at, A, B):
    ours, gain = (m.subs(CART) for m in models(CartPendulum, at))
    assert (ours - A()).applyfunc(sp.simplify).is_zero_matrix
    assert (gain - B()).applyfunc(sp.simplify).is_zero_matrix


@pytest.mark.parametrize("plant", [CartPendulum, Furuta])
def test_inverting_only_flips_signs(plant):
    for hanging, inverted in zip(models(plant, "hanging"), models(plant, "inverted"), strict=True):
        for a, b in zip(hanging, inverted, strict=True):
            assert sp.simplify(a - b) == 0 or sp.simplify(a + b) == 0


def test_furuta_turns_into_equation_2_by_six_signs():
    """Gravity and the coupling m_p l_cg r change sign: entries (2,4), (4,1), (4,2), (4,3) and B (4)."""
    flipped = {
        (i, j)
        for i in range(4)
        for j in range(4)
        if sp.simplify(models(Furuta, "hanging")[0][i, j] + models(Furuta, "inverted")[0][i, j]) == 0
        and models(Furuta, "hanging")[0][i, j] != 0
    }
    assert flipped == {(1, 3), (3, 0), (3, 1), (3, 2)}


def test_furuta_linear_model_with_axial_inertia_and_anchor():
    """Linearized by hand: J = J_d + m_p r^2 + J_a; the anchoring spring acts where the torque acts."""
    k_psi = sp.Symbol("k_psi", real=True)
    J, mlr, mgl = p.J_d + p.m_p * p.r**2 + p.J_a, p.m_p * p.l_cg * p.r, p.m_p * p.g * p.l_cg
    D_2 = J_A * J - mlr**2
    for at, sign in (("hanging", 1), ("inverted", -1)):
        swing = sp.Matrix([[0, 0, -sign * mgl, -p.b_2]])
        turn = sp.Matrix([[-k_psi, -p.b_1, 0, 0]])
        A = sp.Matrix.vstack(
            sp.Matrix([[0, 1, 0, 0]]),
            (J_A * turn + sign * mlr * swing) / D_2,
            sp.Matrix([[0, 0, 0, 1]]),
            (sign * mlr * turn + J * swing) / D_2,
        )
        ours, gain = models(Furuta, at)
        assert (ours - A).applyfunc(sp.simplify).is_zero_matrix
        assert (gain - sp.Matrix([0, J_A, 0, sign * mlr]) / D_2).applyfunc(sp.simplify).is_zero_matrix


def transfer(model, output):
    """Transfer function from the torque, by python-control; zeros and poles that meet are cancelled."""
    return control.ss2tf(model.to_control()[output, "T"]).minreal(1e-6 * np.abs(model.poles()).max())


def test_transfer_functions_of_the_furuta_after_cancelling():
    """Third order over s for the arm, s over third order for the pendulum."""
    rig = Furuta(m_p=0.2, l_cg=0.15, r=0.2, J_d=0.01, J_p=5e-4, J_a=2e-5, b_1=0.007, b_2=3e-4)
    J, J_A_, mgl = rig.J_d + rig.m_p * rig.r**2 + rig.J_a, rig.J_p + rig.m_p * rig.l_cg**2, rig.m_p * rig.g * rig.l_cg
    mlr = rig.m_p * rig.l_cg * rig.r
    D_2 = J_A_ * J - mlr**2
    Delta = np.array([D_2, J * rig.b_2 + J_A_ * rig.b_1, J * mgl + rig.b_1 * rig.b_2, rig.b_1 * mgl]) / D_2
    for output, num, den in (
        ("psi", np.array([0, J_A_, rig.b_2, mgl]) / D_2, [*Delta, 0]),
        ("theta", np.array([0, mlr, 0]) / D_2, Delta),
    ):
        numerator, denominator = control.tfdata(transfer(rig.linear("hanging"), output))
        np.testing.assert_allclose(numerator[0][0], num, rtol=1e-9, atol=1e-9 * np.abs(num).max())
        np.testing.assert_allclose(denominator[0][0], den, rtol=1e-9, atol=1e-9)


def test_transfer_functions_agree_with_the_frequency_response():
    rig = Furuta(m_p=0.2, l_cg=0.15, r=0.2, J_d=0.01, J_p=5e-4, b_1=0.007, b_2=3e-4, k_psi=0.3)
    model, omega = rig.linear("inverted"), np.geomspace(0.1, 100, 30)
    for i, y in enumerate(model.outputs):
        np.testing.assert_allclose(transfer(model, y)(1j * omega), model.response(omega)[:, i, 0], rtol=1e-8)


def test_hanging_plant_tells_the_unstable_pole():
    """Undamped: the pole of the inverted plant is the coupled hanging frequency; Table 1's nominal 7.981 rad/s."""
    rig = Furuta(m_p=0.2, l_cg=0.15, r=0.2, J_d=0.01, J_p=5e-4)
    swing, fall = rig.linear("hanging").poles().imag.max(), rig.linear("inverted").poles().real.max()
    assert swing == pytest.approx(fall, rel=1e-12)


def test_table_1_lies_on_one_root_locus_with_its_unstable_pole_at_7_98():
    """p(s) p(-s) = a(s) a(-s) + N/R with R halved from set to set, so differences of p(s) p(-s) double."""
    a = np.polynomial.Polynomial([0, -63.698, 1])  # in w = s^2
    squares = [np.poly(np.array(poles) ** 2).real[::-1] for poles in printed.TABLE_1]
    N = squares[0] - (a * a).coef
    for k, square in enumerate(squares):
        error = square - ((a * a).coef + 2**k * N)
        assert np.all(np.abs(error) < 2e-4 * (np.abs(square) + np.abs((a * a).coef)) + 1e-9), (k, error)


def test_equation_3_reduces_to_equation_1():
    """Symbolic Jacobian of eq. (3) itself, errata 1 to 3 put right, at rest."""
    right = {p.J_zz: p.J_p, p.J_xx: p.J_a}
    M, f = printed.mass_3().subs(right), printed.force_3().subs(right)
    rest = {p.theta: 0, p.theta_dot: 0, p.psi_dot: 0}
    x = [p.psi, p.psi_dot, p.theta, p.theta_dot]
    slope = M.subs(rest).inv() * f.jacobian(x).subs(rest)
    ours = models(Furuta, "hanging")[0].subs({sp.Symbol("k_psi", real=True): 0})
    assert (ours[[1, 3], :] - slope).applyfunc(sp.simplify).is_zero_matrix
    assert s not in ours.free_symbols
