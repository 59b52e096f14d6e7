"""A frequency is positive, and so is its interval, or it is said that the data do not tell it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from tests.identification.twins import noisy, rig
from upright.identification.estimate import identify
from upright.identification.inference.poles import poles
from upright.identification.model.runs import Run
from upright.physics import CartPendulum, Pendulum, chain
from upright.simulation import Held, simulate

SIMPLE = {"m_p": 0.2, "l_cg": 0.25, "J_p": 0.0}
TWO_SIGMA = 2.0


def upper(spread: float):
    """The hanging pole above the real axis of a simple pendulum whose length is known to a share `spread`."""
    values = {**SIMPLE, "b_2": 0.0, "g": 9.81}
    covariance = np.array([[(spread * SIMPLE["l_cg"]) ** 2]])
    simple = rig(Pendulum, SIMPLE, {})
    found = poles(simple, {**simple.plant(**SIMPLE).parameters(), **values}, ["l_cg"], covariance, TWO_SIGMA)
    (pole,) = found["hanging"]
    return pole.imag


@pytest.mark.parametrize("spread", [0.01, 0.1, 0.5, 0.9])
def test_the_interval_of_a_frequency_is_that_of_its_logarithm(spread: float) -> None:
    # omega = sqrt(g/l), so that log omega is uncertain by half of what log l is
    omega, off = math.sqrt(9.81 / SIMPLE["l_cg"]), TWO_SIGMA * spread / 2
    e = upper(spread)
    assert e.value == pytest.approx(omega)
    assert e.interval == pytest.approx((omega * math.exp(-off), omega * math.exp(off)), rel=1e-3)


def test_a_frequency_that_may_be_zero_has_an_interval_from_zero() -> None:
    assert upper(2.0).interval[0] == 0.0


CRANE = {"m_c": 0.4, "m_p": 0.3, "l_cg": 0.3, "J_p": 5e-3, "b_2": 5e-3}
DT, N = 5e-3, 1600


def swung(label: str, *, held: bool) -> Run:
    """A pendulum on a cart that a servo moves to and fro as it was told, or on one that rolls freely."""
    t = np.arange(N) * DT
    x = 0.02 * np.sin(4 * t)
    motion = Held(q=x)
    y = simulate(
        CartPendulum(**CRANE), {}, [0.0, 0.08 * held, 0.5, 0.0], None, DT, samples=N, substeps=4,
        held={"x": motion} if held else None,
    )[:, ::2, 0]  # fmt: skip
    theta = noisy(Run(label=label, role="fit", t=t, u=np.zeros((N, 1)), y=y[:, 1:], measured=("theta",)), 1e-3, 1)
    return replace(theta, held={"x": x}) if held else replace(theta, measured=("x", "theta"), y=y)


def damped_frequency(mass: float) -> float:
    """Of the pendulum where its hinge is held (infinite mass of the cart), or of both, by hand [rad/s]."""
    m, length, b = CRANE["m_p"], CRANE["l_cg"], CRANE["b_2"]
    J = CRANE["J_p"] + m * length**2 - (m * length) ** 2 / (mass + m)  # elimination of the cart's momentum
    return math.sqrt(m * 9.81 * length / J - (b / (2 * J)) ** 2)


@pytest.mark.parametrize(
    ("runs", "told"),
    [
        ([True], {"hanging, x held": math.inf}),
        ([False], {"hanging": CRANE["m_c"]}),
        ([True, False], {"hanging, x held": math.inf, "hanging": CRANE["m_c"]}),
    ],
)
def test_a_rig_swings_as_it_was_run(runs: list[bool], told: dict[str, float]) -> None:
    known = {n: v for n, v in CRANE.items() if n not in ("l_cg", "b_2")}
    fit = identify(rig(CartPendulum, known, {"l_cg": 0.32, "b_2": 4e-3}), [swung(f"run {h}", held=h) for h in runs])
    hanging = {at: max(p.imag.value for p in found) for at, found in fit.poles.items() if at.startswith("hanging")}
    assert hanging == pytest.approx({at: damped_frequency(mass) for at, mass in told.items()}, rel=5e-3)


@pytest.mark.parametrize("spread", [0.05, 0.3, 0.45])
def test_the_interval_of_a_decay_is_that_of_its_logarithm(spread: float) -> None:
    # a swing decays by b_2/(2 J), so that the logarithm of the decay is as uncertain as that of b_2
    inertia, b_2 = SIMPLE["m_p"] * SIMPLE["l_cg"] ** 2, 2e-3
    simple = rig(Pendulum, SIMPLE | {"b_2": b_2}, {})
    values = {**simple.plant(**SIMPLE).parameters(), **SIMPLE, "b_2": b_2, "g": 9.81}
    found = poles(simple, values, ["b_2"], np.array([[(spread * b_2) ** 2]]), TWO_SIGMA)
    (pole,) = found["hanging"]
    decay, off = b_2 / (2 * inertia), TWO_SIGMA * spread
    assert pole.real.value == pytest.approx(-decay)
    assert pole.real.interval == pytest.approx((-decay * math.exp(off), -decay * math.exp(-off)), rel=1e-3)


def test_a_stable_pole_stays_stable_however_uncertain_its_damping() -> None:
    simple = rig(Pendulum, SIMPLE | {"b_2": 2e-3}, {})
    values = {**simple.plant(**SIMPLE).parameters(), **SIMPLE, "b_2": 2e-3, "g": 9.81}
    (pole,) = poles(simple, values, ["b_2"], np.array([[4e-6]]), TWO_SIGMA)["hanging"]
    assert pole.real.interval[0] < pole.real.value < pole.real.interval[1] == 0.0


def test_of_three_carts_the_middle_one_held_the_outer_ones_swing_by_themselves() -> None:
    """m_1 between the ground and the middle on k_1 and k_12, m_3 on k_23: two damped oscillators by hand."""
    three = chain(3)
    given = {"m_1": 1.0, "m_2": 2.0, "m_3": 0.5, "k_1": 30.0, "k_12": 20.0, "k_23": 18.0, "c_1": 0.2, "c_3": 0.3}
    values = three(**given).parameters()
    found = poles(rig(three, given, {}), values, [], np.zeros((0, 0)), TWO_SIGMA, [frozenset({"x_2"})])
    ((at, told),) = found.items()
    assert at.endswith("x_2 held")
    expected = [
        (-c / (2 * m), math.sqrt(k / m - (c / (2 * m)) ** 2)) for m, k, c in ((1.0, 50.0, 0.2), (0.5, 18.0, 0.3))
    ]
    assert np.allclose([(p.real.value, p.imag.value) for p in told], expected, rtol=1e-9)
