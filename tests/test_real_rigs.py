"""Do the studies of real rigs explain what was measured, and predict what was not shown to the fit?

The figures asked for were reached by throw-away fits of the same logs; the logs themselves are the judges.
"""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from benchmarks.asked import ASKED, HELD_OUT
from upright.identification.estimate import identify
from upright.identification.study import load_study

STUDIES = Path(__file__).parents[1] / "examples" / "studies"
DATA = os.environ.get("UPRIGHT_REAL_DATA", "")

pytestmark = [
    pytest.mark.real_data,
    pytest.mark.slow,
]


@pytest.mark.parametrize("name", ASKED)
def test_a_real_rig_is_explained(name):
    study = load_study(STUDIES / f"{name}.toml", data=DATA)
    fit = identify(study.rig, study.runs)
    reached = {(label, s): v for label, score in fit.runs.items() for s, v in score.fit_percent.items()}
    assert {key: value for key, value in reached.items() if value < ASKED[name].get(key, 0.0)} == {}
    assert set(ASKED[name]) <= set(reached)
    assert fit.trusted, fit.verdict


@pytest.mark.parametrize(("name", "left_out"), HELD_OUT)
def test_a_real_run_is_predicted_from_the_others(name, left_out):
    study = load_study(STUDIES / f"{name}.toml", data=DATA).hold_out(left_out)
    fit = identify(study.rig, study.runs)
    score = fit.runs[left_out]
    assert score.role == "predict"
    assert {s: v for s, v in score.fit_percent.items() if v < HELD_OUT[name, left_out][s]} == {}
