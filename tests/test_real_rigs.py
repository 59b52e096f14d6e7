"""Do the studies of real rigs explain what was measured, and predict what was not shown to the fit?

The figures asked for were reached by throw-away fits of the same logs; the logs themselves are the judges.
"""

from __future__ import annotations

import math
import os
import re
from pathlib import Path

import pytest

from benchmarks.asked import ASKED, studies
from upright.identification.estimate import identify
from upright.identification.ladder.cross_validation import cross_validate
from upright.study.load import load_study

STUDIES = Path(__file__).parents[1] / "examples" / "studies"
MODES = {"ecp205_spinup": 3.55}
"""Flexible modes [Hz] as others found them in the same logs, to 2 %."""

STAIRCASES = ("ecp210_closed_loop",)
"""Carts that climb in stairs, whose cost is a staircase too: the search ends in one of several valleys, which one hangs
on the processor, and the verdict has to say that others explain the log alike."""

UPRIGHT = ("qube_balance",)
VAGUE = {"furuta_sines": "J_d"}

DATA = os.environ.get("UPRIGHT_REAL_DATA", "")

pytestmark = [
    pytest.mark.real_data,
    pytest.mark.slow,
]


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=pytest.mark.thorough) if n == "ecp205_spinup" else n for n in studies()]
)
def test_a_real_rig_is_explained_and_predicted(name):
    study = load_study(STUDIES / f"{name}.toml", data=DATA)
    fit = identify(study.model, study.runs)
    asked = [a for a in ASKED if a.study == name]
    left_out = {}
    if any(a.how == "left out" for a in asked):
        left_out = cross_validate(fit, study.runs).predicted
    # What is known to be missed is published (benchmarks/real.md) and not asserted: where a search of that kind ends
    # hangs on the last digits, and those on the processor.
    claimed = {a: a.reached(left_out if a.how == "left out" else fit.runs) for a in asked if not a.missed}
    assert {a: values for a, values in claimed.items() if not a.met(values)} == {}
    if name in UPRIGHT:  # at 200 ms, 2.8 time constants of its fall, 2048 counts a turn leave half of theta unknown
        for score in fit.runs.values():
            assert score.horizon is not None
            assert 0.05 < score.horizon < 0.2
            assert score.ceiling[0.2]["theta"] < 80 < score.fit_percent["theta"]
    if name in VAGUE:  # its arm is light beside the pendulum: J_d may be anything below 3e-4 kg m^2
        assert not fit.trusted
        assert any(f"{VAGUE[name]} lies anywhere" in reason for reason in fit.answers[1].reasons)
    elif name in STAIRCASES:
        assert "answers explain the log alike: " in fit.verdict
    else:
        assert fit.trusted, fit.verdict
    if name in MODES:
        ((at, mode),) = [(at, p) for at, poles in fit.poles.items() for p in poles if p.imag.value > 0]
        low, high = (end / (2 * math.pi) for end in mode.imag.interval)
        assert 0.98 * MODES[name] < low < MODES[name] < high < 1.02 * MODES[name], at


def test_a_run_that_excites_itself_is_named_and_left_out(tmp_path):
    """Its authors' cart swings ever wider while the volts are on, from 5 to 10 s of the log, and dies down after."""
    text = (STUDIES / "ecp210_cart_1.toml").read_text(encoding="utf-8")
    asked = load_study(STUDIES / "ecp210_cart_1.toml", data=DATA)
    strange = Path(DATA) / "ecp210_rectilinear_ucsd_1khz" / "07-Feb-2025 09_26_10.txt"
    more = f'{text}\n[[runs]]\nlabel = "9:26"\nfile = "{strange.as_posix()}"\n'
    (tmp_path / "more.toml").write_text(more, encoding="utf-8")
    study = load_study(tmp_path / "more.toml", data=DATA)
    fit, clean = identify(study.model, study.runs), identify(asked.model, asked.runs)
    (told,) = [w for w in fit.warnings if w.startswith("Outlier")]
    begins = re.match(r"Outlier: 9:26, ([\d.]+) to 10 s: self-excited", told)
    assert begins is not None
    assert float(begins[1]) == pytest.approx(5.0, abs=0.1)
    assert not any(w.startswith("Outlier") for w in clean.warnings)
    assert fit.runs["9:26"].role == "predict"
    for name, e in clean.estimates.items():
        if e.status == "well determined":
            assert e.interval[0] <= fit.estimates[name].value <= e.interval[1], name
