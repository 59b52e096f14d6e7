"""A constant force or dry friction that the model lacks is found, and intervals and bands hold what it changes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.identification.twins import FURUTA, PENDULUM, noisy, rig, swing
from upright.identification import Parameter, Run
from upright.identification.estimate import identify
from upright.identification.inference.covariance import assess
from upright.identification.inference.neglected import OFFSET, Neglected, consider, with_force
from upright.identification.model.bands import Bands
from upright.identification.model.fit import Estimate, Fit
from upright.identification.problem.residuals import formulate
from upright.identification.search.descent import descend_progressively
from upright.physics import Furuta, Pendulum
from upright.simulation import simulate

GUESSES = {"J_d": 0.006, "b_1": 6e-3, "b_1c": 2e-3}
LEAN = 2e-3
"""Torque [N m] on the arm that nobody logs; what drives it is 40e-3."""


def driven(label: str, role: str, force: float, *, slow: float = 0.7, seed: int = 1) -> Run:
    """A Furuta pendulum whose arm is driven, and pulled by a constant torque besides."""
    dt, n = 4e-3, 1501
    t = np.arange(n) * dt
    u = (0.04 * np.sin(2 * np.pi * slow * t) + 0.03 * np.sin(2 * np.pi * 1.9 * t))[:, None]
    x = simulate(Furuta(**FURUTA), {"actuator.offset": force}, [0.0, 0.0, 0.5, 0.0], u, dt, samples=n, substeps=2)
    run = Run(label=label, role=role, t=t, u=u, y=x[:, [0, 2], 0], measured=("psi", "theta"))  # type: ignore[arg-type]
    return noisy(run, 1e-3, seed=seed)


@pytest.fixture(scope="module")
def pulled():
    return identify(
        rig(Furuta, FURUTA, GUESSES), [driven("one", "fit", LEAN), driven("two", "predict", LEAN, slow=0.5)]
    )


def test_the_force_is_found_and_the_line_that_asks_for_it_is_written(pulled) -> None:
    (said,) = [w for w in pulled.warnings if "constant force" in w]
    low, high = (float(word.strip("():")) for word in said.split(" (")[1].split(")")[0].split(" to "))
    assert low <= LEAN <= high
    assert "[actuator] offset = { guess =" in said


def test_intervals_hold_the_truth_that_the_force_has_moved_the_estimates_from(pulled) -> None:
    assert abs(pulled.estimates["b_1c"].value / FURUTA["b_1c"] - 1) > 0.1  # it took the force's part
    for name in GUESSES:
        low, high = pulled.estimates[name].interval
        assert low <= FURUTA[name] <= high, name


def test_no_interval_leaves_the_bounds_of_its_number_because_of_the_force() -> None:
    """A gain does not grow with the command, whatever a force that the model lacks would have it do."""
    droop = Parameter(name="actuator.droop", value=0.5, unit="1/(N m)", estimate=True, lower=0.0)
    asked = rig(Furuta, FURUTA, GUESSES)
    fit = identify(replace(asked, parameters={**asked.parameters, droop.name: droop}), [driven("one", "fit", LEAN)])
    assert any("constant force" in w for w in fit.warnings)
    low, high = fit.estimates[droop.name].interval
    assert low == 0.0 < high


def test_bands_hold_what_the_force_does_to_another_run(pulled) -> None:
    assert pulled.bands.names[-1] == OFFSET
    assert min(pulled.runs["two"].inside.values()) > 85


def test_no_force_is_told_where_none_is() -> None:
    fit = identify(rig(Furuta, FURUTA, GUESSES), [driven("one", "fit", 0.0, seed=3)])
    assert not any("constant force" in w for w in fit.warnings)
    assert OFFSET not in fit.bands.names  # type: ignore[union-attr]


@pytest.fixture(scope="module")
def frictionless():
    """A fit to a rig with dry friction on its arm of a model that has viscous friction alone."""
    guesses = {"J_d": 0.006, "b_1": 6e-3}
    asked = rig(Furuta, {**FURUTA, "b_1c": 0.0}, guesses)
    return identify(asked, [driven("one", "fit", 0.0), driven("two", "predict", 0.0, slow=0.5)])


def test_dry_friction_that_nobody_asked_for_is_found_and_named(frictionless) -> None:
    (said,) = [w for w in frictionless.warnings if "dry friction that the model leaves out" in w]
    low, high = (float(word.strip("():")) for word in said.split("N m (")[1].split(")")[0].split(" to "))
    assert low <= FURUTA["b_1c"] <= high
    assert "[parameters] b_1c = { guess =" in said


def test_a_model_that_lacks_dry_friction_predicts_in_part_however_well_it_explains(frictionless) -> None:
    assert min(frictionless.runs["two"].fit_percent.values()) > 80
    predicts = frictionless.answers[0]
    assert predicts.answer == "in part"
    assert "b_1c" in predicts.reasons[0]


def test_viscous_friction_that_took_the_part_of_dry_friction_has_an_interval_that_holds_the_truth(frictionless) -> None:
    b_1 = frictionless.estimates["b_1"]
    assert b_1.value > 1.1 * FURUTA["b_1"]
    assert b_1.interval[0] <= FURUTA["b_1"] <= b_1.interval[1]


def test_viscous_friction_that_a_study_leaves_out_is_named_although_dry_friction_took_its_part() -> None:
    """Dry friction loses as much of these swings, and with the wrong share of them at every amplitude."""
    asked = rig(Furuta, {**FURUTA, "b_1": 0.0}, {"J_d": 0.006, "b_1c": 2e-3})
    fit = identify(asked, [driven("one", "fit", 0.0)])
    (said,) = [w for w in fit.warnings if "viscous friction that the model leaves out" in w]
    low, high = (float(word.strip("():")) for word in said.split("N m s/rad (")[1].split(")")[0].split(" to "))
    assert low <= FURUTA["b_1"] <= high
    assert "[parameters] b_1 = { guess =" in said
    b_1c = fit.estimates["b_1c"]
    assert b_1c.value > 1.1 * FURUTA["b_1c"]
    assert b_1c.interval[0] <= FURUTA["b_1c"] <= b_1c.interval[1]


def test_no_dry_friction_is_told_where_it_is_asked_for_or_not_there(pulled) -> None:
    assert not any("dry friction that" in w for w in pulled.warnings)
    smooth = {**FURUTA, "b_1c": 0.0, "b_2c": 0.0}
    x = simulate(Furuta(**smooth), {}, [0.0, 0.0, 0.5, 0.0], driven("a", "fit", 0.0).u, 4e-3, samples=1501, substeps=2)
    run = noisy(replace(driven("a", "fit", 0.0), y=x[:, [0, 2], 0]), 1e-3, seed=4)
    fit = identify(rig(Furuta, smooth, {"J_d": 0.006, "b_1": 6e-3}), [run])
    assert not any("dry friction that" in w for w in fit.warnings)


def test_a_number_is_considered_where_it_takes_its_share_of_the_cost_to_first_order() -> None:
    """Dry friction is nearly linear in what it does to a short swing: what it leaves says what it takes to first order.

    A swing with a little of it, half of what its model misses being noise.
    """
    smooth = {**PENDULUM, "b_2c": 0.0, "b_2q": 0.0}
    run = noisy(swing({**smooth, "b_2c": 4e-4}, seconds=2.0, initial={"theta": 1.5, "theta_dot": 0.0}), 3e-3, seed=7)
    problem = formulate(rig(Pendulum, smooth, {"J_p": smooth["J_p"]}), [run])
    best = assess(problem, descend_progressively(problem, problem.start).x)
    friction = Parameter(name="b_2c", value=0.0, unit="N m", estimate=True, lower=0.0)

    def taken(share: float, **bounds: float) -> float:
        considered = consider(best, replace(friction, **bounds), share=share, tolerance=1e-6, limit=40)
        return 0.0 if considered is None else 1 - considered.leaves

    whole = taken(0.0)
    assert 0.2 < whole < 0.8
    assert taken(0.9 * whole) == pytest.approx(whole)
    assert taken(1.1 * whole) == 0.0
    assert taken(0.0, lower=-1.0, upper=0.0) == 0.0  # friction that drives is beyond its bounds


def test_bands_hold_the_mean_square_of_a_force_and_of_what_it_moves() -> None:
    """A force of 2 +- 0.5 that moves b by 3 and what no band knows: E[f^2] = 2^2 + 0.5^2, and b by 3 all the same."""
    bands = Bands(quantile=1.6, spreads={}, names=("a", "b"), covariance=np.array([[4.0, 1.0], [1.0, 9.0]]), logs=())
    force = Neglected(
        name=OFFSET, size=Estimate(value=2.0, stderr=0.5, interval=(1.0, 3.0), unit="N"), means="", essential=False,
        intervals={}, names=("b", "c"), moves=np.array([3.0, 7.0]),
    )  # fmt: skip
    wider = with_force(bands, force)
    assert wider.names == ("a", "b", OFFSET)
    assert wider.covariance.tolist() == [[4.0, 1.0, 0.0], [1.0, 9.0 + 9.0, 6.0], [0.0, 6.0, 4.25]]
    assert (wider.quantile, wider.logs) == (bands.quantile, bands.logs)


def late(asked: dict[str, Parameter]) -> Fit:
    """Of a Furuta pendulum whose drive has a dead time of 3 ms and a lag of 2.773 ms."""
    dt, n = 4e-3, 1501
    t = np.arange(n) * dt
    u = 0.04 * np.sin(2 * np.pi * 0.7 * t) + 0.03 * np.sin(2 * np.pi * 3.9 * t) + 0.02 * np.sign(np.sin(8.17 * t))
    drive = {"actuator.delay": 3e-3, "actuator.lag": 2.773e-3}
    x = simulate(Furuta(**FURUTA), drive, [0.0, 0.0, 0.5, 0.0], u[:, None], dt, samples=n, substeps=4)
    run = Run(label="one", role="fit", t=t, u=u[:, None], y=x[:, [0, 2], 0], measured=("psi", "theta"))  # type: ignore[arg-type]
    known = rig(Furuta, FURUTA, {"J_d": 0.006, "b_1": 6e-3})
    return identify(replace(known, parameters={**known.parameters, **asked}, substeps=4), [noisy(run, 5e-4, seed=1)])


DEAD_TIME = Parameter(name="actuator.delay", value=4e-3, unit="s", estimate=True, lower=0.0, upper=0.2)


def test_a_dead_time_asked_for_alone_says_that_it_stands_for_a_lag_too_and_holds_their_sum() -> None:
    """To slow commands ``e^(-s T)/(s tau + 1)`` is ``e^(-s (T + tau))``."""
    fit = late({"actuator.delay": DEAD_TIME})
    (said,) = [w for w in fit.warnings if "stands for delay and lag" in w]
    assert said.startswith("actuator.delay stands for delay and lag of the drive together, 5.7")
    low, high = fit.estimates["actuator.delay"].interval
    assert low <= 3e-3 + 2.773e-3 <= high
    assert high - low < 1e-4


def test_a_dead_time_beside_a_lag_that_is_known_stands_for_itself() -> None:
    lag = Parameter(name="actuator.lag", value=2.773e-3, unit="s")
    fit = late({"actuator.delay": DEAD_TIME, "actuator.lag": lag})
    assert not any("stands for delay and lag" in w for w in fit.warnings)
    low, high = fit.estimates["actuator.delay"].interval
    assert low <= 3e-3 <= high
