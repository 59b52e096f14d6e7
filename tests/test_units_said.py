"""Is what somebody typed answered with the kind of quantity that it is and the unit that was meant?"""

from __future__ import annotations

import pytest

from upright import units
from upright.errors import BadInput


def said(text: str, expected: str = "") -> str:
    with pytest.raises(BadInput) as caught:
        units.parse(text, expected)
    return str(caught.value)


@pytest.mark.parametrize(
    ("unit", "kind"),
    [
        ("mm", "a length"), ("g", "a mass"), ("ms", "a time"), ("rpm", "a frequency or an angular speed"),
        ("mN", "a force"),
        ("J", "a torque or an energy"), ("g cm^2", "an inertia"), ("mV", "a voltage"), ("mA", "a current"),
        ("counts", "a number of encoder counts"), ("km/h", "a speed"), ("deg", "an angle or a pure number"),
        ("m^2", "something else"),
    ],
)  # fmt: skip
def test_a_unit_of_another_kind_is_told_what_it_measures(unit, kind):
    assert f"Expected a value in kg/m such as '0.5 kg/m', got '3 {unit}', which is {kind}: " in said(
        f"3 {unit}", "kg/m"
    )


@pytest.mark.parametrize(
    ("text", "expected", "sentence"),
    [
        ("3", "m", "Expected a value in m such as '0.5 m', got '3' without a unit; write '3 m'."),
        ("", "", "Expected a number with its unit, got ''; write the number first, then the unit."),
        ("x", "1", "Expected a pure number such as '0.5', got 'x'"),
        ("2 M", "m", "did you mean 'm'?"),
        ("2 Kgm^2", "", "did you mean 'kg m^2'?"),
        ("2 zzzzzz", "", "use '1' or '%' or 'm'."),
        ("1e308 km", "m", "which is too large to compute with; check the exponent"),
        ("1" * 201, "1", "write the number first"),
    ],
)
def test_what_was_meant_is_said_first(text, expected, sentence):
    assert sentence in said(text, expected)


def test_a_text_of_two_hundred_characters_is_still_read():
    assert units.parse("0" * 197 + "3 m", "m") == 3
    assert units.parse("  +.5e1 mm ", "m") == 0.005
    assert units.parse("-3 %") == -0.03
    assert units.parse("4") == 4


@pytest.mark.parametrize(
    ("unit", "known"),
    [
        ("m^9", True), ("m^99", False), ("(m/s)^2", True), ("((m)^2 s)^2", False), ("m" + "*m" * 29, True),
        ("m" + "*m" * 30, False),
        ("3 m", True), ("99 m", True), ("100 m", False), ("2^2 m", False), ("0 m", False), ("", True), ("1", True),
        ("m squared", True), ("m squared squared", False),
        ("-m", False), ("m!", False),
    ],
)  # fmt: skip
def test_a_unit_has_small_powers_and_a_size_above_zero(unit, known):
    assert units.known(unit) is known


def test_units_of_one_dimension_are_the_same_whatever_their_size():
    assert units.same_dimension("N m s/rad", "N m s")
    assert units.same_dimension("deg", "1")
    assert not units.same_dimension("counts", "1")
    assert units.scale("rpm") == pytest.approx(0.10471975511965977)
    assert units.scale("µm") == units.scale("um") == 1e-6
    assert units.scale("MV") == 1e6
    assert units.scale("lb") == 0.45359237
    assert units.scale("h") == 3600
    assert units.uncertainty("2 %", -3.0, "m") == pytest.approx(0.06)
    assert units.uncertainty("2 mm", -3.0, "m") == 0.002
    assert units.measured("3 m +- ", "m") == (3.0, 0.0)
