"""Each misprint of the paper: what is printed fails, what is right holds. Numbered as in docs/explanation/errata.md."""

from fractions import Fraction
from math import ceil, floor

import numpy as np
import pytest
import sympy as sp

from tests.paper import printed
from tests.paper.printed import J_A, p, s
from tests.paper.symbolic import linear, over_determinant
from upright.physics import Furuta
from upright.physics.lagrange import symbolic_mass_and_force

# The paper's linear models know no axial inertia and no anchoring spring.
PAPERS_RIG = {p.J_a: 0, sp.Symbol("k_psi", real=True): 0}
D_2 = J_A * (p.J_d + p.m_p * p.r**2) - (p.m_p * p.l_cg * p.r) ** 2  # erratum 1
RIG = {"m_p": 0.2, "l_cg": 0.15, "r": 0.2, "J_d": 0.01, "J_p": 5e-4, "b_1": 0.007, "b_2": 3e-4, "g": 9.81}


def zero(expression):
    """Does a ratio of polynomials in the parameters (and sines) vanish?"""
    return sp.trigsimp(sp.expand(sp.numer(sp.together(expression)))) == 0


def all_zero(matrix):
    return all(zero(e) for e in matrix)


def derived(at):
    """A and B of the paper's rig, from the energies."""
    return tuple(m.subs(PAPERS_RIG) for m in linear(Furuta, at, without=Furuta.optional))


def corrected(A, row_sign):
    """Printed A with errata 1 and 2 put right."""
    A = A(D_2).copy()
    A[3, 1] = row_sign * p.m_p * p.l_cg * p.r * p.b_1 / D_2
    return A


def test_erratum_1_the_determinant_has_a_minus():
    upright_rod = {p.theta: 0, p.J_xx: 0, p.J_zz: p.J_p}
    determinant = printed.mass_3().subs(upright_rod).det()  # eq. (3) of the same paper
    assert not zero(determinant - printed.D_2)
    assert zero(determinant - D_2)
    ours, *_ = over_determinant(Furuta, "hanging", without=Furuta.optional)
    assert zero(ours.subs(PAPERS_RIG) - D_2)


def test_erratum_1_printed_system_determinant_needs_the_minus():
    """Delta_2 must be D_2 times what eq. (3) gives close to rest; its middle terms are printed with the minus."""
    upright_rod = {p.theta: 0, p.J_xx: 0, p.J_zz: p.J_p}
    impedance = printed.mass_3().subs(upright_rod) * s**2 + sp.diag(p.b_1, p.b_2) * s
    impedance += sp.diag(0, p.m_p * p.g * p.l_cg)
    Delta = sp.expand(impedance.det()) / s
    assert not zero(printed.Delta_2(printed.D_2, printed.D_2) - printed.D_2 * Delta)
    assert zero(printed.Delta_2(D_2, D_2) - D_2 * Delta)


@pytest.mark.parametrize(("at", "A", "sign"), [("hanging", printed.A_1, -1), ("inverted", printed.A_2, 1)])
def test_erratum_2_arm_friction_reaches_the_pendulum_over_the_radius(at, A, sign):
    A_true, _ = derived(at)
    assert not zero(A_true[3, 1] - A(D_2)[3, 1])
    assert all_zero(A_true - corrected(A, sign))


@pytest.mark.parametrize(("at", "B"), [("hanging", printed.B_1), ("inverted", printed.B_2)])
def test_erratum_1_reaches_the_input_and_nothing_else_of_it_is_wrong(at, B):
    _, B_true = derived(at)
    assert not all_zero(B_true - B())  # as printed, with the plus in D_2
    assert all_zero(B_true - B(D_2))


def test_erratum_2_units():
    """[rad/s^2 per rad/s] must not change when lengths are told in another unit."""
    unit = sp.Symbol("unit", positive=True)
    retold = {p.l_cg: unit * p.l_cg, p.r: unit * p.r, p.g: unit * p.g}
    retold |= {x: unit**2 * x for x in (p.J_p, p.J_d, p.b_1, p.b_2)}
    for entry, sound in ((printed.A_1(D_2)[3, 1], False), (corrected(printed.A_1, -1)[3, 1], True)):
        assert zero(entry.subs(retold, simultaneous=True) - entry) is sound


def test_erratum_3_the_cosine_goes_with_the_axial_inertia():
    M, f = symbolic_mass_and_force(Furuta, without=Furuta.optional)
    f = f.subs({sp.Symbol("T", real=True): 0, sp.Symbol("k_psi", real=True): 0})  # eq. (3) is a free response
    as_printed = {p.J_zz: p.J_p, p.J_xx: p.J_p}  # "both equal the previously defined J_p"
    right = {p.J_zz: p.J_p, p.J_xx: p.J_a}
    assert not zero((M - printed.mass_3().subs(as_printed))[0, 0])
    assert not zero((f - printed.force_3().subs(as_printed))[0])
    assert all_zero(M - printed.mass_3().subs(right))
    assert all_zero(f - printed.force_3().subs(right))


def test_erratum_3_a_hanging_rod_of_no_thickness_turns_like_a_point():
    """Its mass sits on one vertical line at distance r: inertia m_p r^2 about the axis, and nothing more."""
    hanging_thin_rod = {p.theta: 0, p.J_a: 0}
    about_axis = p.J_d + p.m_p * p.r**2
    assert zero(symbolic_mass_and_force(Furuta)[0][0, 0].subs(hanging_thin_rod) - about_axis)
    assert not zero(printed.mass_3()[0, 0].subs({p.J_xx: p.J_p, **hanging_thin_rod}) - about_axis)


def test_erratum_4_leading_coefficient_and_common_factor():
    A = corrected(printed.A_1, -1)
    characteristic = (s * sp.eye(4) - A).det(method="berkowitz") * D_2**2
    assert not zero(characteristic - s * printed.Delta_2(D_2, printed.D_A))  # D is defined in the appendix only
    assert zero(characteristic - s * printed.Delta_2(D_2, D_2))
    J, mgl = p.J_d + p.m_p * p.r**2, p.m_p * p.g * p.l_cg
    Delta = D_2 * s**3 + (J * p.b_2 + J_A * p.b_1) * s**2 + (J * mgl + p.b_1 * p.b_2) * s + p.b_1 * mgl
    assert zero(printed.Delta_2(D_2, D_2) - D_2 * Delta)


def test_erratum_5_the_pendulum_follows_the_torque_with_a_plus():
    A, B = derived("hanging")
    transfer = (printed.C * (s * sp.eye(4) - A).adjugate() * B) / (s * sp.eye(4) - A).det(method="berkowitz")
    assert zero(transfer[0] - printed.psi_over_T(D_2, D_2))
    assert not zero(transfer[1] - printed.theta_over_T(D_2, D_2))
    assert zero(transfer[1] + printed.theta_over_T(D_2, D_2))


def possible(mean, answers, step=1):
    """GRIM: can a mean, printed to half a unit of its last digit, come from so many whole answers?"""
    half = Fraction(1, 2) / 10 ** len(mean.partition(".")[2])
    return floor((Fraction(mean) + half) * answers / step) >= ceil((Fraction(mean) - half) * answers / step)


def test_erratum_6_fifty_three_students_cannot_have_answered_so():
    means = [mean for row in printed.TABLE_4 for mean in row]
    assert sum(not possible(mean, printed.STUDENTS) for mean in means) == 8
    assert not any(possible(str(share), printed.STUDENTS, step=100) for share in printed.TABLE_3[0][:2])
    for answers in (48, 52):
        assert sum(not possible(mean, answers) for mean in means) == 1
        assert all(possible(str(share), answers, step=100) for share in printed.TABLE_3[0])


def numbers(matrix):
    values = {sp.Symbol(name, real=True): value for name, value in RIG.items()}
    return np.array(matrix.subs(values), dtype=float)


def gains(A, b, poles):
    """Ackermann's formula."""
    controllability = np.column_stack([np.linalg.matrix_power(A, i) @ b for i in range(4)])
    wanted = sum(c * np.linalg.matrix_power(A, 4 - i) for i, c in enumerate(np.poly(poles).real))
    return np.linalg.solve(controllability.T, np.eye(4)[3]) @ wanted


def test_untouched_equation_2_has_a_wrong_unstable_pole_and_its_gains_miss():
    A, b = numbers(printed.A_2()), numbers(printed.B_2())[:, 0]
    plant = Furuta(**RIG).linear("inverted")
    unstable = plant.poles()[0].real
    assert abs(np.linalg.eigvals(A).real.max() / unstable - 1) > 0.05
    right = numbers(corrected(printed.A_2, 1))
    assert np.linalg.eigvals(right).real.max() == pytest.approx(unstable, rel=1e-12)
    table_1 = np.sort_complex(np.array(printed.TABLE_1[0]))
    b_right = numbers(printed.B_2(D_2))[:, 0]
    for model, column, hits in ((A, b, False), (right, b_right, True)):
        closed = np.sort_complex(np.linalg.eigvals(plant.A - plant.B @ gains(model, column, table_1)[None]))
        assert np.allclose(closed, table_1, atol=1e-6) is hits
