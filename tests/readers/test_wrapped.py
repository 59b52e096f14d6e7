"""Is a counter that passes its end counted on, and nothing else?"""

from __future__ import annotations

import numpy as np
import pytest

from upright.errors import BadInput
from upright.readers import read_source
from upright.readers.source import Source
from upright.readers.wrapped import counting_on, counts_per_turn, turned_on, unwrapped

T = 0.002 * np.arange(4000)
TURNS = np.round(16000 / (2 * np.pi) * (30 * T + 4 * np.sin(3 * T)))


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize(
    ("bits", "form"), [(16, np.int16), (16, np.uint16), (8, np.int8), (8, np.uint8), (32, np.int32), (32, np.uint32)]
)
def test_a_counter_of_so_many_bits_is_counted_on_from_its_first_reading(bits, form, sign):
    """As the processor itself counts in more bits, in steps of at most a tenth of the range."""
    swiftest = np.abs(np.diff(TURNS)).max()
    counts = sign * np.round(TURNS * 0.1 * 2.0**bits / swiftest)
    logged = counts.astype(np.int64).astype(form).astype(float)
    values, told, times = unwrapped(logged)
    assert told == bits
    lowest = float(np.iinfo(form).min)
    assert times == int((np.diff((counts - lowest) // 2.0**bits) != 0).sum())
    np.testing.assert_array_equal(values - values[0], counts - counts[0])


@pytest.mark.parametrize(
    "values",
    [
        np.where(np.sin(7 * T) > 0, 32767.0, -32768.0),  # bangs from end to end
        32767.0 * np.sin(7 * T),  # no whole numbers
        np.round(30000 * np.sin(3 * T)),  # stays short of the ends
        np.random.default_rng(1).integers(-32768, 32768, T.size).astype(float),  # jumps by any amount
        np.round(40000 * np.sin(3 * T)),  # more bits than 16
        np.zeros(T.size),
    ],
    ids=["bang-bang", "fractions", "short", "noise", "wider", "nothing"],
)
def test_what_is_no_such_counter_stays_as_it_is(values):
    same, bits, times = unwrapped(values)
    np.testing.assert_array_equal(same, values)
    assert bits == times == 0


def test_the_record_says_which_column_was_counted_on_and_how_often():
    wrapped = (TURNS + 32768) % 65536 - 32768
    rows = "\n".join(f"{t:.3f},{c:.0f},{np.cos(t):.4f}" for t, c in zip(T, wrapped, strict=True))
    record = read_source(Source(file="log.csv", data=f"time,enc,theta\n{rows}\n".encode()))
    np.testing.assert_array_equal(record["enc"], TURNS)
    passed = int((np.diff((TURNS + 32768) // 65536) != 0).sum())
    assert f"'enc' is a counter of 16 bits and passed its end {passed} times; it is counted on here." in (
        record.provenance.notes
    )


ANGLE = 6 * np.sin(0.7 * T) + 3 * np.sin(2.1 * T)  # goes round once and a half each way


@pytest.mark.parametrize(("bits", "turn"), [(12, 4096), (13, 8192), (14, 16384), (16, 0)])
def test_a_magnetic_encoder_begins_again_after_a_turn_and_a_timer_s_counter_after_many(bits, turn):
    counts = np.round(2.0**bits * ANGLE / (2 * np.pi))
    rows = "\n".join(f"{t:.3f},{c:.0f}" for t, c in zip(T, counts % 2**bits, strict=True))
    record = read_source(Source(file="log.csv", data=f"time,arm #1\n{rows}\n".encode()))
    np.testing.assert_array_equal(record["arm #1"] - record["arm #1"][0], counts - counts[0])
    assert counts_per_turn("arm #1", record.provenance.notes) == turn
    assert counts_per_turn("arm", record.provenance.notes) == 0


@pytest.mark.parametrize(("unit", "turn"), [("deg", 360.0), ("rad", 2 * np.pi), ("rev", 1.0)])
@pytest.mark.parametrize("lowest", [0.0, -0.5])
def test_an_angle_that_begins_again_after_a_turn_goes_on(unit, turn, lowest):
    angle = turn * ANGLE / (2 * np.pi)
    logged = np.round((angle - lowest * turn) % turn + lowest * turn, 4)
    on, times = turned_on(logged, unit)
    np.testing.assert_allclose(on - on[0], angle - angle[0], atol=1.01e-4)
    assert times == int((np.diff((angle - lowest * turn) // turn) != 0).sum())


def test_an_angle_that_is_balanced_where_it_begins_again_goes_on():
    """An encoder of 2000 counts a turn, and columns without a unit that are called like angles."""
    tilt = np.round(300 * 0.04 * np.sin(9 * T)) * 0.18
    logged = (tilt + 360) % 360 - 180
    rows = "\n".join(f"{t:.3f},{a:.2f},{np.radians(a):.5f},{a:.2f}" for t, a in zip(T, logged, strict=True))
    record = read_source(Source(file="log.csv", data=f"time,pendulum [deg],theta,u\n{rows}\n".encode()))
    np.testing.assert_allclose(record["pendulum [deg]"] - record["pendulum [deg]"][0], tilt - tilt[0], atol=0.011)
    np.testing.assert_allclose(record["theta"] - record["theta"][0], np.radians(tilt - tilt[0]), atol=2e-5)
    np.testing.assert_allclose(record["u"], logged, atol=0.011)  # a command may bang


@pytest.mark.parametrize(
    "angle",
    [
        180 * np.sign(np.sin(3 * T)),  # a square wave that is to be followed
        170 * np.sin(3 * T),  # never as far as a turn
        (360 * ANGLE[::200] / (2 * np.pi)) % 360,  # so seldom that half a turn is a step
        720 * np.sin(3 * T),
    ],
    ids=["square", "short", "seldom", "on and on"],
)
def test_an_angle_that_does_not_begin_again_stays_as_it_is(angle):
    same, times = turned_on(angle, "deg")
    np.testing.assert_array_equal(same, angle)
    assert times == 0


@pytest.mark.parametrize(
    ("kind", "name", "unit", "step"),
    [(np.uint32, "micros", 1e-6, 5000), (np.int16, "millis", 1e-3, 20), (np.uint16, "t_ms", 1e-3, 20)],
)
def test_a_clock_that_begins_again_goes_on(kind, name, unit, step):
    """As C casts what it counts: of 6000 samples 5 ms or 20 ms apart."""
    exact = 2**32 - 9_000_000 + step * np.arange(6000) + np.random.default_rng(3).integers(-1, 2, 6000)
    clock = exact.astype(kind)
    again = int((np.diff(clock.astype(float)) < 0).sum())
    assert again >= 1
    rows = "\n".join(f"{t} {k}" for t, k in zip(clock, range(6000), strict=True))
    record = read_source(Source(file="log.txt", data=f"{name} u\n{rows}\n".encode()))
    np.testing.assert_allclose(record.t - record.t[0], unit * (exact - exact[0]), atol=1.1 * unit)
    often = "once" if again == 1 else f"{again} times"
    assert f"Its clock of {8 * clock.itemsize} bits began again {often}; the time goes on." in record.provenance.notes


@pytest.mark.parametrize(
    "ticks",
    [
        np.concatenate([np.arange(0, 60_000, 20), np.arange(0, 60_000, 20)]),  # two runs
        np.concatenate([np.arange(0, 60_000, 20), np.arange(59_000, 65_000, 20)]),  # a second goes back
        np.arange(60_000, 0, -20),
        0.5 + np.concatenate([np.arange(0, 65_536, 20), np.arange(4, 60_000, 20)]),
    ],
    ids=["two runs", "back by a second", "downwards", "fractions"],
)
def test_a_time_that_goes_back_otherwise_is_refused(ticks):
    assert counting_on(ticks.astype(float))[1:] == (0, 0)
    rows = "\n".join(f"{t} {k % 7}" for k, t in enumerate(ticks))
    with pytest.raises(BadInput, match="increase"):
        read_source(Source(file="log.txt", data=f"t_ms u\n{rows}\n".encode()))
