"""Does each number of a fit.json arrive under its name, and is what it rests on told in its own order?"""

from __future__ import annotations

import copy
import json
import math
from typing import Any

import numpy as np
import pytest

from tests.study.test_stored_fit import FIT
from upright.basis import NOT_TRUSTED, RESERVED, TRUSTED
from upright.errors import BadInput
from upright.identification.model.fit import Judgement
from upright.study.stored_fit import basis_of, read_fit, stored_fit


def model(**changes: Any):
    return stored_fit(copy.deepcopy(FIT) | changes)


def answer(word: str, headline: str = "So.", **more: Any) -> Judgement:
    return Judgement(question="Does it?", answer=word, headline=headline, reasons=("one.", "two."), **more)


@pytest.mark.parametrize(
    ("words", "trusted", "level", "begins", "holds"),
    [
        (["yes"], True, TRUSTED, "Good.", ""),
        ([], True, TRUSTED, "Good.", ""),
        (["yes", "in part"], True, RESERVED, "The fit has reservations: ", "2."),
        (["not tested", "in part"], True, RESERVED, "The fit has reservations: ", "1."),
        (["in part", "no"], True, RESERVED, "The fit has reservations: ", "2."),
        (["in part", "no", "no"], False, NOT_TRUSTED, "The fit's own verdict: ", "2."),
        (["yes", "in part"], False, NOT_TRUSTED, "The fit's own verdict: Good.", ""),
    ],
)
def test_what_speaks_against_a_fit_is_told_before_what_holds_in_part(words, trusted, level, begins, holds):
    answers = [answer(word, f"{i}.") for i, word in enumerate(words, start=1)]
    found = basis_of("Good.", answers, trusted=trusted)
    assert found.level == level
    assert found.sentence.startswith(begins)
    assert holds in found.sentence
    if holds:
        assert "one." in found.sentence
        assert "two." not in found.sentence


def test_a_fit_without_a_verdict_says_so():
    assert basis_of("", [], trusted=True).sentence == "The fit is trusted."
    assert basis_of("", [], trusted=False).sentence == "The fit's own verdict: do not rely on this model yet."
    without = {k: v for k, v in FIT.items() if k != "trusted"}
    assert stored_fit(without).basis.sentence == "This fit does not say whether it can be trusted."
    assert stored_fit(without).trusted is False
    assert model().basis.level == RESERVED
    assert model(answers=[]).basis.level == TRUSTED


def test_estimates_and_their_covariance_are_in_one_order():
    fitted = model()
    errors = {"J_p": 0.01 * 1.6e-3, "actuator.gain": 0.1}
    names, covariance = fitted.covariance(["actuator.gain", "J_p", "m_p"])
    assert names == ["J_p", "actuator.gain"]
    expected = [[errors["J_p"] ** 2, 0.3 * errors["J_p"] * 0.1], [0.3 * errors["J_p"] * 0.1, 0.01]]
    np.testing.assert_allclose(covariance, expected)
    names, covariance = fitted.covariance(["actuator.gain"])
    assert names == ["actuator.gain"]
    np.testing.assert_allclose(covariance, [[0.01]])
    bare = {k: v for k, v in FIT.items() if k not in ("correlation", "estimated")}
    assert stored_fit(bare).covariance(["J_p"])[0] == []
    without = {k: v for k, v in FIT.items() if k != "correlation"}
    np.testing.assert_array_equal(stored_fit(without).covariance(["J_p"])[1], [[0.0]])


def test_units_groups_and_scores_are_read_under_their_names():
    fitted = model(
        runs={
            "a": {"role": "fit", "fit_percent": {"x": 91.5, "theta": None}},
            "b": {"role": "predict", "fit_percent": {"x": 50.0}},
            "c": {"role": "fit"},
            "d": 3,
        }
    )
    assert fitted.scores == {"a": {"x": 91.5}}
    assert model().scores == {}
    assert fitted.unit("m_p") == "kg"
    assert fitted.unit("nothing") == ""
    assert model(parameters=FIT["parameters"] | {"m_p": 0.2}).unit("m_p") == ""
    assert model(parameters=FIT["parameters"] | {"m_p": 0.2}).values["m_p"] == 0.2
    assert fitted.groups == {"28 Jan": {"friction": 1.2}}
    assert fitted.values["actuator.limit"] == math.inf
    assert (fitted.plant, fitted.substeps, fitted.trusted) == ("cart-pendulum", 2, True)
    assert model(bands=None).bands is None


def test_the_drive_of_an_older_fit_is_told_by_what_differs_from_none():
    entries = model().hardware.entries
    assert set(entries) == {"gain", "delay"}
    plain = model(parameters=FIT["parameters"] | {"actuator.limit": 10.0}).hardware.entries["limit"]
    assert (plain.value, plain.unit, plain.source) == (10.0, "", "known")
    assert (entries["gain"].value, entries["gain"].unit, entries["gain"].source) == (4.0, "N/V", "identified")
    assert entries["delay"].source == "known"
    stated = FIT["parameters"] | {"actuator.delay": {"value": 2e-3, "stderr": 1e-4, "unit": "s"}}
    assert model(parameters=stated).hardware.entries["delay"].source == "measured"


def test_bands_arrive_with_their_spreads_and_what_was_reached():
    bands = model().bands
    assert bands is not None
    assert (bands.level, bands.quantile, bands.names, bands.reached) == (0.9, 1.8, ("J_p",), {"x_dot": 0.4})
    (spread,) = bands.spreads["x"]
    assert (spread.horizon, spread.start, spread.end) == (0.0, 1e-3, 1e-3)
    np.testing.assert_array_equal(bands.covariance, [[1e-9]])


def bands(**changes: Any) -> dict[str, Any]:
    return {"bands": FIT["bands"] | changes}


def spread(**changes: Any) -> dict[str, Any]:
    return bands(spreads={"x": [{"horizon": 0.0, "start": 1.0, "end": 2.0} | changes]})


def entry(name: str, value: Any, **changes: Any) -> dict[str, Any]:
    return {"rig": {"entries": {name: {"value": value, "unit": "", "source": "known"} | changes}}}


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        (bands(level=0), "bands.level must be above 0, got 0"),
        (bands(quantile=-1), "bands.quantile must be above 0, got -1"),
        (bands(covariance=[]), "bands.covariance must have 1 rows of as many numbers"),
        (bands(covariance=[[1.0, 2.0]]), "bands.covariance must have 1 rows"),
        (bands(covariance=[[-1.0]]), "none of its variances may be negative"),
        (spread(start=0.0), "bands.spreads.x must have a horizon of 0 or more and 0 < start <= end"),
        (spread(end=0.9), "0 < start <= end"),
        (spread(horizon=-0.1), "a horizon of 0 or more"),
        ({"substeps": 0}, "substeps must be a whole number from 1 to 100, got 0"),
        ({"substeps": 101}, "from 1 to 100, got 101"),
        ({"substeps": True}, "from 1 to 100, got True"),
        ({"plant": ""}, "plant must be a name"),
        ({"parameters": {}}, "it holds no parameters"),
        ({"estimated": ["zeta"]}, "estimated must list names of the parameters"),
        ({"correlation": 3}, "correlation must be a list of rows"),
        ({"correlation": [[1.0, 1.00001], [1.0, 1.0]]}, "between -1 and 1"),
        (entry("servo_period", 0.0), "rig.entries.servo_period.value must be above 0, got 0"),
        (entry("gain", 5.0), "rig.entries.gain.value is 5, and parameters.actuator.gain is 4"),
        (entry("servo_period", None), "rig.entries.servo_period.value must be a finite number"),
        ({"answers": 3}, "answers must be a list"),
    ],
)
def test_what_a_fit_cannot_say_is_refused_under_its_place(changes, sentence):
    with pytest.raises(BadInput) as caught:
        model(**changes)
    assert sentence in str(caught.value)


@pytest.mark.parametrize(
    "changes",
    [
        spread(start=2.0, horizon=0.5), {"substeps": 1}, {"substeps": 100}, entry("gain", 4.0), entry("sign.x", -1.0),
        entry("offset.x", 0.0), entry("delay", None), {"correlation": [[1.0, None], [None, 1.0]]},
        {"correlation": [[1.0, 1 + 1e-7], [-1.0, 1.0]]}, bands(covariance=[[0.0]]), {"correlation": None},
    ],
)  # fmt: skip
def test_what_lies_at_a_limit_is_allowed(changes):
    assert model(**changes).plant == "cart-pendulum"


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("[rig]", "is not a fit.json; the first argument"),
        ('{\n  "plant": "furuta",\n  "param', "line 3: the file is cut off or damaged there"),
        ("[]", "lacks the keys plant, parameters of a fit.json"),
        ('{"plant": "furuta"}', "lacks the keys"),
        (json.dumps(FIT | {"format": 2}), "has format 2, this version reads 1; identify again"),
        (json.dumps(FIT | {"substeps": 0}), "got 0; identify again, or put it right"),
    ],
)
def test_what_is_no_fit_is_told_with_its_file(tmp_path, text, sentence):
    (tmp_path / "fit.json").write_text(text, encoding="utf-8")
    with pytest.raises(BadInput, match=r"fit\.json") as caught:
        read_fit(tmp_path / "fit.json")
    assert sentence in str(caught.value)
