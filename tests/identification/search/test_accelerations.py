"""Accelerations and energies of a cart by hand, beside those that the closed-form starts compare."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tests.identification.twins import FURUTA, rig, shaken
from upright.identification import GreyBox, Parameter, Run
from upright.identification.model.grey_box import base_values
from upright.identification.search.starts import (
    Sample,
    disagreement,
    friction_from_energy,
    model_accelerations,
    observe,
    regress,
    samples_of,
)
from upright.physics import CartPendulum, Furuta, find
from upright.signals.smoothing import scatter
from upright.simulation import simulate

CART = find("rectilinear-1")
DT, N = 2e-3, 4000
VALUES = {"m_1": 2.0, "k_1": 50.0, "c_1": 1.5, "f_1c": 0.4, "f_1q": 0.3}
T = DT * np.arange(N)


def cart(*asked: str, gain: float = 3.0, **other: float) -> GreyBox:
    numbers = {n: Parameter(name=n, value=v, estimate=n in asked) for n, v in {**VALUES, **other}.items()}
    return GreyBox(plant=CART, parameters=numbers | {"actuator.gain": Parameter(name="actuator.gain", value=gain)})


def driven(**about: Any) -> Run:
    u = np.sign(np.sin(3.0 * T))
    y = simulate(CART(**VALUES), {"actuator.gain": 3.0}, [0.05, 0.0], u, DT, samples=N, substeps=2)[:, :1, 0]
    base: dict[str, Any] = {"label": "run", "role": "fit", "t": T, "u": u[:, None], "y": y, "measured": ("x_1",)}
    return Run(**{**base, **about})


def sample(**about: Any) -> Sample:
    """Positions, speeds and commands that nothing ties together."""
    q, v = 0.1 * np.cos(T)[None], 0.5 * np.sin(2 * T)[None]
    base: dict[str, Any] = {"run": driven(), "dt": DT, "q": q, "v": v, "a": np.sin(T)[None], "u": np.cos(3 * T)[None]}
    rest: dict[str, Any] = {"free": (0,), "fades": np.array([0.02]), "width": 5, "edge": 100, "period": 1.0}
    return Sample(**{**base, **rest, **about})


def test_the_model_s_acceleration_is_force_over_mass() -> None:
    """``m a = g u - k x - c v - f tanh(v/fade) - f_q v |v|``."""
    s = sample()
    q, v, u = s.q[0], s.v[0], s.u[0]
    force = 3.0 * u - 50.0 * q - 1.5 * v - 0.4 * np.tanh(v / 0.02) - 0.3 * v * np.abs(v)
    values = base_values(cart())
    assert model_accelerations(CART, values, s)[0] == pytest.approx(force / 2.0)
    without = force + 0.4 * np.tanh(v / 0.02)  # where no speed is believed, none has a sign
    assert model_accelerations(CART, values, replace(s, fades=np.zeros(1)))[0] == pytest.approx(without / 2.0)


def test_a_held_coordinate_acts_by_its_measured_acceleration() -> None:
    """Of a crane the pendulum, its cart moved: ``J theta'' = -m g l sin theta - m l cos theta x'' - b theta'``."""
    values = {"m_c": 0.4, "m_p": 0.3, "l_cg": 0.3, "J_p": 5e-3, "b_2": 5e-3}
    q = np.stack([0.1 * np.cos(T), np.sin(T)])
    v = np.stack([0.2 * np.sin(T), 0.5 * np.cos(2 * T)])
    a = np.stack([0.7 * np.sin(5 * T), np.zeros(N)])
    s = sample(q=q, v=v, a=a, u=np.zeros((1, N)), free=(1,), fades=np.full(2, 0.02))
    asked = rig(CartPendulum, values, {})
    found = model_accelerations(CartPendulum, base_values(asked), s)
    J, ml = 5e-3 + 0.3 * 0.09, 0.3 * 0.3
    pull = -ml * 9.81 * np.sin(q[1]) - 5e-3 * v[1]
    coupled = [(pull + sign * ml * np.cos(q[1]) * a[0]) / J for sign in (-1, 1)]
    assert any(np.allclose(found[0], c) for c in coupled)
    still = model_accelerations(CartPendulum, base_values(asked), replace(s, a=np.zeros((2, N))))
    assert still[0] == pytest.approx(pull / J)


def test_what_disagrees_is_told_in_the_spread_of_the_measured_acceleration_and_without_the_ends() -> None:
    values = base_values(cart())
    s = sample()
    a = model_accelerations(CART, values, s)
    exact = replace(s, a=a)
    assert disagreement(cart(), values, exact).shape == (1, N - 200)
    # seven samples a polynomial passes over: jumps of dry friction are rounded, the rest stays
    assert np.median(np.abs(disagreement(cart(), values, exact))) < 1e-3
    off = replace(s, a=a + 0.5)
    assert np.median(disagreement(cart(), values, off)) == pytest.approx(-0.5 / scatter(a[0] + 0.5), rel=1e-2)
    assert disagreement(cart(), values, replace(exact, edge=3000)).shape == (1, N // 2)
    heavier = replace(exact, run=replace(s.run, known={"m_1": 4.0}))
    assert np.allclose(disagreement(cart(), {**values, "m_1": 9.0}, heavier),
                       disagreement(cart(), {**values, "m_1": 4.0}, exact))  # fmt: skip


def test_smoothed_motion_is_that_of_the_run_with_its_conventions_and_its_drive() -> None:
    asked, run = cart("k_1"), driven()
    s = observe(asked, run)
    assert s is not None
    assert s.q[0] == pytest.approx(run.y[:, 0], abs=1e-3)
    assert np.array_equal(s.u, run.u.T)
    assert (s.free, s.dt) == ((0,), pytest.approx(DT))
    assert s.fades == pytest.approx([0.02 * scatter(s.v[0])])
    turned = observe(asked, run, flips={"x_1": -1.0}, turns={"x_1": 0.3})
    assert turned is not None
    assert turned.q[0] == pytest.approx(0.3 - s.q[0])
    assert turned.v[0] == pytest.approx(-s.v[0])
    tripped = observe(asked, replace(run, t=run.t + 4.0, guesses={"input_start": 1.0, "input_end": 3.0}))
    assert tripped is not None
    on = (T >= 1.0 - 1e-9) & (T < 3.0 - 1e-9)
    assert np.array_equal(tripped.u[0], np.where(on, run.u[:, 0], 0.0))
    assert observe(asked, run.samples(slice(29))) is None
    assert observe(asked, run.samples(slice(30))) is not None
    assert observe(asked, replace(run, held={"x_1": 0.0})) is None
    two = shaken(seconds=1.0)
    assert observe(rig(Furuta, FURUTA, {}), replace(two, y=two.y[:, :1], measured=("psi",))) is None
    locked = observe(rig(Furuta, FURUTA, {}), replace(two, y=two.y[:, 1:], measured=("theta",), held={"psi": 0.4}))
    assert locked is not None
    assert locked.free == (1,)
    assert np.array_equal(locked.q[0], np.full(two.t.size, 0.4))
    assert not locked.v[0].any()


def test_thinned_runs_keep_every_so_many_samples() -> None:
    for most, period in ((4000, 1), (3999, 2), (2000, 2), (1999, 3)):
        (s,) = samples_of(cart("k_1"), [driven()], most=most)
        assert s.dt == pytest.approx(period * DT)


def test_accelerations_give_a_stiffness_and_leave_what_they_cannot_see() -> None:
    s = observe(cart("k_1"), driven())
    assert s is not None
    found = regress(cart("k_1", k_1=20.0), [s])
    assert found.values["k_1"] == pytest.approx(50.0, rel=0.02)
    assert found.values["m_1"] == 2.0
    assert found.unexplained < 0.05
    r = disagreement(cart(), found.values, s)
    assert found.unexplained == pytest.approx(float(np.mean(r**2)))
    blind = regress(cart("a_1", a_1=0.0), [replace(s, a=0 * s.a + 1.0)])
    assert math.isfinite(blind.unexplained)


@pytest.mark.parametrize("asked", [("c_1",), ("f_1c",), ("c_1", "f_1c"), ("f_1q",)])
def test_energy_lost_under_a_drive_gives_the_friction_beside_what_is_known_of_it(asked: tuple[str, ...]) -> None:
    """What the drive puts in is taken off, and what known friction takes."""
    wrong = dict.fromkeys(asked, 9.0)
    s = observe(cart(*asked, **wrong), driven())
    assert s is not None
    found = friction_from_energy(cart(*asked, **wrong), [s], base_values(cart(**wrong)))
    # drag takes a twentieth of what is lost here, so that it is known to a fifth
    rel = 0.2 if asked == ("f_1q",) else 0.1 if len(asked) == 1 else 0.3
    for n in asked:
        assert found[n] == pytest.approx(VALUES[n], rel=rel), n
    assert set(found) == set(asked)


def test_friction_that_a_run_knows_or_that_nobody_asks_is_not_told() -> None:
    s = observe(cart("c_1"), driven())
    assert s is not None
    values = base_values(cart())
    assert friction_from_energy(cart("k_1"), [s], values) == {}
    assert friction_from_energy(cart("c_1"), [replace(s, run=replace(s.run, known={"c_1": 1.5}))], values) == {}
    heavier = friction_from_energy(
        cart("c_1"), [replace(s, run=replace(s.run, known={"m_1": 2.0}))], values | {"m_1": 9.0}
    )
    assert heavier["c_1"] == pytest.approx(1.5, rel=0.05)
    short = observe(cart("c_1"), driven().samples(slice(700)))  # fewer than five turns
    assert short is not None
    assert friction_from_energy(cart("c_1"), [short], values) == {}
    moved = replace(s, run=replace(s.run, held={"x_1": np.zeros(N)}))
    assert friction_from_energy(cart("c_1"), [moved], values) == {}


def test_two_coordinates_lose_energy_together() -> None:
    asked = rig(Furuta, FURUTA, {"b_1": 9.0})
    s = observe(asked, shaken())
    assert s is not None
    found = friction_from_energy(asked, [s], base_values(rig(Furuta, FURUTA, {})))
    assert found["b_1"] == pytest.approx(FURUTA["b_1"], rel=0.1)
