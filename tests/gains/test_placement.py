"""Do the gains put the poles where they were asked, and does the tool say so when it cannot?

Expected gains are printed in the books and guides cited; poles are checked by exact arithmetic or numpy.
"""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest

from upright.errors import BadInput
from upright.gains import place
from upright.gains.requests import read_poles, weak_modes
from upright.physics import Furuta

OGATA_CHAIN = ([[0, 1, 0], [0, 0, 1], [-1, -5, -6]], [0, 0, 1])
OGATA_PENDULUM = ([[0, 1, 0, 0], [20.601, 0, 0, 0], [0, 0, 0, 1], [-0.4905, 0, 0, 0]], [0, -1, 0, 0.5])
OGATA_SERVO = (
    [[0, 1, 0, 0, 0], [20.601, 0, 0, 0, 0], [0, 0, 0, 1, 0], [-0.4905, 0, 0, 0, 0], [0, 0, -1, 0, 0]],
    [0, -1, 0, 0.5, 0],
)
CTMS_BALL = ([[0, 1, 0], [980, 0, -2.8], [0, 0, -100]], [0, 0, 100])
RIG = Furuta(m_p=0.2, l_cg=0.15, r=0.2, J_d=0.01, J_p=5e-4, b_1=0.007, b_2=3e-4)


@pytest.mark.parametrize(
    ("model", "poles", "gains", "digit"),
    [
        # Ogata, Modern Control Engineering, 5th ed., Example 10-1
        pytest.param(OGATA_CHAIN, "-2+-4j, -10", [199, 55, 8], 1e-9, id="Ogata 10-1"),
        # Ogata, Discrete-Time Control Systems / Modern Control Engineering, inverted pendulum on a cart, double pole
        pytest.param(
            OGATA_PENDULUM,
            f"-2+-{2 * math.sqrt(3)!r}j, -10, -10",
            [-298.15, -60.697, -163.099, -73.394],
            6e-3,
            id="Ogata inverted pendulum",
        ),
        # Ogata, Modern Control Engineering, 5th ed., Example 10-5: the same with an integrator, triple pole
        pytest.param(
            OGATA_SERVO,
            f"-1+-{math.sqrt(3)!r}j, -5, -5, -5",
            [-157.6336, -35.3733, -56.0652, -36.7466, 50.9684],
            6e-5,
            id="Ogata 10-5",
        ),
        # Franklin, Powell, Emami-Naeini, Feedback Control of Dynamic Systems, 6th ed., Example 7.14, w_0 = 1
        pytest.param(([[0, 1], [-1, 0]], [0, 1]), "-2, -2", [3, 4], 1e-9, id="Franklin 7.14"),
        # Control Tutorials for MATLAB and Simulink (Univ. of Michigan), magnetically suspended ball
        pytest.param(CTMS_BALL, "-10+-10j, -50", [-280.7143, -7.7857, -0.3], 6e-5, id="CTMS ball"),
    ],
)
def test_published_gains(model, poles, gains, digit):
    found = place(*model, read_poles(poles))
    np.testing.assert_allclose(found.K[0], gains, rtol=0, atol=digit)


@pytest.mark.parametrize("gamma", [0.0, 0.5, 1.3])
def test_steering_of_a_vehicle(gamma):
    """Astrom and Murray, Feedback Systems, Example 7.4: k_1 = w^2, k_2 = 2 zeta w - gamma w^2."""
    w, zeta = 1.7, 0.7
    poles = np.roots([1, 2 * zeta * w, w**2])
    found = place([[0, 1], [0, 0]], [gamma, 1], poles)
    np.testing.assert_allclose(found.K[0], [w**2, 2 * zeta * w - gamma * w**2], rtol=1e-12)


def test_reactor_of_kautsky_with_two_inputs():
    """Kautsky, Nichols, Van Dooren, Int. J. Control 41 (1985), example 1: poles as asked there."""
    A = [
        [1.380, -0.2077, 6.715, -5.676],
        [-0.5814, -4.290, 0, 0.6750],
        [1.067, 4.273, -6.654, 5.893],
        [0.0480, 4.273, 1.343, -2.104],
    ]
    B = [[0, 0], [5.679, 0], [1.136, -3.146], [1.136, 0]]
    asked = [-0.2, -0.5, -5.0566, -8.6659]
    found = place(A, B, asked)
    poles = np.linalg.eigvals(np.array(A) - np.array(B) @ found.K)
    np.testing.assert_allclose(np.sort(poles.real), np.sort(asked), rtol=1e-9)
    np.testing.assert_allclose(poles.imag, 0, atol=1e-9)


@pytest.mark.parametrize("states", [4, 10, 15])
def test_gains_of_a_diagonal_model_are_those_of_exact_arithmetic(states):
    """A = diag(a_i), b = 1: k_i = prod_j (a_i - p_j) / prod_{j != i} (a_i - a_j).

    With ten states scipy's gains miss by 0.04, and eigenvalues in double precision by 4 whatever the gains.
    """
    a = [Fraction(i) for i in range(1, states + 1)]
    found = place(np.diag([float(x) for x in a]), np.ones(states), [-float(x) for x in a])
    for i, gain in enumerate(found.K[0]):
        exact = math.prod(a[i] + p for p in a) / math.prod(a[i] - a[j] for j in range(states) if j != i)
        assert Fraction(gain) == pytest.approx(exact, rel=1e-15)
    assert found.miss <= 1e-9
    if states >= 10:
        assert "do not build" in found.sentence


def characteristic(A, b, K, s):
    """det(sI - A + b K) in rational numbers."""
    n = len(b)
    M = [
        [(s if i == j else 0) - Fraction(A[i][j]) + Fraction(b[i]) * Fraction(K[j]) for j in range(n)] for i in range(n)
    ]
    sign, value = 1, Fraction(1)
    for c in range(n):
        pivot = next((r for r in range(c, n) if M[r][c]), None)
        if pivot is None:
            return Fraction(0)
        if pivot != c:
            M[c], M[pivot], sign = M[pivot], M[c], -sign
        value *= M[c][c]
        for r in range(c + 1, n):
            factor = M[r][c] / M[c][c]
            M[r] = [x - factor * y for x, y in zip(M[r], M[c], strict=True)]
    return sign * value


def test_as_many_equal_poles_as_inputs_keep_directions_of_their_own():
    """Two inputs leave A - B K + 5 without two of its four ranks; one mixture of them would leave three (Heymann).

    And with a direction for each, the poles move by as much as A and B are off, not by the root of it.
    """
    A, B = np.diag([1.0, 2.0, 3.0, 4.0]), np.array([[1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [1.0, -1.0]])
    found = place(A, B, [-5, -5, -2, -3])
    values = np.linalg.svd(A - B @ found.K + 5 * np.eye(4), compute_uv=False)
    assert np.sum(values > 1e-9 * values[0]) == 2


def test_distinct_poles_of_several_inputs_are_as_robust_as_scipy_s():
    """How far the eigenvectors are from orthogonal is what several inputs leave free."""
    from scipy.signal import place_poles

    rng = np.random.default_rng(3)
    A, B, asked = rng.normal(size=(5, 5)), rng.normal(size=(5, 2)), -np.arange(1.0, 6)
    ours, theirs = (np.linalg.cond(np.linalg.eig(A - B @ K)[1]) for K in
                    (place(A, B, asked).K, place_poles(A, B, asked).gain_matrix))  # fmt: skip
    assert ours < 1.5 * theirs


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("states", [8, 12, 15])
@pytest.mark.slow
def test_a_dense_model_is_right_or_refused(states, seed):
    """Right: det(sI - A + b K), in rational numbers, changes its sign within 1e-5 around every pole asked."""
    rng = np.random.default_rng(seed)
    A, b = rng.normal(size=(states, states)), rng.normal(size=states)
    try:
        K = place(A, b, -np.arange(1.0, states + 1)).K[0]
    except BadInput:
        if states == 8:
            raise  # easy enough to be solved
        return
    near = Fraction(states) / 10**6 * 2
    for pole in range(1, states + 1):
        left, right = (characteristic(A, b, K, -pole + side * near) for side in (-1, 1))
        assert left * right < 0


@pytest.mark.parametrize("poles", ["-5, -5, -5, -5", "-4+-2j, -4+-2j", "-4.1484+-1.6341j, -16.8545, -3.222"])
def test_units_of_the_states_do_not_matter(poles):
    """x_i told in other units: the gains change by the same factors, the poles not at all."""
    model, other = RIG.linear("inverted"), np.array([1e3, 1e-4, 57.3, 1e6])
    plain = place(model.A, model.B, read_poles(poles))
    told = place(other[:, None] * model.A / other, other[:, None] * model.B, read_poles(poles))
    np.testing.assert_allclose(told.K * other, plain.K, rtol=1e-11)
    assert plain.miss < 0.01


def test_repeated_poles_are_repeated_roots():
    """(s + 5)^4, coefficient by coefficient."""
    model = RIG.linear("inverted")
    found = place(model.A, model.B, [-5] * 4)
    np.testing.assert_allclose(np.poly(model.A - model.B @ found.K), [1, 20, 150, 500, 625], rtol=1e-10)


def test_python_control_agrees():
    import control

    model = RIG.linear("inverted")
    for text in ("-4.1484+-1.6341j, -16.8545, -3.222", "-4.6314+-2.3357j, -40.7029, -2.7882"):
        poles = read_poles(text)
        found = place(model.A, model.B, poles)
        np.testing.assert_allclose(found.K[0], np.ravel(control.acker(model.A, model.B, poles)), rtol=1e-8)
        np.testing.assert_allclose(found.K[0], np.ravel(control.place(model.A, model.B, poles)), rtol=1e-8)


def test_more_equal_poles_than_inputs():
    """scipy's place_poles refuses this; A has the pole 1 twice, so no single mixture of the inputs reaches both."""
    A, B = np.diag([1.0, 1.0, 3.0]), np.array([[2.0, 1.0], [1.0, 2.0], [1.0, 1.0]])
    found = place(A, B, [-1, -1, -1])
    np.testing.assert_allclose(np.poly(A - B @ found.K), [1, 3, 3, 1], rtol=1e-9)


@pytest.mark.parametrize("a", [0.0, 100.0, -30.0])
def test_the_sensitivity_is_the_farthest_move_of_a_root_by_hand(a):
    """x'' = a x + u, u = -k_1 x - k_2 x', poles -1 and -4: s^2 + k_2 s + k_1 - a, each number 0.1 % off in turn."""
    found = place([[0, 1], [a, 0]], [0, 1], [-1, -4])
    k_1, k_2 = 4 + a, 5
    assert found.K[0] == pytest.approx([k_1, k_2])
    off = ([1, k_2, 1.001 * (k_1 - a)], [1, k_2, k_1 - 1.001 * a], [1, 1.001 * k_2, 1.001 * k_1 - a])
    moves = [np.abs(np.sort(np.roots(c)) - [-4, -1]).max() for c in off]
    assert found.sensitivity == pytest.approx(max(moves), rel=1e-6)
    assert ("touchy" in found.sentence) == (max(moves) > 0.4)


def test_how_well_a_mode_is_reached_does_not_depend_on_the_unit_of_time():
    """The distance to the nearest model that does not reach it, as a share of [A, B] (Eising 1984)."""
    A, B = np.array([[1.0, 0.0], [0.0, 3.0]]), np.array([[1.0], [1e-3]])
    plain, faster = weak_modes(A, B), weak_modes(1e4 * A, 1e4 * B)
    assert [pole for _, pole in plain] == [3.0, 1.0]
    # at s = 3 the rows (-2, 0, 1) and (0, 0, 1e-3) remain: what of the second is across the first, over the norm, 3
    assert plain[0][0] == pytest.approx(1e-3 * math.sqrt(1 - 1 / 5) / 3, rel=1e-5)
    assert [reach for reach, _ in faster] == pytest.approx([reach for reach, _ in plain])
    assert weak_modes(np.zeros((1, 1)), np.zeros((1, 1))) == [(0.0, 0.0)]


@pytest.mark.parametrize(
    ("A", "B", "poles", "words"),
    [
        (np.diag([1.0, 2.0, 3.0]), [1, 1, 0], [-1, -2, -3], "cannot move the pole at 3"),
        (np.diag([1.0, 1.0, 3.0]), [1, 1, 1], [-1, -2, -3], "cannot move the pole at 1 "),
        ([[0, 2], [-2, 0]], [0, 0], [-1, -2], "cannot move the poles at 0±2j"),
        ([[0, 1], [0, 0]], [0, 1], [-1], "needs 2 poles, got 1"),
        ([[0, 1], [0, 0]], [0, 1], [-1, -2, -3], "needs 2 poles, got 3"),
        ([[0, 1], [0, 0]], [0, 1], [-1 + 1j, -2], "comes without -1-1j"),
        ([[0, 1], [0, 0]], [0, 1], [-1 + 1j, -1 - 1.1j], "comes without"),
        ([[0, 1], [0, 0]], [0, 1], [-1, np.nan], "finite"),
        ([[0, 1], [0, np.inf]], [0, 1], [-1, -2], "finite"),
        ([[0, 1]], [0, 1], [-1, -2], "shape"),
    ],
)
def test_what_cannot_be_is_said_in_a_sentence(A, B, poles, words):
    with pytest.raises(BadInput, match=words):
        place(A, B, poles)


def test_an_unreachable_mode_is_named_in_any_coordinates():
    """Two equal pendulums on one base: the mode in which they swing against each other cannot be moved."""
    rng = np.random.default_rng(5)
    A = np.zeros((4, 4))
    A[0, 1] = A[2, 3] = 1
    A[1, [0, 2]], A[3, [0, 2]] = [5, 1], [1, 5]  # poles +-sqrt(6) together, +-2 against each other
    T = rng.normal(size=(4, 4))
    with pytest.raises(BadInput, match=r"cannot move the poles at (2, -2|-2, 2) "):
        place(T @ A @ np.linalg.inv(T), T @ [0, 1, 0, 1], [-1, -2, -3, -4])


@pytest.mark.parametrize(
    ("text", "poles"),
    [
        ("-4.1484+-1.6341j, -16.85, -3.222", [-4.1484 + 1.6341j, -4.1484 - 1.6341j, -16.85, -3.222]),
        ("-4 ± 2i; −3", [-4 + 2j, -4 - 2j, -3]),
        ("-1+2j, -1-2j", [-1 + 2j, -1 - 2j]),
        ("-1e1", [-10]),
        ("-+3j", [3j, -3j]),
    ],
)
def test_poles_as_people_write_them(text, poles):
    np.testing.assert_array_equal(read_poles(text), poles)


def test_what_is_no_pole_is_said():
    with pytest.raises(BadInput, match="'four' is no pole"):
        read_poles("-1, four")
