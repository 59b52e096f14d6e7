"""Is a log whose numbers have names, units or times of arrival beside them the plain table that it stands for?"""

from __future__ import annotations

import json

import numpy as np
import pytest

from upright.errors import BadInput
from upright.readers import read_source
from upright.readers.labelled import bare_rows
from upright.readers.source import Source

T = np.arange(12) * 0.01
THETA = np.round(0.6 * np.cos(6.2 * T), 4)
TURNS = np.round(100 * np.sin(6.2 * T)).astype(int)


def record(text: str):
    return read_source(Source(file="log.txt", data=text.encode()))


def rows(write, *above: str) -> str:
    return "".join([f"{line}\n" for line in above] + [f"{write(*row)}\n" for row in zip(T, THETA, TURNS, strict=True)])


PLAIN = record(rows(lambda t, a, n: f"{t:.2f},{a:.4f},{n}", "t,theta (rad),turns"))

WRITTEN = {
    "Arduino's serial plotter": rows(lambda t, a, n: f"t:{t:.2f},theta (rad):{a:.4f},turns:{n}"),
    "with tabs": rows(lambda t, a, n: f"t: {t:.2f}\ttheta (rad): {a:.4f}\tturns: {n}"),
    "with blanks": rows(lambda t, a, n: f"t={t:.2f} theta(rad)={a:.4f} turns={n}"),
    "in words": rows(lambda t, a, n: f"t = {t:.2f} s, theta = {a:.4f} rad, turns = {n}"),
    "decimal commas": rows(lambda t, a, n: f"t: {t:.2f} s; theta: {a:.4f} rad; turns: {n}").replace(".", ","),
    "JSON lines": rows(lambda t, a, n: json.dumps({"t": t, "theta (rad)": a, "turns": int(n)})),
    "tuples of Python": rows(lambda t, a, n: f"({t:.2f}, {a:.4f}, {n})", "t, theta (rad), turns"),
    "a timetable of MATLAB": rows(lambda t, a, n: f"{t:.2f} sec,{a:.4f},{n}", "Time,theta (rad),turns"),
    "units in a line of their own": rows(lambda t, a, n: f"{t:.2f}\t{a:.4f}\t{n}", "t\ttheta\tturns", "s\trad\t"),
    "units in brackets": rows(lambda t, a, n: f"{1e3 * t:.0f},{a:.4f},{n}", "Time,theta,turns", "(ms),(rad),()", ""),
    "a first line cut short": rows(lambda t, a, n: f"t:{t:.2f},theta (rad):{a:.4f},turns:{n}", "ta (rad):0.1,turns:3"),
}


@pytest.mark.parametrize("way", WRITTEN)
def test_however_numbers_are_labelled_the_log_is_the_same(way):
    log = record(WRITTEN[way])
    np.testing.assert_allclose(log.t, PLAIN.t, rtol=0, atol=1e-12)
    angle, turns = log.names
    assert angle.replace(" ", "") == "theta(rad)"
    assert (turns, log.units[angle]) == ("turns", "rad")
    np.testing.assert_array_equal(log[angle], PLAIN["theta (rad)"])
    np.testing.assert_array_equal(log["turns"], PLAIN["turns"])


@pytest.mark.parametrize("mark", [" ", ",", "; "])
def test_letters_may_stand_before_their_numbers(mark):
    log = record(rows(lambda t, a, n: mark.join([f"T{t:.2f}", f"A{a:.4f}", f"N{n}"])))
    np.testing.assert_allclose(log.t, PLAIN.t, rtol=0, atol=1e-12)
    assert log.names == ("A", "N")
    np.testing.assert_array_equal(log["A"], PLAIN["theta (rad)"])
    np.testing.assert_array_equal(log["N"], PLAIN["turns"])


def test_names_that_end_in_a_number_are_names():
    log = record(rows(lambda t, a, n: f"{t:.2f},{a:.4f},{n}", "t0,theta1,theta2"))
    assert log.names == ("theta1", "theta2")


ARRIVED = [f"15:03:{12 + 1.003 * t:06.3f} -> " for t in T]


def test_the_time_of_arrival_gives_way_to_the_clock_of_the_board():
    text = rows(lambda t, a, n: f"{ARRIVED[round(100 * t)]}{1e3 * t:.0f},{a:.4f},{n}", "15:03:11.900 -> ready")
    log = record(text.replace("-> ready", "-> ms,theta (rad),turns"))
    np.testing.assert_allclose(log.t, T, rtol=0, atol=1e-12)
    assert log.names == ("theta (rad)", "turns")
    labelled = record(rows(lambda t, a, n: f"{ARRIVED[round(100 * t)]}t_ms:{1e3 * t:.0f},theta:{a:.4f}"))
    np.testing.assert_allclose(labelled.t, T, rtol=0, atol=1e-12)


@pytest.mark.parametrize("unit", [1.0, 1e-3, 1e-6])
def test_the_time_of_arrival_says_what_a_clock_without_a_name_counts(unit):
    digits = round(-np.log10(unit))
    log = record(rows(lambda t, a, n: f"{ARRIVED[round(100 * t)]}{t / unit:.{max(2 - digits, 0)}f},{a:.4f},{n}"))
    np.testing.assert_allclose(log.t, T, rtol=0, atol=1e-9)
    np.testing.assert_array_equal(log["c1"], THETA)
    assert f"counts {unit:g} s" in str(log.provenance)


def test_an_angle_that_grows_is_no_clock():
    log = record(rows(lambda t, a, n: f"{ARRIVED[round(100 * t)]}{7.3 * t:.3f},{a:.4f}"))
    np.testing.assert_allclose(log.t, np.round(1.003 * T, 3), rtol=0, atol=5e-4)
    np.testing.assert_allclose(log["c1"], 7.3 * T, rtol=0, atol=1e-3)


@pytest.mark.parametrize("label", ["", "theta:"])
def test_where_a_board_sends_no_clock_the_time_is_that_of_arrival_and_the_log_says_so(label):
    log = record(rows(lambda t, a, n: f"{ARRIVED[round(100 * t)]}{label}{a:.4f}"))
    np.testing.assert_allclose(log.t, np.round(1.003 * T, 3), rtol=0, atol=5e-4)
    np.testing.assert_array_equal(log[log.names[0]], THETA)
    assert "times are those at which lines arrived" in str(log.provenance)
    assert log.names == ("theta",) or not label


def test_rows_of_bare_numbers_are_left_as_they_are():
    for text in ("t,x\n0,1\n1,2\n", "# t [s]  x (rad)\n0.0 1e5\n0.1 -2.\n", "0;0,5\n1;0,6\n", "t,state\n0,on\n1,off\n"):
        assert bare_rows(text) == (text, ())


@pytest.mark.parametrize(
    ("torn", "line"), [("t:0.12,thet\n", 13), ("t:0.12,phi (rad):0.1,turns:3\n", 13), ("t:0.12,theta (rad):\n", 13)]
)
def test_a_row_with_other_labels_is_refused_with_its_line(torn, line):
    with pytest.raises(BadInput, match=rf"line {line}\b"):
        record(WRITTEN["Arduino's serial plotter"] + torn + "t:0.13,theta (rad):0.2,turns:4\n")


@pytest.mark.parametrize(("digits", "unit"), [(0, "s"), (3, "ms"), (6, "us"), (9, "ns")])
def test_a_stamp_since_1970_counts_what_its_size_says(digits, unit):
    """A float64 of nanoseconds since 1970 resolves 256 of them."""
    first = 1_764_342_192 * 10**digits
    steps = [10**digits * k for k in range(5)]
    log = record("timestamp,x\n" + "".join(f"{first + step},{k}\n" for k, step in enumerate(steps)))
    np.testing.assert_array_equal(log.t, np.arange(5.0))
    assert "epoch 1764342192.000000 s" in str(log.provenance)
