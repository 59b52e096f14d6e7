"""What the data cannot see is said, with the number that would fix it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from tests.identification.twins import FURUTA, PENDULUM, noisy, rig, shaken, swing
from upright.identification import Parameter
from upright.identification.estimate import identify
from upright.identification.inference.covariance import assess, identifiability
from upright.identification.problem.residuals import formulate
from upright.physics import Furuta, Pendulum


def test_a_free_swing_sees_only_ratios() -> None:
    """Nothing known pushes it, so m_p, J_p and frictions scale together; any one of them given fixes the rest."""
    guesses = {n: 1.3 * PENDULUM[n] for n in ("m_p", "J_p", "b_2", "b_2c")}
    run = noisy(swing({**PENDULUM, "b_2q": 0.0}), 1e-4, seed=1)
    fit = identify(rig(Pendulum, PENDULUM, guesses, b_2q=0.0), [run])
    assert {n for n, e in fit.estimates.items() if e.status == "unseen"} == set(guesses)
    assert not fit.trusted
    assert len(fit.unseen) == 1
    assert "scale together" in fit.unseen[0]
    assert "Give m_p" in fit.unseen[0]
    assert fit.unseen[0] in fit.verdict
    for e in fit.estimates.values():
        assert e.interval == (-math.inf, math.inf)
        assert math.isfinite(e.value)
    assert fit.singular_values[-1] < 1e-5 * fit.singular_values[0]


def test_the_ratios_themselves_are_right() -> None:
    guesses = {n: 1.3 * PENDULUM[n] for n in ("m_p", "J_p", "b_2", "b_2c")}
    fit = identify(rig(Pendulum, PENDULUM, guesses, b_2q=0.0), [swing({**PENDULUM, "b_2q": 0.0})])
    v = {n: e.value for n, e in fit.estimates.items()}
    assert abs(v["b_2c"] / v["m_p"] / (PENDULUM["b_2c"] / PENDULUM["m_p"]) - 1) < 1e-3


def test_one_number_given_restores_sight() -> None:
    guesses = {n: 1.3 * PENDULUM[n] for n in ("J_p", "b_2", "b_2c")}
    fit = identify(rig(Pendulum, PENDULUM, guesses), [noisy(swing(), 1e-4, seed=1)])
    assert not fit.unseen
    assert all(e.status == "well determined" for e in fit.estimates.values())


@pytest.mark.slow
def test_a_parameter_without_effect_is_named() -> None:
    """The arm is locked, so its inertia moves nothing."""
    from dataclasses import replace

    run = shaken()
    still = replace(run, y=run.y[:, 1:], measured=("theta",), held={"psi": 0.0}, u=np.zeros_like(run.u))
    from upright.simulation import Held, simulate

    x = simulate(Furuta(**FURUTA), {}, [0.0, 0.0, 1.5, 0.0], None, run.period, samples=run.t.size, held={"psi": Held()})
    still = replace(still, y=x[:, [2], 0])
    fit = identify(rig(Furuta, FURUTA, {"J_d": 0.01, "b_2": 3e-4, "b_2c": 1e-4}), [noisy(still, 1e-4, seed=2)])
    assert fit.estimates["J_d"].status == "unseen"
    assert fit.estimates["b_2c"].status == "well determined"
    assert any("J_d" in s and "no measured output" in s for s in fit.unseen)


@pytest.mark.slow
def test_back_emf_and_friction_cannot_be_told_apart() -> None:
    run = noisy(shaken(), 1e-4, seed=3)
    asked = rig(Furuta, FURUTA, {"b_1": 4e-3, "actuator.slope": 1e-3, "J_d": 0.01})
    fit = identify(asked, [run])
    assert {"b_1", "actuator.slope"} <= {n for n, e in fit.estimates.items() if e.status == "unseen"}
    assert fit.estimates["J_d"].status == "well determined"
    assert any("b_1" in s and "actuator.slope" in s for s in fit.unseen)


def test_a_weakly_seen_number_is_called_weak() -> None:
    """Drag in a swing of 0.1 rad, buried in noise of a tenth of the swing."""
    run = noisy(swing({**PENDULUM, "b_2c": 0.0}, angle=0.1, seconds=5.0), 0.01, seed=4)
    fit = identify(rig(Pendulum, PENDULUM, {"b_2q": 1e-3, "J_p": 2e-3}, b_2c=0.0), [run], method="least-squares")
    e = fit.estimates["b_2q"]
    assert e.status in ("poorly determined", "at bound", "unseen")
    assert e.interval[0] <= PENDULUM["b_2q"] <= e.interval[1]


def test_where_every_number_is_held_by_a_bound_none_is_left_to_see() -> None:
    problem = formulate(rig(Pendulum, PENDULUM, {"b_2": 2e-3}), [swing(seconds=2.0)])
    best = assess(problem, problem.start)
    seen = identifiability(replace(best, pinned=np.ones(best.x.size, dtype=bool)))
    assert (seen.names, seen.singular_values.size, seen.hidden) == ((), 0, set())


def test_a_mass_that_nothing_shows_stays_a_number_one_can_print() -> None:
    # without gravity, force or friction the mass of a spinning arm is in no output
    from tests.identification.twins import rig as known
    from upright.identification.problem.unknowns import FAR, shared_unknowns
    from upright.physics import Pendulum

    values = {"m_p": 0.2, "l_cg": 0.3, "J_p": 2e-3}
    [sought] = shared_unknowns(known(Pendulum, values, {"m_p": 0.2}))
    lower, upper = sought.bounds
    assert abs(upper - lower - 2 * np.log(FAR)) < 1e-9


def test_a_fit_whose_every_number_ends_at_a_bound_says_so() -> None:
    run = noisy(swing({**PENDULUM, "b_2": 0.0, "b_2c": 0.0, "b_2q": 0.0}, seconds=4.0), 1e-4, 3)
    values = {n: v for n, v in PENDULUM.items() if n not in ("b_2", "b_2c", "b_2q")}
    b = Parameter(name="b_2", value=5e-3, unit="N m s/rad", estimate=True, lower=1e-3)  # the data have none
    known = rig(Pendulum, values, {})
    fit = identify(replace(known, parameters={**known.parameters, "b_2": b}), [run])
    assert fit.estimates["b_2"].status == "at bound"
    assert "b_2 reached its lower limit" in fit.verdict
