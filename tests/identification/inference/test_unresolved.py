"""A presliding length that no encoder can see: plain Coulomb friction, and honest intervals for all else."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.identification.twins import rig, swing
from upright.identification import Run
from upright.identification.estimate import identify
from upright.physics import Pendulum

TRUTH = {"m_p": 0.2, "l_cg": 0.3, "J_p": 2e-3, "b_2": 2e-3, "b_2c": 4e-3}
STEP = 2 * np.pi / 2000


def _counted(angle: float, seed: int, **more: float) -> Run:
    run = swing({**TRUTH, **more}, angle=angle, seconds=8.0, label=f"{angle} rad", resolution=(STEP,))
    dither = np.random.default_rng(seed).uniform(-0.5, 0.5, run.y.shape)
    return replace(run, y=np.round(run.y / STEP + dither) * STEP)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_intervals_hold_the_truth_when_nothing_preslides(seed: int) -> None:
    runs = [_counted(0.8, seed), _counted(1.6, seed + 10)]
    guesses = {"J_p": 3e-3, "b_2": 1e-3, "b_2c": 2e-3, "delta_2": 1e-2}
    fit = identify(rig(Pendulum, TRUTH, guesses), runs, method="least-squares", watch=False)
    for name in guesses:
        e = fit.estimates[name]
        assert e.interval[0] <= TRUTH.get(name, 0.0) <= e.interval[1], name
    assert fit.estimates["delta_2"].status == "left out"
    assert any(w.startswith("delta_2 was left out") and "rounding" in w for w in fit.warnings)
    assert fit.trusted, fit.verdict


def test_a_length_of_many_steps_is_found() -> None:
    length = 10 * STEP
    runs = [_counted(a, seed, delta_2=length) for seed, a in enumerate((0.8, 1.6))]
    guesses = {"J_p": 3e-3, "b_2": 1e-3, "b_2c": 2e-3, "delta_2": 1e-2}
    fit = identify(rig(Pendulum, TRUTH, guesses), runs, method="least-squares", watch=False)
    e = fit.estimates["delta_2"]
    assert e.status in ("well determined", "poorly determined")
    assert e.interval[0] <= length <= e.interval[1]
