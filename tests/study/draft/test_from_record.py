"""What an owner knows and asks takes the place of what a draft guesses, and guesses are of the right size."""

from __future__ import annotations

import pytest

from tests.identification.twins import PENDULUM, swing
from upright.errors import BadInput
from upright.physics import Pendulum
from upright.records import Provenance, Record
from upright.study.draft.from_record import study_of_record


def swung() -> Record:
    run = swing(PENDULUM, seconds=6.0)
    return Record(
        t=run.t, signals={"theta": run.y[:, 0]}, units={"theta": "rad"},
        provenance=Provenance(file="log.csv", reader="table"),
    )  # fmt: skip


def test_an_inertia_without_a_guess_begins_at_a_tenth_of_that_of_its_mass() -> None:
    study = study_of_record(swung(), Pendulum, known={"m_p": 0.2, "l_cg": 0.3}, ask=["J_p", "b_2"])
    assert study.model.estimated == ("J_p", "b_2")
    assert study.model.parameters["J_p"].value == pytest.approx(0.1 * 0.2 * 0.3**2)


def test_numbers_may_wear_their_unit_and_their_uncertainty() -> None:
    known = {"m_p": "223.5 g +- 1 g", "l_cg": 0.3}
    study = study_of_record(swung(), Pendulum, known=known, ask={"J_p": "12 kg cm^2"})
    mass, inertia = study.model.parameters["m_p"], study.model.parameters["J_p"]
    assert (mass.value, mass.uncertainty, mass.estimate) == (pytest.approx(0.2235), pytest.approx(1e-3), False)
    assert (inertia.value, inertia.estimate) == (pytest.approx(12e-4), True)
    # what was neither known nor asked does nothing
    assert study.model.estimated == ("J_p",)
    assert study.model.parameters["b_2"].value == 0.0


def test_what_is_asked_and_known_at_once_is_a_sentence() -> None:
    with pytest.raises(BadInput, match="'m_p' cannot be known and asked at once"):
        study_of_record(swung(), Pendulum, known={"m_p": 0.2, "l_cg": 0.3}, ask=["m_p"])


def test_a_window_is_the_only_run_and_is_fitted() -> None:
    study = study_of_record(swung(), Pendulum, known={"m_p": 0.2, "l_cg": 0.3}, ask=["J_p"], window=(1.0, 3.0))
    (run,) = study.runs
    assert run.role == "fit"
    assert run.t[-1] - run.t[0] == pytest.approx(2.0, abs=0.011)
