"""Do the studies of real rigs explain what was measured, and predict what was not shown to the fit?

The figures asked for were reached by throw-away fits of the same logs; the logs themselves are the judges.
"""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from upright.identification.estimate import identify
from upright.identification.study import load_study

STUDIES = Path(__file__).parents[1] / "examples" / "studies"
DATA = os.environ.get("UPRIGHT_REAL_DATA", "")

pytestmark = [
    pytest.mark.real_data,
    pytest.mark.slow,
    pytest.mark.skipif(not DATA, reason="UPRIGHT_REAL_DATA names no folder of real logs"),
]

ASKED = {
    "aau_pendulum": {("whole fall", "theta"): 99.3},
    "aau_pendulum_tail": {("tail, restarted", "theta"): 97.0},
    "uw_pendulum": {("55 s", "theta"): 98.5},
    "uw_pendulum_tail": {("tail", "theta"): 90.0},
    "furuta_fall": {("fall", "theta"): 98.0},
    "furuta_sines": {
        ("sine 2 V", "psi"): 96.0,
        ("sine 2 V", "theta"): 92.0,
        ("sine 4 V", "psi"): 96.0,
        ("sine 4 V", "theta"): 92.0,
        ("constant 2 V", "psi"): 97.0,
        ("constant 2 V", "theta"): 85.0,
        ("constant 4 V", "psi"): 97.0,
        ("constant 4 V", "theta"): 85.0,
    },
    "kawata_crane": {
        **{(f"kP {k}", "x"): 98.5 for k in ("2.5", "5", "10")},
        **{(f"kP {k}", "theta"): 96.0 for k in ("2.5", "5", "10")},
        ("decay", "theta"): 98.0,
    },
}


@pytest.mark.parametrize("name", ASKED)
def test_a_real_rig_is_explained(name):
    study = load_study(STUDIES / f"{name}.toml", data=DATA)
    fit = identify(study.rig, study.runs)
    reached = {(label, s): v for label, score in fit.runs.items() for s, v in score.fit_percent.items()}
    assert {key: value for key, value in reached.items() if value < ASKED[name].get(key, 0.0)} == {}
    assert set(ASKED[name]) <= set(reached)
    assert fit.trusted, fit.verdict


@pytest.mark.parametrize("left_out", ["kP 2.5", "kP 5", "kP 10"])
def test_any_crane_run_is_predicted_from_the_others(left_out):
    study = load_study(STUDIES / "kawata_crane.toml", data=DATA).hold_out(left_out)
    fit = identify(study.rig, study.runs)
    score = fit.runs[left_out]
    assert score.role == "predict"
    assert score.fit_percent["x"] >= 97.0
    assert score.fit_percent["theta"] >= 93.0
