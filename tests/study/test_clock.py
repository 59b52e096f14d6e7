"""Is a clock that no laboratory keeps refused, with the unit in which it would make sense?"""

from __future__ import annotations

import numpy as np
import pytest

from upright.errors import BadInput
from upright.records import Provenance, Record
from upright.study.clock import check_clock, with_time_unit


def log(step: float) -> Record:
    t = step * np.arange(100)
    return Record(t=t, signals={"theta": np.sin(t)}, provenance=Provenance(file="a.csv"))


@pytest.mark.parametrize("step", [1e-6, 4e-3, 0.5, 2.0])
def test_two_seconds_between_samples_are_the_most(step):
    check_clock(log(step))


@pytest.mark.parametrize(
    ("step", "units"),
    [
        (4.0, ["ms"]),  # 250 Hz; 4 us and 4 ns are no pace of a laboratory's
        (200.0, ["ms", "us"]),  # 5 Hz, or 5 kHz
        (1e4, ["us"]),
        (3e6, ["ns"]),
        (3e5, ["us", "ns"]),
        (1e9, []),
    ],
)
def test_a_clock_may_count_what_makes_its_samples_a_tenth_of_a_millisecond_to_half_a_second_apart(step, units):
    with pytest.raises(BadInput) as caught:
        check_clock(log(step))
    said = str(caught.value)
    assert said.startswith("'a.csv': expected a sample at least every 2 s, got one every ")
    assert [u for u in ("ms", "us", "ns") if f"--time-unit {u}" in said and f'time_unit = "{u}"' in said] == units
    assert ("check the unit of its time column" in said) == (not units)


@pytest.mark.parametrize(("unit", "seconds"), [("", 4.0), ("s", 4.0), ("ms", 4e-3), ("us", 4e-6), ("min", 240.0)])
def test_numbers_of_a_stated_unit_are_seconds(unit, seconds):
    assert with_time_unit(log(4.0), unit).period == pytest.approx(seconds)


@pytest.mark.parametrize("unit", ["kg", "rad/s", "fortnights"])
def test_a_unit_that_is_none_of_time_is_refused(unit):
    with pytest.raises(BadInput, match=f"expected a unit of time, such as 'ms', 'us' or 's', got '{unit}'"):
        with_time_unit(log(4.0), unit)
