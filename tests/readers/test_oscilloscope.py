"""Is a screen of an oscilloscope read as its maker writes it: times, channels and units?"""

from __future__ import annotations

import numpy as np
import pytest

from upright.errors import BadInput
from upright.readers import read_source
from upright.readers.source import Source

STEP = 0.004
T = STEP * np.arange(-50, 250)
DRIVE, SWING = np.where(T < 0, 0.0, 1.5), 2.43 + 0.8 * np.cos(6 * T)


def rows(form: str) -> list[str]:
    return [form.format(k=k, t=t, u=u, y=y) for k, (t, u, y) in enumerate(zip(T, DRIVE, SWING, strict=True))]


def beside() -> list[str]:
    """Tektronix TDS 2000: the header stands beside the first rows, a channel in a file."""
    head = ["Record Length,3.0e+02", "Sample Interval,4.0e-03", "Trigger Point,5.0e+01", ",", ",", "Source,CH2"]
    head += ["Vertical Units,V", "Vertical Scale,1.0e+00", "Horizontal Units,s"]
    return [f"{(head[k : k + 1] or [','])[0]},,{row}" for k, row in enumerate(rows("{t:.9f},{y:.5f},"))]


SCREENS = {
    "Rigol": ["X,CH1,CH2,Start,Increment,", f"Sequence,Volt,Volt,{T[0]:.6e},{STEP:.6e}", *rows("{k},{u:.3e},{y:.5e},")],
    "Keysight": ["x-axis,1,2", "second,Volt,Volt", *rows("{t:+.9E},{u:+.5E},{y:+.5E}")],
    "Siglent": [
        "Record Length,Analog:300", "Sample Interval,0.004", "Vertical Units,V,V", "Horizontal Units,s",
        "Model Number,SDS1104X-E", "Source,CH1,CH2", "Second,Volt,Volt", *rows("{t:.9f},{u:.5f},{y:.5f}"),
    ],
    "Tektronix": beside(),
}  # fmt: skip


def log(lines: list[str], end: str = "\n"):
    return read_source(Source(file="screen.csv", data=(end.join(lines) + end).encode()))


@pytest.mark.parametrize("end", ["\n", "\r\n"])
@pytest.mark.parametrize("maker", SCREENS)
def test_every_makers_screen_is_the_same_log(maker, end):
    record = log(SCREENS[maker], end)
    assert record.provenance.reader == "oscilloscope"
    np.testing.assert_allclose(record.t, T, rtol=0, atol=1e-9)
    np.testing.assert_allclose(record["CH2"], SWING, rtol=0, atol=6e-6)
    assert record.units["CH2"] == "V"
    if maker != "Tektronix":
        np.testing.assert_array_equal(record["CH1"], DRIVE)


def test_a_screen_without_its_step_is_refused_with_the_line():
    with pytest.raises(BadInput, match="line 2: expected the first time and the step"):
        log(["X,CH1,Start,Increment,", "Sequence,Volt,,", *rows("{k},{y:.3f},,")])


def test_a_cell_that_is_no_number_is_named_by_its_line():
    lines = [*SCREENS["Keysight"]]
    lines[7] = "-1.76E-01,clip,+3.0E+00"
    with pytest.raises(BadInput, match=r"line 8, column 2 \(CH1\).*'clip'"):
        log(lines)


def test_a_table_whose_first_column_is_called_x_is_no_screen():
    lines = [f"{t:.3f},{y:.4f}" for t, y in zip(T + 1, SWING, strict=True)]
    assert log(["x,theta", *lines]).provenance.reader == "table"


def test_a_channel_without_a_unit_is_refused():
    lines = [*SCREENS["Keysight"]]
    lines[1] = "second,Volt"
    with pytest.raises(BadInput, match="line 2: expected a unit for each channel, got 2 and 1"):
        log(lines)


def test_what_is_no_screen_is_refused_where_the_reader_is_named():
    with pytest.raises(BadInput, match="expected the header of an oscilloscope's export"):
        read_source(Source(file="log.csv", data=b"t,theta\n0,1\n1,2\n"), reader="oscilloscope")
