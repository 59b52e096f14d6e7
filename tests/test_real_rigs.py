"""Do the studies of real rigs explain what was measured, and predict what was not shown to the fit?

The figures asked for were reached by throw-away fits of the same logs; the logs themselves are the judges.
"""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from benchmarks.asked import ASKED, studies
from upright.identification.crossval import cross_validate
from upright.identification.estimate import identify
from upright.identification.study import load_study

STUDIES = Path(__file__).parents[1] / "examples" / "studies"
DATA = os.environ.get("UPRIGHT_REAL_DATA", "")

pytestmark = [
    pytest.mark.real_data,
    pytest.mark.slow,
]


@pytest.mark.parametrize("name", studies())
def test_a_real_rig_is_explained_and_predicted(name):
    study = load_study(STUDIES / f"{name}.toml", data=DATA)
    fit = identify(study.rig, study.runs)
    asked = [a for a in ASKED if a.study == name]
    left_out = {}
    if any(a.how == "left out" for a in asked):
        left_out = cross_validate(fit, study.runs).predicted
    reached = {a: a.reached(left_out if a.how == "left out" else fit.runs) for a in asked}
    assert {a: values for a, values in reached.items() if not a.met(values)} == {}
    assert fit.trusted, fit.verdict
