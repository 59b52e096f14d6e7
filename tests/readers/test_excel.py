"""Is a sheet of Excel the log that it would be as text?"""

from __future__ import annotations

import io
from datetime import datetime, timedelta
from zipfile import ZIP_DEFLATED, ZipFile

import numpy as np
import pytest

from upright.errors import BadInput
from upright.readers import read_source
from upright.readers.source import Source

openpyxl = pytest.importorskip("openpyxl")

T = np.arange(30) * 0.01
ANGLE = 20 * np.cos(6 * T)


def book(*sheets):
    """Sheets by name, each a list of rows."""
    made = openpyxl.Workbook()
    made.remove(made.active)
    for name, rows in sheets:
        sheet = made.create_sheet(name)
        for row in rows:
            sheet.append(row)
    stream = io.BytesIO()
    made.save(stream)
    return Source(file="run.xlsx", data=stream.getvalue())


def table(first, names=("Time (s)", "Angle (deg)", "Voltage (V)")):
    return [names, *([t, a, 0] for t, a in zip(first, ANGLE.tolist(), strict=True))]


SHEETS = {
    "the only one": [("Sheet1", table(T.tolist()))],
    "behind notes": [("notes", [["Run 3"], ["J. Doe"]]), ("data", table(T.tolist()))],
    "in a corner": [("data", [[], [None, "Run 3"], *([None, *row] for row in table(T.tolist()))])],
    "units below": [("data", [("Time", "Angle", "Voltage"), ("s", "deg", "V"), *table(T.tolist())[1:]])],
    "milliseconds": [("data", table([10 * k for k in range(30)], ("Time (ms)", "Angle (deg)", "Voltage (V)")))],
    "dates": [("data", table([datetime(2026, 3, 1, 12) + timedelta(milliseconds=10 * k) for k in range(30)]))],
}  # fmt: skip


@pytest.mark.parametrize("way", SHEETS)
def test_every_layout_is_the_same_log(way):
    record = read_source(book(*SHEETS[way]))
    np.testing.assert_allclose(record.t, T, rtol=0, atol=1e-6)  # Excel keeps dates to some microseconds
    (angle,) = (n for n in record.names if n.startswith("Angle"))
    np.testing.assert_allclose(record[angle], ANGLE, rtol=1e-15)  # openpyxl writes sixteen digits
    assert record.units[angle] == "deg"
    assert record.provenance.reader == "excel"


def test_which_sheet_was_taken_is_told():
    notes = read_source(book(("a", table(T.tolist())), ("b", table(T.tolist())))).provenance.notes
    assert notes[0] == "Sheet 'a', of a, b."


@pytest.mark.parametrize(
    ("source", "sentence"),
    [
        (Source(file="old.xls", data=b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(600)), "save it as .xlsx or CSV"),
        (book(("notes", [["Run 3"]])), "none of its sheets has rows of numbers: notes"),
        (
            book(("data", [("Time (s)", "Angle"), (0.0, 1.0), (0.01, None), (0.02, 2.0)])),
            "Sheet 'data' of .*line 3.*Angle",
        ),
    ],
)
def test_what_cannot_be_read_is_a_sentence(source, sentence):
    with pytest.raises(BadInput, match=sentence):
        read_source(source)


def test_a_bomb_and_a_torn_file_are_sentences():
    stream = io.BytesIO()
    with ZipFile(stream, "w", ZIP_DEFLATED) as file:
        file.writestr("xl/workbook.xml", bytes(64 << 20))
    with pytest.raises(BadInput, match="unpack to more than any log holds"):
        read_source(Source(file="bomb.xlsx", data=stream.getvalue()))
    with pytest.raises(BadInput):
        read_source(Source(file="torn.xlsx", data=book(("data", table(T.tolist()))).data[:-400]))
