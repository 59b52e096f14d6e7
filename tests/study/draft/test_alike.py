"""Which other plants could a log be of, and when is one of them said to explain it far better?"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from tests.study.draft.test_recognise import OTHER, SWING, T, log
from tests.study.draft.test_tables import shown
from upright.identification.model.grey_box import GreyBox, Parameter
from upright.identification.search.starts import Sample
from upright.physics import find
from upright.readers import inspect
from upright.study.draft import draft as module
from upright.study.draft.compare import sprung
from upright.study.draft.draft import alike, window_of
from upright.study.draft.plausible import implausible
from upright.study.draft.suits import plants_that_suit
from upright.study.draft.tables import run_tables

RECORD = log(phi=SWING, alpha=OTHER)
SEEN = inspect(RECORD)
COLUMNS = {"psi": SEEN.columns[0], "theta": SEEN.columns[1]}


@pytest.fixture
def told(monkeypatch):
    """What is taken instead of a Furuta pendulum of two angles, and said, when the accelerations are explained so."""

    def sentence(
        shares: dict[str, float], columns=COLUMNS, plant: str = "furuta",
        suits=("furuta", "torsional-2", "double-pendulum"), **more,
    ) -> tuple[str, list[str]]:  # fmt: skip
        monkeypatch.setattr(module, "explained", lambda *_: dict(sorted(shares.items(), key=lambda item: -item[1])))
        monkeypatch.setattr(module, "draft", lambda *_, **__: "")
        monkeypatch.setattr(module, "plants_that_suit", lambda *_: suits)
        return alike(RECORD, SEEN, shown(plant, columns, **more))

    return sentence


@pytest.mark.parametrize(
    ("own", "best", "better"),
    [
        (0.89, 0.946, True), (0.89, 0.944, False),  # leaves less than half of the 11 % that are left
        (0.91, 0.99, False),  # hardly anything is left to explain
        (0.5, 0.76, True), (0.5, 0.74, False), (0.99, 0.5, False),
    ],
)  # fmt: skip
def test_a_plant_that_leaves_half_of_more_than_a_tenth_is_taken_instead(told, own, best, better):
    instead, (said,) = told({"furuta": own, "torsional-2": best})
    theirs, ours = f"torsional-2 {100 * best:.0f} %", f"furuta {100 * own:.0f} %"
    assert instead == ("torsional-2" if better else "")
    assert said == (
        f"Taken for torsional-2. It explains {100 * best:.0f} % of the accelerations, {ours}, double-pendulum was not "
        "tried; choose with --plant."
        if better
        else f"Taken for furuta by its columns. It explains {100 * own:.0f} % of the accelerations, {theirs}, "
        "double-pendulum was not tried; choose with --plant."
    )


def test_columns_called_as_the_coordinates_are_believed_and_the_better_plant_is_named(told):
    named = {name: replace(c, name=f"{name} [rad]") for name, c in COLUMNS.items()}
    instead, (said,) = told({"furuta": 0.3, "torsional-2": 0.97}, named)
    assert instead == ""
    assert said.startswith("Taken for furuta by its columns. It explains 30 % of the accelerations, torsional-2 97 %,")
    assert said.endswith("--plant torsional-2 drafts what explains them far better.")


def test_a_plant_that_its_columns_could_only_be_of_is_not_compared(told):
    assert told({"furuta": 0.9}, suits=("furuta",)) == ("", [])
    counted = {name: replace(c, guess="counts") for name, c in COLUMNS.items()}
    assert told({"furuta": 0.9}, counted, suits=("furuta",)) == ("", [])


def test_where_nothing_can_be_explained_the_columns_are_all_there_is(told):
    by_columns = ["Taken for furuta; the columns also suit torsional-2 or double-pendulum; choose with --plant."]
    assert told({}) == ("", by_columns)
    assert told({"torsional-2": 0.9}) == ("", by_columns)
    counted = {name: replace(c, guess="counts") for name, c in COLUMNS.items()}
    assert told({"furuta": 0.9, "torsional-2": 0.95}, counted) == ("", by_columns)
    assert told({"furuta": 0.9}, counted, plant="rectilinear-2") == ("", [])  # carts from disks they never tell
    _, (only,) = told({}, doubts=("torsional-2 looks the same",))
    assert only == "Taken for furuta; the columns also suit double-pendulum; choose with --plant."
    assert told({}, doubts=("torsional-2 or double-pendulum",)) == ("", [])


def test_plants_that_suit_have_as_many_coordinates_of_each_kind():
    for signals, likely, others in (
        ({"phi": SWING}, "pendulum", ("torsional-1",)),
        ({"phi": SWING, "alpha": OTHER}, "furuta", ("torsional-2", "double-pendulum")),
        ({"x": SWING, "theta": OTHER}, "cart-pendulum", ()),
        ({"x": SWING}, "rectilinear-1", ()),
        ({"enc1": np.round(900 * SWING)}, "rectilinear-1", ("pendulum", "torsional-1")),
    ):
        record = log(**signals)
        first, *found = plants_that_suit(record, inspect(record))
        assert first == likely
        assert set(others) <= set(found)
        for name in found:
            units = [c.unit for c in find(name).coordinates]
            assert len(units) == len(signals)
            if "theta" in signals:
                assert sorted(units) == ["m", "rad"]
            if likely in ("pendulum", "furuta"):
                assert set(units) == {"rad"}
    still = log(alpha=0 * T)
    assert plants_that_suit(still, inspect(still)) == ()


@pytest.mark.parametrize(
    ("name", "least", "most"),
    [("m_1", 1e-3, 30.0), ("k_1", 0.1, 1e5)],
)
def test_a_number_is_implausible_outside_what_stands_on_a_bench(name, least, most):
    plant = find("rectilinear-1")
    for value in (least, most, -least, 0.0):
        assert implausible(plant, {name: value}, scaled_by="") == []
    for value in (0.99 * least, 1.01 * most, -1.01 * most):
        (said,) = implausible(plant, {name: value}, scaled_by="")
        assert f"No laboratory rig has {name} = " in said
        assert said.endswith("the unit of a column or of the clock is likely not what it seems.")
    (said,) = implausible(plant, {name: 2 * most}, scaled_by="the assumed 1 N per volt")
    assert "or of the clock, or the assumed 1 N per volt is likely" in said
    assert implausible(plant, {"c_1": 1e9}, scaled_by="") == []


def test_springs_that_a_draft_leaves_out_are_asked_with_the_swing_of_the_log():
    """A spring that swings 2 kg with a period of 0.5 s."""
    plant = find("rectilinear-1")
    numbers = {
        "m_1": Parameter(name="m_1", value=2.0, unit="kg", meaning=""),
        "k_1": Parameter(name="k_1", value=0.0, unit="N/m", meaning=""),
        "c_1": Parameter(name="c_1", value=0.0, unit="N s/m", meaning=""),
    }

    def asked(**changes: Parameter) -> Parameter:
        rig = GreyBox(plant=plant, parameters=numbers | changes)
        empty = np.zeros((1, 3))
        sample = Sample(
            run=None, dt=0.1, q=empty, v=empty, a=empty, u=empty, free=(0,), fades=np.zeros(1), width=5, edge=2,
            period=0.5,
        )  # fmt: skip
        found = sprung(rig, sample).parameters
        assert found["m_1"] == rig.parameters["m_1"]
        assert not found["c_1"].estimate
        return found["k_1"]

    k = asked()
    assert (k.value, k.estimate, k.lower) == (pytest.approx(2 * (4 * math.pi) ** 2), True, 0.0)
    known = replace(numbers["k_1"], value=3.0)
    assert asked(k_1=known) == known
    guessed = replace(numbers["k_1"], estimate=True)
    assert asked(k_1=guessed) == guessed
    assert asked(m_1=replace(numbers["m_1"], value=0.0)) == numbers["k_1"]


def test_a_draft_says_how_much_of_the_log_it_fits():
    tables = run_tables("a.csv", [("a", 1.0, 3.0, "fit"), ("b", 3.0, 4.0, "predict")])
    assert window_of(tables, log(x=np.arange(1001))) == "Fits 1 to 3 s and predicts 3 to 4 s, 30 % of the record."
