"""Is a clock that no laboratory keeps refused, with the unit in which it would make sense?"""

from __future__ import annotations

import json

import numpy as np
import pytest

import upright as up
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


ROWS = "".join(f"angle:{np.sin(0.1 * i):.6f},speed:{np.cos(0.1 * i):.6f}\n" for i in range(60))
COUNTED = {
    "plotter": ROWS,
    "index": "k,angle\n" + "".join(f"{i},{np.sin(0.1 * i):.6f}\n" for i in range(60)),
    "frame": json.dumps({"angle": [float(np.sin(0.1 * i)) for i in range(60)], "u": [0.0] * 60}),
}


@pytest.mark.parametrize("name", COUNTED)
def test_rows_without_a_time_are_counted_where_somebody_says_what_lies_between_two(name, tmp_path):
    (tmp_path / "log.txt").write_text(COUNTED[name], encoding="utf-8")
    with pytest.raises(BadInput, match='time_unit="20 ms"'):
        up.read(tmp_path / "log.txt")
    record = up.read(tmp_path / "log.txt", time_unit="20 ms")
    np.testing.assert_allclose(record.t, 0.02 * np.arange(60), rtol=0, atol=1e-12)
    np.testing.assert_allclose(record["angle"], np.sin(0.1 * np.arange(60)), rtol=0, atol=1e-6)


def test_a_log_that_begins_with_a_column_that_rises_keeps_it_as_its_time(tmp_path):
    (tmp_path / "log.txt").write_text("0 5\n1 6\n2 4\n3 5\n" * 1, encoding="utf-8")
    assert up.read(tmp_path / "log.txt", time_unit="20 ms").t == pytest.approx([0, 0.02, 0.04, 0.06])


def test_a_log_with_a_time_of_its_own_is_not_counted(tmp_path):
    (tmp_path / "log.csv").write_text(
        "time,theta\n" + "".join(f"{0.02 * i:.2f},{i}\n" for i in range(20)), encoding="utf-8"
    )
    with pytest.raises(BadInput, match=r"has a time of its own, 0\.02 s from sample"):
        up.read(tmp_path / "log.csv", time_unit="20 ms")
