"""Is a drive that its owner names, in a column that looks like no drive, one for the draft as well?"""

from __future__ import annotations

import tomllib

import numpy as np
import pandas as pd
import pytest

import upright as up
from upright.simulation import simulate
from upright.study.draft.from_record import study_of_record
from upright.verbs.values import open_log

TRUTH = {"m_p": 0.2235, "l_cg": 0.2, "J_p": 0.0, "b_2": 1e-3, "b_2c": 8e-4}
SECONDS = 23.4


def driven(dt: float, noise: float, seed: int = 3) -> pd.DataFrame:
    """A pendulum let go at 0.4 rad, pushed by two sines of torque after a second until 20 s."""
    t = np.arange(round(SECONDS / dt)) * dt
    torque = 0.04 * (np.sin(2 * np.pi * t / 3.1) + 0.7 * np.sin(2 * np.pi * 0.9 * t + 1)) * (t > 1) * (t < 20)
    x = simulate(up.Pendulum(**TRUTH), {}, [0.4, 0.0], torque[:, None], dt, samples=t.size, substeps=4)
    return pd.DataFrame({"t": t, "angle": x[:, 0, 0] + noise * np.random.default_rng(seed).normal(size=t.size),
                         "shaft": torque})  # fmt: skip


NAMED = {"theta": "angle", "T": "shaft"}


@pytest.mark.parametrize("dt", [5e-3, 2e-2, 5e-2])
@pytest.mark.parametrize("noise", [0.0, 5e-3, 2e-2])
def test_a_driven_record_is_fitted_whole(noise, dt):
    study = study_of_record(open_log(driven(dt, noise))[0], up.Pendulum, columns=NAMED, units={"angle": "rad"})
    (run,) = study.runs
    assert run.t.size >= 0.99 * round(SECONDS / dt)  # it moves from the first sample on, and still at the end
    assert run.u.any()


def test_init_takes_a_column_with_the_name_of_the_torque_for_the_drive(tmp_path):
    """As a twin's own table is saved; without its drive the log would be cut to the swing after the last push."""
    log = tmp_path / "log.csv"
    driven(2e-2, 1e-3).rename(columns={"angle": "theta", "shaft": "T"}).to_csv(log, index=False)
    study = tomllib.loads(up.init(log, plant="pendulum", out=tmp_path / "study.toml").value)
    assert study["drive"]["column"] == "T"
    (run,) = study["runs"]
    assert run["window"][1] - run["window"][0] >= 0.99 * SECONDS - 1


def test_a_torque_that_is_named_weighs_the_pendulum_and_predicts_it():
    log = driven(2e-2, 1e-3)
    fit = up.identify(log, up.Pendulum, columns=NAMED, units={"angle": "rad"}, known={"J_p": 0.0})
    for name in ("m_p", "l_cg", "b_2", "b_2c"):
        low, high = fit.fit.estimates[name].interval
        assert low <= TRUTH[name] <= high
    # what is left is noise: 1 mrad of what the angle varies by
    best = 100 * (1 - 1e-3 / float(log["angle"].std()))
    (score,) = fit.predict(driven(2e-2, 1e-3, seed=4), columns=NAMED, units={"angle": "rad"}).value.runs.values()
    assert score.fit_percent["theta"] > best - 0.5


def test_a_command_in_volts_leaves_the_mass_to_be_measured():
    fit = up.identify(driven(2e-2, 1e-3), up.Pendulum, columns=NAMED, units={"angle": "rad", "shaft": "V"})
    assert fit.fit.estimates["actuator.gain"].rests_on == ("m_p", "J_p")
    # 1 N m/V of the twin per its mass of 0.2235 kg: the draft assumes 1 kg
    assert fit.fit.estimates["actuator.gain"].value == pytest.approx(1 / TRUTH["m_p"], rel=0.01)
