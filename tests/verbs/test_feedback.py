"""Does a loop come out the same from plants, plain matrices and python-control's systems, as other programs have it?"""

from __future__ import annotations

import math

import numpy as np
import pytest

import upright as up
from upright.gains import feedback, filtered

MODEL = up.Furuta(m_p=0.135, l_cg=0.19, r=0.16, J_d=0.011, J_p=6e-4, b_1=6e-4).linear("inverted")
WEIGHTS = [1, 0, 10, 0]


def random_model(seed: int):
    rng = np.random.default_rng(seed)
    return tuple(rng.normal(size=shape) for shape in ((3, 3), (3, 2), (2, 3), (2, 2)))


@pytest.mark.parametrize("method", ["zoh", "foh"])
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_holds_of_either_order_are_scipys_with_their_feedthrough(seed, method):
    from scipy.signal import cont2discrete

    model = random_model(seed)
    found = up.hold(model, 0.3, method=method)
    for ours, theirs in zip((found.A, found.B, found.C, found.D), cont2discrete(model, 0.3, method), strict=False):
        np.testing.assert_allclose(ours, theirs, atol=1e-12)


def test_a_first_order_hold_is_exact_for_a_ramp():
    """x' = -x + t from rest: x = t - 1 + e^-t; y = x + 2 u of a command that runs straight from sample to sample."""
    T = 0.25
    model = up.hold(([[-1.0]], [[1.0]], [[1.0]], [[2.0]]), T, method="foh")
    t = T * np.arange(20)
    state = np.zeros(1)
    for now in t.tolist():
        assert (model.C @ state + model.D @ [now])[0] == pytest.approx(now - 1 + math.exp(-now) + 2 * now, abs=1e-12)
        state = model.A @ state + model.B @ [now]


@pytest.mark.parametrize(("delay", "acts"), [(1.0, 1), (2.0, 2), (0.4, 1)])
def test_what_comes_through_is_as_late_as_the_command(delay, acts):
    """One command of 1: at the sample that it acts on, the reading shows it through D."""
    model = up.hold(([[-1.0]], [[0.0]], [[1.0]], [[3.0]]), 0.1, delay=delay)
    assert not model.D.any()
    state, shown = model.B[:, 0], []
    for _ in range(4):
        shown.append(float((model.C @ state)[0]))
        state = model.A @ state
    assert shown == pytest.approx([3.0 if k + 1 == acts else 0.0 for k in range(4)])


@pytest.mark.parametrize("given", ["held", "control", "pair", "stepped"])
def test_sampled_gains_of_least_cost_agree_with_python_control(given):
    control = pytest.importorskip("control")
    held, theirs = up.hold(MODEL, "10 ms"), control.c2d(MODEL.to_control(), 0.01)
    np.testing.assert_allclose(held.A, theirs.A, atol=1e-12)
    system = {
        "held": (held,),
        "control": (theirs,),
        "pair": ((held.A, held.B),),
        "stepped": ((held.A, held.B, None, None, 0.01),),
    }[given]
    K, S, E = up.dlqr(*system, WEIGHTS, 2.0)
    K_c, S_c, E_c = control.dlqr(theirs, np.diag(WEIGHTS), 2.0)
    np.testing.assert_allclose(K, K_c, rtol=1e-6)
    np.testing.assert_allclose(S, S_c, rtol=1e-6)
    np.testing.assert_allclose(np.sort_complex(E), np.sort_complex(E_c), rtol=1e-6)


def test_margins_of_a_loop_gain_are_python_controls():
    control = pytest.importorskip("control")
    L = control.ss(control.tf([4], [1, 3, 3, 1]))
    gm, pm, sm, _, wp, _ = control.stability_margins(L)
    for found in (up.margins(L), up.margins((L.A, L.B, L.C, L.D))):
        assert found.most_gain == pytest.approx(gm, rel=1e-6)
        assert math.degrees(found.phase) == pytest.approx(pm, rel=1e-6)
        assert found.modulus == pytest.approx(sm, rel=1e-6)
        assert found.delay == pytest.approx(math.radians(pm) / wp, rel=1e-6)


def test_a_regulator_of_least_cost_has_the_margins_that_theory_grants():
    """Kalman: |1 + L| is nowhere below 1, so gains from 1/2 to infinity and 60 degrees (Anderson and Moore)."""
    found = up.margins(MODEL, up.lqr(MODEL, WEIGHTS, 1.0))
    assert found.modulus == pytest.approx(1.0, abs=1e-6)
    assert found.least_gain <= 0.5
    assert found.most_gain == math.inf
    assert found.phase >= math.radians(60)


def test_a_loop_with_feedthrough_in_closed_form():
    """L = 1/2 + 1/(s + 1): |L| = 1 where w^2 = 5/3; 1 + L has its least size, 3/2, at high frequency."""
    found = up.margins(([[-1]], [[1]], [[1]], [[0.5]]))
    w = math.sqrt(5 / 3)
    assert found.phase == pytest.approx(abs(np.angle(-(0.5 + 1 / (1 + 1j * w)))), rel=1e-9)
    assert found.modulus == pytest.approx(1.5, rel=1e-6)
    assert found.most_gain == math.inf


def test_the_margins_of_a_law_as_it_runs_come_through_the_same_door():
    held = up.hold(MODEL, "2 ms", delay=1)
    law = feedback(filtered(held, 0.5), up.lqr(MODEL, WEIGHTS, 1.0).K)
    from upright.gains import margins

    assert up.margins(held, law) == margins(held, law)


@pytest.mark.parametrize("D", [0.0, 0.7])
def test_a_prefilter_brings_the_output_to_the_reference(D):
    """The closed loop integrated to rest by scipy: y = C x + D u = r."""
    from scipy.integrate import solve_ivp

    A, B, C = np.array([[0.0, 1.0], [-3.0, -0.5]]), np.array([[0.0], [2.0]]), np.array([[1.0, 0.2]])
    K = up.lqr((A, B), [5, 1], 1.0).K
    k_pf = up.prefilter((A, B, C, D), K)
    x = solve_ivp(lambda _, x: A @ x + B[:, 0] * (k_pf * 0.8 - K[0] @ x), (0, 30), [0, 0], rtol=1e-10, atol=1e-12).y[
        :, -1
    ]
    assert (C @ x)[0] + D * (k_pf * 0.8 - K[0] @ x) == pytest.approx(0.8, rel=1e-7)


def test_an_output_is_named_or_numbered():
    K = up.lqr(MODEL, WEIGHTS, 1.0)
    assert up.prefilter(MODEL, K, output="psi") == up.prefilter(MODEL.to_control(), K, output=0)
    assert up.prefilter(MODEL, K, output="psi") == pytest.approx(K.K[0, 0])  # nothing else holds a free arm


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda: up.margins(MODEL), "one input and one output, got 1 and 2"),
        (lambda: up.margins(([[1]], [[1]], [[0.1]])), "not stable"),
        (lambda: up.margins(([[1]], [[1]], [[1, 2]])), r"C of shape \(p, 1\)"),
        (lambda: up.margins(MODEL, [1, 2]), r"K of shape \(1, 4\)"),
        (lambda: up.margins(), r"margins is called as margins\(model, K=None\): missing"),
        (lambda: up.hold(up.hold(MODEL, 0.1), 0.1), "a period of 0.1 s already"),
        (lambda: up.hold(MODEL, 0.1, method="tustin"), '"zoh", or one, "foh"'),
        (lambda: up.hold(MODEL, 0.1, delay=0.5, method="foh"), "whole samples"),
        (lambda: up.hold(([[1]], [[1]], [[1]], [[1, 2]]), 0.1), r"D of shape \(1, 1\)"),
        (lambda: up.dlqr(MODEL, WEIGHTS, 1.0), "this one is continuous"),
        (lambda: up.prefilter(MODEL, [1, 2, 3]), r"K of shape \(1, 4\)"),
        (lambda: up.prefilter(MODEL, np.ones(4), output="fi"), "no output 'fi'"),
        (lambda: up.prefilter(MODEL, np.ones(4), output=2), "a number from 0 to 1"),
        (lambda: up.lqr(MODEL, [0, 0, 10, 1], 1.0), "weigh psi too"),
        (lambda: filtered(up.hold(([[0, 1], [0, 0]], [0, 1], [[1, 0]], [[1]]), 0.1), 0.5), "D is not zero"),
    ],
)
def test_what_cannot_be_is_said(call, sentence):
    with pytest.raises(up.BadInput, match=sentence):
        call()
