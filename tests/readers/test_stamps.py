"""Is a log whose rows begin with a date and a time of day the log that a clock in seconds would have written?"""

from __future__ import annotations

import re
from datetime import UTC, datetime, timedelta, timezone

import numpy as np
import pytest

from upright.errors import BadInput
from upright.readers import read_source
from upright.readers.source import Source
from upright.readers.stamps import in_seconds

SECONDS = (0.0, 0.004, 0.0085, 0.5, 61.25)
BEGAN = datetime(2024, 2, 28, 23, 59, 30, 123456, timezone(timedelta(hours=-3, minutes=-30)))  # a leap day follows
VALUES = (1.5, -2.25, 0.0, 3.0, 4.0)


def record(text: str):
    return read_source(Source(file="log.csv", data=text.encode()))


@pytest.mark.parametrize(("delimiter", "mark"), [(",", "."), (";", "."), (";", ","), ("\t", ",")])
@pytest.mark.parametrize(
    "write",
    [
        lambda t: t.isoformat(timespec="microseconds"),
        lambda t: t.isoformat(" ", timespec="microseconds"),
        lambda t: t.astimezone(UTC).isoformat(timespec="microseconds").replace("+00:00", "Z"),
        lambda t: t.strftime("%d.%m.%Y %H:%M:%S.%f"),
    ],
)
@pytest.mark.parametrize("quote", ["", '"'])
def test_stamps_give_the_times_of_a_clock_that_began_with_the_log(write, delimiter, mark, quote):
    stamps = [re.sub(r"\.(?=\d{6})", mark, write(BEGAN + timedelta(seconds=s))) for s in SECONDS]
    cells = [f"{v:.2f}".replace(".", mark) for v in VALUES]
    rows = [f"{quote}{stamp}{quote}{delimiter}{cell}" for stamp, cell in zip(stamps, cells, strict=True)]
    log = record("\n".join([f"When{delimiter}Angle [rad]", *rows, ""]))
    np.testing.assert_allclose(log.t, SECONDS, rtol=0, atol=1e-12)
    np.testing.assert_array_equal(log["Angle [rad]"], VALUES)
    assert f"from the first sample, {stamps[0]}." in str(log.provenance)


def test_a_stamp_is_exact_to_a_nanosecond():
    text, began = in_seconds("t,x\n10:00:00.000000001,1\n10:00:00.123456789,2\n9:59:59.9,3\n")
    assert text == "t,x\n0.000000000,1\n0.123456788,2\n-0.100000001,3\n"
    assert began == "10:00:00.000000001"


@pytest.mark.parametrize("order", ["%m/%d/%Y", "%d/%m/%Y"])
def test_strokes_are_read_in_the_order_in_which_the_log_passes_midnight_once(order):
    """From 2 to 3 February is a day; read the other way round, the same strokes are four weeks."""
    began = datetime(2026, 2, 2, 23, 59, 30, 250000)
    rows = [f"{(began + timedelta(seconds=s)).strftime(order + ' %I:%M:%S.%f %p')};1" for s in SECONDS]
    np.testing.assert_allclose(record("\n".join(["When;x", *rows, ""])).t, SECONDS, rtol=0, atol=1e-12)


def test_noon_and_midnight_of_twelve_hours_are_those_of_twenty_four():
    text, _ = in_seconds("t,x\n12:00:00 AM,1\n1:00:00 am,2\n11:59:59 AM,3\n12:00:00 PM,4\n1:00:01 p.m.,5\n")
    read = [float(line.split(",")[0]) for line in text.split("\n")[1:-1]]
    assert read == [0.0, 3600.0, 12 * 3600.0 - 1, 12 * 3600.0, 13 * 3600.0 + 1]


@pytest.mark.parametrize("delimiter", [",", ";", "\t", ", "])
@pytest.mark.parametrize("names", [("Date", "Time"), ("Datum", "Uhrzeit")])
@pytest.mark.parametrize("quote", ["", '"'])
def test_a_date_in_a_column_of_its_own_is_part_of_the_time(delimiter, names, quote):
    stamps = [BEGAN + timedelta(seconds=s) for s in SECONDS]
    rows = [
        delimiter.join([f"{quote}{t:%Y/%m/%d}{quote}", f"{quote}{t:%H:%M:%S.%f}{quote}", f"{v}"])
        for t, v in zip(stamps, VALUES, strict=True)
    ]
    log = record("\n".join([delimiter.join([*names, "Angle [rad]"]), *rows, ""]))
    np.testing.assert_allclose(log.t, SECONDS, rtol=0, atol=1e-12)
    assert list(log.signals) == ["Angle [rad]"]
    np.testing.assert_array_equal(log["Angle [rad]"], VALUES)


@pytest.mark.parametrize("text", ["t,x\n0.5,1\n1.5,2\n", "t,x\n10:00,1\n", "2024-02-28 of a log\nt,x\n1,2\n"])
def test_a_log_without_stamps_is_left_as_it_is(text):
    assert in_seconds(text) == (text, "")


def test_a_clock_that_passes_midnight_without_a_date_is_refused_with_its_row():
    with pytest.raises(BadInput, match=r"line 3, column 1 \(t\): time must increase"):
        record("t;x\n23:59:59,99;1\n00:00:00,01;2\n")


def test_a_log_whose_stamps_end_long_before_it_is_read_as_far_as_they_go():
    """The last stamp is looked for in the last characters; where there is none, the first stands for it."""
    remark = "# " + 70 * "x"
    text, began = in_seconds("t,x\n3/2/2026 10:00:00,1\n3/2/2026 10:00:01,2\n" + 1000 * f"{remark}\n")
    assert text.splitlines()[1:3] == ["0.000000000,1", "1.000000000,2"]
    assert began == "3/2/2026 10:00:00"
