"""Is a column's name read as the time, or as a unit, only where it says so?"""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from upright.errors import BadInput
from upright.records import Record
from upright.records.columns import ANGLES, LENGTHS, bare_name, stated_unit, take_time, time_scale
from upright.units import scale


@pytest.mark.parametrize(
    ("name", "seconds"),
    [
        ("t", 1), ("Time", 1), (" TIMESTAMP ", 1), ("tout", 1), ("__time", 1), ("seconds", 1), ("time_s", 1),
        ("time [ms]", 1e-3), ("Time (s)", 1), ("t [ us ]", 1e-6), ("t(\u00b5s)", 1e-6), ("t_\u03bcs", 1e-6),
        ("t [ns]", 1e-9), ("time [min]", 0), ("t_us", 1e-6), ("time_ms", 1e-3),
        ("timestamp_ns", 1e-9), ("t_sec", 1), ("t_x", 0), ("theta", 0), ("theta_s", 0),
        ("Zeit (ms)", 1e-3), ("temps", 1), ("ms", 1e-3), ("\u00b5s", 1e-6), ("s", 0),  # s may be a position
        ("millis", 1e-3), ("micros()", 1e-6), ("time_millis", 1e-3), ("time [seconds]", 1), ("t (sec)", 1),
        ("Time [msec]", 1e-3), ("t_usec", 1e-6), ("millis()", 1e-3), ("micros", 1e-6), ("t_seconds", 1), ("sec", 1),
        ("Zeit/s", 1), ("t / ms", 1e-3), ("time, ms", 1e-3), ("Zeit in s", 1), ("Time (sec.)", 1), ("x/s", 0),
        ("Time (milliseconds)", 1e-3), ("time [s, of arrival]", 1), ("Time (hh:mm:ss)", 0), ("m/s", 0),
        ("", 0), ("x [ms]", 0), ("t" + " " * 199, 1),
    ],
)  # fmt: skip
def test_a_column_is_a_time_by_its_name_and_its_unit(name, seconds):
    assert time_scale(name) == seconds


@pytest.mark.parametrize("unit", [*ANGLES, *LENGTHS])
def test_units_of_places_are_worth_what_pint_says(unit):
    assert (ANGLES | LENGTHS)[unit] == pytest.approx(scale(unit), rel=1e-15)


@pytest.mark.parametrize(
    ("name", "unit"),
    [
        ("theta [rad]", "rad"), ("u (V)", "V"), ("a [b] [deg]", "deg"), ("x [ mm ] ", "mm"), ("x [bogus]", ""),
        ("x", ""), ("Pendel (\u00b0)", "deg"), ("arm [degrees]", "deg"), ("angle [Radians]", "rad"),
        ("x [V] raw", ""), ("k" * 300 + " [V]", "V"), ("Angle (deg, 0 = up)", "deg"), ("a (degrees; raw)", "deg"),
        ("a [m/s^2, filtered]", "m/s^2"), ("probe (1,5 V)", ""), ("a (left, right)", ""), ("a [, V]", ""),
        # DIN 1313: a symbol through its unit; m/s is one unit, whatever stands before it
        ("Zeit/s", "s"), ("\u03c6/rad", "rad"), ("U / V", "V"), ("omega/(rad/s)", "rad/s"), ("a [N/(m s)]", "N/(m s)"),
        ("Angle, deg", "deg"), ("Weg in mm", "mm"), ("m/s", ""), ("v m/s", ""), ("v/m/s", ""), ("rad/s", ""),
        ("dx/dt", ""), ("left/right", ""), ("encoder/A", ""), ("/arm/m", ""), ("u_V", ""), ("theta/", ""),
    ],
)  # fmt: skip
def test_a_unit_stands_in_brackets_behind_a_name(name, unit):
    assert stated_unit(name) == unit


def frame(**columns):
    return pd.DataFrame(columns)


def test_the_one_column_called_like_a_time_is_the_time_wherever_it_stands():
    t, rest = take_time(frame(u=[1.0, 2.0], t_ms=[0, 20], y=[3.0, 4.0]))
    np.testing.assert_allclose(t, [0, 0.02])
    assert list(rest.columns) == ["u", "y"]
    np.testing.assert_array_equal(rest["y"], [3, 4])


def test_an_index_that_was_set_is_the_time_and_one_that_counts_rows_is_none():
    t, rest = take_time(frame(u=[1.0, 2.0], t=[5, 6]).set_index("t"))
    assert (t.tolist(), list(rest.columns)) == ([5.0, 6.0], ["u"])
    t, rest = take_time(frame(u=[1.0, 2.0], t=[5, 6]).set_index(pd.Index([0.25, 0.5])))
    assert (t.tolist(), list(rest.columns)) == ([0.25, 0.5], ["u", "t"])
    t, _ = take_time(frame(u=[1.0, 2.0], t=[5, 6]).set_index(pd.Index([7, 9], name="row")))
    assert t.tolist() == [5.0, 6.0]


def test_a_named_time_counts_in_its_unit_or_in_seconds():
    assert take_time(frame(clock=[1, 3], u=[0.0, 1.0]), "clock")[0].tolist() == [1.0, 3.0]
    np.testing.assert_allclose(take_time(frame(t_us=[1, 3], t=[0.0, 1.0]), "t_us")[0], [1e-6, 3e-6])
    ago = pd.to_timedelta([250, 750], unit="ms")
    assert take_time(pd.DataFrame({"u": [0.0, 1.0]}, index=ago))[0].tolist() == [0.25, 0.75]


SMALL = {"t": [0.0, 0.1, 0.2], "signals": {"x": [1.0, 2.0, 4.0]}}


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"t": [0.0, 0.3, 0.1]}, "sample 3 is at 0.1 s after 0.3 s; sort the rows"),
        ({"t": [0.0, 0.1, 0.1 + 5e-13]}, "advance by 1e-12 s or more from sample to sample, but sample 3 comes 5"),
        ({"signals": {"x": [1.0, 2.0]}}, "Column 'x' needs 3 samples, one per time, got 2"),
        ({"signals": {"x": [1.0, -2e30, 4]}}, "column 'x' must be finite and below 1e+30, got -2e+30 at sample 2"),
        ({"signals": {"x": [1.0, 2, np.nan]}}, "got nan at sample 3"),
        ({"signals": {"x": np.zeros((3, 2))}}, "must be one-dimensional, got shape (3, 2)"),
        ({"inputs": ("y",)}, "no column 'y', named under inputs"),
        ({"outputs": ("y",)}, "no column 'y', named under outputs"),
        ({"units": {"y": "V"}}, "no column 'y', named under units"),
    ],
)
def test_a_record_that_cannot_be_is_refused_by_sample(changes, sentence):
    with pytest.raises(BadInput) as caught:
        Record(**(SMALL | changes))
    assert sentence in str(caught.value)


def test_a_record_at_its_limits_is_one():
    assert len(Record(t=[0.0, 2e-12], signals={"x": [1e30, -1e30]})) == 2


def test_a_window_holds_two_samples_or_says_how_many():
    record = Record(**SMALL)
    assert record.window(0.1, 0.2).t.tolist() == [0.1, 0.2]
    assert record.window(0.05, 0.3)["x"].tolist() == [2.0, 4.0]
    for start, stop, count in ((0.11, 0.2, 1), (0.05, 0.15, 1), (0.3, 0.2, 0)):
        with pytest.raises(
            BadInput, match=rf"holds {count} samples and needs at least 2; this record runs from 0 to 0\.2 s"
        ):
            record.window(start, stop)


def test_a_column_that_is_not_there_is_answered_with_those_that_are():
    with pytest.raises(BadInput, match=r"the log has no column 'z'; .* \(it holds x\)"):
        Record(**SMALL)["z"]


def test_a_description_of_columns_that_were_dropped_leaves_them_out():
    whole = Record(
        t=[0, 1], signals={"x": [1, 2], "y": [3, 4]}, units={"x": "V", "y": "rad"}, inputs=("x",), outputs=("y",)
    )
    back = Record.rebuild([0, 1], {"x": [1, 2]}, whole.describe(), {"x": "mV"})
    assert (back.units, back.inputs, back.outputs) == ({"x": "mV"}, ("x",), ())
    plain = Record.rebuild([0, 1], {"x": [1, 2]}, "")
    assert plain.units == {"x": ""}
    for text in ("{", "3", '{"provenance": 3}', '{"provenance": {"window": ["a"]}}'):
        with pytest.raises(BadInput, match="must be the JSON this package wrote, got"):
            Record.rebuild([0, 1], {"x": [1, 2]}, text)


@pytest.mark.parametrize(
    ("name", "bare"),
    [
        ("theta [deg]", "theta"), ("theta (counts)", "theta"), ("theta_rad", "theta"), ("x_1", "x_1"), ("x_mm", "x"),
        ("u [V]", "u"), ("_m", "_m"), ("psi", "psi"), ("f(x) [m]", "f(x)"),
        ("Winkel/deg", "Winkel"), ("omega/(rad/s)", "omega"), ("Angle, deg", "Angle"), ("m/s", "m/s"), ("u_V", "u_V"),
    ],
)  # fmt: skip
def test_a_name_without_its_unit(name, bare):
    assert bare_name(name) == bare
