"""Is the sampled loop, late and with differenced encoders, what textbooks, the kernel and python-control make of it?"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from upright.errors import BadInput
from upright.gains import (
    difference,
    dlqr,
    feedback,
    filtered,
    kalman,
    lqr,
    margins,
    place,
    place_sampled,
    prefilter,
    process_noise,
    read_off,
)
from upright.gains.loop import closed, command_noise
from upright.gains.velocity import observer, placed_observer
from upright.physics import CartPendulum, Furuta, chain
from upright.systems import StateSpace, to_s, to_z

RIG = Furuta(m_p=0.2, l_cg=0.15, r=0.2, J_d=0.01, J_p=5e-4, b_1=0.007, b_2=3e-4)
UPRIGHT = RIG.linear("inverted")
SET_1 = [-4.1484 + 1.6341j, -4.1484 - 1.6341j, -16.8545, -3.2220]
COUNT = 2 * math.pi / 16_000
CTMS = CartPendulum(m_c=0.5, m_p=0.2, b_1=0.1, l_cg=0.3, J_p=0.006, g=9.8).linear("inverted")


def linear(A, B, C):
    A, B, C = (np.atleast_2d(np.array(m, dtype=float)) for m in (A, B, C))
    names = tuple(f"x{i}" for i in range(A.shape[0]))
    return StateSpace(A, B, C, states=names, inputs=("u",))


DOUBLE_INTEGRATOR = linear([[0, 1], [0, 0]], [[0], [1]], [[1, 0]])


@pytest.mark.parametrize("delay", [0.0, 0.5, 2.5])
def test_states_are_read_off_outputs_that_show_them_in_other_units(delay):
    """Position in turns and the sum of both: two equations for two states; commands on their way are no states."""
    C = np.array([[1 / (2 * math.pi), 0.0], [1.0, 1.0]])
    model = linear([[0, 1], [0, 0]], [[0], [1]], C).to_sampled(0.01, delay)
    found = read_off(model)
    np.testing.assert_allclose(found.D @ C @ [0.3, -2.0], [0.3, -2.0], rtol=1e-12)
    assert found.D.shape == (2, 2)
    with pytest.raises(BadInput, match="do not tell every state"):
        read_off(DOUBLE_INTEGRATOR.to_sampled(0.01, delay))


@pytest.mark.parametrize("delay", [0.0, 0.3, 1.0, 2.6])
def test_double_integrator_with_a_late_command(delay):
    """Astrom and Wittenmark, Computer-Controlled Systems, 3rd ed., section 2.3: Gamma_0 and Gamma_1 in closed form."""
    h, whole = 0.4, math.floor(delay)
    tau = (delay - whole) * h
    model = DOUBLE_INTEGRATOR.to_sampled(h, delay)
    np.testing.assert_allclose(model.A[:2, :2], [[1, h], [0, 1]], rtol=1e-14)
    from_command = np.column_stack([model.B[:2], model.A[:2, 2:]])
    newest, older = [(h - tau) ** 2 / 2, h - tau], [tau * (h - tau / 2), tau]
    expected = np.zeros_like(from_command)
    expected[:, whole] = newest
    if tau:
        expected[:, whole + 1] = older
    np.testing.assert_allclose(from_command, expected, atol=1e-14)


def test_a_lag_with_a_late_command():
    """The same book, Example 2.8: x' = alpha x + beta u(t - tau)."""
    a, b, h, tau = -1.3, 2.0, 0.5, 0.2
    model = linear([[a]], [[b]], [[1]]).to_sampled(h, tau / h)
    assert model.A[0, 0] == pytest.approx(math.exp(a * h))
    assert model.B[0, 0] == pytest.approx(b / a * (math.exp(a * (h - tau)) - 1))
    assert model.A[0, 1] == pytest.approx(b / a * math.exp(a * (h - tau)) * (math.exp(a * tau) - 1))


def test_pendulum_sampled_at_10_ms():
    """Control Tutorials for MATLAB and Simulink, digital inverted pendulum: c2d and dlqr as printed there."""
    model = CTMS.to_sampled(0.01)
    printed = [[1, 0.01, 0.0001, 0], [0, 0.9982, 0.0267, 0.0001], [0, 0, 1.0016, 0.01], [0, -0.0045, 0.3119, 1.0016]]
    np.testing.assert_allclose(model.A, printed, atol=6e-5)
    np.testing.assert_allclose(model.B[:, 0], [0.0001, 0.0182, 0.0002, 0.0454], atol=6e-5)
    K = dlqr(model.A, model.B, [5000, 0, 100, 0], 1)
    np.testing.assert_allclose(K[0], [-61.9933, -33.5040, 95.0597, 18.8300], atol=6e-5)


def test_deadbeat_gains_of_the_double_integrator():
    """Astrom and Wittenmark, section 4.3: L = [1/h^2, 3/(2 h)] puts both poles at z = 0."""
    h = 0.25
    model = DOUBLE_INTEGRATOR.to_sampled(h)
    np.testing.assert_allclose(place(model.A, model.B, [0, 0]).K[0], [1 / h**2, 3 / (2 * h)], rtol=1e-12)


@pytest.mark.parametrize("delay", [0.0, 0.5, 1.0, 2.25])
def test_commands_on_their_way_are_states_that_can_be_placed(delay):
    """Full state feedback of the late plant; numpy finds the poles again."""
    model = UPRIGHT.to_sampled(0.01, delay)
    asked = np.concatenate([to_z(SET_1, 0.01), np.zeros(model.remembered)])
    K = place(model.A, model.B, asked).K
    np.testing.assert_allclose(np.poly(model.A - model.B @ K), np.poly(asked).real, atol=1e-9)


@pytest.mark.parametrize("delay", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("memory", [0.0, 0.6])
@pytest.mark.parametrize("asked", [SET_1, [-5, -5, -5, -5], [-4 + 2j, -4 - 2j, -4 + 2j, -4 - 2j]])
def test_gains_on_differenced_encoders_that_meet_the_poles(asked, memory, delay):
    """The loop's characteristic polynomial has the poles asked as roots, to the order in which they repeat."""
    model = UPRIGHT.to_sampled(0.005, delay)
    estimator = filtered(model, memory)
    K = place_sampled(model, estimator, asked)
    poly = np.poly(closed(model, feedback(estimator, K))).real
    _, rest = np.polydiv(poly, np.poly(to_z(asked, 0.005)).real)
    assert np.abs(rest).max() < 1e-9


def test_fast_sampling_comes_to_the_continuous_gains():
    """The difference to Ackermann's gains falls with the period to the first power."""
    K = place(UPRIGHT.A, UPRIGHT.B, SET_1).K
    off = []
    for period in (1e-3, 5e-4):
        model = UPRIGHT.to_sampled(period)
        off.append(np.abs(place_sampled(model, difference(model), SET_1) - K).max())
    assert off[0] / off[1] == pytest.approx(2, rel=0.05)


def simulated(model, law, start, samples):
    """Commands of the compiled kernel on the nonlinear rig close to upright."""
    from upright.simulation import simulate

    given = replace(law, target=[0.0, math.pi], begin=None, delay=model.delay)
    x = simulate(RIG, {}, RIG.state("inverted") + start, None, model.period, samples=samples, substeps=4, loop=given)
    return x[:, :4, 0] - RIG.state("inverted")


@pytest.mark.parametrize("delay", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("kind", ["plain", "filtered", "kalman"])
def test_the_kernel_moves_as_the_sampled_loop_says(kind, delay):
    """Small tilt on the nonlinear rig, integrated by the kernel: same samples as powers of the loop's matrix."""
    model = UPRIGHT.to_sampled(0.004, delay)
    estimator = {
        "plain": lambda: difference(model),
        "filtered": lambda: filtered(model, 0.5),
        "kalman": lambda: kalman(model, 1e-2, 1e-4),
    }[kind]()
    law = feedback(estimator, place(UPRIGHT.A, UPRIGHT.B, SET_1).K)
    start = np.array([0.0, 0.0, 1e-5, 0.0])
    x = simulated(model, law, start, 300)
    M = closed(model, law)
    state = np.zeros(M.shape[0])
    state[:4] = start
    expected = np.empty((300, 4))
    for k in range(300):
        expected[k] = state[:4]
        state = M @ state
    # pi is held to 4e-16, a tilt of 1e-5 to 4e-11 of itself, which the free arm sums up over 300 samples to some 1e-8
    assert np.all(np.abs(x - expected) < 1e-6 * np.abs(expected).max(axis=0))


def test_noise_of_differences_in_closed_form():
    """Plain: resolution/(T sqrt 6). Filtered: variance resolution^2/12 * 2 (1 - a)^2/((1 + a) T^2)."""
    model, T = UPRIGHT.to_sampled(0.002), 0.002
    assert difference(model).noise(COUNT)[1::2] == pytest.approx(COUNT / (T * math.sqrt(6)))
    for a in (0.2, 0.9):
        variance = COUNT**2 / 12 * 2 * (1 - a) ** 2 / ((1 + a) * T**2)
        assert filtered(model, a).noise(COUNT)[1::2] == pytest.approx(math.sqrt(variance))


@pytest.mark.parametrize("index", [0.05, 1.0, 4.0])
def test_kalman_filter_of_a_tracked_target(index):
    """Kalata (IEEE Trans. AES 20, 1984): alpha, beta from the tracking index, random acceleration over each period."""
    T = 0.1
    model = DOUBLE_INTEGRATOR.to_sampled(T)
    gain = kalman(model, index / T**2, 1.0).D[:, 0]
    r = (4 + index - math.sqrt(8 * index + index**2)) / 4
    alpha = 1 - r**2
    beta = 2 * (2 - alpha) - 4 * math.sqrt(1 - alpha)
    np.testing.assert_allclose(gain, [alpha, beta / T], rtol=1e-9)


def test_a_shaken_double_integrator_is_one_whose_command_is_noise():
    model = DOUBLE_INTEGRATOR.to_sampled(0.1)
    np.testing.assert_allclose(process_noise(model, 3.0), 9.0 * model.B @ model.B.T, rtol=1e-12)


def test_a_filter_that_expects_pushes_anywhere_corrects_faster_than_the_zeros_of_the_drive():
    """Noise in the command alone, however loud, leaves observer poles at mirrored zeros (Kwakernaak and Sivan, Linear
    Optimal Control Systems, 1972): here that of the arm's answer, the pendulum about a held arm.
    """
    model = UPRIGHT.to_sampled(0.001)
    zero = math.sqrt(RIG.m_p * RIG.g * RIG.l_cg / (RIG.J_p + RIG.m_p * RIG.l_cg**2))
    count = COUNT / math.sqrt(12)
    by_command, anywhere = (
        -to_s(np.linalg.eigvals(kalman(model, process, count).A), 0.001).real.max()
        for process in (100.0, process_noise(model, 100.0 * np.abs(UPRIGHT.B[1::2, 0])))
    )
    assert by_command < 1.1 * zero
    assert anywhere > 10 * zero


def test_kalman_filter_of_a_random_walk():
    """q = r: the gain is 0.618, the golden ratio less one (Anderson and Moore, Optimal Filtering)."""
    model = linear([[0]], [[1]], [[1]]).to_sampled(1.0)
    assert kalman(model, [[1.0]], 1.0).D[0, 0] == pytest.approx((math.sqrt(5) - 1) / 2)


def test_separation_of_observer_and_gains():
    """Poles of the loop are those of the gains and those of the observer."""
    model = UPRIGHT.to_sampled(0.01)
    estimator = kalman(model, 1e-2, COUNT / math.sqrt(12))
    K = dlqr(model.A, model.B, [1, 0, 1, 0], 1.0)
    found = np.poly(closed(model, feedback(estimator, K)))
    wanted = np.polymul(np.poly(model.A - model.B @ K), np.poly(estimator.A))
    np.testing.assert_allclose(found, wanted, atol=1e-9)


@pytest.mark.parametrize(("delay", "lag"), [(0.0, 0.0), (1.0, 0.0), (1.7, 0.02)])
@pytest.mark.parametrize("at_once", [False, True])
def test_the_error_of_an_observer_dies_out_with_its_poles_whatever_is_commanded(delay, lag, at_once):
    """Cayley and Hamilton: its samples obey the recurrence whose roots were asked for.

    A state that is forgotten within a sample cannot be traced back, and makes the observer a sample late.
    """
    A, B, C = np.array([[1.0, 0.1], [0.2, 0.9]]), np.array([[0.005], [0.1]]), np.array([[1.0, 0.0]])
    if at_once:
        A[:, 1] = [0.1, 0.02]  # the second column is a tenth of the first
    model = StateSpace(A, B, C, dt=0.1)
    if lag or delay % 1:
        model = StateSpace([[0.0, 1.0], [2.0, -0.3]], [[0.0], [1.0]], C).to_sampled(0.1, delay, lag)
    elif delay:
        model = model.to_sampled(0.1, delay)
    z = np.array([0.5, 0.3])
    found = placed_observer(model, z)
    assert found.name.endswith("a sample late") == (at_once and not lag)
    x, s, misses = np.zeros(len(model.A)), np.zeros(len(found.A)), []
    x[:2] = [0.3, -1.0]
    for k in range(8):
        y, u = model.C @ x, np.array([math.sin(k)])
        misses.append((found.C @ s + found.D @ y - x)[:2])
        s = found.A @ s + found.B @ y + found.E @ u
        x = model.A @ x + model.B @ u
    misses = np.array(misses)
    assert np.abs(misses[0]).max() > 0.1
    c = np.poly(z)
    assert c[0] * misses[2:] + c[1] * misses[1:-1] + c[2] * misses[:-2] == pytest.approx(0.0, abs=1e-9)


def test_an_observer_needs_an_output_that_shows_every_mode():
    with pytest.raises(BadInput, match="the outputs do not show the mode at -2 1/s"):
        placed_observer(linear(np.diag([-1.0, -2.0]), [[1], [1]], [[1, 0]]).to_sampled(0.1), [0.5, 0.3])


@pytest.mark.slow
def test_noise_of_the_command_is_what_a_long_run_shows():
    """White rounding errors through the loop by hand, against Lyapunov's equation."""
    model = UPRIGHT.to_sampled(0.01)
    law = feedback(filtered(model, 0.5), place(UPRIGHT.A, UPRIGHT.B, SET_1).K)
    rng = np.random.default_rng(3)
    B, D = law.B[:, :2], law.D[:, :2]
    x, z, u = np.zeros(4), np.zeros(law.A.shape[0]), []
    for error in rng.normal(size=(200_000, 2)) * COUNT / math.sqrt(12):
        y = model.C @ x + error
        u.append((law.C @ z + D @ y)[0])
        z, x = law.A @ z + B @ y, model.A @ x + model.B[:, 0] * u[-1]
    # correlated over about 0.3 s, so some 3000 independent values: 1.3 % standard error, four of them
    assert np.std(u[1000:]) == pytest.approx(command_noise(model, law, COUNT), rel=0.055)


def test_margins_agree_with_python_control():
    import control

    model = UPRIGHT.to_sampled(0.005, 1.0)
    law = feedback(filtered(model, 0.5), place(UPRIGHT.A, UPRIGHT.B, SET_1).K)
    found = margins(model, law)
    B, D = law.B[:, :2], law.D[:, :2]
    plant = control.ss(model.A, model.B, model.C, 0, model.period)
    L = -control.ss(law.A, B, law.C, D, model.period) * plant
    gm, pm, sm, *_ = control.stability_margins(control.frd(L, np.geomspace(0.05, 620, 20_000)), returnall=True)
    assert found.most_gain == pytest.approx(min(g for g in gm if g > 1), rel=1e-3)
    assert found.least_gain == pytest.approx(max(g for g in gm if g < 1), rel=1e-3)
    assert math.degrees(found.phase) == pytest.approx(np.abs(pm).min(), rel=1e-3)
    assert found.modulus == pytest.approx(min(sm), rel=1e-3)


def test_a_lag_before_an_integrator_in_closed_form():
    """f' = (u - f)/a, x' = f over a held command: exponentials by hand."""
    h, a = 0.3, 0.2
    e = math.exp(-h / a)
    model = linear([[0]], [[1]], [[1]]).to_sampled(h, lag=a)
    np.testing.assert_allclose(model.A, [[1, a * (1 - e)], [0, e]], atol=1e-15)
    np.testing.assert_allclose(model.B, [[h - a * (1 - e)], [1 - e]], atol=1e-15)
    assert model.remembered == 1
    late = linear([[0]], [[1]], [[1]]).to_sampled(h, 1.0, lag=a)
    np.testing.assert_allclose(late.A[:2], np.hstack([model.A, model.B]), atol=1e-15)


def test_sampled_gains_make_up_for_a_lag():
    model = UPRIGHT.to_sampled(0.002, 1.0, lag=0.004)
    estimator = filtered(model, 0.5)
    law = feedback(estimator, place_sampled(model, estimator, SET_1))
    found = to_s(np.linalg.eigvals(closed(model, law)), model.period)
    for pole in SET_1:
        assert np.abs(found - pole).min() < 1e-6
    plain = feedback(estimator, place(UPRIGHT.A, UPRIGHT.B, SET_1).K)
    assert margins(model, plain).delay < margins(UPRIGHT.to_sampled(0.002, 1.0), plain).delay


@pytest.mark.slow
def test_margin_of_delay_is_the_phase_margin_over_the_crossover():
    """One lag and a gain, fast sampled: delay = phase margin / crossover (Astrom and Murray, section 10.3)."""
    plant = linear([[-1]], [[1]], [[1]])
    T, k = 1e-3, 5.0
    model = plant.to_sampled(T)
    law = feedback(observer(model, [[1.0]]), [[k]])
    w = math.sqrt(k**2 - 1)
    phase = math.pi - math.atan(w) - w * T / 2  # the hold itself is late by half a period
    found = margins(model, law)
    assert found.phase == pytest.approx(phase, abs=1e-3)
    assert found.delay == pytest.approx(phase / w, abs=1e-3)


def test_a_loop_that_falls_has_no_margins():
    model = UPRIGHT.to_sampled(0.05, 2.0)
    law = feedback(difference(model), place(UPRIGHT.A, UPRIGHT.B, SET_1).K)
    with pytest.raises(BadInput, match="not stable"):
        margins(model, law)


def test_prefilter_of_a_sampled_flexible_shaft():
    """Step on two disks with a spring to ground: the second disk stands at the reference (final value by hand)."""
    plant = chain(2, "torsional")(J_1=0.01, J_2=0.01, k_12=1.4, k_1=0.3, c_1=0.007, c_2=0.001).linear()
    model = plant.to_sampled(0.01)
    K = lqr(plant.A, plant.B, [1, 0, 1, 0], 0.1)
    k_pf = prefilter(model.A, model.B, plant.C[1], K, sampled=True)
    x = np.zeros(4)
    for _ in range(3000):
        x = model.A @ x + model.B[:, 0] * (k_pf * 0.7 - K[0] @ x)
    assert x[2] == pytest.approx(0.7, rel=1e-9)


def test_poles_in_s_and_z_go_together():
    np.testing.assert_allclose(to_s(to_z(SET_1, 0.01), 0.01), SET_1, rtol=1e-12)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: UPRIGHT.to_sampled(0.0), "period above 0"),
        (lambda: UPRIGHT.to_sampled(0.01, -1.0), "delay must be"),
        (lambda: UPRIGHT.to_sampled(0.01, lag=-1.0), "lag must be"),
        (lambda: filtered(UPRIGHT.to_sampled(0.01), 1.0), "memory must be"),
        (lambda: kalman(UPRIGHT.to_sampled(0.01), 1.0, 0.0), "noise above 0"),
        (lambda: feedback(difference(UPRIGHT.to_sampled(0.01)), [[1, 2, 3, 4, 5]]), "shape"),
        (
            lambda: place_sampled(UPRIGHT.to_sampled(0.01), difference(UPRIGHT.to_sampled(0.01)), [-1]),
            "needs 4 poles",
        ),
    ],
)
def test_what_cannot_be_is_said(call, words):
    with pytest.raises(BadInput, match=words):
        call()
