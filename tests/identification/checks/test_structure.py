"""What a model leaves out, found from runs of a rig that has it: a spring, an offset, a lean, friction in a joint."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from tests.identification.twins import FURUTA, PENDULUM, noisy, rig, shaken, swing
from upright.identification import GreyBox, Run
from upright.identification.checks.structure import missing_numbers, with_proposal
from upright.identification.estimate import identify
from upright.physics import CartPendulum, Furuta, Pendulum, find
from upright.simulation import simulate

CART = {"m_c": 0.6, "m_p": 0.2, "l_cg": 0.25, "J_p": 2e-3, "b_1": 1.5, "b_2": 1e-3}
TWO_CARTS = {"m_1": 1.0, "m_2": 0.8, "k_1": 200.0, "k_12": 300.0, "c_1": 3.0, "c_2": 2.0}


def asked(plant: type, values: dict[str, float], *names: str) -> GreyBox:
    """A rig with everything known but `names`, whose guesses are 30 % off; what is left out is not in it."""
    return rig(plant, {n: v for n, v in values.items() if n not in names}, {n: 1.3 * values[n] for n in names})


def stepped(plant: type, values: dict[str, float], force: float, drive: dict[str, float] | None = None) -> Run:
    """Steps of a force, to either side in turn, on a rig at rest; 6 s at 250 Hz."""
    dt, n = 4e-3, 1500
    u = force * np.where((np.arange(n) // 150) % 2, -1.0, 1.0)[:, None] * (np.arange(n) > 50)[:, None]
    x = simulate(plant(**values), drive or {}, [0.0] * len(plant.state_names()), u, dt, samples=n, substeps=2)
    measured = tuple(c.name for c in plant.coordinates)
    return Run(label="steps", role="fit", t=np.arange(n) * dt, u=u, y=x[:, ::2, 0], measured=measured)


def test_a_cable_that_pulls_the_arm_back_is_named_with_its_stiffness():
    run = noisy(shaken({**FURUTA, "k_psi": 0.05}), 1e-3, seed=1)
    fit = identify(asked(Furuta, FURUTA, "J_d", "b_1", "b_1c"), [run])
    assert not fit.trusted
    assert fit.proposed == {"k_psi": pytest.approx(0.05, rel=0.03)}
    assert "k_psi (torsional stiffness that anchors the arm to ground)" in fit.answers[0].reasons[0]
    assert fit.answers[0].reasons[0] in fit.warnings
    assert fit.answers[0].reasons[0] in fit.verdict


def test_a_rail_out_of_level_is_named_as_the_offset_that_it_is_like():
    """On a slope of s the cart is pulled by (m_c + m_p) g s, and its pendulum hangs off by s."""
    slope, weight = 0.01, (CART["m_c"] + CART["m_p"]) * 9.81
    run = noisy(stepped(CartPendulum, CART, 1.0, {"actuator.offset": -weight * slope}), 1e-4, seed=2)
    fit = identify(asked(CartPendulum, CART, "m_c", "b_1"), [run])
    assert fit.proposed == {"actuator.offset": pytest.approx(-weight * slope, rel=0.03)}
    assert "under [actuator]" in fit.answers[0].reasons[0]


@pytest.mark.parametrize(("name", "value"), [("k_2", 150.0), ("f_2c", 2.5)])
def test_a_spring_to_ground_or_a_joint_that_rubs_is_named(name, value):
    plant = find("rectilinear-2")
    run = noisy(stepped(plant, {**TWO_CARTS, name: value}, 4.0), 1e-5, seed=3)
    fit = identify(asked(plant, TWO_CARTS, "m_1", "m_2", "c_1"), [run])
    assert fit.proposed == {name: pytest.approx(value, rel=0.05)}


def test_a_lean_is_named_by_both_of_its_components():
    """A quarter of a degree one way and half a degree the other, of which neither alone explains the accelerations."""
    lean = {"tilt_x": 4e-3, "tilt_y": 9e-3}
    run = shaken({**FURUTA, **lean})
    missing = missing_numbers(asked(Furuta, FURUTA, "J_d"), [run])
    assert missing[0] == pytest.approx(lean, rel=0.4)  # where a search begins: the arm's inertia takes a part
    assert not any(set(numbers) < set(lean) for numbers in missing)


def test_two_that_are_missing_are_both_named():
    run = noisy(shaken({**FURUTA, "k_psi": 0.05, "b_1q": 0.02}), 1e-4, seed=4)
    without = {n: v for n, v in FURUTA.items() if n != "b_1q"}
    fit = identify(asked(Furuta, without, "J_d", "b_1", "b_1c"), [run])
    assert fit.proposed["k_psi"] == pytest.approx(0.05, rel=0.2)


def test_nothing_is_missing_from_a_model_that_explains_its_runs():
    fit = identify(asked(Pendulum, PENDULUM, "J_p", "b_2"), [noisy(swing(), 2e-3, seed=5)])
    assert fit.trusted
    assert fit.proposed == {}


@pytest.mark.parametrize(
    ("percents", "more", "looked"),
    [
        ({"fit": 79.9}, {}, True),
        ({"fit": 80.0}, {}, False),  # explained well enough
        ({"predict": 30.0}, {}, False),  # nothing was fitted
        ({"fit": 30.0}, {"interrupted": True}, False),
        ({"fit": 30.0}, {"failed": True}, False),
    ],
)
def test_what_is_missing_is_looked_for_where_a_whole_fit_explains_its_runs_badly(monkeypatch, percents, more, looked):
    asked_for = []
    monkeypatch.setattr(
        "upright.identification.checks.structure.proposed", lambda _, runs, worst: asked_for.append((runs, worst))
    )
    runs = {role: SimpleNamespace(role=role, fit_percent={"a": 99.0, "b": p}) for role, p in percents.items()}
    fit = SimpleNamespace(**({"runs": runs, "interrupted": False, "failed": False, "model": None} | more))
    assert with_proposal(fit, []) is fit  # nothing is found here
    assert asked_for == [([], 79.9)] * looked


def test_what_is_known_or_assumed_is_no_number_that_is_left_out():
    """A spring whose stiffness somebody gave is not asked for again, nor is anything of a reversed sensor."""
    run = shaken({**FURUTA, "k_psi": 0.05})
    known = rig(Furuta, {**FURUTA, "k_psi": 0.02}, {"J_d": 0.01})
    assert not any("k_psi" in numbers for numbers in missing_numbers(known, [run]))
    assert "k_psi" in missing_numbers(asked(Furuta, FURUTA, "J_d"), [run])[0]
    assert missing_numbers(asked(Furuta, FURUTA), [run]) == []  # of numbers that are all known nothing is asked
    short = replace(run, t=run.t[:5], u=run.u[:5], y=run.y[:5])
    assert missing_numbers(asked(Furuta, FURUTA, "J_d"), [short]) == []
    reversed_arm = Run(**{**vars(run), "y": run.y * [-1.0, 1.0]})
    fit = identify(asked(Furuta, FURUTA, "J_d", "b_1", "b_1c"), [reversed_arm])
    assert fit.proposed == {}
    assert any("sign" in w for w in fit.warnings)
