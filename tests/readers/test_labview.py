"""Is a LabVIEW measurement read as National Instruments specify it, whatever its separators and columns?"""

from __future__ import annotations

import numpy as np
import pytest

from upright.errors import BadInput
from upright.readers import read_source
from upright.readers.source import Source

T = np.arange(40) * 0.01
ANGLE, DRIVE = 20 * np.cos(6 * T), np.where(T < 0.2, 0.0, 2.5)
HEAD = (
    "LabVIEW Measurement\t\nWriter_Version\t2\nReader_Version\t2\nSeparator\tTab\nDecimal_Separator\t.\n"
    "Multi_Headings\tYes\nX_Columns\tOne\nTime_Pref\tAbsolute\nOperator\tstudent\nDate\t2026/03/01\n"
    "Time\t10:15:30.5\n***End_of_Header***\t\n\t\n"
)


def segment(names="X_Value\tAngle\tDrive\tComment", rows=None, start=0):
    head = (
        "Channels\t2\nSamples\t40\t40\nY_Unit_Label\tdeg\tVolts\nX_Dimension\tTime\tTime\nX0\t0.0E+0\t0.0E+0\n"
        "Delta_X\t0.010000\t0.010000\n***End_of_Header***\n"
    )
    rows = (
        [f"{t + start:.6f}\t{a:.9f}\t{d:.9f}" for t, a, d in zip(T, ANGLE, DRIVE, strict=True)]
        if rows is None
        else rows
    )
    return head + names + "\n" + "\n".join(rows) + "\n"


def log(text):
    return read_source(Source(file="run.lvm", data=text.encode()))


COLUMNS = list(zip(T, ANGLE, DRIVE, strict=True))
WRITTEN = {
    "one time": HEAD + segment(),
    "a remark": HEAD + segment().replace("\t2.500000000\n", "\t2.500000000\tstep\n", 1),
    "no time": HEAD + segment(rows=[f"\t{a:.9f}\t{d:.9f}" for _, a, d in COLUMNS]),
    "a time each": HEAD + segment(
        "X_Value\tAngle\tX_Value\tDrive\tComment", [f"{t:.6f}\t{a:.9f}\t{t:.6f}\t{d:.9f}" for t, a, d in COLUMNS]
    ),
    "decimal commas": (HEAD.replace("Separator\t.", "Separator\t,") + segment().replace(".", ",")),
    "Windows": (HEAD + segment()).replace("\n", "\r\n"),
}  # fmt: skip


@pytest.mark.parametrize("way", WRITTEN)
def test_every_layout_is_the_same_log(way):
    record = log(WRITTEN[way])
    np.testing.assert_allclose(record.t, T, rtol=0, atol=1e-9)
    np.testing.assert_allclose(record["Angle"], ANGLE, rtol=0, atol=1e-8)
    np.testing.assert_allclose(record["Drive"], DRIVE, rtol=0, atol=1e-8)
    assert record.units == {"Angle": "deg", "Drive": "V"}
    assert "Begun 2026/03/01 10:15:30.5." in record.provenance.notes


def test_segments_that_go_on_in_time_are_one_run_and_others_are_refused():
    both = log(HEAD + segment() + "\t\n" + segment(start=0.4))
    assert len(both) == 80
    np.testing.assert_allclose(both.t, np.arange(80) * 0.01, atol=1e-9)
    with pytest.raises(BadInput, match=r"sample 41.*runs of their own"):
        log(HEAD + segment() + segment())
    with pytest.raises(BadInput, match="different channels"):
        log(HEAD + segment() + segment(names="X_Value\tAngle\tSpeed\tComment", start=0.4))


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (HEAD, "one of a segment, got 1"),
        (HEAD + segment(rows=["0.0\t1.0\t2.0", "0.01\t1.0"]), "line 23.*Drive.*empty cell"),
        (HEAD + segment(rows=["\t1.0\t2.0"]).replace("Delta_X", "Delta"), "no Delta_X"),
        (HEAD + segment("X_Value\ta\tX_Value\tb\tComment", ["0\t1\t0.5\t2"]), "times of their own"),
        (HEAD + segment(rows=[]), "no rows of numbers"),
    ],
)
def test_what_cannot_be_read_is_a_sentence(text, sentence):
    with pytest.raises(BadInput, match=sentence):
        log(text)
