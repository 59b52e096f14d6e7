"""Two disks on one shaft: the twist speaks although friction is wrong by what carries both astray."""

import math
from dataclasses import replace

import numpy as np
import pytest

from upright.identification import GreyBox, Parameter, Run, identify
from upright.identification.problem.residuals import formulate
from upright.physics import find
from upright.simulation import simulate

PLANT = find("torsional-2")
TRUTH = {"J_1": 2.4e-3, "J_2": 1.9e-3, "k_12": 1.1, "c_1": 4e-3, "c_2": 1e-3, "c_12": 4e-4, "f_1c": 8e-3, "f_2c": 2e-3}
QUANTUM, DT = 2 * math.pi / 16000, 2e-3


def spin_up() -> Run:
    """Both disks spun up from rest and left alone, read by encoders."""
    t = np.arange(2501) * DT
    u = np.where((t > 0.5) & (t < 3.0), 0.06, 0.0)[:, None]
    x = simulate(PLANT(**TRUTH), {}, [0.0] * 4, u, DT, samples=t.size, substeps=2)
    y = QUANTUM * np.round(x[:, ::2, 0] / QUANTUM)
    return Run(label="spin-up", role="fit", t=t, u=u, y=y, measured=("theta_1", "theta_2"), resolution=(QUANTUM,) * 2,
               unknown=(), initial=dict.fromkeys(PLANT.state_names(), 0.0))  # fmt: skip


@pytest.mark.slow
def test_the_shaft_is_found_although_the_friction_is_another():
    # the model has no dry friction, the rig has: no viscous friction makes up for it, and both disks are led astray
    asked = {"J_1", "J_2", "k_12", "c_1", "c_12"}
    parameters = {n: Parameter(name=n, value=1.3 * TRUTH[n], estimate=True, lower=0.0) for n in asked}
    parameters["c_2"] = Parameter(name="c_2", value=0.0)
    run = spin_up()
    fit = identify(GreyBox(plant=PLANT, parameters=parameters, substeps=2), [run])
    score = fit.runs["spin-up"]
    astray = np.abs(score.y - score.simulated).max()
    twist = score.y[:, 0] - score.y[:, 1]
    assert astray > 3 * np.ptp(twist)  # otherwise there would be nothing to drown in

    def flexible(v):  # frequency of two free disks on a shaft, sqrt(k (1/J_1 + 1/J_2))
        return math.sqrt(v["k_12"] * (1 / v["J_1"] + 1 / v["J_2"]))

    found = {n: e.value for n, e in fit.estimates.items()}
    assert abs(flexible(found) / flexible(TRUTH) - 1) < 0.02


def test_components_are_weighed_by_what_is_missed_of_them_and_the_cost_stays():
    run = spin_up()
    parameters = {n: Parameter(name=n, value=v, estimate=n == "J_1", lower=0.0) for n, v in TRUTH.items()}
    problem = formulate(GreyBox(plant=PLANT, parameters=parameters, substeps=2), [run])
    x = problem.start
    y = problem.tracks[0].y
    apart = 0.05 * (y[:, :1] - y[:, 1:]) * [1, -1]  # a tenth of the twist, and a hundredth of both angles
    problem.tracks[0] = replace(problem.tracks[0], y=1.01 * y + apart)
    cost, e = problem.cost(x), problem.residuals(0, x).reshape(-1, 2)
    missed = np.sqrt(np.mean(e**2, axis=0))
    assert missed.max() > 2 * missed.min()  # otherwise there would be nothing to weigh
    assert problem.weigh_components(x)
    weighed = np.sqrt(np.mean(problem.residuals(0, x).reshape(-1, 2) ** 2, axis=0))
    assert weighed[0] == pytest.approx(weighed[1], rel=1e-9)  # all alike now
    assert problem.cost(x) == pytest.approx(cost, rel=1e-9)
    assert not problem.weigh_components(x)  # and nothing changes any more


def test_runs_of_the_same_outputs_share_the_weights_of_their_components_and_what_is_missed_of_all():
    """Mean squares 1 and 3 times as large, beside each other: each run is weighed by their root mean, 2."""
    parameters = {n: Parameter(name=n, value=v, estimate=n == "J_1", lower=0.0) for n, v in TRUTH.items()}
    problem = formulate(
        GreyBox(plant=PLANT, parameters=parameters, substeps=2), [spin_up(), replace(spin_up(), label="b")]
    )
    x = problem.start
    y = problem.tracks[0].y
    away = 0.01 * y + 0.05 * (y[:, :1] - y[:, 1:]) * [1, -1]
    problem.tracks = [
        replace(track, y=y + math.sqrt(part) * away) for track, part in zip(problem.tracks, (1.0, 3.0), strict=True)
    ]
    before = [np.mean(problem.residuals(i, x).reshape(-1, 2) ** 2, axis=0) for i in (0, 1)]
    assert problem.weigh_components(x)
    after = [np.mean(problem.residuals(i, x).reshape(-1, 2) ** 2, axis=0) for i in (0, 1)]
    # encoders round, so that the first motion is missed by a little more than what was added
    assert after[0] / before[0] == pytest.approx(after[1] / before[1], rel=1e-9)
    both = np.add(*after)
    assert both[0] == pytest.approx(both[1], rel=1e-9)


def test_where_nothing_or_everything_is_missed_no_component_is_weighed_anew():
    """A light disk on a stiff shaft runs away in steps of 1 ms."""
    parameters = {n: Parameter(name=n, value=v, estimate=n == "J_1", lower=0.0) for n, v in TRUTH.items()}
    problem = formulate(GreyBox(plant=PLANT, parameters=parameters, substeps=2), [spin_up()])
    x, track = problem.start, problem.tracks[0]
    light = x - 15.0  # a millionth of its inertia and less, as its logarithm is sought
    with np.errstate(over="ignore", invalid="ignore"):
        assert not np.isfinite(problem.residuals(0, light)).all()
        assert not problem.weigh_components(light)
    assert problem.tracks[0].missed is None
    problem.tracks[0] = replace(track, y=problem.simulate(0, x[:, None], track.length)[:, 0, :, 0])
    assert not problem.weigh_components(x)
    assert problem.tracks[0].missed is None
