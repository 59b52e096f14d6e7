"""Does the response of a rig say what the equations of motion say?"""

from __future__ import annotations

import math
from dataclasses import replace

import control
import numpy as np
import pytest

from upright.errors import BadInput, NotIdentifiable
from upright.identification import GreyBox, Parameter
from upright.identification.frequency.answer import explain
from upright.identification.frequency.balance import Balance
from upright.identification.frequency.detection import by_period, detect, settled
from upright.identification.frequency.fitting import least_squares, simplex_dB
from upright.identification.frequency.response import FrequencyResponse, describing
from upright.identification.frequency.spectra import response_of
from upright.physics import CartPendulum, DoublePendulum, DoublePendulumAbsolute, Furuta, chain
from upright.records import Provenance, Record
from upright.simulation import simulate

FURUTA = Furuta(m_p=0.135, l_cg=0.184, r=0.15, J_d=7.2e-3, J_p=6e-4, J_a=2e-5, b_1=2e-3, b_2=4e-5)
OMEGA = np.geomspace(2.0, 40.0, 25)


def smooth(plant=FURUTA, gain=0.65, lag=2e-3, omega=OMEGA) -> FrequencyResponse:
    """A response without dry friction and noise, from eq. (3) about hanging, transformed by hand."""
    p = plant
    s = 1j * omega
    J, J_A = p.J_d + p.m_p * p.r**2 + p.J_a, p.J_p + p.m_p * p.l_cg**2
    mlr, mgl = p.m_p * p.l_cg * p.r, p.m_p * p.g * p.l_cg
    D_2 = J_A * J - mlr**2
    Delta = D_2 * s**3 + (J * p.b_2 + J_A * p.b_1) * s**2 + (J * mgl + p.b_1 * p.b_2) * s + p.b_1 * mgl
    drive = gain / (1 + lag * s)
    psi, theta = (J_A * s**2 + p.b_2 * s + mgl) / (s * Delta), mlr * s / Delta
    small = np.full((omega.size, 2), 1e-12)
    return FrequencyResponse(
        omega=omega, response=np.column_stack([psi, theta]) * drive[:, None], outputs=("psi", "theta"),
        units=("rad", "rad", "V"), variance=small, drive=np.full(omega.size, 1e-4),
    )  # fmt: skip


def asked(**sought: float) -> GreyBox:
    """The Furuta rig with guesses for what is sought, the rest known."""
    values = {**FURUTA.parameters(), "actuator.gain": 0.65, "actuator.lag": 2e-3}
    return GreyBox(
        plant=Furuta,
        parameters={
            n: Parameter(name=n, value=sought.get(n, v), estimate=n in sought, lower=0.0) for n, v in values.items()
        },
    )


GUESS = {"J_d": 1e-2, "J_p": 9e-4, "b_1": 4e-3, "b_2": 2e-5, "actuator.gain": 0.9, "actuator.lag": 1e-3}


def test_a_line_under_drift_and_harmonics_is_found_exactly():
    t = np.arange(0, 400) * 0.01
    omega = 2 * math.pi * 5 / 4.0  # five whole periods
    y = 3.0 - 0.7 * t + np.real((0.2 - 0.5j) * np.exp(1j * omega * t)) + 0.03 * np.cos(3 * omega * t + 1)
    tone = detect(t, y, omega)
    assert tone.lines[0, 0] == pytest.approx(0.2 - 0.5j, abs=1e-12)
    assert tone.distortion[0] == pytest.approx(0.03 / abs(0.2 - 0.5j), rel=1e-9)
    assert tone.coherence[0] == pytest.approx(1.0)


def test_the_stated_variance_is_that_of_repeats():
    """White noise of variance s^2 leaves 4 s^2/N in a complex line."""
    rng = np.random.default_rng(3)
    t = np.arange(2000) * 0.01
    omega = 2 * math.pi
    y = np.cos(omega * t)[:, None] + 0.3 * rng.normal(size=(t.size, 400))
    tone = detect(t, y, omega, blocks=1)
    scatter = np.mean(np.abs(tone.lines[0] - 1) ** 2)
    assert scatter == pytest.approx(4 * 0.09 / t.size, rel=0.15)  # 400 repeats: 5 % standard error
    assert np.mean(tone.variance) == pytest.approx(4 * 0.09 / t.size, rel=0.02)


def test_dry_friction_of_a_sine_is_its_describing_function():
    t = np.arange(1000) * 1e-3 * 2 * math.pi
    tone = detect(t, 0.3 * np.sin(3 * t), 3.0)
    assert tone.dry[0] == pytest.approx(4 / (math.pi * 3 * 0.3), rel=1e-3)  # 4096 instants
    assert describing(np.array([3.0]), np.array([[0.3]]))[0, 0] == pytest.approx(4 / (math.pi * 3 * 0.3))
    assert tone.still[0] == pytest.approx(2 * math.asin(0.05) / math.pi, abs=1e-3)


def test_a_body_that_stands_still_has_no_friction_and_divides_by_no_speed():
    t = np.arange(400) * 0.01
    tone = detect(t, np.column_stack([np.zeros(400), 0.3 * np.cos(2 * math.pi * t)]), 2 * math.pi)
    with np.errstate(all="raise"):
        still, moving = tone.dry
    assert still == 0
    assert moving == pytest.approx(4 / (math.pi * 2 * math.pi * 0.3), rel=1e-3)  # 4 / (pi V), beside it


def test_a_transient_is_waited_for_as_long_as_it_lasts():
    """Lines of successive periods approach theirs as rho^k: the wait ends when rho^k is below the tolerance."""
    k = np.arange(200)
    for rho in (0.6, 0.9 * np.exp(0.4j), 0.95):
        lines = (1 + 0.5 * rho**k)[:, None]
        end = settled(lines, tolerance=1e-3)
        assert end is not None
        assert 0.5 * abs(rho) ** end < 1.1e-3
        assert 0.5 * abs(rho) ** (end - 25) > 1e-3
    assert settled((1 + 0.5 * 0.999**k)[:, None], tolerance=1e-3) is None


def test_a_transient_is_settled_once_a_whole_window_is() -> None:
    """Five periods are looked at at once: of six with one that is off the last five are whole, of five no window is."""
    assert settled(np.array([2, 1, 1, 1, 1], dtype=complex)[:, None]) is None
    assert settled(np.array([2, 1, 1, 1, 1, 1], dtype=complex)[:, None]) == 6
    assert settled(np.ones((5, 1), dtype=complex)) == 5
    assert settled(np.ones((4, 1), dtype=complex)) is None


def test_dry_friction_under_a_multisine_is_that_of_its_large_line_and_half_for_a_faint_one() -> None:
    """Of a sine of speed V the sign of the speed is 4/(pi V) per speed; of a faint one beside it 2/(pi V)."""
    length, dt = 400, 1e-3
    k = np.arange(6 * length)
    big, faint = 5, 7
    u = np.cos(2 * math.pi * big * k / length) + 0.08 * np.cos(2 * math.pi * faint * k / length)
    record = Record(t=k * dt, signals={"u": u, "y": 0.3 * u}, provenance=Provenance(file="log.csv", reader="table"))
    found = response_of([record], command="u", outputs=["y"], kind="multisine")
    omega = 2 * math.pi * np.array([big, faint]) / (length * dt)
    assert found.omega == pytest.approx(omega)
    assert found.response[:, 0] == pytest.approx([0.3, 0.3])
    V = 0.3 * omega[0]
    # but for the square of the ratio of their speeds, (0.08 7/5)^2 = 1.3 %
    assert found.dry[:, 0] == pytest.approx([4 / (math.pi * V), 2 / (math.pi * V)], rel=0.02)


def test_periods_are_told_apart():
    length, tick = 50, 0.01
    t = np.arange(500) * tick
    omega = 2 * math.pi / (length * tick)
    y = (np.where(t < 2.5, 1.0, 2.0) * np.cos(omega * t) + 0.4 * t)[:, None]
    assert np.abs(by_period(y, length, tick))[:, 0] == pytest.approx([1] * 5 + [2] * 5, abs=1e-9)


@pytest.mark.parametrize("plant", [FURUTA, CartPendulum(m_c=0.6, m_p=0.135, l_cg=0.15, J_p=6e-4, b_1=1.2, b_2=3e-5)])
def test_small_motions_answer_as_the_linear_model(plant):
    """With a drive in front: gain, delay, lag and hold, as python-control has them."""
    names = tuple(c.name for c in plant.coordinates)
    data = FrequencyResponse(
        omega=OMEGA, response=plant.linear("hanging").response(OMEGA)[:, :, 0], outputs=names,
        drive=np.full(OMEGA.size, 1e-6), hold=1e-3,
    )  # fmt: skip
    drive = {"actuator.gain": 0.65, "actuator.lag": 2e-3, "actuator.delay": 1.5e-3}
    model = Balance(plant=type(plant), at="hanging", data=data).response({**plant.parameters(), **drive})[0]
    lag = control.tf([0.65], [2e-3, 1])
    hold = np.exp(-1j * OMEGA * (1.5e-3 + 0.5e-3)) * np.sinc(OMEGA * 1e-3 / 2 / math.pi)
    expected = (plant.linear("hanging").to_control() * lag)(1j * OMEGA)[:, 0].T * hold[:, None]
    # data.response has no drive, but motions of 1e-6 times it are small enough to be linear
    assert model == pytest.approx(expected, rel=1e-5)


def test_many_lanes_answer_as_one():
    data = smooth()
    values = {**FURUTA.parameters(), "actuator.gain": 0.65}
    balance = Balance(plant=Furuta, at="hanging", data=data)
    lanes = balance.response({**values, "J_d": np.array([7e-3, 8e-3]), "b_1c": np.array([0.0, 1e-3])}, 2)
    for lane, changed in zip(lanes, ({"J_d": 7e-3, "b_1c": 0.0}, {"J_d": 8e-3, "b_1c": 1e-3}), strict=True):
        assert lane == pytest.approx(balance.response({**values, **changed})[0], rel=1e-9)


def test_a_cart_with_dry_friction_answers_as_den_hartog_says():
    """One mass on a spring with Coulomb friction alone: its peak (Den Hartog, 1931), and friction found from it.

    x/a = sqrt(V^2 - (x_f/a)^2 U^2), a = P/k, x_f = f/k, V = 1/(1 - beta^2), U = sin(pi/beta)/(beta (1 + cos(pi/beta))).
    """
    plant = chain(1, "rectilinear")(m_1=1.0, k_1=100.0, f_1c=0.5)
    beta, P, dt = 0.8, 2.0, 1e-3 * math.pi / 4
    omega = beta * 10.0
    turns, length = 40, round(2 * math.pi / omega / dt)
    u = P * np.cos(omega * dt * np.arange(turns * length))
    x = simulate(plant, {}, [0.0, 0.0], u, dt, samples=turns * length)[:, 0, 0]
    last = slice(-8 * length, None)
    V, U = 1 / (1 - beta**2), math.sin(math.pi / beta) / (beta * (1 + math.cos(math.pi / beta)))
    peak = P / 100 * math.sqrt(V**2 - (0.5 / P * U) ** 2)
    assert np.abs(x[last]).max() == pytest.approx(peak, rel=2e-3)  # the command is held for a thousandth of a period
    t = dt * np.arange(x.size)[last]
    tone, command = detect(t, x[last], omega), detect(t, u[last], omega)
    data = FrequencyResponse(
        omega=np.array([omega]), response=tone.lines[:1] / command.lines[0, 0], outputs=("x_1",),
        drive=command.lines[0], dry=tone.dry[None], hold=dt,
    )  # fmt: skip
    answers = {
        f: Balance(plant=type(plant), at="rest", data=data).response({**plant.parameters(), "f_1c": f})[0, 0, 0]
        for f in (0.0, 0.5)
    }
    assert answers[0.5] == pytest.approx(data.response[0, 0], rel=2e-3)
    assert abs(answers[0.0] - data.response[0, 0]) > 0.05 * abs(data.response[0, 0])


def test_a_large_swing_with_overtones_is_explained_by_the_equations_of_motion():
    """Eqs. (A1) and (A2) solved backwards: a swing with a third harmonic, the cart's motion and the force it takes.

    Without dry friction the hinge's equation gives the cart's acceleration, and the cart's equation the force.
    """
    m_c, m_p, l_cg, J_p, b_1, b_2, g = 0.5, 0.2, 0.3, 0.006, 0.4, 0.003, 9.81
    omega, count = 9.0, 4096
    t = 2 * np.pi / omega * np.arange(count) / count
    parts = {1: 0.5, 3: 0.1 * np.exp(0.7j)}
    theta, theta_dot, theta_ddot = (
        sum((a * (1j * k * omega) ** n * np.exp(1j * k * omega * t) for k, a in parts.items())).real for n in (0, 1, 2)
    )
    turning = (J_p + m_p * l_cg**2) * theta_ddot + b_2 * theta_dot + m_p * g * l_cg * np.sin(theta)
    x_ddot = -turning / (m_p * l_cg * np.cos(theta))
    orders = np.arange(1, 16)

    def harmonics(signal):
        return 2 / count * np.fft.fft(signal)[orders]

    x = harmonics(x_ddot) / (1j * orders * omega) ** 2
    x_dot = sum((1j * k * omega * a * np.exp(1j * k * omega * t) for k, a in zip(orders, x, strict=True))).real
    push = (m_c + m_p) * x_ddot + b_1 * x_dot
    push += m_p * l_cg * (np.cos(theta) * theta_ddot - np.sin(theta) * theta_dot**2)
    force = harmonics(push)[0]
    lines = np.column_stack([x, harmonics(theta)])
    data = FrequencyResponse(
        omega=np.array([omega]), response=lines[:1] / force, outputs=("x", "theta"), units=("m", "rad", "N"),
        drive=np.array([force]), overtones=lines[1:].T[None],
    )  # fmt: skip
    plant = CartPendulum(m_c=m_c, m_p=m_p, l_cg=l_cg, J_p=J_p, b_1=b_1, b_2=b_2, g=g)
    found = Balance(plant=CartPendulum, at="hanging", data=data).response(plant.parameters())[0]
    np.testing.assert_allclose(found, data.response, rtol=1e-7)


@pytest.mark.parametrize("kept", [0, 1])
def test_a_wide_swing_of_one_frequency_is_explained_alike_beside_a_line_that_is_silent(kept):
    """Driven together with a second frequency at which nothing moves, a sine has the response that it has alone."""
    omega = np.array([1.4, 2.1])
    single = replace(smooth(omega=omega[[kept]]), drive=np.array([0.2]))
    silent = np.where(np.arange(2) == kept, 0.2, 1e-12)
    both = replace(smooth(omega=omega), drive=silent, together=True)
    values = {**FURUTA.parameters(), "actuator.gain": 0.65}
    alone = Balance(plant=Furuta, at="hanging", data=single).response(values)[0, 0]
    beside = Balance(plant=Furuta, at="hanging", data=both).response(values)[0, kept]
    assert beside == pytest.approx(alone, rel=1e-5)  # products of more than six overtones are left out
    small = Balance(plant=Furuta, at="hanging", data=replace(single, drive=np.array([1e-6]))).response(values)[0, 0]
    assert abs(alone - small).max() > 1e-3 * abs(small).max()


def test_what_was_known_before_is_no_part_of_the_misfit():
    """An inertia stated 20 % too large, to 1 %: exact data leave no misfit, and it ends 20 of its errors away."""
    rig = asked(b_1=GUESS["b_1"], J_d=GUESS["J_d"])
    wrong = replace(rig.parameters["J_d"], value=1.2 * FURUTA.J_d, uncertainty=0.01 * FURUTA.J_d)
    found = least_squares(replace(rig, parameters={**rig.parameters, "J_d": wrong}), "hanging", smooth())
    assert found.way.values["J_d"] == pytest.approx(FURUTA.J_d, rel=1e-3)
    assert found.surprise["J_d"] == pytest.approx(math.log(1 / 1.2) / (0.01 / 1.2), rel=0.01)
    assert found.misfit < 0.01


def test_both_ways_recover_a_smooth_rig_from_bad_guesses():
    """The response comes from the paper's transfer functions, corrected; errata 4 and 5."""
    data = smooth()
    found = least_squares(asked(**GUESS), "hanging", data)
    for name in GUESS:
        truth = {**FURUTA.parameters(), "actuator.gain": 0.65, "actuator.lag": 2e-3}[name]
        assert found.way.values[name] == pytest.approx(truth, rel=1e-3)
    assert found.reached >= 4
    sizes = {n: v for n, v in GUESS.items() if n != "actuator.lag"}  # hardly seen in a magnitude
    walked = simplex_dB(asked(**sizes), "hanging", data)
    for name in ("J_d", "J_p", "b_1", "actuator.gain"):
        assert walked.values[name] == pytest.approx({**FURUTA.parameters(), "actuator.gain": 0.65}[name], rel=0.01)


def test_the_unstable_pole_does_not_depend_on_the_scale():
    """Masses, frictions and gain scale together: with the pendulum's mass 10 % wrong the pole stays."""
    data = smooth()
    poles = []
    for factor in (1.0, 1.1):
        rest = asked(**GUESS)
        heavy = Parameter(name="m_p", value=factor * FURUTA.m_p)
        rest = GreyBox(plant=Furuta, parameters={**rest.parameters, "m_p": heavy})
        found = least_squares(rest, "hanging", data, starts=2).way.values
        poles.append(Furuta(**{n: found[n] for n in Furuta.names()}).linear("inverted").poles()[0].real)
    assert found["actuator.gain"] == pytest.approx(1.1 * 0.65, rel=1e-3)
    assert poles == pytest.approx([FURUTA.linear("inverted").poles()[0].real] * 2, rel=1e-4)


def test_errors_stated_are_those_of_repeats():
    """Noise of known variance on the response: estimates scatter by their standard errors."""
    clean = smooth()
    rng = np.random.default_rng(8)
    variance = (0.01 * np.abs(clean.response)) ** 2
    off = []
    for _ in range(12):
        noise = (rng.normal(size=(2, *clean.response.shape)) * np.sqrt(variance / 2)).astype(np.complex128)
        data = FrequencyResponse(
            omega=clean.omega, response=clean.response + noise[0] + 1j * noise[1], outputs=clean.outputs,
            variance=variance, drive=clean.drive,
        )  # fmt: skip
        found = least_squares(asked(**GUESS), "hanging", data, starts=1)
        truth = np.array([{**FURUTA.parameters(), "actuator.gain": 0.65, "actuator.lag": 2e-3}[n] for n in found.names])
        values = np.array([found.way.values[n] for n in found.names])
        off.append((values - truth) / np.sqrt(np.diag(found.covariance)))
    z = np.array(off)[:, [0, 1, 2, 4]]  # b_2 and lag may end at zero
    # 48 numbers of unit variance, correlated within a repeat: 12 independent ones at the worst, 0.05 % points
    assert 0.35 < np.sqrt(np.mean(z**2)) < 1.9


@pytest.mark.parametrize("heard", [0, 1, 3])
def test_a_response_travels(tmp_path, heard):
    rng = np.random.default_rng(0)
    F, n = 5, 2
    data = FrequencyResponse(
        omega=np.arange(1.0, 6.0), response=rng.normal(size=(F, n)) + 1j * rng.normal(size=(F, n)),
        outputs=("psi", "theta"), units=("rad", "rad", "V"), input="volts", variance=rng.random((F, n)),
        coherence=rng.random((F, n)), distortion=rng.random((F, n)), still=rng.random((F, n)),
        drive=rng.normal(size=F) + 1j, dry=rng.normal(size=(F, n)) + 2j, hold=1e-3, notes=("said",),
        **({"overtones": rng.normal(size=(F, n, heard)) + 3j} if heard else {}),
    )  # fmt: skip
    data.to_csv(tmp_path / "r.csv")
    back = FrequencyResponse.from_csv(tmp_path / "r.csv")
    for name in ("omega", "response", "variance", "coherence", "distortion", "still", "drive", "dry", "overtones"):
        assert np.array_equal(getattr(back, name), getattr(data, name))
    assert (back.outputs, back.units, back.input, back.notes, back.hold) == (
        data.outputs, data.units, data.input, data.notes, data.hold,
    )  # fmt: skip
    there = data.to_control()
    assert isinstance(there, control.FrequencyResponseData)
    assert there(2j)[:, 0] == pytest.approx(data.response[1])
    again = FrequencyResponse.from_control(there)
    assert np.array_equal(again.response, data.response)
    assert again.outputs == data.outputs


def test_what_is_no_response_is_refused(tmp_path):
    (tmp_path / "x.csv").write_text("a,b\n1,2\n")
    with pytest.raises(BadInput, match="written by upright"):
        FrequencyResponse.from_csv(tmp_path / "x.csv")
    with pytest.raises(BadInput, match="increase"):
        FrequencyResponse(omega=np.array([2.0, 1.0]), response=np.ones((2, 1)), outputs=("y",))
    with pytest.raises(BadInput, match="shape"):
        FrequencyResponse(omega=np.array([1.0, 2.0]), response=np.ones((2, 2)), outputs=("y",))
    with pytest.raises(BadInput, match="no coordinate 'phi'"):
        Balance(plant=Furuta, at="hanging", data=FrequencyResponse(omega=[1.0], response=[[1.0]], outputs=("phi",)))
    with pytest.raises(NotIdentifiable, match="too few"):
        explain(asked(**GUESS), "hanging", smooth(omega=OMEGA[:3]))
    with pytest.raises(BadInput, match="at least one period"):
        detect(np.arange(10) * 0.1, np.zeros(10), 1.0)


def test_friction_between_two_links_answers_alike_in_relative_and_absolute_angles():
    links = {"m_1": 0.35, "m_2": 0.2, "l_1": 0.2, "l_c1": 0.11, "l_c2": 0.13, "b_1": 5e-3, "b_1c": 3e-3, "b_2c": 4e-3}
    omega, rng = np.array([3.0, 5.0, 9.0]), np.random.default_rng(1)
    relative = rng.normal(size=(3, 2)) + 1j * rng.normal(size=(3, 2))
    answers: list[np.ndarray] = []
    for plant, G in (
        (DoublePendulum(**links), relative),
        (DoublePendulumAbsolute(**links), np.cumsum(relative, axis=1)),
    ):
        data = FrequencyResponse(
            omega=omega, response=G, outputs=("theta_1", "theta_2"), units=("rad", "rad", "N m"),
            drive=np.full(3, 0.05), dry=describing(omega, np.abs(0.05 * G)),
        )  # fmt: skip
        answers.append(Balance(plant=type(plant), at="hanging", data=data).response(plant.parameters())[0])
    np.testing.assert_allclose(answers[1], np.cumsum(answers[0], axis=1), rtol=1e-12)
