"""Is what is said of each column and of the time base true on both sides of every limit?"""

from __future__ import annotations

import math

import numpy as np
import pytest

from upright.errors import BadInput
from upright.readers import inspect
from upright.readers.inspection import (
    Column,
    copy_of,
    dac_levels,
    difference_of,
    effort_unit,
    first_outlier,
    follows_encoder,
    remarks,
    sample_index,
    time_base,
    time_copy,
)
from upright.records import Provenance, Record


def column(name: str, x: np.ndarray, *, unit: str = "", dt: float = 0.01) -> Column:
    x = np.asarray(x, dtype=float)
    record = Record(t=dt * np.arange(x.size), signals={name: x}, units={name: unit})
    return inspect(record).columns[0]


WAVE = 0.7 * np.sin(0.05 * np.arange(200)) + 0.1 * np.sqrt(np.arange(200))
WHOLE = np.tile([0, 3, 1, 4], 50)


@pytest.mark.parametrize(
    ("name", "x", "unit"),
    [
        ("theta", WAVE, "rad"),
        ("pendulum", WAVE, "rad"),
        ("theta_dot", WAVE, "rad/s"),
        ("joint1/velocity", WAVE, "rad/s"),
        ("cart speed", WAVE, ""),
        ("theta_dot", 30 * WHOLE, ""),
        ("x", 5 * WHOLE, "counts"),  # whole, over 20
        ("x", 20 / 4 * WHOLE + 0.5 * (WHOLE == 1), "m"),
        ("signal", np.r_[WHOLE, 19], ""),
        ("signal", np.r_[WHOLE, 20], "counts"),
        ("enc", WHOLE, "counts"),
        ("enc", 0 * WHOLE, ""),
        ("signal", 2 * math.pi / 2000 * np.round(500 * WAVE), "rad"),  # steps of an encoder
        ("theta", np.r_[WAVE, 1999.5], "rad"),
        ("theta", np.r_[WAVE, -2000], ""),
        ("arm effort", WAVE, ""),
        ("voltage", WAVE, "V"),
        ("u", WAVE, "V"),
        ("position", WAVE, "m"),
        ("x2", WAVE, "m"),
        ("px", WAVE, ""),
        ("/joint_states/slider_to_cart/position", WAVE, "m"),
        ("/joint_states/cart_to_pole/position", WAVE, "rad"),
        ("cart_position", WAVE, "m"),
        ("cart_position", 100 * WAVE, ""),
        ("pole", WAVE, "rad"),
        ("tau_Nm", WAVE, "N m"),
        ("n", np.arange(200) + 7, "1"),
    ],
)
def test_the_unit_of_a_column_is_guessed_from_its_name_and_its_steps(name, x, unit):
    assert column(name, x).guess == unit


def test_a_stated_unit_goes_before_any_guess():
    seen = column("theta", 2 * math.pi / 2000 * np.round(500 * WAVE), unit="m")
    assert (seen.unit, seen.guess) == ("m", "m")
    assert seen.resolution.counts_per_rev is None  # a length has steps, and no revolutions
    assert seen.resolution.step == pytest.approx(2 * math.pi / 2000)


@pytest.mark.parametrize(
    ("name", "unit"),
    [
        ("u [V]", "V"), ("i (mA)", "mA"), ("f_1 [N]", "N"), ("tau_Nm", "N m"), ("t_mA", "mA"), ("F[ N m ]", "N m"),
        ("u", ""), ("u [bogus]", ""), ("v [m/s]", ""), ("x [V]", ""), ("u [V] raw", ""), ("tau [1]", ""),
    ],
)  # fmt: skip
def test_an_effort_states_its_unit_in_its_name(name, unit):
    assert effort_unit(name) == unit


def steps(changes: int, levels: int = 2, size: int = 100) -> np.ndarray:
    """Signal of `levels` values that changes so often, the last time at sample `changes`."""
    return 0.25 + 0.5 * (np.minimum(np.arange(size), changes) % levels)


@pytest.mark.parametrize(
    ("name", "x", "drive"),
    [
        ("signal", steps(10), True),
        ("signal", steps(11), False),
        ("signal", steps(1), True),
        ("signal", steps(10, 5), True),
        ("signal", steps(10, 6), False),
        ("theta", steps(10), False),  # an angle
        ("x", steps(10), False),  # a length
        ("enc", 4 * steps(10) - 1, False),  # counts
        ("signal", 0 * WAVE, False),
        ("Control Effort", WAVE, True),
        ("i", WAVE, True),
        ("f [N]", WAVE, True),
    ],
)
def test_a_drive_is_told_by_its_name_or_by_its_few_steps(name, x, drive):
    assert column(name, x).drive is drive


@pytest.mark.parametrize(
    ("x", "idle", "constant"), [(0 * WAVE, True, True), (0 * WAVE + 2, False, True), (WAVE, False, False)]
)
def test_a_drive_is_idle_that_never_leaves_zero(x, idle, constant):
    seen = column("command", x)
    assert (seen.idle, seen.constant) == (idle, constant)
    assert not column("theta", 0 * WAVE).idle


def test_up_to_twelve_steps_are_told_one_by_one():
    x = steps(12, 13, 200)
    seen = column("command", x)
    assert seen.stepwise
    assert seen.switches == tuple((pytest.approx(0.01 * k), 0.25 + 0.5 * k) for k in range(1, 13))
    assert not column("command", steps(13, 14, 200)).stepwise
    assert not column("command", np.full(9, 2.0)).stepwise
    assert column("command", np.full(9, 2.0)).switches == ()
    assert column("theta", steps(12, 13, 200)).switches == ()


@pytest.mark.parametrize(
    ("before", "after", "switches"),
    [
        (30, 20, ((0.3, 0.5), (0.8, 0.0))),
        (0, 20, ((0.5, 0.0),)),
        (30, 0, ((0.3, 0.5),)),
        (1, 1, ((0.01, 0.5), (0.51, 0.0))),
    ],
)
def test_of_more_steps_the_first_and_the_last_are_told(before, after, switches):
    x = np.r_[np.zeros(before), 0.5 + np.arange(50), np.zeros(after)]
    assert column("command", x).switches == tuple(map(pytest.approx, switches))


@pytest.mark.parametrize(
    ("first", "last", "turns"), [(2.2, 2.9, 2), (3.1, 1.4, 1), (-3.0, 1.0, 1), (-2.0, -3.0, -2), (0.4, 5.0, 0)]
)
def test_whole_turns_are_those_of_the_end_nearer_to_zero(first, last, turns):
    x = 2 * math.pi * np.linspace(first, last, 150)
    assert column("theta", x).turns == turns
    assert column("theta", x, unit="deg").turns == 0


def test_extremes_of_a_column_are_its_lowest_and_its_highest_value():
    seen = column("theta", WAVE)
    assert (seen.low, seen.high) == (WAVE.min(), WAVE.max())


@pytest.mark.parametrize(
    ("x", "low", "high"),
    [
        (np.r_[np.arange(50.0) + 0.5 * (np.arange(50) == 7), 49, 49], 0, 3 / 52),
        (np.r_[np.arange(50.0) + 0.5 * (np.arange(50) == 7), 49], 0, 0),  # two samples are a turning point
        (np.r_[0, 0, np.arange(50.0)], 3 / 52, 0),
        (np.r_[np.arange(11.0), 10, 10], 0, 0),  # few levels are no saturation
        (np.r_[np.arange(12.0), 11, 11], 0, 3 / 14),
        (np.r_[np.arange(12.0), 11, 11, 5, 11], 0, 4 / 16),
        (np.full(20, 3.0), 0, 0),
    ],
)
def test_a_signal_is_pinned_where_it_stays_for_three_samples(x, low, high):
    seen = column("theta", x)
    assert (seen.low_share, seen.high_share) == (pytest.approx(low), pytest.approx(high))


@pytest.mark.parametrize("amplitude", [190.6, 191.0, 191.49])
@pytest.mark.parametrize("slow", [400, 1111])
def test_the_top_of_a_sine_that_is_put_out_in_steps_is_no_limit(amplitude, slow):
    """On its last step a parabola stays at most 1/(sqrt(2) - 1) times as long as on the one before."""
    sine = amplitude * np.sin(2 * np.pi * (np.arange(20 * slow) + 0.3) / slow)
    seen = column("u", np.round(sine) * 0.0235)
    assert (seen.low_share, seen.high_share) == (0, 0)
    cut = column("u", np.round(np.clip(sine, -170, 170)) * 0.0235)
    share = np.mean(sine > 169.5)
    assert (cut.low_share, cut.high_share) == (pytest.approx(share, rel=0.02), pytest.approx(share, rel=0.02))


@pytest.mark.parametrize(("name", "unit"), [("loop_us", "us"), ("exec_time_ms", "ms"), ("dt", "s")])
def test_a_column_named_after_a_unit_of_time_is_no_counter(name, unit):
    assert column(name, 350 + 30 * np.round(WAVE * 10)).guess == unit


def test_the_volts_of_a_supply_drive_nothing():
    for name in ("battery_voltage", "vbat", "supply [V]", "v_bus"):
        assert not column(name, 12 + 0.1 * WAVE).drive
    assert column("motor_voltage", 12 * WAVE).drive


def resting(*still: tuple[int, int], size: int = 1000, creep: float = 0.0) -> np.ndarray:
    """Signal over [-1, 1] that stays, or creeps by `creep` of its range in 25 samples, from sample a to before b."""
    x = np.where(np.arange(size) % 2, 1.0, -1.0)
    for a, b in still:
        x[a:b] = creep * 2 * np.arange(b - a) / 24
    return x


@pytest.mark.parametrize(
    ("x", "rests"),
    [
        (resting((100, 200)), [(1.0, 1.99)]),
        (resting((0, 100), (900, 1000)), [(0, 0.99), (9.0, 9.99)]),
        (resting((100, 150)), []),  # 0.49 s
        (resting((100, 175)), [(1.0, 1.74)]),
        (resting((100, 200), size=10_025), []),  # 0.99 s of more than 100 s
        (resting((100, 225), size=10_025), [(1.0, 2.24)]),
        (resting((100, 200), creep=0.009), [(1.0, 1.99)]),
        (resting((100, 200), creep=0.011), []),
        (np.r_[np.zeros(49), 1.0][:49], []),  # shorter than two spans
    ],
)
def test_a_rest_lasts_half_a_second_and_a_hundredth_of_the_record(x, rests):
    """Looked at in spans of 25 samples of 10 ms."""
    seen = inspect(Record(t=0.01 * np.arange(x.size), signals={"theta": x}))
    assert seen.rests == tuple(map(pytest.approx, rests))


def test_a_rest_is_one_of_all_that_is_measured():
    """A drive, a constant and a copy of the time do not move a rig."""
    t = 0.01 * np.arange(1000)
    one, two = resting((100, 300)), resting((200, 400))
    signals = {"theta": one, "phi": two, "command": resting(), "alpha": 0 * t, "received": t + 0.002}
    assert inspect(Record(t=t, signals=signals)).rests == (pytest.approx((2.0, 2.99)),)
    assert inspect(Record(t=t, signals={"command": one})).rests == ()


def test_twelve_rests_are_told():
    x = resting(*((200 * k, 200 * k + 100) for k in range(14)), size=2800)
    seen = inspect(Record(t=0.01 * np.arange(x.size), signals={"theta": x}))
    assert [round(start) for start, _ in seen.rests] == list(range(0, 24, 2))


def test_an_inspection_says_whose_log_it_is_and_finds_a_column():
    record = Record(
        t=[0, 1],
        signals={"theta": [0, 1], "u": [2, 3]},
        provenance=Provenance(file="a.csv", reader="ecp", notes=("n",)),
    )
    seen = inspect(record)
    assert (seen.file, seen.reader, seen.notes) == ("a.csv", "ecp", ("n",))
    assert seen.column("u").low == 2
    with pytest.raises(BadInput, match=r"no column 'thera': .*'theta'"):
        seen.column("thera")


@pytest.mark.parametrize(("wide", "gap"), [(1.85, None), (1.95, 1), (2.0, 1), (3.0, 2), (3.6, 3), (21.0, 20)])
def test_a_gap_is_a_step_of_nearly_two_periods(wide, gap):
    steps = np.full(400, 2e-3)
    steps[100] = wide * 2e-3
    t = 0.5 + np.r_[0, np.cumsum(steps)]
    time = time_base(Record(t=t, signals={}))
    assert [g.missing for g in time.gaps] == ([gap] if gap else [])
    assert (time.samples, time.late, time.rebuilt) == (401, 0.5, False)
    assert time.duration == pytest.approx(0.8 + (wide - 1) * 2e-3)
    if gap:
        assert time.period == pytest.approx(2e-3, rel=1e-12)
        assert (time.gaps[0].start, time.gaps[0].length) == (pytest.approx(0.7), pytest.approx(wide * 2e-3))
    else:
        assert time.period == pytest.approx(time.duration / 400)


def test_jitter_is_the_ninety_ninth_percentile_of_what_steps_are_off():
    """Of 1000 steps 980 are off by 0.1 ms and 20 by 0.4 ms, as many up as down."""
    off = np.r_[np.tile([1e-4, -1e-4], 490), np.tile([4e-4, -4e-4], 10)]
    time = time_base(Record(t=np.r_[0, np.cumsum(2e-3 + off)], signals={}))
    assert time.period == pytest.approx(2e-3)
    assert time.jitter == pytest.approx(4e-4)
    assert time.rounding == pytest.approx(1e-4)
    less = np.r_[np.tile([1e-4, -1e-4], 496), np.tile([4e-4, -4e-4], 4)]
    assert time_base(Record(t=np.r_[0, np.cumsum(2e-3 + less)], signals={})).jitter == pytest.approx(1e-4)


def test_a_clock_that_was_rebuilt_keeps_what_it_was_rounded_to():
    note = "Time was rounded to 1 ms; rebuilt from the sample index with a period of 1.1275 ms."
    record = Record(t=1.1275e-3 * np.arange(50), signals={}, provenance=Provenance(notes=("Other.", note)))
    time = time_base(record)
    assert time.rounding == pytest.approx(1e-3)
    assert time.rebuilt
    assert time.jitter == 0


N = np.arange(40.0)


def test_a_sample_index_counts_by_one_over_four_rows_or_more():
    assert sample_index(N + 3) == "the sample index, not a measurement"
    assert sample_index(N[:4])
    assert sample_index(N[:3]) == ""
    assert sample_index(2 * N) == ""
    assert sample_index(-N) == ""


@pytest.mark.parametrize(
    ("t", "x", "said"),
    [
        (0.01 * N, 0.01 * N + 0.0052, "a copy of the time, 5.2 ms later"),
        (0.01 * N, 0.01 * N - 3, "a copy of the time, -3e+03 ms later"),
        (N[:4], N[:4] + 1, "a copy of the time, 1e+03 ms later"),
        (N[:3], N[:3] + 1, ""),
        (0.01 * N, -0.01 * N, ""),
        (1e-3 * np.arange(1000), 1.0038e-3 * np.arange(1000), "a copy of the time, 1.9 ms later"),
        (1e-3 * np.arange(1000), 1.0044e-3 * np.arange(1000), ""),  # 2.2 periods away at the ends
        (N[:5], 0.55 * N[:5], "a copy of the time, -900 ms later"),
        (N[:5], 0.45 * N[:5], ""),  # half the time is none
    ],
)
def test_a_copy_of_the_time_stays_within_two_periods_of_it(t, x, said):
    assert time_copy(t, x) == said


@pytest.mark.parametrize(
    ("x", "y", "said"),
    [
        (WAVE, WAVE, "the same as 'y'"),
        (-2.5 * WAVE + 3, WAVE, "'y' times -2.5"),
        (WAVE + 1e-6 * np.sin(np.arange(200)), WAVE, ""),
        (WAVE, 0 * WAVE + 1, ""),
        (np.tile([1.0, 2.0], 9), np.tile([3.0, 6.0], 9), ""),  # any two levels are in proportion
        (np.tile([1.0, 2.0, 5.0], 9), np.tile([2.0, 4.0, 10.0], 9), "'y' times 0.5"),
    ],
)
def test_a_copy_in_another_scale_is_told_with_its_factor(x, y, said):
    assert copy_of(x, "y", y) == said


@pytest.mark.parametrize(
    ("name", "levels", "unit", "said"),
    [
        ("Control Effort", [409, -573], "", "the command in DAC counts (819 per V: -573 = -0.7 V, 409 = 0.5 V)"),
        ("target", [819], "", "the command in DAC counts (819 per V: 819 = 1 V)"),
        ("effort", [81], "", "the command in DAC counts (819 per V: 81 = 0.1 V)"),
        ("effort", [80], "", "the reference (levels 0 and 80), not the effort the controller put out"),
        ("effort", [84], "", "the reference (levels 0 and 84), not the effort the controller put out"),
        ("effort", [100, 409], "", "the reference (levels 0 and 100, 409), not the effort the controller put out"),
        ("effort", [50], "", "the reference (levels 0 and 50), not the effort the controller put out"),
        ("effort", [49], "", ""),
        ("effort", [-49, 409], "", ""),
        ("effort", [409, 491, 573, 819], "", "the command in DAC counts (819 per V: 409 = 0.5 V, 491 = 0.6 V, "
         "573 = 0.7 V, 819 = 1 V)"),
        ("effort", [409, 491, 573, 655, 819], "", ""),
        ("effort", [409.5], "", ""),
        ("effort", [0], "", ""),
        ("effort", [409], "V", ""),
        ("position", [409], "", ""),
    ],
)  # fmt: skip
def test_an_effort_of_a_few_whole_levels_is_read_as_converter_counts_or_as_the_reference(name, levels, unit, said):
    """ECP's front end writes 819 per V; the levels here are tenths of a volt to a count or two, or are not."""
    assert dac_levels(name, np.r_[0.0, 0.0, levels, 0.0], unit) == said


SAW = 3.0 * np.abs(np.arange(600) % 200 - 100)


@pytest.mark.parametrize(
    ("name", "x", "other", "said"),
    [
        ("Commanded Pos", 0.55 * SAW, "Encoder 1", "1.35"),
        ("Commanded Pos", 0.45 * SAW, "Encoder 1", ""),  # moves less than half as far
        ("Commanded Pos", np.round(SAW / 30) * 30, "Encoder 1", "3"),
        ("Commanded Pos", np.round(SAW / 60) * 60, "Encoder 1", ""),  # six levels are a staircase
        ("Commanded Pos", -SAW, "Encoder 1", ""),
        ("Target", SAW, "Encoder 1", ""),
        ("Commanded Pos", SAW, "theta", ""),
    ],
)  # fmt: skip
def test_a_command_follows_an_encoder_that_it_resembles(name, x, other, said):
    record = Record(t=1e-3 * np.arange(600), signals={"Encoder 0": 0 * SAW, name: x, other: SAW})
    sentence = f"follows 'Encoder 1' (steps differ by {said} at the median); no reference, open loop"
    assert follows_encoder(record, name, record[name]) == (sentence if said else "")


@pytest.mark.parametrize(
    ("first", "n", "said"),
    [
        ([0, 0, -10.5], 20, "the first samples are outliers (10.5 against 2 after)"),
        ([10.5], 11, "the first samples are outliers (10.5 against 2 after)"),
        ([10.5], 10, ""),
        ([9.5], 20, ""),
        ([0, 0, 0, 10.5], 20, ""),
        ([10.5, 0, 0, 10.5], 20, ""),
    ],
)
def test_the_first_three_samples_are_outliers_at_five_times_the_rest(first, n, said):
    x = np.tile([1.0, -2.0], 10)[:n]
    x[: len(first)] = first
    assert first_outlier(x) == said
    assert first_outlier(np.r_[1.0, np.zeros(20)]) == ""


T = 2e-3 * np.arange(2000)
COUNTS = 2 * math.pi / 2000 * np.round(2000 / (2 * math.pi) * 0.9 * np.cos(5 * T))
QUOTIENT = np.diff(COUNTS) / np.diff(T)


def filtered(weight: float) -> np.ndarray:
    out = np.zeros_like(COUNTS)
    for k in range(1, COUNTS.size):
        out[k] = out[k - 1] + weight * (QUOTIENT[k - 1] - out[k - 1])
    return out


@pytest.mark.parametrize(
    ("v", "said"),
    [
        (np.r_[0, QUOTIENT], "the backward difference quotient of 'p', not a sensor of its own"),
        (np.r_[QUOTIENT, 0], "the forward difference quotient of 'p', not a sensor of its own"),
        (np.r_[0, (QUOTIENT[1:] + QUOTIENT[:-1]) / 2, 0], "the central difference quotient of 'p', not a sensor "
         "of its own"),
        (filtered(0.05), "the difference quotient of 'p' through a first-order filter (weight 0.05)"),
        (filtered(0.4), "the difference quotient of 'p' through a first-order filter (weight 0.4)"),
        (filtered(0.005), ""),
        (-np.r_[0, QUOTIENT], ""),
        (2 * np.r_[0, QUOTIENT], ""),
        (-4.5 * np.sin(5 * T), ""),  # the rate itself
        (0 * T, ""),
    ],
)  # fmt: skip
def test_a_speed_that_somebody_differenced_is_told_with_the_way_it_was(v, said):
    assert difference_of(T, "p", COUNTS, v) == said


def test_a_difference_is_looked_for_in_twenty_samples_or_more():
    v = np.r_[0, QUOTIENT]
    assert difference_of(T[100:120], "p", COUNTS[100:120], v[100:120])
    assert difference_of(T[100:119], "p", COUNTS[100:119], v[100:119]) == ""
    assert difference_of(T, "p", 0 * COUNTS, v) == ""


def test_a_column_is_compared_with_all_the_others_and_never_with_itself():
    v = np.r_[0, QUOTIENT]
    record = Record(t=T, signals={"p": COUNTS, "v": v, "w": -v, "k": 0 * T + 3})
    assert remarks(record, "p") == ()
    assert remarks(record, "k") == ()
    assert remarks(record, "v") == ("'w' times -1", "the backward difference quotient of 'p', not a sensor of its own")
    assert remarks(record, "w") == ("'v' times -1",)
