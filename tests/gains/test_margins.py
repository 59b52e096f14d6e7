"""Are margins found where they lie, however slow the loop and however narrow its resonance?"""

from __future__ import annotations

import math

import numpy as np
import pytest

from upright.errors import BadInput
from upright.gains import margins
from upright.gains.margins import balanced, gain_bounds, gain_factors, loop_margins, modulus, phases, sampled_continuous
from upright.laws import Law
from upright.systems import StateSpace


def linear(A, B, C):
    A, B, C = (np.atleast_2d(np.array(m, dtype=float)) for m in (A, B, C))
    names = tuple(f"x{i}" for i in range(A.shape[0]))
    inputs = tuple(f"u{i}" for i in range(B.shape[1]))
    return StateSpace(A, B, C, states=names, inputs=inputs, outputs=("y",))


def proportional(gain: float, period: float) -> Law:
    return Law(np.zeros((0, 0)), np.zeros((0, 1)), np.zeros((1, 0)), np.array([[-gain]]), period=period)


def random_loops(seed: int, count: int):
    """Loops of one to four states with open-loop poles on either side of the circle, closed by a stable feedback."""
    rng = np.random.default_rng(seed)
    while count:
        n = int(rng.integers(1, 5))
        A, B, C = rng.normal(size=(n, n)), rng.normal(size=(n, 1)), rng.normal(size=(1, n))
        A *= rng.uniform(0.3, 1.2) / np.abs(np.linalg.eigvals(A)).max()
        C *= 10 ** rng.uniform(-2, 0.5)
        if np.abs(np.linalg.eigvals(A - B @ C)).max() < 0.999:
            count -= 1
            yield A, B, C


def searched(A, B, C) -> tuple[float, float, float, float]:
    """Least and most gain, phase and modulus from 400,000 points of the response, by its partial fractions."""
    poles, vectors = np.linalg.eig(A)
    shares = (C @ vectors)[0] * np.linalg.solve(vectors, B)[:, 0]
    L = (shares / (np.exp(1j * np.linspace(0, np.pi, 400_001))[:, None] - poles)).sum(axis=1)
    turned = np.flatnonzero(np.diff(np.sign(L.imag[1:-1]))) + 1
    factors = -1 / L.real[[0, *turned, -1]]
    size = np.log(np.abs(L))
    k = np.flatnonzero(np.diff(np.sign(size)))
    crossed = L[k] + (L[k + 1] - L[k]) * size[k] / (size[k] - size[k + 1])
    return (
        max(factors[(factors > 0) & (factors < 1)], default=0.0), min(factors[factors > 1], default=math.inf),
        np.abs(np.angle(-crossed)).min(initial=np.inf), np.abs(1 + L).min(),
    )  # fmt: skip


def by_python_control(A, B, C) -> tuple[float, float, float, float]:
    """The same from roots of polynomials strictly between z = 1 and z = -1, with both ends beside them."""
    control = pytest.importorskip("control")
    gm, pm, sm, *_ = control.stability_margins(control.ss(A, B, C, 0, True), returnall=True)
    ends = np.array([(C @ np.linalg.solve(z * np.eye(len(A)) - A, B))[0, 0] for z in (1.0, -1.0)])
    factors = np.concatenate([np.asarray(gm, dtype=float), -1 / ends])
    turned = np.abs(np.angle(np.exp(1j * np.radians(np.asarray(pm, dtype=float)))))
    return (
        max(factors[(factors > 0) & (factors < 1)], default=0.0), min(factors[factors > 1], default=math.inf),
        turned.min(initial=np.inf), min([*sm, *np.abs(1 + ends)]),
    )  # fmt: skip


@pytest.mark.filterwarnings("ignore:stability_margins. Falling back")
@pytest.mark.slow
def test_three_hundred_random_loops_have_python_control_s_margins():
    """Where its polynomials are ill conditioned it invents or misses a crossing; the response, searched, decides."""
    apart = 0
    for A, B, C in random_loops(1, 300):
        L = balanced(A, B, C)
        found = (*gain_bounds(gain_factors(L)[1]), np.abs(phases(L)[1]).min(initial=np.inf), modulus(L))
        if found != pytest.approx(by_python_control(A, B, C), rel=1e-3):
            apart += 1
            assert found == pytest.approx(searched(A, B, C), rel=1e-3)
    assert apart < 15  # 5 % of them


@pytest.mark.parametrize("slow", [1e-2, 1e-4, 1e-6])
def test_a_loop_far_below_the_sample_rate_has_its_continuous_margins(slow):
    """L = k/(s (s + a)): w^2 = (sqrt(a^4 + 4 k^2) - a^2)/2, phase = 90 degrees - atan(w/a), delay = phase/w.

    The hold is late by half a period, w T/2 of phase; a = w tan(5.6 degrees) leaves 5.6 degrees.
    """
    T = 1e-3
    w = slow * math.pi / T
    a = w * math.tan(math.radians(5.6))
    plant = linear([[0, 1], [0, -a]], [[0], [1]], [[1, 0]])
    found = margins(plant.to_sampled(T), proportional(w * math.hypot(w, a), T))
    phase = math.radians(5.6) - w * T / 2
    assert found.phase == pytest.approx(phase, rel=1e-3)
    assert found.delay == pytest.approx(phase / w, rel=1e-3)
    # the phase reaches -180 degrees where atan(a/w') = w' T/2, so w'^2 = 2 a/T; |L| there is w sqrt(..)/(w' sqrt(..))
    if slow <= 1e-4:
        beyond = math.sqrt(2 * a / T)
        assert found.most_gain == pytest.approx(beyond * math.hypot(beyond, a) / (w * math.hypot(w, a)), rel=1e-2)


def test_a_resonance_between_the_points_of_any_grid_is_seen():
    """A resonator of damping d: |L| = g/|1 - x^2 + 2 i d x| is 1 at x^2 = 1 - 2 d^2 +- sqrt(g^2 - 4 d^2 + 4 d^4).

    Its peak is g/(2 d) = 2 and its width 1e-7 of its frequency; L is on the unit circle at both flanks.
    """
    d, g, w = 1e-7, 4e-7, 17.0
    L = sampled_continuous(np.array([[0.0, 1.0], [-w * w, -2 * d * w]]), np.array([[0.0], [g * w * w]]),
                           np.array([[1.0, 0.0]]), 0.0, 20.0)  # fmt: skip
    x = np.sqrt(1 - 2 * d**2 + np.array([-1, 1]) * math.sqrt(g * g - 4 * d**2 + 4 * d**4))
    response = g / (1 - x**2 + 2j * d * x)
    angles, phase = phases(L)
    np.testing.assert_allclose(20.0 * np.tan(angles / 2), w * x, rtol=1e-9)
    np.testing.assert_allclose(np.abs(phase), np.abs(np.angle(-response)), rtol=1e-6)


@pytest.mark.parametrize(("k", "most"), [(0.5, 8 / 0.5), (4.0, 2.0)])
def test_a_third_order_lag_in_closed_form(k, most):
    """L = k/(s + 1)^3 reaches -180 degrees at sqrt(3), where it is k/8 (Astrom and Murray, Feedback Systems)."""
    A = np.array([[-1.0, 1.0, 0.0], [0.0, -1.0, 1.0], [0.0, 0.0, -1.0]])
    L = sampled_continuous(A, np.array([[0.0], [0.0], [k]]), np.array([[1.0, 0.0, 0.0]]), 0.0, 1.7)
    assert gain_bounds(gain_factors(L)[1])[1] == pytest.approx(most, rel=1e-9)
    x = np.linspace(0, 20, 2_000_001)
    assert modulus(L) == pytest.approx(np.abs(1 + k / (1 + 1j * x) ** 3).min(), rel=1e-8)


def test_the_delay_is_that_at_which_the_late_loop_has_a_pole_on_the_circle():
    """A fast loop, where part of a sample is not a mere turn: eigenvalues of the loop held that much later."""
    from upright.gains.loop import closed

    T = 0.4
    plant = linear([[0, 1], [2, -0.3]], [[0], [1]], [[1, 0]])
    pd = Law(np.zeros((1, 1)), np.ones((1, 1)), np.array([[2.0]]), np.array([[-5.0]]), period=T)
    found = margins(plant.to_sampled(T), pd)
    model = plant.to_sampled(T, found.delay / T)
    assert np.abs(np.linalg.eigvals(closed(model, pd))).max() == pytest.approx(1.0, abs=1e-6)
    for share in np.linspace(0, 0.99, 20):
        assert np.abs(np.linalg.eigvals(closed(plant.to_sampled(T, share * found.delay / T), pd))).max() < 1


def test_margins_of_two_inputs_are_refused():
    plant = linear([[-1, 0], [0, -2]], [[1, 0], [0, 1]], [[1, 0]])
    law = Law(np.zeros((0, 0)), np.zeros((0, 1)), np.zeros((2, 0)), np.array([[-0.1], [0.0]]), period=0.1)
    with pytest.raises(BadInput, match="for one input"):
        margins(plant.to_sampled(0.1), law)


@pytest.mark.parametrize("period", [0.0, 0.02])
def test_what_a_command_shows_at_once_weakens_the_feedback_of_a_loop(period):
    """L = d + b/(s - a): the loop's pole is a - b/(1 + d), and stays stable down to the factor f of f b = a (1 + f d).

    Sampled, z - p for s - a: the pole is p - b/(1 + d), which leaves the circle at p - f b/(1 + f d) = 1.
    """
    a = 0.5
    pole = 1.0 + a if period else a
    one = np.ones((1, 1))
    for b, d in ((0.4, 0.5), (0.8, 1.0)):  # it would hold without d
        with pytest.raises(BadInput, match="not stable"):
            loop_margins(pole * one, b * one, one, d, period)
    b, d = 1.2, 0.5
    found = loop_margins(pole * one, b * one, one, d, period)
    assert found.least_gain == pytest.approx(a / (b - a * d), rel=1e-6)
