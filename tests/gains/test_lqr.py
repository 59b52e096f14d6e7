"""Are the gains of least cost those that books and other programs find, and does the effort stay below its limit?"""

from __future__ import annotations

import math

import numpy as np
import pytest

from upright.errors import BadInput
from upright.gains import dlqr, locus, lqr, place, prefilter, weight_for_effort
from upright.gains.lqr import least_cost, linear_motion, peak_effort
from upright.physics import CartPendulum, Furuta

DOUBLE_INTEGRATOR = ([[0, 1], [0, 0]], [0, 1])
# Control Tutorials for MATLAB and Simulink (Univ. of Michigan), inverted pendulum: M, m, b, l, I of its page
CTMS = CartPendulum(m_c=0.5, m_p=0.2, b_1=0.1, l_cg=0.3, J_p=0.006, g=9.8).linear("inverted")
RIG = Furuta(m_p=0.2, l_cg=0.15, r=0.2, J_d=0.01, J_p=5e-4, b_1=0.007, b_2=3e-4)
ARM = RIG.linear("inverted")


@pytest.mark.parametrize(
    ("model", "Q", "R", "gains", "digit"),
    [
        # Ogata, Modern Control Engineering, 5th ed., Example 10-9: K = [1, sqrt(mu + 2)]
        pytest.param(DOUBLE_INTEGRATOR, [1, 7], 1, [1, 3], 1e-9, id="Ogata 10-9"),
        # the same book, Example 10-10
        pytest.param(([[0, 1], [0, -1]], [0, 1]), [1, 1], 1, [1, 1], 1e-9, id="Ogata 10-10"),
        # the same book, Example 10-11 and MATLAB Program 10-20
        pytest.param(
            ([[0, 1, 0], [0, 0, 1], [-35, -27, -9]], [0, 0, 1]),
            [1, 1, 1], 1, [0.0143, 0.1107, 0.0676], 6e-5, id="Ogata 10-11",
        ),
        # the same book, Example 10-12
        pytest.param(
            ([[0, 1, 0], [0, 0, 1], [0, -2, -3]], [0, 0, 1]),
            [100, 1, 1], 0.01, [100, 53.12, 11.6711], 6e-5, id="Ogata 10-12",
        ),
        pytest.param((CTMS.A, CTMS.B), [1, 0, 1, 0], 1, [-1.0, -1.6567, 18.6854, 3.4594], 6e-5, id="CTMS, Q = C'C"),
        pytest.param(
            (CTMS.A, CTMS.B), [5000, 0, 100, 0], 1, [-70.7107, -37.8345, 105.5298, 20.9238], 6e-5, id="CTMS, weighed"
        ),
    ],
)  # fmt: skip
def test_published_regulators(model, Q, R, gains, digit):
    np.testing.assert_allclose(lqr(*model, Q, R)[0], gains, rtol=0, atol=digit)


def test_python_control_agrees():
    import control

    model, Q, R = RIG.linear("inverted"), np.diag([1.0, 0.1, 3.0, 0.2]), 0.3
    np.testing.assert_allclose(lqr(model.A, model.B, Q, R), control.lqr(model.A, model.B, Q, R)[0], rtol=1e-7)
    Phi, Gamma = np.eye(4) + 0.01 * model.A, 0.01 * model.B
    np.testing.assert_allclose(dlqr(Phi, Gamma, Q, R), control.dlqr(Phi, Gamma, Q, R)[0], rtol=1e-7)


def test_two_inputs_share_the_effort():
    """python-control's gains for two inputs with a full R."""
    import control

    A, B = np.array([[0.0, 1.0], [2.0, -0.3]]), np.array([[1.0, 0.2], [0.0, 1.0]])
    R = [[2.0, 0.3], [0.3, 1.0]]
    np.testing.assert_allclose(lqr(A, B, np.eye(2), R), control.lqr(A, B, np.eye(2), R)[0], rtol=1e-8)


def test_dear_effort_mirrors_the_unstable_poles():
    """Kwakernaak and Sivan: as R grows, unstable poles go to their mirror images and stable ones stay."""
    model = RIG.linear("inverted")
    poles = np.sort(locus(model.A, model.B, [1, 0, 1, 0], [1e12])[0].real)
    open_loop = np.linalg.eigvals(model.A).real
    np.testing.assert_allclose(poles, np.sort(-np.abs(open_loop)), atol=2e-3)


def test_the_locus_is_spectral_factorization():
    """p(s) p(-s) = a(s) a(-s) + N(s)/R with Q = c'c: N = n(s) n(-s) of c (sI - A)^-1 B."""
    model = RIG.linear("inverted")
    c = np.array([0.3, 0.0, 1.0, 0.0])
    a = np.poly(model.A)
    n = np.poly(model.A - model.B @ c[None]) - a
    mirror = np.array([1.0, -1.0, 1.0, -1.0, 1.0])
    for R, poles in zip([1.0, 0.5, 0.01], locus(model.A, model.B, np.outer(c, c), [1.0, 0.5, 0.01]), strict=True):
        p = np.poly(poles).real
        left, right = np.polymul(p, p * mirror), np.polyadd(np.polymul(a, a * mirror), np.polymul(n, n * mirror) / R)
        np.testing.assert_allclose(left, right, atol=1e-7 * np.abs(right).max())


def test_the_weight_for_an_effort_needs_that_effort():
    """Peak found again by another integrator, scipy's LSODA, on the loop with those gains."""
    from scipy.integrate import solve_ivp

    model, start, limit = RIG.linear("inverted"), np.array([0.0, 0.0, 0.1, 0.0]), 0.6
    R = weight_for_effort(model.A, model.B, [1, 0, 1, 0], start, limit)
    K = lqr(model.A, model.B, [1, 0, 1, 0], R)
    t = np.linspace(0, 5, 20_001)
    x = solve_ivp(lambda _, x: (model.A - model.B @ K) @ x, (0, 5), start, t_eval=t, rtol=1e-9, atol=1e-12).y
    assert np.abs(K @ x).max() == pytest.approx(limit, rel=1e-3)


def test_a_deviation_beyond_the_drive_is_refused():
    model = RIG.linear("inverted")
    with pytest.raises(BadInput, match=r"takes at least .*, and the limit is 0.01"):
        weight_for_effort(model.A, model.B, [1, 0, 1, 0], [0, 0, 0.1, 0], 0.01)


def test_the_least_effort_of_one_unstable_pole():
    """x' = a x + u from x0: K = 2 a whatever the weight, so the peak is 2 a x0."""
    A, B = np.array([[3.0]]), np.array([[1.0]])
    K = lqr(A, B, 1e-9, 1.0)
    assert K[0, 0] == pytest.approx(6.0, rel=1e-8)
    assert np.abs(linear_motion(A, B, K, [0.2])[2]).max() == pytest.approx(1.2, rel=1e-8)


@pytest.mark.parametrize(("seconds", "lasts"), [(0.0, 5.0), (2.0, 2.0)])
def test_the_motion_of_a_critically_damped_body_runs_forwards_from_its_start(seconds, lasts):
    """x'' = u, u = -4 x - 4 x': x = x_0 (1 + 2 t) exp(-2 t), for ten time constants where nothing else is asked."""
    A, B, K = np.array([[0.0, 1.0], [0.0, 0.0]]), np.array([[0.0], [1.0]]), np.array([[4.0, 4.0]])
    t, x, u = linear_motion(A, B, K, [0.3, 0.0], seconds)
    assert (t[0], t[-1]) == (0.0, pytest.approx(lasts, rel=1e-6))  # a double pole is good to half the digits
    assert len(t) == 401  # 40 a time constant of the fastest, 400 at least
    assert np.all(np.diff(t) > 0)
    np.testing.assert_allclose(x[:, 0], 0.3 * (1 + 2 * t) * np.exp(-2 * t), atol=1e-9)
    np.testing.assert_allclose(x[:, 1], -1.2 * t * np.exp(-2 * t), atol=1e-9)
    np.testing.assert_allclose(u[:, 0], -4 * x[:, 0] - 4 * x[:, 1], atol=1e-12)
    assert peak_effort(A, B, K, [0.3, 0.0]) == pytest.approx(1.2, rel=1e-9)  # at the start: 4 x_0


def test_a_motion_under_gains_that_do_not_stabilize_is_refused():
    A, B = np.array([[0.0, 1.0], [0.0, 0.0]]), np.array([[0.0], [1.0]])
    for K in ([[0.0, 0.0]], [[1.0, 0.0]], [[1.0, -1.0]]):  # stays, swings on, grows
        with pytest.raises(BadInput, match="do not stabilize"):
            linear_motion(A, B, np.array(K), [0.3, 0.0])


@pytest.mark.parametrize(
    ("Q", "R", "words"),
    [([1, 1], -1, "R above 0"), ([-1, 1], 1, "no eigenvalue of Q below 0"), ([1, 1, 1], 1, "Q must be 2 weights")],
)
def test_weights_that_do_not_cost_are_refused(Q, R, words):
    with pytest.raises(BadInput, match=words):
        lqr(*DOUBLE_INTEGRATOR, Q, R)


def test_a_mode_out_of_reach_has_no_regulator():
    with pytest.raises(BadInput, match="input cannot move the mode at 2, which"):
        lqr([[1, 0], [0, 2]], [1, 0], [1, 1], 1)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        # two integrators: the position's mode, s = 0 with the eigenvector (1, 0), costs nothing where the speed does
        (lambda: lqr(*DOUBLE_INTEGRATOR, [0, 1], 1), r"mode at 0 \(state 1\).*weigh state 1 too"),
        (lambda: dlqr([[1, 0.1], [0, 1]], [0, 0.1], [0, 1], 1), r"mode at 1 \(state 1\)"),
        # an undamped oscillator of 2 rad/s, any state of which shows it
        (lambda: lqr([[0, 1], [-4, 0]], [0, 1], [0, 0], 1), r"mode at 0±2j .*weigh state 1 or state 2"),
        # the free arm of a rotary pendulum: nothing turns it back
        (lambda: lqr(ARM.A, ARM.B, [0, 0, 10, 1], 1, states=ARM.states), r"mode at 0 \(psi\).*weigh psi too"),
    ],
)
def test_weights_that_do_not_see_a_mode_that_stays_are_refused(call, words):
    with pytest.raises(BadInput, match=words):
        call()


def test_an_unstable_mode_is_mirrored_even_where_it_costs_nothing():
    """Kwakernaak and Sivan, section 3.8: without a cost of the states the least effort mirrors +-2; K by hand."""
    np.testing.assert_allclose(lqr([[0, 1], [4, 0]], [0, 1], 0, 1), [[8, 4]], rtol=1e-7)


@pytest.mark.parametrize("sampled", [False, True])
def test_the_riccati_matrix_is_the_cost_from_a_start(sampled):
    """``x0' S x0`` against the cost of the motion, summed or integrated; python-control's S and E beside it."""
    import control
    from scipy.integrate import quad
    from scipy.linalg import expm

    model, Q, R, x0 = RIG.linear("inverted"), np.diag([1.0, 0.1, 3.0, 0.2]), 0.3, np.array([0.1, 0.0, -0.05, 0.3])
    A, B = (np.eye(4) + 0.01 * model.A, 0.01 * model.B) if sampled else (model.A, model.B)
    K, S, E = least_cost(A, B, Q, R, sampled=sampled)
    _, S_c, E_c = (control.dlqr if sampled else control.lqr)(A, B, Q, R)
    np.testing.assert_allclose(S, S_c, rtol=1e-6)
    np.testing.assert_allclose(np.sort_complex(E), np.sort_complex(E_c), rtol=1e-6)
    rate = Q + K.T @ np.atleast_2d(R) @ K

    def cost(x):
        return x @ rate @ x

    if sampled:
        powers = [x0]
        for _ in range(5000):
            powers.append((A - B @ K) @ powers[-1])
        total = sum(map(cost, powers))
    else:
        total = quad(lambda t: cost(expm((A - B @ K) * t) @ x0), 0, 30, epsrel=1e-9, limit=400)[0]
    assert x0 @ S @ x0 == pytest.approx(total, rel=1e-6)


def test_an_effort_that_costs_nothing_is_used_whole():
    """A scalar x' = a x + b u is put to zero in one step, K = a/b, and S is the weight of that one step, q."""
    for a, b, q in ((2.0, 0.5, 3.0), (-0.7, 4.0, 1.0)):
        K, S, E = least_cost(np.array([[a]]), np.array([[b]]), [q], 0.0, sampled=True)
        np.testing.assert_allclose([K[0, 0], S[0, 0], abs(E[0])], [a / b, q, 0.0], atol=1e-9)


@pytest.mark.parametrize("inputs", [1, 2])
def test_without_a_cost_of_the_effort_the_riccati_equation_holds_and_is_the_limit_of_small_ones(inputs):
    """``S = A'SA - A'SB (B'SB)^-1 B'SA + Q``; python-control's S at R = 1e-9 lies beside it."""
    import control

    rng = np.random.default_rng(3)
    A, B = rng.normal(size=(3, 3)), rng.normal(size=(3, inputs))
    Q = np.diag([1.0, 2.0, 0.5])
    K, S, E = least_cost(A, B, Q, np.zeros((inputs, inputs)), sampled=True)
    gain = np.linalg.solve(B.T @ S @ B, B.T @ S @ A)
    np.testing.assert_allclose(K, gain, rtol=1e-7, atol=1e-9)
    np.testing.assert_allclose(S, A.T @ S @ A - A.T @ S @ B @ gain + Q, rtol=1e-7)
    np.testing.assert_allclose(S, S.T)
    assert np.abs(E).max() < 1
    _, limit, _ = control.dlqr(A, B, Q, 1e-9 * np.eye(inputs))
    np.testing.assert_allclose(S, limit, rtol=1e-6)


@pytest.mark.parametrize("gamma", [0.0, 0.5, 1.3])
def test_prefilter_of_a_steered_vehicle(gamma):
    """Astrom and Murray, Feedback Systems, Example 7.4: k_r = w_c^2."""
    w, zeta = 1.7, 0.7
    K = place([[0, 1], [0, 0]], [gamma, 1], np.roots([1, 2 * zeta * w, w**2])).K
    assert prefilter([[0, 1], [0, 0]], [gamma, 1], [1, 0], K) == pytest.approx(w**2, rel=1e-12)


def test_prefilter_of_a_free_body_is_its_position_gain():
    """Where nothing ties a coordinate to ground, only K x_r holds it: k_pf = K of that coordinate."""
    K = lqr(CTMS.A, CTMS.B, [5000, 0, 100, 0], 1)
    assert prefilter(CTMS.A, CTMS.B, CTMS.C[0], K) == pytest.approx(-math.sqrt(5000), rel=1e-9)


def test_an_angle_that_cannot_be_held_has_no_prefilter():
    K = lqr(CTMS.A, CTMS.B, [5000, 0, 100, 0], 1)
    with pytest.raises(BadInput, match="track another coordinate"):
        prefilter(CTMS.A, CTMS.B, CTMS.C[1], K)
