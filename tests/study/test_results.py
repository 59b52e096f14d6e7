"""Does fit.json hold what a fit says, as plain values? Of a fit made by hand."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from upright.identification import GreyBox, Parameter
from upright.identification.ladder.cross_validation import CrossValidation
from upright.identification.model.bands import Bands
from upright.identification.model.fit import Assumption, Estimate, Fit, RunScore
from upright.physics import Pendulum
from upright.rig.hardware import Entry, Hardware
from upright.study.load import Study
from upright.study.results import fit_content

NOTHING = np.zeros((0, 1))
NUMBERS = {
    "m_p": Parameter(name="m_p", value=0.2, unit="kg", meaning="mass", uncertainty=0.01),
    "l_cg": Parameter(name="l_cg", value=0.3, unit="m", assumed=True),
    "J_p": Parameter(name="J_p", value=1e-3, unit="kg m^2", estimate=True),
    "actuator.gain": Parameter(name="actuator.gain", value=1.0, unit="N m/V", estimate=True),
}
FOUND = {
    "J_p": Estimate(value=2e-3, stderr=1e-4, interval=(1.8e-3, 2.2e-3), unit="kg m^2", rests_on=("l_cg",)),
    "actuator.gain": Estimate(value=0.4, stderr=0.01, interval=(0.38, 0.42), unit="N m/V"),
}
LENGTH = Assumption(name="l_cg", value=0.3, unit="m", size=0.3, follows={"J_p": 1.23456789, "actuator.gain": 1e-9},
                    without={}, range=(0.1, 0.9))  # fmt: skip


def score(role: str, percent: float, **more) -> RunScore:
    return RunScore(role=role, fit_percent={"theta": percent}, horizon=None, t=np.zeros(0), y=NOTHING,
                    simulated=NOTHING, measured=("theta",), **more)  # fmt: skip


FIT = Fit(
    model=GreyBox(plant=Pendulum, parameters=NUMBERS, substeps=3), estimates=FOUND, per_run={}, verdict="So.",
    trusted=True, method="least-squares", evaluations=17, seconds=1.23456789, cost=0.5, assumptions=(LENGTH,),
    names=("J_p", "actuator.gain"), correlation=np.array([[1.0, 0.3], [0.3, 1.0]]),
    history=(("start", 9.0, 1), ("end", 0.5, 17)),
    runs={"a": score("fit", 99.0), "b": score(
        "predict", 91.0, ahead={0.1: {"theta": 95.0}, 0.2: {"theta": 90.0}}, ceiling={0.2: {"theta": 97.0}},
    )},
)  # fmt: skip
HARDWARE = Hardware(entries={
    "gain": Entry(value=1.0, unit="N m/V", source="known"), "limit": Entry(value=10.0, unit="V", source="known")
})  # fmt: skip
STUDY = Study(path=Path("here/swing.toml"), plant="pendulum", model=FIT.model, runs=(), title="A swing", source="us",
              sha256="0a", hardware=HARDWARE)  # fmt: skip


def test_a_known_number_has_the_interval_of_its_uncertainty_and_an_assumed_one_its_range():
    """95 % of a normal distribution lie within 1.96 standard deviations."""
    told = fit_content(FIT, STUDY)["parameters"]
    mass, length, inertia = (told[n] for n in ("m_p", "l_cg", "J_p"))
    assert mass["interval"] == pytest.approx([0.2 - 0.0196, 0.2 + 0.0196])
    assert (mass["status"], mass["stderr"], mass["meaning"]) == ("known", 0.01, "mass")
    assert (length["status"], length["interval"]) == ("assumed", [0.1, 0.9])
    assert (inertia["value"], inertia["interval"], inertia["rests_on"]) == (2e-3, [1.8e-3, 2.2e-3], ["l_cg"])
    assert list(told) == list(NUMBERS)


def test_what_rests_on_an_assumed_number_is_told_with_the_power_it_follows_by():
    (told,) = fit_content(FIT, STUDY)["assumed"]
    assert (told["name"], told["value"], told["range"]) == ("l_cg", 0.3, [0.1, 0.9])
    assert told["percent_per_percent"] == {"J_p": 1.234568, "actuator.gain": 0.0}
    assert told["rests"] == ["J_p"]


def test_the_drive_stands_there_as_it_was_estimated_and_the_rest_as_it_was_described():
    entries = fit_content(FIT, STUDY)["rig"]["entries"]
    assert {name: entry["value"] for name, entry in entries.items()} == {"gain": 0.4, "limit": 10.0}


def test_runs_stand_with_their_scores_at_every_horizon_and_what_the_start_state_allows():
    told = fit_content(FIT, STUDY)
    assert told["runs"]["a"]["fit_percent"] == {"theta": 99.0}
    assert told["runs"]["a"]["ahead"] == []
    assert told["runs"]["b"]["ahead"] == [
        {"horizon": 0.1, "fit_percent": {"theta": 95.0}, "ceiling": {}},
        {"horizon": 0.2, "fit_percent": {"theta": 90.0}, "ceiling": {"theta": 97.0}},
    ]
    assert told["history"] == [
        {"stage": "start", "cost": 9.0, "evaluations": 1}, {"stage": "end", "cost": 0.5, "evaluations": 17}
    ]  # fmt: skip
    assert (told["estimated"], told["correlation"]) == (["J_p", "actuator.gain"], [[1.0, 0.3], [0.3, 1.0]])
    assert (told["seconds"], told["substeps"], told["bands"]) == (1.2346, 3, None)
    assert told["provenance"]["study"] == "swing.toml"
    assert (told["provenance"]["study_sha256"], told["provenance"]["source"]) == ("0a", "us")
    assert "cross_validation" not in told


def test_predictions_from_fits_of_the_others_bring_their_own_bands():
    bands = Bands(quantile=1.6, spreads={}, names=("J_p",), covariance=np.eye(1), logs=())
    crossed = CrossValidation(
        fitted=FIT.runs, predicted={"a": score("predict", 80.0)}, values={}, blind={"a": ("gain",)}, bands=bands
    )
    told = fit_content(FIT, STUDY, crossed)
    assert told["cross_validation"] == {"a": {"fit_percent": {"theta": 80.0}, "blind": ["gain"]}}
    assert told["bands"]["quantile"] == 1.6
