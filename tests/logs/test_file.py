"""Does a log give back what was put into it, to this reader and to MCAP's own, and never anything else?"""

from __future__ import annotations

import io
import json
import sys
import tomllib
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader

import upright as up
from tests.logs.runs import HEADER, row, written, wrong
from upright.errors import BadInput
from upright.logs import LogHeader, follow, recover
from upright.logs.layout import RunFile, holds, row_schema, with_checksum
from upright.logs.whole import log_of

NUMBER = st.floats(allow_nan=False, allow_infinity=False)
WHOLE = st.integers(-(2**63), 2**63 - 1)


@settings(deadline=None, max_examples=50)
@given(st.lists(st.tuples(NUMBER, WHOLE, WHOLE, NUMBER, NUMBER, NUMBER, WHOLE, WHOLE), max_size=5))
def test_every_number_comes_back_to_the_last_bit(rows):
    header = LogHeader(rig="", law={}, coordinates=(("x", "m"),), command_unit="A", period=1.0, versions={})
    stream = io.BytesIO()
    file = RunFile(stream, header)
    for numbers in rows:
        file.row(numbers)
    file.finish()
    log = log_of(stream.getvalue(), "x.mcap")
    assert [repr(log.row(k)) for k in range(len(log))] == [repr(numbers) for numbers in rows]
    assert log.complaint == ""


def test_a_header_comes_back_as_it_was():
    law = {"kind": "linear", "C": [[]], "D": [[0.1 + 0.2]]}
    header = LogHeader(
        rig='"ä" = 1\n', law=law, coordinates=(("θ", "rad"),), command_unit="N m", period=0.1, driven=(2,),
        modes={2: "HOST"}, faults={1: "WATCHDOG"}, start=1.7e9, versions={"upright": "1"},
    )  # fmt: skip
    stream = io.BytesIO()
    RunFile(stream, header).finish()
    assert log_of(stream.getvalue(), "x").header == header
    followed = replace(header, references=(("r", "rad"),))
    texts = followed.as_metadata()
    assert LogHeader.of_metadata(texts) == followed
    assert [c.name for c in followed.columns][3:6] == ["θ", "r", "u"]
    old = {k: v for k, v in json.loads(texts["log"]["json"]).items() if k != "references"}
    assert LogHeader.of_metadata(texts | {"log": {"json": json.dumps(old)}}) == header
    assert header.fault_names(3) == ("WATCHDOG", "fault 2")


@pytest.mark.parametrize("period", [0.0, -1e-3, 3600.0, float("nan"), float("inf")])
def test_a_log_needs_a_period_between_none_and_an_hour(period):
    replace(HEADER, period=3599.0)
    with pytest.raises(BadInput, match="a log needs the period of its rows"):
        replace(HEADER, period=period)


def test_counts_ticks_modes_and_faults_are_whole_and_nothing_else_is():
    assert [c.name for c in HEADER.columns if c.whole] == ["tick", "psi_counts", "theta_counts", "mode", "faults"]
    assert HEADER.fault_names(0) == ()
    assert HEADER.fault_names(6) == ("OVERTRAVEL", "OVERSPEED")
    assert HEADER.fault_names(1 | 4 | 16) == ("fault 1", "OVERSPEED", "fault 16")


def test_metadata_holds_in_whatever_order_it_is_read_and_not_when_a_letter_differs():
    kept = with_checksum({"b": "two", "a": "one"})
    assert holds(dict(sorted(kept.items())))
    assert holds(dict(sorted(kept.items(), reverse=True)))
    assert not holds({**kept, "a": "One"})
    assert not holds({"a": "one", "b": "two"})


def test_mcap_itself_reads_rows_units_and_metadata():
    reader = make_reader(io.BytesIO(written(250)), validate_crcs=True)
    messages = list(reader.iter_messages(topics=["/samples"]))
    names = [column.name for column in HEADER.columns]
    assert [json.loads(m.data) for _, _, m in messages] == [dict(zip(names, row(k), strict=True)) for k in range(250)]
    assert [m.log_time for _, _, m in messages] == [k * 1_000_000 for k in range(250)]
    schema, channel, _ = messages[0]
    assert (schema.encoding, channel.message_encoding) == ("jsonschema", "json")
    units = {name: field["unit"] for name, field in json.loads(schema.data)["properties"].items()}
    assert units == {
        "t": "s", "tick": "1", "psi_counts": "counts", "theta_counts": "counts", "psi": "rad", "theta": "rad",
        "u": "V", "u_applied": "V", "mode": "1", "faults": "1",
    }  # fmt: skip
    assert {m.name: m.metadata for m in reader.iter_metadata()}["rig"]["file"] == HEADER.rig
    assert reader.get_summary().statistics.message_count == 251


def test_a_number_that_is_none_is_null_and_leaves_the_record():
    stream = io.BytesIO()
    file = RunFile(stream, HEADER)
    for k in range(4):
        file.row((*row(k)[:6], float("inf") if k == 1 else 0.0, 0.0, 2, 0))
    file.finish()
    log = log_of(stream.getvalue(), "x")
    assert np.isnan(log.columns["u"]).tolist() == [False, True, False, False]
    assert log.record()["tick"].tolist() == [0, 2, 3]
    assert "1 rows left out" in log.record().provenance.notes[0]


def test_a_log_is_a_record_like_any_other(tmp_path):
    path = tmp_path / "renamed.dat"
    path.write_bytes(written(300))
    record = up.read(path)
    assert record.provenance.reader == "mcap"
    assert (record.inputs, record.outputs) == (("u_applied",), ("psi", "theta"))
    assert (record.units["theta"], record.units["u"]) == ("rad", "V")
    assert record.names == ("tick", "psi", "theta", "u", "u_applied", "mode", "faults")
    assert "theta_counts" in log_of(path.read_bytes(), "x").record(counts=True).names
    np.testing.assert_array_equal(record["theta"], [row(k)[5] for k in range(300)])
    np.testing.assert_array_equal(record.t, 1e-3 * np.arange(300))


def test_a_torn_log_gives_its_whole_chunks_and_never_a_wrong_row():
    """Every row stands in one chunk of 50, so that what is read is a multiple of it: the chunks that are whole."""
    data = written(400, every=50, finish=False)
    ends = chunk_ends(data)
    for cut in np.random.default_rng(0).integers(ends[0], len(data), 80).tolist():
        for tail in (b"", bytes(cut % 1000)):  # zeros are what a file system leaves that had not written yet
            log = log_of(data[:cut] + tail, "x")
            assert len(log) == 50 * min(sum(end <= cut for end in ends), 8)
            assert wrong(log) == []
            assert ("stopped" in log.complaint) or ("Damaged" in log.complaint)


def chunk_ends(data: bytes) -> list[int]:
    """Where each chunk ends, by MCAP's own reader."""
    from mcap.records import Chunk
    from mcap.stream_reader import StreamReader

    stream, ends = io.BytesIO(data), []
    try:
        for record in StreamReader(stream, emit_chunks=True).records:
            if isinstance(record, Chunk):
                ends.append(stream.tell())
    except Exception:  # it ends without a footer
        pass
    return ends


@pytest.mark.parametrize("finish", [True, False])
def test_a_changed_byte_never_gives_a_wrong_row(finish):
    data = written(300, every=50, finish=finish)
    rng = np.random.default_rng(1)
    kept = []
    for at, by in zip(rng.integers(0, len(data), 300), rng.integers(1, 256, 300), strict=True):
        damaged = bytearray(data)
        damaged[at] ^= int(by)
        try:
            log = log_of(bytes(damaged), "x")
        except BadInput:
            continue
        kept.append(len(log))
        assert wrong(log) == []
        assert log.columns["tick"].tolist() == list(range(len(log)))
        # a change that costs rows is told of
        assert log.complaint if finish and len(log) < 300 else True
    assert len(kept) > 200
    assert max(kept) == 300


def test_text_that_was_changed_is_said_to_be_lost():
    data = written(100).replace(b'name = "twin"', b'name = "twim"')
    log = log_of(data, "x")
    assert log.header.rig == ""
    assert "Damaged: the text of rig" in log.complaint
    assert len(log) == 100


def test_a_chunk_that_is_missing_ends_the_reading():
    data = written(300, finish=False)
    ends = chunk_ends(data)
    log = log_of(data[: ends[0]] + data[ends[1] :], "x")
    assert len(log) == 100
    assert "message 100 of /samples is missing" in log.complaint


def test_what_is_recovered_is_whole_to_mcap_itself(tmp_path):
    torn = tmp_path / "torn.mcap"
    torn.write_bytes(written(400, finish=False)[:-3000])
    found = recover(torn, tmp_path / "whole.mcap")
    data = (tmp_path / "whole.mcap").read_bytes()
    rows = list(make_reader(io.BytesIO(data), validate_crcs=True).iter_messages(["/samples"]))
    assert len(rows) == len(found.log) == 300
    log = log_of(data, "whole.mcap")
    assert (log.complaint, wrong(log), log.header) == ("", [], HEADER)
    assert log.events[-1].kind == "recovered"
    assert found.lost_bytes == torn.stat().st_size - found.log.readable
    with pytest.raises(BadInput, match="would be overwritten"):
        recover(torn, torn)


def test_events_keep_their_places_among_the_rows_that_are_recovered(tmp_path):
    """Before the first row, between two and behind the last; what was dropped stays said."""
    stream = io.BytesIO()
    file = RunFile(stream, HEADER)
    for k in range(6):
        if k in (0, 3):
            file.event(k * 1e-3, "note", f"before row {k}", dropped=k)
        file.row(row(k))
    file.event(6e-3, "stop", "behind them all")
    file.finish()
    path = tmp_path / "run.mcap"
    path.write_bytes(stream.getvalue())
    recover(path, tmp_path / "whole.mcap")
    events = log_of((tmp_path / "whole.mcap").read_bytes(), "whole.mcap").events
    assert [(e.row, e.text, e.dropped) for e in events] == [
        (0, "before row 0", 0), (3, "before row 3", 3), (6, "behind them all", 0),
    ]  # fmt: skip


def test_viewers_are_told_what_the_numbers_of_modes_and_faults_mean():
    fields = json.loads(row_schema(HEADER))["properties"]
    assert fields["mode"]["description"] == "one of 0 IDLE, 2 HOST, 4 FAULT"
    assert fields["faults"]["description"] == "sum of 2 OVERTRAVEL, 4 OVERSPEED"
    assert "description" not in fields["psi"]
    assert "description" not in json.loads(row_schema(replace(HEADER, modes={})))["properties"]["mode"]
    assert [fields[name]["type"] for name in ("psi", "psi_counts", "mode")] == ["number", "integer", "integer"]


def test_the_tail_of_a_growing_log_is_every_row_once(tmp_path):
    """The file grows by a few bytes whenever nothing new was found, so that chunks are met half written."""
    data, path = written(300, every=30), tmp_path / "run.mcap"
    path.write_bytes(b"")
    at = 0

    def grow() -> bool:
        nonlocal at
        with open(path, "ab") as file:
            file.write(data[at : at + 700])
        at += 700
        return True

    parts = list(follow(path, grow))
    assert np.concatenate([part.columns["tick"] for part in parts]).tolist() == list(range(300))
    assert [event.kind for part in parts for event in part.events] == ["stop"]
    assert len(parts) > 5


def test_a_tail_ends_when_the_wait_is_over(tmp_path):
    path = tmp_path / "run.mcap"
    path.write_bytes(written(200, finish=False))
    assert sum(part.columns["t"].size for part in follow(path, lambda: False)) == 200


@pytest.mark.parametrize(
    ("data", "sentence"),
    [
        (b"t,x\n0,1\n", "no log of a run"),
        (b"\x89MCAP0\r\n", "says nothing of its columns"),
        (written(10).replace(b"\x07\x00\x00\x00upright", b"\x07\x00\x00\x00else???"), "its profile is 'else\\?\\?\\?'"),
    ],
)
def test_what_is_no_log_of_ours_gets_a_sentence(data, sentence):
    with pytest.raises(BadInput, match=sentence):
        log_of(data, "x")


DEEP = 200_000
"""Lists in one another, where Python follows a thousand."""


def nested(where: str, depth: int, monkeypatch) -> bytes:
    """Log of ten rows with lists in one another at one place of its JSON."""
    import upright.logs.layout as layout

    lists, writer = "[" * depth + "]" * depth, layout.row_writer
    if where == "schema":
        monkeypatch.setattr(layout, "row_schema", lambda header: lists.encode())
    elif where in ("row", "value", "unused"):
        texts = {"row": lists, "value": f'{{"t":{lists},"was":', "unused": f'{{"more":{lists},"t":'}

        def message(columns):
            text = writer(columns)
            return lambda row: texts[where].encode() + (b"" if where == "row" else text(row)[len(b'{"t":') :])

        monkeypatch.setattr(layout, "row_writer", message)

    class Header(LogHeader):
        def as_metadata(self):
            given = super().as_metadata()
            if where == "law":
                given["law"] = {"json": f'{{"kind":"linear","A":{lists}}}'}
            elif where == "no law":
                given["law"] = {"json": lists}
            elif where == "header":
                given["log"]["json"] = f'{given["log"]["json"][:-1]},"more":{lists}}}'
            return given

    return written(10, header=Header(**vars(HEADER)))


@pytest.mark.parametrize("where", ["row", "value", "unused", "schema"])
@pytest.mark.parametrize("depth", [2, 500, DEEP])
def test_rows_that_are_lists_in_one_another_are_a_damage(where, depth, monkeypatch):
    """But for what no row needs, as long as Python can follow it."""
    log = log_of(nested(where, depth, monkeypatch), "x")
    if where == "unused" and depth < DEEP:
        assert (wrong(log), log.complaint) == ([], "")
    else:
        assert len(log) == 0
        assert "a row or an event does not follow its schema" in log.complaint


@pytest.mark.parametrize(
    ("where", "depth"),
    [("law", 500), ("law", DEEP), ("no law", 2), ("no law", DEEP), ("header", 500), ("header", DEEP)],
)
def test_a_header_of_lists_in_one_another_gets_a_sentence(where, depth, monkeypatch):
    reason = "not a table of names and values" if depth == 2 else "nested too deeply"
    with pytest.raises(BadInput, match=rf"says nothing of its columns \({reason}\)"):
        log_of(nested(where, depth, monkeypatch), "x")


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"coordinates": ()}, "at least one"),
        ({"period": 0.0}, "above 0"),
        ({"coordinates": (("u", "rad"),)}, "u would stand there twice"),
    ],
)
def test_a_header_that_makes_no_rows_gets_a_sentence(changes, sentence):
    given = {"rig": "", "law": {}, "coordinates": (("x", "m"),), "command_unit": "V", "period": 1.0, "versions": {}}
    with pytest.raises(BadInput, match=sentence):
        LogHeader(**{**given, **changes})


def test_without_the_extra_its_name_is_given(monkeypatch):
    data = written(10)
    monkeypatch.setitem(sys.modules, "mcap.writer", None)
    with pytest.raises(BadInput, match=r"pip install 'upright\[rig\]'"):
        log_of(data, "x")


def test_doctor_and_init_go_by_what_the_log_says_of_its_columns(tmp_path):
    """The command asked for repeats the one applied, and is neither a position nor the drive."""
    path = tmp_path / "run.mcap"
    path.write_bytes(written(3000))
    assert not up.doctor(path).wrong
    drive = tomllib.loads(up.init(path, plant="furuta").value)["drive"]
    assert (drive["column"], drive["unit"]) == ("u_applied", "V")
