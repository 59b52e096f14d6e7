"""Is a linear model, whatever form it came in, what python-control and scipy make of it?"""

from __future__ import annotations

import math

import control
import numpy as np
import pytest
from scipy.signal import cont2discrete

import upright as up
from upright.errors import BadInput
from upright.systems import StateSpace

FURUTA = up.Furuta(m_p=0.135, l_cg=0.19, r=0.16, J_d=0.011, J_p=6e-4, b_1=6e-4, b_2=1e-4)
SHAFT = up.chain(2, "torsional")(J_1=0.01, J_2=0.01, k_12=1.4, c_1=0.007, c_2=0.001)


def square(seed: int, n: int = 4, m: int = 2) -> tuple[np.ndarray, ...]:
    rng = np.random.default_rng(seed)
    return tuple(rng.normal(size=shape) for shape in ((n, n), (n, m), (m, n), (m, m)))


def by_value(roots):
    roots = np.asarray(roots, dtype=complex)
    return roots[np.lexsort((np.round(roots.imag, 6), np.round(roots.real, 6)))]


FORMS = {
    "ours": lambda: StateSpace(*square(0)),
    "tuple": lambda: square(0),
    "control": lambda: control.ss(*square(0)),
    "unpacked": lambda: tuple(StateSpace(*square(0))),
}


@pytest.mark.parametrize("form", FORMS)
def test_every_form_is_the_same_model(form):
    for ours, given in zip(StateSpace.of(FORMS[form]()), square(0), strict=True):
        np.testing.assert_array_equal(ours, given)


@pytest.mark.parametrize("dt", [None, 0.05])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_poles_zeros_damping_and_response_are_python_controls(seed, dt):
    ours, theirs = StateSpace(*square(seed), dt), control.ss(*square(seed), dt or 0)
    np.testing.assert_allclose(by_value(ours.poles()), by_value(theirs.poles()), rtol=1e-9)
    np.testing.assert_allclose(by_value(ours.zeros()), by_value(theirs.zeros()), rtol=1e-6)
    assert np.all(np.diff(ours.zeros().real) < 1e-9)
    omega = np.geomspace(0.01, 30, 7)
    z = 1j * omega if dt is None else np.exp(1j * omega * dt)
    np.testing.assert_allclose(ours.response(omega), np.moveaxis(theirs(z), -1, 0), rtol=1e-9)
    wn, zeta, poles = control.damp(theirs, doprint=False)
    frequency, ratio, ours_poles = ours.damping()
    by = {complex(np.round(p, 6)): (w, d) for p, w, d in zip(poles, wn, zeta, strict=True)}
    for p, w, d in zip(ours_poles, frequency, ratio, strict=True):
        assert (w, d) == pytest.approx(by[complex(np.round(p, 6))], rel=1e-6)


def test_zeros_of_the_arm_are_those_of_the_pendulum_about_a_held_arm():
    """psi/T has zeros where the pendulum swings by itself: J_A s^2 + b_2 s - m_p g l_cg = 0 upright."""
    p = FURUTA
    J_A = p.J_p + p.m_p * p.l_cg**2
    expected = np.roots([J_A, p.b_2, -p.m_p * p.g * p.l_cg])
    found = p.linear("inverted")["psi", "T"].zeros()
    np.testing.assert_allclose(by_value(found), by_value(expected), rtol=1e-9)


def test_zeros_of_a_flexible_shaft_do_not_depend_on_the_unit_of_time():
    """theta_2/T has no zero, theta_1/T those of the second disk on a shaft that is held."""
    model = SHAFT.linear()
    assert model["theta_2", "T"].zeros().size == 0
    held = np.roots([SHAFT.J_2, SHAFT.c_2, SHAFT.k_12])
    np.testing.assert_allclose(by_value(model["theta_1", "T"].zeros()), by_value(held), rtol=1e-9)
    slow = StateSpace(*(1e-6 * np.array(M) for M in model[:2]), *model[2:4])["y[0]", "u[0]"]
    np.testing.assert_allclose(by_value(slow.zeros()), 1e-6 * by_value(held), rtol=1e-6)


def test_a_transfer_function_keeps_its_poles_its_zeros_and_its_gain():
    transfer = control.tf([2, 3], [1, 0.4, 9])
    model = StateSpace.of(transfer)
    np.testing.assert_allclose(by_value(model.poles()), by_value(np.roots([1, 0.4, 9])), rtol=1e-9)
    np.testing.assert_allclose(model.zeros(), [-1.5], rtol=1e-9)
    assert model.response(0.0)[0, 0, 0] == pytest.approx(3 / 9)
    held = up.hold(transfer, "10 ms")
    A, B, C, D, _ = cont2discrete(tuple(model), 0.01)
    np.testing.assert_allclose(
        held.response([1.0, 5.0])[:, 0, 0], StateSpace(A, B, C, D, 0.01).response([1.0, 5.0])[:, 0, 0]
    )


def test_python_control_takes_it_back():
    model = FURUTA.linear("inverted")
    named, plain = model.to_control(), control.ss(*model)
    assert (named.state_labels, named.input_labels) == (list(model.states), list(model.inputs))
    np.testing.assert_array_equal(plain.A, model.A)
    sampled = up.hold(model, 0.002)
    assert control.ss(*sampled).dt == sampled.to_control().dt == 0.002
    back = StateSpace.of(sampled.to_control())
    assert (back.dt, back.states, back.outputs) == (0.002, sampled.states, sampled.outputs)
    assert StateSpace.of(control.ss(*square(0), name="cart")).name == "cart"


def test_a_model_knows_where_it_holds_and_its_units():
    model = FURUTA.linear("inverted")
    assert model.point == {"psi": 0.0, "theta": math.pi}
    assert up.hold(model, 1e-3, delay=2).point == model.point
    assert model.state_units == ["rad", "rad/s", "rad", "rad/s"]
    assert model.unit == "N m"
    assert up.hold(model, 1e-3).continuous is model


def test_a_gain_without_states_is_a_model_too():
    static = StateSpace.of(control.ss([], [], [], 3))
    assert static.poles().size == 0
    assert StateSpace([], [], [], [[3.0]]).D == 3.0
    gains = np.array([[3.0, 1.0]])
    for D in (gains, gains.T):
        np.testing.assert_array_equal(StateSpace([], [], [], D).response(7.0)[0], D)


def test_names_that_are_not_as_many_as_the_states_are_left_aside():
    class Named:
        A, B, C, D, dt = *square(0), None
        state_labels, input_labels, outputs = ("x", "v"), ["u", "w"], ("y", "z")

    model = StateSpace.of(Named())
    assert (model.inputs, model.outputs) == (("u", "w"), ("y", "z"))
    assert model.states == StateSpace(*square(0)).states
    assert model.name == "linear model"


@pytest.mark.parametrize("period", [None, 0.1])
def test_a_step_response_is_that_of_a_lag_in_closed_form(period):
    """T y' + y = K u: y = K (1 - exp(-t/T)); sampled, at each sample."""
    K, T = 3.0, 0.4
    model = StateSpace([[-1 / T]], [[K / T]], [[1.0]])
    t, y = (model if period is None else model.to_sampled(period)).step(2.0, samples=11)
    assert t == pytest.approx(np.linspace(0.0, 2.0, 11 if period is None else 21))
    assert y[:, 0] == pytest.approx(K * (1 - np.exp(-t / T)))


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda: StateSpace([[1, 2]], [1]), r"A of shape \(n, n\)"),
        (lambda: StateSpace([[1]], [[1]], [[1, 2]]), r"C of shape \(p, 1\)"),
        (lambda: StateSpace([[math.inf]], [[1]]), "finite"),
        (lambda: StateSpace([["a"]], [[1]]), "real numbers"),
        (lambda: StateSpace([[1]], [[1]], dt=-1.0), "above 0"),
        (lambda: StateSpace([[1]], [[1]], states=("a", "b")), "1 names, got 2"),
        (lambda: StateSpace([[1]], [[1]]).period, "is continuous"),
        (lambda: StateSpace.of(control.ss([[0.5]], [[1]], [[1]], 0, True)), "does not say its period"),
        (lambda: StateSpace.of(3), "got int"),
        (lambda: FURUTA.linear("inverted").zeros(), 'model\\["psi", "T"\\]'),
        (lambda: FURUTA.linear("inverted")["fi", "T"], "no output 'fi'"),
        (lambda: FURUTA.linear("inverted")["psi", 7], "a number from 0 to 0"),
        (lambda: up.hold(FURUTA.linear(), 0.01).to_sampled(0.02), "another"),
    ],
)
def test_what_is_no_model_is_said(call, sentence):
    with pytest.raises(BadInput, match=sentence):
        call()
