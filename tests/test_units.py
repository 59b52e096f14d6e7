"""Does a value lose its unit correctly, and is a wrong unit named with the right one?"""

from __future__ import annotations

import math
import subprocess
import sys
from contextlib import suppress

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from upright import units
from upright.errors import BadInput
from upright.records.columns import stated_unit, time_scale


# Expected values from the definitions of the units (SI brochure; inch and pound by their 1959 definition).
@pytest.mark.parametrize(
    ("text", "expected", "value"),
    [
        ("2 mm", "m", 0.002),
        ("0.107 kg", "kg", 0.107),
        ("1.6e-3 kg m^2", "kg m^2", 1.6e-3),
        ("2 g cm^2", "kg m^2", 2e-7),
        ("1 kg*m**2", "kg m^2", 1.0),
        ("5e-4 N m s/rad", "N m s", 5e-4),
        ("0.5 rev", "rad", math.pi),
        ("180 deg", "rad", math.pi),
        ("60 rpm", "rad/s", 2 * math.pi),
        ("16000 counts/rev", "counts/rad", 16000 / (2 * math.pi)),
        ("3 counts", "counts", 3.0),
        ("560 counts/cm", "counts/m", 56000.0),
        ("-3.5 V", "V", -3.5),
        ("0.1034 N m/A", "V s/rad", 0.1034),
        ("16 ohm", "V/A", 16.0),
        ("1.16 mH", "V s/A", 1.16e-3),
        ("9.81 m/s^2", "m/s^2", 9.81),
        ("50 %", "1", 0.5),
        ("0.3", "1", 0.3),
        ("1 in", "m", 0.0254),
        ("2mm", "m", 0.002),
        ("1.5 mNm", "N m", 1.5e-3),
        ("3 Ncm", "N m", 0.03),
        ("2 Nms/rad", "N m s/rad", 2.0),  # no plural
        ("2 mNms", "N m s", 2e-3),
        ("4 Ns/m", "N s/m", 4.0),
        ("0.1 Vs/rad", "V s/rad", 0.1),
        ("16000 ticks/rev", "counts/rad", 16000 / (2 * math.pi)),
    ],
)
def test_a_value_becomes_si(text: str, expected: str, value: float) -> None:
    assert units.parse(text, expected) == pytest.approx(value, rel=1e-14)


@pytest.mark.parametrize(
    ("text", "expected", "sentence"),
    [
        ("2 V", "kg m^2", "a voltage: use 'kg m\\^2'"),
        ("2 nm", "N m", "a length"),
        ("1 Kg", "kg", "did you mean 'kg'"),
        ("2 kgm^2", "kg m^2", "did you mean 'kg m\\^2'"),
        ("3 counts", "rad", "encoder counts"),
        ("0.23", "m", "without a unit; write '0.23 m'"),
        ("long", "m", "write the number first"),
        ("1e999 m", "m", "too large"),
        ("3 m^99", "m", "did you mean 'm'"),
        ("9**9**9 m", "m", "Expected a value in m"),
    ],
)
def test_a_wrong_unit_is_answered_with_the_right_one(text: str, expected: str, sentence: str) -> None:
    with pytest.raises(BadInput, match=sentence):
        units.parse(text, expected)


@pytest.mark.parametrize(
    "unit",
    [
        "9**9**9",
        "9^9^9^9",
        "2^9^9^9 m",
        "m^9^9^9",
        "m^(9^9^9)",
        "((((((9)^9)^9)^9)^9)^9)^9",
        "((((((m)^9)^9)^9)^9)^9)^9",
        "9 squared squared squared squared squared squared",
        "999999999",
        "(" * 60,
        "m" * 1_000_000,
    ],
)
def test_a_power_that_nobody_can_work_out_is_no_unit(unit: str) -> None:
    """9**(9**9) has 370 million digits (log10 of it), so who begins to compute it does not answer today."""
    assert not units.known(unit)
    assert stated_unit(f"theta [{unit}]") == ""


def test_a_name_of_blanks_is_looked_through_at_once() -> None:
    """A pattern with two runs of blanks around one of anything takes a step for every way to share them: 2e13."""
    assert stated_unit("x [" + " " * 40_000) == ""
    assert time_scale("x" + " " * 40_000 + "y") == 0.0


@pytest.mark.parametrize("unit", ["(m/s)^2", "m^-1", "V/Hz^0.5", "m^(-2)", "kg·m**2"])
def test_a_power_of_a_unit_is_one(unit: str) -> None:
    assert units.known(unit)


@pytest.mark.parametrize("unit", units.COMMON)
def test_a_value_in_a_common_unit_reads_back(unit: str) -> None:
    assert units.parse(f"0.125 {unit}", unit) == pytest.approx(units.scale(unit) * 0.125)


@settings(deadline=None)  # the first call pays for an import
@given(st.text(max_size=40), st.sampled_from(["", "m", "kg m^2", "counts", "1"]))
def test_any_text_is_a_finite_value_or_a_sentence(text: str, expected: str) -> None:
    with suppress(BadInput):
        assert math.isfinite(units.parse(text, expected))


@settings(deadline=None)  # the first call pays for an import
@given(st.text(alphabet="0123456789 mskgNVrad^*/().-", max_size=20))
def test_any_unit_like_text_is_a_finite_value_or_a_sentence(text: str) -> None:
    with suppress(BadInput):
        assert math.isfinite(units.parse("1 " + text))


def test_a_number_is_in_the_unit_already_and_a_text_in_its_own() -> None:
    assert units.in_unit(2.0, "mm") == 2.0
    assert units.in_unit("2 cm", "mm") == pytest.approx(20.0)
    assert units.parse_if_given("", "m") is None
    assert units.parse_if_given("2 cm", "m") == pytest.approx(0.02)


@pytest.mark.parametrize(
    ("text", "unit", "value", "spread"),
    [
        ("135 g +- 0.2 %", "kg", 0.135, 2.7e-4),
        ("135 g +/- 2 g", "kg", 0.135, 2e-3),
        ("-20 cm ± 2 mm", "m", -0.2, 2e-3),
        ("-20 cm ± 1 %", "m", -0.2, 2e-3),
        ("135 g", "kg", 0.135, 0.0),
    ],
)
def test_an_uncertainty_is_a_length_of_its_own_or_a_share(text: str, unit: str, value: float, spread: float) -> None:
    assert units.measured(text, unit) == pytest.approx((value, spread))


def test_a_wrong_unit_is_answered_with_those_of_the_quantity_first() -> None:
    """Asked for a stiffness, it does not speak of metres."""
    with pytest.raises(BadInput, match=r"use 'N/rad'"):
        units.parse("3 xyz", "N/rad")
    with pytest.raises(BadInput, match=r"did you mean 'N/m'\?"):
        units.parse("3 N/mm2", "N/m")


def test_pint_waits_until_a_unit_is_read() -> None:
    code = "import sys, upright.units; sys.exit('pint' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
