"""A disk that a hand holds and that creeps all the same: its measured motion is prescribed."""

from __future__ import annotations

import numpy as np
import pytest

from upright.identification import GreyBox, Parameter, Run
from upright.identification.estimate import identify
from upright.physics.oscillators import Torsional2
from upright.simulation import Held, simulate

COUNT = 2 * np.pi / 16000
DISKS = {"J_1": 2e-3, "J_2": 2e-3, "k_12": 0.5, "c_1": 2e-2}


def step(creep: np.ndarray, t: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Motion of disk 1 in whole counts while disk 2 follows `creep`."""
    x = simulate(
        Torsional2(**DISKS), {}, [0.0, 0.0, creep[0], 0.0], u, t[1], samples=t.size, held={"theta_2": Held(q=creep)}
    )
    return np.round(x[:, [0], 0] / COUNT) * COUNT


def test_a_hand_that_gives_way_quickly_hides_neither_stiffness_nor_damping():
    t = np.arange(5000) * 1e-3
    u = np.where(t < 0.5, 0.0, 0.2)[:, None]
    # a slow drift and a quick answer to the step: 40 and 60 counts, far shorter than the 4.5 s that volts are on
    ring = np.exp(-4 * (t - 0.5)) * np.sin(2 * np.pi * 4.0 * (t - 0.5))
    creep = COUNT * (8 * t + 60 * np.where(t < 0.5, 0.0, ring))
    run = Run(
        label="held", role="fit", t=t, u=u, y=step(creep, t, u), measured=("theta_1",), resolution=(COUNT,),
        held={"theta_2": np.round(creep / COUNT) * COUNT},
    )  # fmt: skip
    parameters = {n: Parameter(name=n, value=v) for n, v in DISKS.items()}
    parameters |= {n: Parameter(name=n, value=0.7 * DISKS[n], estimate=True) for n in ("k_12", "c_1", "J_1")}
    fit = identify(GreyBox(plant=Torsional2, parameters=parameters), [run])
    for name in ("k_12", "c_1", "J_1"):
        e = fit.estimates[name]
        assert abs(e.value - DISKS[name]) < 4 * e.stderr + 1e-3 * DISKS[name], name
    # rounding of disk 1 limits the score, 100 (1 - count/sqrt(12) / spread); as much again for that of disk 2
    limit = 200 * COUNT / np.sqrt(12) / float(np.std(run.y))
    assert fit.runs["held"].fit_percent["theta_1"] > 100 - limit


@pytest.mark.parametrize("level", [0.0, 0.3])
def test_a_disk_that_does_not_move_may_be_given_as_measured(level):
    t = np.arange(2000) * 1e-3
    u = np.where(t < 0.2, 0.0, 0.2)[:, None]
    run = Run(
        label="still", role="fit", t=t, u=u, y=step(np.full(t.size, level), t, u), measured=("theta_1",),
        resolution=(COUNT,), held={"theta_2": np.full(t.size, level)},
    )  # fmt: skip
    parameters = {n: Parameter(name=n, value=v) for n, v in DISKS.items()}
    parameters["k_12"] = Parameter(name="k_12", value=0.35, estimate=True)
    fit = identify(GreyBox(plant=Torsional2, parameters=parameters), [run])
    assert fit.estimates["k_12"].value == pytest.approx(0.5, rel=1e-3)
