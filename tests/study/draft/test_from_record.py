"""What an owner knows and asks takes the place of what a draft guesses, and guesses are of the right size."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from tests.identification.twins import PENDULUM, swing
from upright.errors import BadInput
from upright.identification import identify
from upright.physics import CartPendulum, Furuta, Pendulum
from upright.records import Provenance, Record
from upright.rig import Rig
from upright.rig.hardware import Entry
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


def test_a_known_centre_of_gravity_leaves_the_inertia_to_be_estimated() -> None:
    """Unless somebody says what to ask, or knows it: without a length a draft takes a simple pendulum."""
    study = study_of_record(swung(), Pendulum, known={"m_p": PENDULUM["m_p"], "l_cg": PENDULUM["l_cg"]})
    assert study.model.parameters["J_p"].estimate
    fit = identify(study.model, study.runs)
    assert fit.estimates["J_p"].value == pytest.approx(PENDULUM["J_p"], rel=1e-4)  # a swing without noise
    assert study_of_record(swung(), Pendulum, known={"m_p": 0.2}).model.parameters["J_p"].assumed
    known = {"m_p": 0.2, "l_cg": 0.3, "J_p": 1e-3}
    assert not study_of_record(swung(), Pendulum, known=known).model.parameters["J_p"].estimate


def test_what_is_asked_and_known_at_once_is_a_sentence() -> None:
    with pytest.raises(BadInput, match="'m_p' cannot be known and estimated at once"):
        study_of_record(swung(), Pendulum, known={"m_p": 0.2, "l_cg": 0.3}, ask=["m_p"])


def test_a_window_is_the_only_run_and_is_fitted() -> None:
    study = study_of_record(swung(), Pendulum, known={"m_p": 0.2, "l_cg": 0.3}, ask=["J_p"], window=(1.0, 3.0))
    (run,) = study.runs
    assert run.role == "fit"
    assert run.t[-1] - run.t[0] == pytest.approx(2.0, abs=0.011)


T = np.arange(800) * 0.01
SWING = 0.4 * np.exp(-0.1 * T) * np.cos(6 * T)
PLAIN = Record(t=T, signals={"theta": SWING}, units={"theta": "rad"}, provenance=Provenance(file="runs/swing 3.csv"))
KNOWN = {"m_p": 0.2, "l_cg": 0.3}


def test_a_placeholder_is_the_first_guess_of_what_is_asked_beyond_the_draft() -> None:
    study = study_of_record(PLAIN, Pendulum, known={"l_cg": 0.3}, ask=["m_p"])
    assert study.model.estimated == ("m_p",)
    assert study.model.parameters["m_p"].value == 1.0
    assert (study.title, study.plant) == ("swing 3", "pendulum")
    assert study_of_record(PLAIN.replace(provenance=Provenance()), Pendulum, known=KNOWN).title == "log"


def test_what_the_draft_asks_is_asked_where_nobody_says_otherwise() -> None:
    study = study_of_record(PLAIN, Pendulum, known={"b_2": 1e-3})
    assert "l_cg" in study.model.estimated
    assert "b_2" not in study.model.estimated
    assert study.model.parameters["b_2"].value == 1e-3
    assert study.model.parameters["l_cg"].value == pytest.approx(9.81 / 36, rel=0.02)
    given = study_of_record(PLAIN, Pendulum, known=KNOWN, ask={"b_2": "3e-3 N m s/rad"})
    assert given.model.estimated == ("b_2",)
    assert given.model.parameters["b_2"].value == 3e-3
    assert study_of_record(PLAIN, Pendulum, known=KNOWN, ask=["b_2"]).model.parameters["b_2"].value > 0


@pytest.mark.parametrize(
    ("how", "sentence"),
    [
        ({"known": {"zeta": 1}}, "Pendulum has no number 'zeta'"),
        ({"known": KNOWN, "ask": ["zeta"]}, "Pendulum has no number 'zeta'"),
        ({"known": {"m_p": 1}, "ask": ["b_2"]}, 'needs l_cg, neither known nor estimated; measure and pass'),
        ({"known": KNOWN, "ask": ["b_2s"]}, 'b_2s is to be estimated and no guess of it can be read'),
        ({"known": KNOWN, "ask": ["actuator.delay"]}, "actuator.delay is to be estimated and no guess"),
        ({"columns": {"theta": "angle"}}, "no column 'angle'"),
        ({"units": {"phi": "rad"}}, "units names columns, got 'phi'"),
    ],
)  # fmt: skip
def test_what_fits_neither_plant_nor_record_is_a_sentence(how, sentence) -> None:
    with pytest.raises(BadInput) as caught:
        study_of_record(PLAIN, Pendulum, **how)
    assert sentence in str(caught.value)


def test_columns_and_units_may_be_said() -> None:
    record = Record(t=T, signals={"a": np.degrees(SWING)}, outputs=("a",))
    for units in ({"theta": "deg"}, {"a": "deg"}):
        study = study_of_record(record, Pendulum, known=KNOWN, columns={"theta": "a"}, units=units)
        y = study.runs[0].y[:, 0]
        inside = np.interp(study.runs[0].t, T, SWING)
        assert np.ptp(y - inside) < 1e-6  # but for where its zero was read


def test_of_two_joints_one_lends_the_other_its_friction() -> None:
    """A driven arm is asked for b_1; an undriven one is not, and the pendulum's friction is of its size."""
    arm = 0.1 * np.sin(3 * T) * np.exp(-0.2 * T)
    record = Record(t=T, signals={"psi": arm, "theta": SWING}, units={"psi": "rad", "theta": "rad"})
    known = {"m_p": 0.1, "l_cg": 0.25, "r": 0.1, "J_d": 1e-3, "b_2": 7e-4}
    study = study_of_record(record, Furuta, known=known, ask=["b_1"])
    assert study.model.parameters["b_1"].value == 7e-4


class Own(Pendulum):
    """A plant that no draft knows."""


def test_a_plant_of_ones_own_takes_columns_of_its_coordinates_names() -> None:
    study = study_of_record(PLAIN, Own, known=KNOWN, ask={"b_2": 1e-3})
    assert study.model.estimated == ("b_2",)
    np.testing.assert_allclose(study.runs[0].y[:, 0], SWING)
    assert study.runs[0].unknown == ("initial",)
    bare = Record(t=T, signals={"theta": SWING})
    np.testing.assert_allclose(study_of_record(bare, Own, known=KNOWN).runs[0].y[:, 0], SWING)
    with pytest.raises(
        BadInput, match=r'Own moves in theta, .* columns phi; say which is which: columns=\{"theta": "phi"\}'
    ):
        study_of_record(Record(t=T, signals={"phi": SWING}), Own, known=KNOWN)


@pytest.mark.parametrize("gain", [1.0, 2.5])
def test_a_study_of_a_known_rig_has_its_gain_whatever_that_is(gain: float) -> None:
    """A gain of 1 N/V is one, and no matter of course: only forces themselves need none."""
    t = 0.01 * np.arange(800)
    record = Record(
        t=t, signals={"x": 0.1 * np.sin(3 * t), "theta": 0.2 * np.cos(5 * t), "u": np.sign(np.sin(2 * t))},
        units={"x": "m", "theta": "rad", "u": "V"}, provenance=Provenance(file="log.csv", reader="table"),
    )  # fmt: skip
    plant = CartPendulum(m_c=0.5, m_p=0.1, l_cg=0.2, J_p=1e-3)
    rig = Rig.known(plant, gain=f"{gain} N/V", limit="10 V", period="10 ms", counts=4096)
    study = study_of_record(record, rig, columns={"drive": "u"})
    assert study.model.parameters["actuator.gain"].value == gain
    assert study.rig.gain == gain


@pytest.mark.parametrize("sign", [1, -1])
def test_a_study_of_a_known_rig_counts_as_its_encoder_does(sign: int) -> None:
    """2000 counts a turn, where a draft would begin with another number; one of its own plant's lengths is known."""
    record = Record(t=T, signals={"theta": np.round(sign * SWING * 2000 / math.tau)}, units={"theta": "counts"})
    known = Rig.known(Pendulum(m_p=0.2, l_cg=0.3, J_p=2e-3), counts=2000)
    entry = Entry(value=float(sign), unit="1", source="known")
    rig = replace(known, hardware=known.hardware.with_entries({"sign.theta": entry}))
    study = study_of_record(record, rig, ask=["b_2"])
    run = study.runs[0]
    y = run.y[:, 0] - np.interp(run.t, T, SWING)
    assert np.ptp(y) < 1.1 * math.tau / 2000
    assert run.resolution == (pytest.approx(math.tau / 2000),)
    assert study.model.parameters["l_cg"].value == 0.3
