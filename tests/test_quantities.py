"""Do bounds keep out what they exclude and nothing more, and does a standard error leave the figures that it leaves?"""

from __future__ import annotations

import math

import pytest

from upright.errors import ImpossiblePhysics
from upright.physics.actuator import ACTUATOR
from upright.quantities import Quantity, figures


@pytest.mark.parametrize(
    ("value", "stderr", "shown"),
    [
        (12.345, 0.012, "12.345"),  # 12.345 +- 0.012: two figures of the error
        (0.13456, 0.0021, "0.1346"),
        (9.81, 0.0999, "9.81"),
        (-1234.5, 10.0, "-1234"),
        (3.0, 40.0, "3"),  # two figures at least
        (1.23456789012, 1e-12, "1.2345679"),  # eight at most
        (1.23456, 0.0, "1.235"),  # four where no error is known
        (1.23456, math.nan, "1.235"),
        (1.23456, math.inf, "1.235"),
        (0.0, 0.1, "0"),
    ],
)
def test_a_number_is_shown_to_the_second_figure_of_its_error(value, stderr, shown):
    assert f"{value:.{figures(value, stderr)}g}" == shown


@pytest.mark.parametrize(
    ("quantity", "allowed", "refused", "words"),
    [
        (Quantity(unit="m", meaning="x"), [-1e9, 0.0, 1e9], [math.inf, -math.inf, math.nan], "must be finite m"),
        (Quantity(unit="m", meaning="x", lower=2.0), [2.0, 3.0], [1.999], "must be >= 2 m, got"),
        (Quantity(unit="m", meaning="x", lower=2.0, open_lower=True), [2.001], [2.0, 1.0], "must be > 2 m, got"),
        (Quantity(unit="m", meaning="x", upper=2.0), [2.0, -9.0], [2.001], "must be finite and <= 2 m, got"),
        (Quantity(unit="m", meaning="x", lower=0.0, upper=2.0), [0.0, 2.0], [-1.0, 3.0], "must be >= 0 and <= 2 m"),
    ],
)
def test_a_value_on_the_bound_is_allowed_unless_the_bound_is_open(quantity, allowed, refused, words):
    for value in allowed:
        quantity.check("d", value)
    for value in refused:
        with pytest.raises(ImpossiblePhysics, match=rf"^d \(x\) {words}"):
            quantity.check("d", value)


def test_every_number_of_a_drive_has_the_sign_that_physics_gives_it():
    """Times, limits, dampings and losses are not negative; a gain, an offset, a slope and a rise may be."""
    either = {"gain", "offset", "slope", "start", "end", "damping_rise"}
    assert {n.removeprefix("actuator.") for n, number in ACTUATOR.items() if not number.never_negative} == either
    # an ideal drive: gain one, no limits, always alive, nothing else
    endless = {"limit": math.inf, "knee": math.inf, "force_limit": math.inf, "end": math.inf, "start": -math.inf}
    ideal = {"gain": 1.0, **endless}
    assert {n: a.default for n, a in ACTUATOR.items()} == {
        n: ideal.get(n.removeprefix("actuator."), 0.0) for n in ACTUATOR
    }
