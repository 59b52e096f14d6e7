"""Is each form of a parameter read as known or asked, within its bounds, and refused otherwise?"""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from upright.errors import BadInput
from upright.physics import find
from upright.study.rig import actuator_unit, known_values, per, read_rig
from upright.study.text import StudyText

PLANT = find("cart-pendulum")
NEEDED = '[rig]\nplant = "cart-pendulum"\n[parameters]\nm_c = 0.5\nm_p = 0.1\nl_cg = 0.2\n'


def rig(more: str, unit: str = "", fixed=None):
    return read_rig(StudyText(Path("s.toml"), NEEDED + more).root(), PLANT, unit, fixed)


@pytest.mark.parametrize(
    ("above", "below", "unit"),
    [
        ("N", "V", "N/V"), ("N m", "V", "(N m)/V"), ("N", "m/s", "N s/m"), ("V", "m s", "V/(m s)"),
        ("N", "V/m", "N/(V/m)"),
        ("N m", "rad/s", "N m s/rad"),
    ],
)  # fmt: skip
def test_a_ratio_is_written_with_brackets_where_it_needs_them(above, below, unit):
    assert per(above, below) == unit


@pytest.mark.parametrize(
    ("name", "drive", "unit"),
    [
        ("actuator.gain", "V", "N/V"), ("actuator.gain", "", "N"),
        ("actuator.limit", "V", "V"),
        ("actuator.limit", "", "1"),
        ("actuator.delay", "V", "s"), ("actuator.slope", "V", "N s/m"), ("actuator.damping", "V", "N s/m"),
    ],
)  # fmt: skip
def test_a_drives_numbers_have_the_units_of_its_command_and_its_force(name, drive, unit):
    assert actuator_unit(PLANT, name, drive) == unit


def test_a_number_is_known_uncertain_assumed_or_asked():
    found = rig(
        'b_1 = "2 N s/m"\nJ_p = { value = "50 kg cm^2", uncertainty = "2 %" }\nb_2 = { value = 1e-4, assumed = true }\n'
        'b_1c = { guess = "3 N", min = 1, max = "4 N" }\nb_2c = { guess = 1e-3 }\n[actuator]\ngain = "3 N/V"\n', "V"
    ).parameters  # fmt: skip
    assert (found["b_1"].value, found["b_1"].estimate, found["b_1"].uncertainty, found["b_1"].assumed) == (
        2,
        False,
        0,
        False,
    )
    assert found["J_p"].value == pytest.approx(5e-3)
    assert found["J_p"].uncertainty == pytest.approx(1e-4)
    assert found["b_2"].assumed
    asked = found["b_1c"]
    assert (asked.value, asked.estimate, asked.lower, asked.upper) == (3, True, 1, 4)
    assert (found["b_2c"].lower, found["b_2c"].upper) == (0, math.inf)
    assert (found["actuator.gain"].value, found["actuator.gain"].unit) == (3, "N/V")
    assert found["actuator.limit"].value == math.inf
    assert found["g"].value == pytest.approx(9.81)  # as the plant has it
    assert found["m_c"].unit == "kg"
    stated = rig('J_p = { value = "50 kg cm^2", uncertainty = "1 kg cm^2" }\n').parameters["J_p"]
    assert stated.uncertainty == pytest.approx(1e-4)


def test_numbers_of_a_model_fitted_before_replace_what_the_study_says():
    found = rig("b_1 = { guess = 3 }\n", fixed={"b_1": 7.0, "actuator.gain": 2.0}).parameters
    assert (found["b_1"].value, found["b_1"].estimate) == (7.0, False)
    assert found["actuator.gain"].value == 2.0
    assert found["m_c"].value == 0.5


@pytest.mark.parametrize(
    ("more", "sentence"),
    [
        ("b_1 = { value = 1, guess = 1 }\n", "line 7: b_1 needs either value (known) or guess (to estimate)"),
        ("b_1 = { min = 1 }\n", "b_1 needs either value (known) or guess"),
        ("b_1 = { value = 1, min = 0 }\n", "b_1 is known, so min has no meaning here; write guess instead of value"),
        ("b_1 = { guess = 1, uncertainty = 1 }\n", "b_1 is estimated from a guess, so uncertainty has no meaning here"),
        ("b_1 = { guess = 1, assumed = true }\n", "so assumed has no meaning here; write value instead of guess"),
        ("b_1 = { value = 1, assumed = true, measured = true }\n", "b_1 is assumed or measured, not both"),
        ("b_1 = { value = 1, assumed = true, uncertainty = 1 }\n", "b_1 has an uncertainty, so it was measured"),
        ("b_1 = { guess = 1, min = 2 }\n", "b_1 starts at 1 N s/m, outside its bounds 2 to inf"),
        ("b_1 = { guess = 3, max = 2 }\n", "outside its bounds 0 to 2"),
        ("b_1 = { guess = 2, min = 2, max = 2 }\n", "outside its bounds 2 to 2"),
        ("b_1 = { value = 1, uncertainty = -1 }\n", "the uncertainty of b_1 must be zero or more, got -1"),
        ('b_1 = { value = 1, uncertainty = "x %" }\n', 'uncertainty must be like "2 mm" or "1 %"'),
        ("b_1 = -1\n", "line 7: b_1"),
        ("zeta = 1\n", "'zeta'"),
        ("[actuator]\ndelay = -1\n", "delay"),
    ],
)
def test_a_number_that_contradicts_itself_is_refused_by_line(more, sentence):
    with pytest.raises(BadInput) as caught:
        rig(more)
    assert sentence in str(caught.value)


def test_a_guess_at_its_bound_is_inside():
    assert rig("b_1 = { guess = 2, min = 2 }\n").parameters["b_1"].lower == 2
    assert rig("b_1 = { guess = 2, max = 2 }\n").parameters["b_1"].upper == 2
    assert rig("b_1 = { guess = 2, min = -5 }\n").parameters["b_1"].lower == 0  # damping is never negative


def test_a_number_that_has_no_default_is_needed():
    text = StudyText(Path("s.toml"), '[rig]\nplant = "cart-pendulum"\n[parameters]\nm_c = 0.5\nm_p = 0.1\n')
    with pytest.raises(BadInput, match="CartPendulum needs l_cg") as caught:
        read_rig(text.root(), PLANT, "")
    assert 'l_cg = { guess = "1 m" }' in str(caught.value)


def test_known_values_of_a_run_are_in_si():
    root = StudyText(Path("s.toml"), '[known]\nm_p = "200 g"\n').root()
    assert known_values(root.section("known"), PLANT) == {"m_p": pytest.approx(0.2)}
    assert rig("").substeps == 1
    with pytest.raises(BadInput, match="'zeta'"):
        known_values(StudyText(Path("s.toml"), "[known]\nzeta = 1\n").root().section("known"), PLANT)
