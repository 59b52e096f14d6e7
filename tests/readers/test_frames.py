"""Is a log in the files of data frames, Parquet, Feather and JSON, the log that pandas or a list of objects held?"""

from __future__ import annotations

import io
import json
import re

import numpy as np
import pandas as pd
import pytest

from tests.readers import logs
from upright.errors import BadInput
from upright.readers import read_source
from upright.readers.source import Source
from upright.records import Record

N = 240
T = np.round(0.005 * np.arange(N), 6)
FRAME = pd.DataFrame({"time_s": T, "theta [rad]": np.round(np.cos(5 * T), 7), "u": np.sign(np.sin(9 * T))})
BEGUN = pd.Timestamp("2026-03-05 10:00:59.5")


def read(data: bytes | str) -> Record:
    return read_source(Source(file="log.bin", data=data if isinstance(data, bytes) else data.encode()))


def parquet(frame: pd.DataFrame) -> bytes:
    file = io.BytesIO()
    frame.to_parquet(file)
    return file.getvalue()


def feather(frame: pd.DataFrame) -> bytes:
    file = io.BytesIO()
    frame.to_feather(file)
    return file.getvalue()


def stamped(*, index: bool) -> pd.DataFrame:
    frame = FRAME.assign(stamp=BEGUN + pd.to_timedelta(T, unit="s")).drop(columns="time_s")
    return frame.set_index("stamp") if index else frame


LISTS = {name: FRAME[name].tolist() for name in FRAME}
OBJECTS = [{"time_s": t, "arm": {"theta [rad]": a, "u": u}} for t, a, u in FRAME.to_numpy().tolist()]
FILES = {
    "Parquet": parquet(FRAME),
    "Feather": feather(FRAME),
    "stamps, Parquet": parquet(stamped(index=False)),
    "stamps as index": parquet(stamped(index=True)),
    "stamps, Feather": feather(stamped(index=False)),
    **{f"JSON, {o}": FRAME.to_json(orient=o) for o in ("records", "columns", "index", "split", "table")},
    "JSON, lists": json.dumps(LISTS),
    "JSON, lists within": json.dumps({"rig": "arm 3", "period": 0.005, "run": {"data": LISTS}}, indent=2),
    "indexed, no name": parquet(stamped(index=True).rename_axis(None)),
    "JSON, index": FRAME.set_index("time_s").to_json(),
    "JSON, index by rows": FRAME.set_index("time_s").to_json(orient="index"),
    "JSON, split index": FRAME.set_index("time_s").to_json(orient="split"),
    "JSON, time above": json.dumps(
        {"time_s": LISTS["time_s"], "of": "arm 3", "y": {n: LISTS[n] for n in ("theta [rad]", "u")}}
    ),
    "JSON, stamps": stamped(index=False).to_json(orient="records", date_format="iso", date_unit="us"),
}


@pytest.mark.parametrize("name", FILES)
def test_a_frame_comes_back_whole(name):
    record = read(FILES[name])
    names = {n.removeprefix("y."): n for n in record.names}
    np.testing.assert_allclose(record.t, T, rtol=0, atol=1e-9)
    np.testing.assert_array_equal(record[names["theta [rad]"]], FRAME["theta [rad]"])
    np.testing.assert_array_equal(record[names["u"]], FRAME["u"])
    assert record.units[names["theta [rad]"]] == "rad"


def test_names_that_are_numbers_are_no_row():
    record = read(pd.DataFrame(FRAME.to_numpy()).to_json(orient="split"))
    assert record.t.size == N
    np.testing.assert_array_equal(record["c1"], FRAME["theta [rad]"])


def test_objects_within_objects_are_named_by_both():
    record = read(json.dumps(OBJECTS))
    np.testing.assert_array_equal(record["arm.theta [rad]"], FRAME["theta [rad]"])


def test_rows_without_names_are_columns_by_number():
    record = read(json.dumps(FRAME.to_numpy().tolist()))
    np.testing.assert_array_equal(record["c1"], FRAME["theta [rad]"])


def test_of_several_tables_the_largest_is_read_and_the_others_are_named():
    record = read(json.dumps({"calibration": {"x": [1, 2, 3, 4], "y": [2, 4, 6, 8]}, "run": LISTS}))
    np.testing.assert_array_equal(record["u"], FRAME["u"])
    assert "'calibration'" in " ".join(record.provenance.notes)


def test_what_upright_wrote_as_parquet_is_the_same_record(tmp_path):
    written = read(logs.SYNTHETIC["run.mcap"]())
    written.to_parquet(tmp_path / "run.parquet")
    again = read((tmp_path / "run.parquet").read_bytes())
    assert (again.units, again.inputs, again.names) == (written.units, written.inputs, written.names)
    np.testing.assert_array_equal(again.t, written.t)
    for name in written.names:
        np.testing.assert_array_equal(again[name], written[name])


@pytest.mark.parametrize(
    ("data", "sentence"),
    [
        (parquet(FRAME.assign(u=[None, *FRAME["u"][1:]])), "sample 1: expected a value in every row"),
        (parquet(FRAME.assign(who="me")), "expected numbers in the column 'who'"),
        (parquet(FRAME)[:-40], "the file is damaged"),
        (feather(FRAME)[:500], "the file is damaged"),
        (json.dumps([*OBJECTS, {"time_s": 9.0}]), f"sample {N + 1}: expected a value of 'arm.theta [rad]'"),
        (json.dumps(OBJECTS)[:-30], "no whole JSON"),
        (json.dumps({"rig": "arm 3", "name": ["a", "b"]}), "none of its objects is a table"),
        (json.dumps({"t": [0, 1, 2, 3], "x": [0, 1, 2, "high"]}), "expected a finite number"),
    ],
)
def test_what_is_wrong_is_a_sentence(data, sentence):
    with pytest.raises(BadInput, match=re.escape(sentence)):
        read(data)


@pytest.mark.parametrize("kind", [parquet, feather])
def test_no_small_file_unpacks_to_all_memory(kind):
    bomb = kind(pd.DataFrame({"t": np.zeros(20_000_000, dtype=np.int8), "x": np.zeros(20_000_000, dtype=np.int8)}))
    assert len(bomb) < 1 << 20
    with pytest.raises(BadInput, match="more than any log holds"):
        read(bomb)
