"""Is a fit.json that somebody changed read as a rig that can be, or refused with one sentence?"""

import json
import math

import pytest

from tests.study.mutations import at, changed, paths, wrong
from upright.diagnosis.case import read_known
from upright.errors import BadInput, UprightError
from upright.physics import CartPendulum
from upright.study.stored_fit import read_fit
from upright.study.stored_rig import read_stored_rig


def number(value, unit, stderr=0.0):
    around = [value - 2 * stderr, value + 2 * stderr]
    return {
        "value": value,
        "stderr": stderr,
        "interval": around,
        "unit": unit,
        "status": "well determined",
        "meaning": "...",
    }


VALUES = {"m_c": 0.5, "m_p": 0.107, "l_cg": 0.23, "J_p": 1.6e-3, "b_1": 0.4, "b_2": 1e-4, "g": 9.81}
FIT = {
    "format": 1,
    "plant": "cart-pendulum",
    "substeps": 2,
    "verdict": "The model can be trusted.",
    "trusted": True,
    "answers": [
        {"question": "Does it predict?", "answer": "in part", "headline": "It explains 90 %.", "reasons": ["Some."]}
    ],
    "parameters": {n: number(v, CartPendulum.quantity(n).unit, 0.01 * v) for n, v in VALUES.items()}
    | {"actuator.gain": number(4.0, "N/V", 0.1), "actuator.delay": number(2e-3, "s"),
       "actuator.limit": {"value": None, "stderr": 0.0, "interval": [None, None], "unit": "V"}},
    "groups": {"28 Jan": {"friction": number(1.2, "1", 0.1)}},
    "estimated": ["J_p", "actuator.gain"],
    "correlation": [[1.0, 0.3], [0.3, 1.0]],
    "bands": {
        "level": 0.9, "quantile": 1.8, "names": ["J_p"], "covariance": [[1e-9]], "reached": {"x_dot": 0.4},
        "slow": [{"coulomb": "b_1c", "speed": 0.2, "moves": [-0.5]}],
        "spreads": {"x": [{"horizon": 0.0, "start": 1e-3, "end": 1e-3}]},
    },
}  # fmt: skip
MUTATIONS = [(p, what, value) for p in paths(FIT) for what, value in wrong(at(FIT, p))]


def use(path):
    """What every reader of a fit.json makes of it: its numbers, a linear model, and rigs drawn from its covariance."""
    fitted = read_fit(path)
    rig = read_stored_rig(path, draws=5)
    known = read_known(str(path))
    models = [rig.linear("inverted"), *rig.spread("inverted")]
    return fitted, rig, known, models


def test_the_fit_itself_is_good(tmp_path):
    (tmp_path / "fit.json").write_text(json.dumps(FIT), encoding="utf-8")
    fitted, rig, _, models = use(tmp_path / "fit.json")
    assert fitted.values["actuator.limit"] == math.inf
    assert (rig.plant.m_p, rig.unit, len(models)) == (0.107, "V", 6)


@pytest.mark.parametrize("part", range(4))
@pytest.mark.slow
def test_a_changed_fit_is_a_possible_rig_or_one_sentence(tmp_path, part):
    """Every key, changed in every way; whatever is accepted is finite, of positive mass, and can be computed with."""
    path = tmp_path / "fit.json"
    refused = 0
    for place, what, value in MUTATIONS[part::4]:
        text = json.dumps(changed(FIT, place, value))
        path.write_text(text, encoding="utf-8")
        try:
            fitted, rig, _, models = use(path)
        except UprightError as error:
            said = str(error)
            assert said, (place, what)
            assert "\n" not in said, (place, what)
            assert len(said) < 500, (place, what, said)
            refused += 1
        else:
            numbers = rig.plant.parameters()
            assert all(math.isfinite(v) for v in numbers.values()), (place, what)
            assert min(numbers[n] for n in ("m_c", "m_p", "l_cg", "g")) > 0, (place, what)
            assert all(abs(m.A).max() < math.inf and abs(m.B).max() < math.inf for m in models), (place, what)
            assert isinstance(fitted.verdict, str)
        assert path.read_text(encoding="utf-8") == text
    assert 0.3 * len(MUTATIONS[part::4]) < refused < 0.95 * len(MUTATIONS[part::4])


@pytest.mark.parametrize(
    ("place", "value", "says"),
    [
        (("parameters", "m_p", "value"), -0.1, r"m_p .* must be > 0 kg, got -0\.1"),
        (("parameters", "m_p", "value"), float("nan"), r"parameters\.m_p\.value must be a finite number"),
        (("parameters", "m_p", "stderr"), -1.0, r"parameters\.m_p\.stderr must be 0 or more"),
        (("parameters", "actuator.delay", "value"), -1.0, r"actuator\.delay .* must be 0 or more, got -1"),
        (("parameters", "actuator.gain", "value"), 0, "nothing would drive the rig"),
        (("correlation", 0, 1), 1.5, "correlation must lie between -1 and 1, got 1.5"),
        (("estimated",), ["J_p"], "correlation must have 1 rows"),
        (("substeps",), 10**9, "substeps must be a whole number from 1 to 100"),
        (("trusted",), "yes", "trusted must be true or false"),
    ],
)
def test_what_is_wrong_with_a_fit_is_said(tmp_path, place, value, says):
    (tmp_path / "fit.json").write_text(json.dumps(changed(FIT, place, value)), encoding="utf-8")
    with pytest.raises(BadInput, match=says):
        read_fit(tmp_path / "fit.json")


def test_variances_are_squares_of_what_a_number_may_be(tmp_path):
    """A number that the data hardly see is uncertain by 1e9 of its unit: its fit is read, and not trusted by itself."""
    path = tmp_path / "fit.json"
    bands = {"names": ["J_p"], "covariance": [[1e18]]}
    path.write_text(json.dumps({**FIT, "bands": {**FIT["bands"], **bands}}), encoding="utf-8")
    assert read_fit(path).bands.covariance[0, 0] == 1e18
    path.write_text(
        json.dumps({**FIT, "bands": {**FIT["bands"], "names": ["J_p"], "covariance": [[1e30]]}}), encoding="utf-8"
    )
    with pytest.raises(BadInput, match="of a plausible size"):
        read_fit(path)


@pytest.mark.parametrize(("between", "possible"), [(0.9e-6, True), (1.5e-6, False)])
def test_a_covariance_is_judged_by_its_correlations_whatever_its_units(tmp_path, between, possible):
    """Standard deviations of 1e-6 and 1: a covariance of 0.9e-6 is a correlation of 0.9, one of 1.5e-6 is none."""
    bands = {"names": ["J_p", "actuator.gain"], "covariance": [[1e-12, between], [between, 1.0]]}
    path = tmp_path / "fit.json"
    path.write_text(json.dumps({**FIT, "bands": {**FIT["bands"], **bands}}), encoding="utf-8")
    if possible:
        assert read_fit(path).bands.covariance[0, 1] == between
    else:
        with pytest.raises(BadInput, match="none of its variances may be negative"):
            read_fit(path)
