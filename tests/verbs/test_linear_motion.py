"""A linear model moves as its closed form says, in every form that it comes in."""

from __future__ import annotations

import control
import numpy as np
import pytest

import upright as up

A, B = [[0.0, 1.0], [-4.0, -0.4]], [[0.0], [2.0]]
FURUTA = up.Furuta(m_p=0.135, l_cg=0.19, r=0.16, J_d=0.011, J_p=6e-4).linear("inverted")
POLES = [-4 + 2j, -4 - 2j, -17, -3]
FORMS = {
    "pair": (A, B),
    "state space": up.StateSpace(A, B),
    "control": control.ss(A, B, np.eye(2), 0),
    "sampled": up.hold((A, B), 1e-3),
}


def oscillator(t):
    """Step response of x'' + 0.4 x' + 4 x = 2: half the size of the step, less a decaying cosine."""
    a, w = 0.2, (4 - 0.04) ** 0.5
    return 0.5 * (1 - np.exp(-a * t) * (np.cos(w * t) + a / w * np.sin(w * t)))


@pytest.mark.parametrize("form", FORMS)
def test_an_oscillator_answers_a_step_in_closed_form(form):
    record = up.simulate(FORMS[form], u=1.0, seconds=5)
    np.testing.assert_allclose(record[record.names[0]], oscillator(record.t), atol=1e-12)
    t, y = up.StateSpace.of(FORMS[form]).step(5.0)
    np.testing.assert_allclose(y[:, 0], oscillator(t), atol=1e-12)
    assert t[-1] == pytest.approx(5.0)


def test_a_driven_motion_is_that_of_python_control():
    """Another engine, told of commands that go straight on between samples; ours stay, so both meet as steps shrink."""
    t = np.arange(0, 3, 1e-3)
    u = np.sin(2 * t)
    ours = up.simulate((A, B), u=u, seconds=float(t[-1]), start=[0.1, 0.0])["x[0]"]
    late = np.sin(2 * (t - 0.5e-3))  # a held command is half a sample late
    theirs = control.forced_response(control.ss(A, B, np.eye(2), 0), t, late, [0.1, 0.0]).outputs[0]
    np.testing.assert_allclose(ours, theirs, atol=2e-6)


def test_gains_bring_a_model_back_to_its_point():
    """Poles at -3 and faster: after 6 s less than e^-18 times the condition of the modes is left."""
    record = up.simulate(FURUTA, up.place(FURUTA, POLES), start={"theta": "3 deg"}, seconds=6)
    assert abs(record["theta"][-1]) < 1e-5
    assert record.units["theta"] == "rad"
    assert record.inputs == tuple(FURUTA.inputs)
    assert "simulated" in " ".join(record.provenance.notes)


def test_gains_of_a_sampled_model_act_at_its_samples():
    """z^k of the sampled closed loop, by powers of its matrix."""
    held = up.hold(FURUTA, "20 ms")
    gains = up.place(held, np.exp(0.02 * np.array(POLES)))
    record = up.simulate(FURUTA, gains, start={"theta": 0.05}, seconds=1)
    loop = np.linalg.matrix_power(held.A - held.B @ gains.K, 50) @ [0, 0, 0.05, 0]
    assert record.period == pytest.approx(0.02)
    np.testing.assert_allclose([record[n][-1] for n in FURUTA.states], loop, atol=1e-12)


def test_a_command_stays_within_its_limit():
    record = up.simulate(FURUTA, up.place(FURUTA, POLES), start={"theta": 0.02}, seconds=1, limit=0.05)
    command = record[FURUTA.inputs[0]]
    assert np.abs(command).max() == 0.05


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda: up.simulate((A, B), at="inverted"), "at belongs to a rig"),
        (lambda: up.simulate(FURUTA, start={"theta": 0.1}, seconds=60), "grows without bound"),
        (lambda: up.simulate((A, B), [1.0, 2.0, 3.0]), r"need shape \(1, 2\), got \(1, 3\)"),
        (lambda: up.simulate((A, B), object()), "a linear model runs under gains"),
        (lambda: up.simulate(up.hold((A, B), 0.01), dt="1 ms"), "sampled every 10 ms, so leave dt out"),
        (lambda: up.simulate((A, B), seconds=1e-4), "needs a sample at least"),
        (lambda: up.StateSpace(A, B).step(-1.0), "more than 0 s"),
        (lambda: up.StateSpace(A, B).step(1.0, command="v"), "has no input 'v'"),
    ],
)
def test_what_a_linear_model_cannot_do_is_said_in_a_sentence(call, sentence):
    with pytest.raises(up.BadInput, match=sentence):
        call()


def test_an_output_that_feels_the_command_at_once_has_its_share_of_it():
    """x' = -x + u under u = 1 is x = 1 - exp(-t), and the output 2 x + 3 u begins at 3."""
    model = up.StateSpace([[-1.0]], [[1.0]], [[2.0]], [[3.0]], states=("x",), inputs=("u",), outputs=("y",))
    record = up.simulate(model, u=1.0, seconds=2)
    np.testing.assert_allclose(record["y"], 2 * (1 - np.exp(-record.t)) + 3, atol=1e-9)
