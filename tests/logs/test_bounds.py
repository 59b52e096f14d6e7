"""Are the bounds of a log's writer and the words about what is wrong with a file those that are promised?"""

from __future__ import annotations

import io
import json

import pytest

from tests.logs.runs import HEADER, row, written
from upright.errors import BadInput
from upright.logs import LogWriter, recover
from upright.logs.layout import RunFile, columns_of_schema, event_schema, row_schema, row_writer
from upright.logs.whole import log_of


@pytest.mark.parametrize("rows", [15, (1 << 22) + 1])
def test_a_buffer_holds_sixteen_to_four_million_rows(rows, tmp_path):
    with pytest.raises(BadInput, match=f"holds 16 to 4194304 rows, got {rows}"):
        LogWriter(tmp_path / "a.mcap", header=HEADER, rows=rows)
    assert not (tmp_path / "a.mcap").exists()


def test_a_row_is_json_with_whole_numbers_whole_and_what_is_none_null():
    message = row_writer(HEADER.columns)
    assert json.loads(message(row(7))) == dict(zip([c.name for c in HEADER.columns], row(7), strict=True))
    assert b'"tick":7,' in message(row(7))
    odd = (*row(7)[:6], float("inf"), float("-inf"), 2, 0)
    assert b'"u":null,"u_applied":null,"mode":2' in message(odd)


def test_schemas_say_type_unit_and_meaning_of_every_field():
    fields = json.loads(row_schema(HEADER))["properties"]
    assert fields["mode"] == {"type": "integer", "unit": "1", "description": "one of 0 IDLE, 2 HOST, 4 FAULT"}
    assert fields["faults"]["description"] == "sum of 2 OVERTRAVEL, 4 OVERSPEED"
    assert fields["psi"] == {"type": "number", "unit": "rad"}
    assert columns_of_schema(row_schema(HEADER)) == HEADER.columns
    assert json.loads(event_schema())["properties"]["dropped"]["type"] == "integer"


@pytest.mark.parametrize(
    ("t", "nanoseconds"),
    [(0.0, 0), (1.5, 1_500_000_000), (-1.0, 0), (1e9, 0), (999_999_999.0, 999_999_999_000_000_000)],
)
def test_time_stamps_of_the_format_count_nanoseconds_where_they_can(t, nanoseconds):
    from mcap.reader import make_reader

    stream = io.BytesIO()
    file = RunFile(stream, HEADER)
    file.row((t, *row(0)[1:]))
    file.event(float("nan"), "k", "x")
    file.finish()
    found = list(make_reader(io.BytesIO(stream.getvalue())).iter_messages())
    assert sorted(m.log_time for _, _, m in found) == sorted([nanoseconds, 0])
    assert log_of(stream.getvalue(), "x").columns["t"][0] == t  # the row has the time itself


def test_what_is_wrong_with_a_file_is_told_with_its_byte():
    data = written(250)
    whole = log_of(data, "a")
    assert (whole.complaint, whole.size, whole.readable) == ("", len(data), len(data))
    open_ended = written(250, finish=False)
    waiting = log_of(open_ended, "a")
    assert waiting.complaint == f"Its writer was stopped, or is still at work: it ends at byte {len(open_ended)}."
    torn = log_of(open_ended[:-5], "a")
    assert torn.complaint.startswith(
        f"Its writer was stopped, or is still at work: it ends at byte {torn.readable}, and "
    )
    assert torn.complaint.endswith(f"{len(open_ended) - 5 - torn.readable} bytes of a torn record follow.")
    cut = log_of(data[:-5], "a")
    assert (len(cut), cut.complaint) == (250, "Every chunk was read, but its summary is torn.")
    assert cut.readable < cut.size == len(data) - 5


def test_as_many_rows_were_lost_as_bytes_that_could_not_be_read_held(tmp_path):
    """Rows of one length: the lost share of the bytes is the lost share of the rows."""
    data = written(300, finish=False)
    path = tmp_path / "torn.mcap"
    path.write_bytes(data[:-1] + b"\xff" * 1000)
    done = recover(path, tmp_path / "new.mcap")
    readable = done.log.readable
    assert done.lost_bytes == len(data) + 999 - readable
    assert done.lost_rows == round(done.lost_bytes * len(done.log) / readable)
    assert log_of((tmp_path / "new.mcap").read_bytes(), "new").complaint == ""
    whole = tmp_path / "whole.mcap"
    whole.write_bytes(written(300)[:-5])
    again = recover(whole, tmp_path / "again.mcap")
    assert (again.lost_rows, len(again.log)) == (0, 300)
    assert again.lost_bytes > 0
