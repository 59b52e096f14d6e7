"""Is a long table, a row for each value, the same log as the wide one it was made from?"""

from __future__ import annotations

from datetime import UTC, datetime, timedelta

import numpy as np
import pytest

from upright.errors import BadInput
from upright.readers import read_source
from upright.readers.source import Source

T = 0.005 * np.arange(300)
SIGNALS = {"theta": np.round(np.cos(5 * T), 6), "motor_u": np.round(np.sign(np.sin(9 * T)), 6)}
BEGUN = datetime(2026, 3, 5, 10, 0, 59, tzinfo=UTC)
ANNOTATED = (
    "#group,false,false,true,true,false,false,true,true\n"
    "#datatype,string,long,dateTime:RFC3339,dateTime:RFC3339,dateTime:RFC3339,double,string,string\n"
    "#default,_result,,,,,,,\n,result,table,_start,_stop,_time,_value,_field,_measurement\n"
)


def log(text: str):
    return read_source(Source(file="export.csv", data=text.encode()))


def stamped(t: float) -> str:
    return f"{BEGUN + timedelta(seconds=t):%Y-%m-%dT%H:%M:%S.%fZ}"


def plain(mark: str = ",", clock: str = "time", stamp=lambda t: f"{t:.3f}") -> str:
    rows = [f"{stamp(t)}{mark}{n}{mark}{y[i]}" for i, t in enumerate(T.tolist()) for n, y in SIGNALS.items()]
    return "\n".join([mark.join([clock, "signal", "value"]), *rows]) + "\n"


def influx(every: int = 1) -> str:
    """InfluxDB's annotated CSV: one signal below the other; the command is written `every` so many samples."""
    rows = [
        f",,{k},2026-03-05T09:00:00Z,2026-03-05T11:00:00Z,{stamped(T[i])},{y[i]},{n},rig"
        for k, (n, y) in enumerate(SIGNALS.items()) for i in range(0, T.size, every if k else 1)
    ]  # fmt: skip
    return ANNOTATED + "\r\n".join(rows) + "\r\n"


@pytest.mark.parametrize(
    "text",
    [plain(), plain(";"), plain("\t", "timestamp"), plain(stamp=stamped),
     plain(clock="t_ms", stamp=lambda t: f"{1e3 * t:.0f}"), influx()],
    ids=["seconds", "semicolons", "tabs", "stamps", "milliseconds", "InfluxDB"],
)  # fmt: skip
def test_every_layout_is_the_same_log(text):
    record = log(text)
    assert record.provenance.reader == "tidy"
    np.testing.assert_allclose(record.t, T, rtol=0, atol=1e-9)
    for name, y in SIGNALS.items():
        np.testing.assert_array_equal(record[name], y)


def test_a_signal_that_is_written_seldom_is_held():
    record = log(influx(every=10))
    np.testing.assert_array_equal(record["motor_u"], np.repeat(SIGNALS["motor_u"][::10], 10))
    assert any("Held" in note and "motor_u" in note for note in record.provenance.notes)


def test_a_value_that_is_none_is_named_by_its_line():
    lines = plain().split("\n")
    lines[9] = lines[9].rpartition(",")[0] + ",null"
    with pytest.raises(BadInput, match=r"line 10, column 3 \(theta\).*'null'|line 10, column 3 \(motor_u\).*'null'"):
        log("\n".join(lines))


def test_a_row_with_a_cell_too_many_is_named_by_its_line():
    lines = plain().split("\n")
    lines[200] += ",1"
    with pytest.raises(BadInput, match="line 201: expected 3 cells, got 4"):
        log("\n".join(lines))


def test_a_time_that_comes_twice_is_named_by_its_line_in_the_file():
    lines = plain().split("\n")
    lines[7] = lines[5].split(",")[0] + lines[7][lines[7].index(",") :]
    with pytest.raises(BadInput, match="line 8: the time of 'theta' must increase"):
        log("\n".join(lines))


def test_a_wide_table_with_a_column_of_words_is_none():
    """What else it holds in numbers would be lost."""
    rows = [f"{t:.3f},swing,{y},{u}" for t, y, u in zip(T, *SIGNALS.values(), strict=True)]
    with pytest.raises(BadInput, match="expected a finite number, got something else: 'swing'"):
        log("\n".join(["time,tag,value,motor_u", *rows]) + "\n")
