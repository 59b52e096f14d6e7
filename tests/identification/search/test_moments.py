"""A push that ends one swing too early leaves the shaft in the same phase: the right end is found all the same."""

import math

import numpy as np
import pytest

from upright.identification import GreyBox, Parameter, Run, identify
from upright.physics import find
from upright.simulation import simulate

PLANT = find("torsional-2")
TRUTH = {"J_1": 0.010, "J_2": 0.009, "k_12": 2.3, "c_1": 0.005, "c_12": 5e-4, "f_1c": 0.06}
SWING = 2 * math.pi / math.sqrt(TRUTH["k_12"] * (1 / TRUTH["J_1"] + 1 / TRUTH["J_2"]))


@pytest.mark.slow
def test_the_end_of_a_push_is_found_from_one_swing_too_early():
    t = np.arange(3001) * 2e-3
    u = np.where((t > 0.2) & (t < 5.0), 0.5, 0.0)[:, None]
    end = 0.9
    x = simulate(PLANT(**TRUTH), {"actuator.end": end}, [0.0] * 4, u, 2e-3, samples=t.size)
    resolution = 2 * math.pi / 16000
    y = resolution * np.round(x[:, ::2, 0] / resolution)
    run = Run(label="trip", role="fit", t=t, u=u, y=y, measured=("theta_1", "theta_2"), resolution=(resolution,) * 2,
              unknown=("input_end",), initial=dict.fromkeys(PLANT.state_names(), 0.0))  # fmt: skip
    parameters = {n: Parameter(name=n, value=1.1 * v, estimate=True, lower=0.0) for n, v in TRUTH.items()}
    fit = identify(GreyBox(plant=PLANT, parameters=parameters), [run])
    e = fit.per_run["trip"]["input_end"]
    assert abs(e.value - end) < max(4 * e.stderr, 2e-3)


def test_another_valley_is_reached_from_the_one_beside_it():
    from upright.identification.problem.residuals import formulate
    from upright.identification.search.descent import SearchLog, descend
    from upright.identification.search.strategy import other_moments

    t = np.arange(3001) * 2e-3
    u = np.where((t > 0.2) & (t < 5.0), 0.5, 0.0)[:, None]
    end = 0.9
    x = simulate(PLANT(**TRUTH), {"actuator.end": end}, [0.0] * 4, u, 2e-3, samples=t.size)
    run = Run(label="trip", role="fit", t=t, u=u, y=x[:, ::2, 0], measured=("theta_1", "theta_2"),
              unknown=("input_end",), initial=dict.fromkeys(PLANT.state_names(), 0.0))  # fmt: skip
    parameters = {n: Parameter(name=n, value=v, estimate=n == "c_12", lower=0.0) for n, v in TRUTH.items()}
    problem = formulate(GreyBox(plant=PLANT, parameters=parameters), [run])
    place = next(i for i, u in enumerate(problem.unknowns) if u.name == "input_end")
    start = problem.start
    start[place] = end - SWING
    stuck = descend(problem.normal, start, problem.lower, problem.upper)
    assert abs(stuck.x[place] - end) > 0.5 * SWING  # a descent alone stays in the valley it began in
    found = other_moments(problem, stuck, SearchLog())
    assert abs(found.x[place] - end) < 1e-3
