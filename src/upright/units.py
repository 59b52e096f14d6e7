"""Values in SI units with radians, of texts such as "2 mm" and of units such as "mm".

Values from a study, a form or the command line wear their unit and lose it here, once. Pint does the
arithmetic on the units a laboratory uses; it is imported when the first unit is read.

A radian counts as 1, so ``N m s/rad`` and ``N m s`` agree. Encoder counts are a quantity of their own:
they become an angle or a length only through counts per revolution or per metre.
"""

from __future__ import annotations

import math
import re
from functools import lru_cache
from pathlib import Path
from typing import Any

from upright.errors import BadInput

_PLAIN = "1 % m mm cm um km in kg g mg lb s ms us min Hz kHz rad mrad deg rev counts N mN kN J W V mV A mA ohm H mH rpm"
COMMON = (
    *_PLAIN.split(),
    *("kg m^2", "kg cm^2", "g cm^2", "g mm^2", "kg/m", "N m", "mN m", "N/m", "N m/rad", "N s/m", "N m s/rad"),
    *("N m s^2/rad^2", "N m/A", "V s/rad", "N/V", "N m/V", "N/A", "m/s", "m/s^2", "rad/s", "rad/s^2", "deg/s", "1/s"),
    *("counts/rev", "counts/m", "counts/cm", "counts/s", "counts/V", "rad/V", "m/V", "V/rad", "V/m", "V s/m"),
    *("V s^2/m", "V/count", "V s/count", "V s^2/count"),
)

_NUMBER = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*?)\s*", re.DOTALL)
_UNIT = re.compile(r"[A-Za-zµμΩ°%·*/^() .0-9-]{0,60}")
_POWER = re.compile(r"(.?)\s*(?:\^|\*\*)\s*\(?\s*-?\s*(\d*)")
_POWER_IN_WORDS = re.compile(r"squared?\b|cubed\b|cubic\b|sq\b")
_LONGEST = 200  # characters of a value with its unit


def parse(text: str, expected: str = "") -> float:
    """Value of a text such as ``"2 mm"`` in SI units with radians; counts stay counts.

    Parameters
    ----------
    text : str
        A number and its unit.
    expected : str, optional
        Expected unit, such as ``"kg m^2"``; any unit of the same dimension is accepted.
        Without it every unit is.

    Raises
    ------
    BadInput
        When there is no number, the unit is unknown, or its dimension is not the one expected.
    """
    plain = {"": "a number with its unit", "1": "a pure number such as '0.5'"}
    wanted = plain.get(expected, f"a value in {expected} such as '0.5 {expected}'")
    match = _NUMBER.fullmatch(text) if len(text) <= _LONGEST else None
    if match is None:
        raise BadInput(f"Expected {wanted}, got {text[:60]!r}; write the number first, then the unit.")
    number, unit = float(match[1]), match[2]
    try:
        factor = scale(unit)
    except BadInput:
        raise BadInput(f"Expected {wanted}, got {text[:60]!r}: {_hint(unit, expected)}") from None
    if expected and not same_dimension(unit, expected):
        if not unit:
            raise BadInput(f"Expected {wanted}, got {text[:60]!r} without a unit; write '{text.strip()} {expected}'.")
        raise BadInput(f"Expected {wanted}, got {text[:60]!r}, which is {_kind(unit)}: {_hint(unit, expected)}")
    value = number * factor
    if not math.isfinite(value):
        raise BadInput(f"Expected {wanted}, got {text[:60]!r}, which is too large to compute with; check the exponent.")
    return value


def parse_if_given(text: str, expected: str) -> float | None:
    """Value of an option in SI, None where it was left empty; see `parse`."""
    return parse(text, expected) if text else None


def in_unit(value: float | str, unit: str) -> float:
    """Number in `unit`: a text is converted, a plain number is taken to be in it."""
    if isinstance(value, str):
        return parse(value, unit) / scale(unit)
    try:
        return float(value)
    except (TypeError, ValueError):
        raise BadInput(f"A number in {unit or '1'} was needed, or a text with its unit, got {value!r:.40}.") from None


def uncertainty(text: str, value: float, unit: str) -> float:
    """Standard uncertainty [SI] of a value, stated as ``"2 mm"`` or as a share of it, ``"1 %"``."""
    return abs(value) * parse(text, "1") if text.strip().endswith("%") else parse(text, unit)


def measured(text: str, unit: str) -> tuple[float, float]:
    """Value and standard uncertainty [SI] of a text such as ``"135 g +- 0.2 %"``; 0 where none is stated."""
    number, _, spread = re.sub(r"\+/-|±", "+-", text).partition("+-")
    value = parse(number, unit)
    return value, uncertainty(spread.strip(), value, unit) if spread.strip() else 0.0


def scale(unit: str) -> float:
    """SI value (radians, counts) of one `unit`: 0.001 for ``"mm"``, pi/180 for ``"deg"``.

    Raises
    ------
    BadInput
        When the unit is unknown.
    """
    return _si(unit)[0]


PARTS = {1e-2: 1e2, 1e-3: 1e3, 1e-6: 1e6, 1e-9: 1e9}
"""Factors of decimal prefixes that float64 does not hold, and what divides as they multiply."""


def converted(value: Any, factor: float) -> Any:
    """A number or an array times a factor; 9750 times a thousandth is then 9.75 to the last bit, as it is written."""
    per = PARTS.get(abs(factor))
    return value * factor if per is None else value / math.copysign(per, factor)


def same_dimension(unit: str, other: str) -> bool:
    """Whether two units measure the same thing; a radian counts as 1."""
    return _si(unit)[1] == _si(other)[1]


def denominator(unit: str) -> str:
    """What a gain is per, "" where it is per nothing: V of ``N m/V``, m/s^2 of ``N/(m/s^2)``."""
    _, slash, below = unit.rstrip().rpartition("/(" if unit.rstrip().endswith(")") else "/")
    return below.removesuffix(")") if slash else ""


def is_acceleration(unit: str) -> bool:
    """Whether a command in this unit is an acceleration, as of a stepper."""
    return known(unit) and any(same_dimension(unit, a) for a in ("m/s^2", "rad/s^2"))


def known(unit: str) -> bool:
    """Whether `unit` can be read."""
    try:
        _si(unit)
    except BadInput:
        return False
    return True


@lru_cache(maxsize=512)
def _si(unit: str) -> tuple[float, str]:
    """SI factor and dimension of a unit."""
    plain = unit.strip()
    if plain in ("", "1"):
        return 1.0, "[]"
    if not _UNIT.fullmatch(plain) or _too_powerful(plain):
        raise BadInput(f"Expected a unit such as 'kg m^2', got {unit[:60]!r}: {_hint(unit, '')}")
    spelled = plain.replace("·", "*").replace("%", " percent ").replace("^", "**").replace("°", " degree ").strip()
    try:
        quantity = _registry().parse_expression(spelled)
        base = quantity.to_base_units()
        factor, dimension = float(base.magnitude), str(quantity.dimensionality)
    except Exception:  # pint raises AssertionError, TypeError, tokenize and its own errors for a bad unit
        raise BadInput(f"Expected a unit such as 'kg m^2', got {unit!r}: {_hint(unit, '')}") from None
    if not (math.isfinite(factor) and factor > 0):
        raise BadInput(f"Expected a unit such as 'kg m^2', got {unit!r}: {_hint(unit, '')}")
    return factor, "[]" if dimension == "dimensionless" else dimension


def _too_powerful(unit: str) -> bool:
    """Whether a unit holds powers that no unit has; pint works out ``9**9**9`` to the last digit, and never returns."""
    powers = [(base, exponent) for base, exponent in _POWER.findall(unit)]
    return (
        any(base.isdigit() or base in "*^(" or len(exponent) > 1 for base, exponent in powers)
        or sum(base == ")" for base, _ in powers) + len(_POWER_IN_WORDS.findall(unit)) > 1
        or re.search(r"\d{3}", unit) is not None
    )


@lru_cache(maxsize=1)
def _registry() -> Any:
    import pint

    nothing: Any = None  # not "", which stands for pint's full list
    registry: Any = pint.UnitRegistry(nothing, system=nothing)
    registry.load_definitions(str(Path(__file__).with_suffix(".txt")))
    return registry


def _kind(unit: str) -> str:
    """What a unit measures, in a few words."""
    names = {
        "m": "a length",
        "kg": "a mass",
        "s": "a time",
        "Hz": "a frequency or an angular speed",
        "N": "a force",
        "N m": "a torque or an energy",
        "kg m^2": "an inertia",
        "V": "a voltage",
        "A": "a current",
        "counts": "a number of encoder counts",
        "m/s": "a speed",
        "1": "an angle or a pure number",
    }
    return next((words for known_unit, words in names.items() if same_dimension(unit, known_unit)), "something else")


def _hint(unit: str, expected: str) -> str:
    """The nearest unit that would have been right."""
    from difflib import get_close_matches

    fitting = [u for u in COMMON if not expected or same_dimension(u, expected)]
    if expected:
        fitting = [expected, *(u for u in fitting if u != expected)]
    folded = {re.sub(r"[\s*·^]", "", u).lower(): u for u in reversed(fitting)}
    key = re.sub(r"[\s*·^]", "", unit[:_LONGEST]).lower()
    close = [key] if key in folded else get_close_matches(key, list(folded), n=1, cutoff=0.5)
    if close:
        return f"did you mean '{folded[close[0]]}'?"
    return f"use {' or '.join(repr(u) for u in fitting[:3])}."
