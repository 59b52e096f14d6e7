"""Are a wrap, lost counts, a spike and a late reading told apart, and from motion that is none of them?"""

from __future__ import annotations

import math

import numpy as np
import pytest

from upright.diagnosis.clock import doubled_rows
from upright.diagnosis.sensors import clipped, frozen_from
from upright.signals.spikes import jumps

T = np.arange(2000) * 2e-3
STEP = 2 * math.pi / 4096
SWING = np.round(1.2 * np.exp(-0.3 * T) * np.cos(6 * T) / STEP) * STEP
PACE = float(np.abs(np.diff(SWING)).max())


def test_a_swing_does_none_of_it():
    found = jumps(T, SWING, STEP, (2 * math.pi,))
    assert found.wraps.size == found.steps.size == found.spikes.size == 0
    assert frozen_from(SWING, STEP)[0] == -1
    assert doubled_rows([(SWING, STEP)]).size == 0
    assert clipped(SWING, STEP, inertia=True)[2] == 0


@pytest.mark.parametrize("turn", [2 * math.pi, 4096 * STEP])
def test_a_counter_that_wraps_is_unwrapped_where_it_does(turn):
    spin = np.round((0.4 + 9 * T / (1 + T)) / STEP) * STEP
    wrapped = np.mod(spin, turn)
    found = jumps(T, wrapped, STEP, (turn,))
    assert found.wraps.tolist() == (np.flatnonzero(np.diff(np.floor(spin / turn + 1e-9))) + 1).tolist()
    assert found.modulus == pytest.approx(turn)
    assert found.steps.size == 0


@pytest.mark.parametrize("lost", [-40, 25, 300])
def test_lost_counts_are_found_with_their_number(lost):
    i = 731
    found = jumps(T, SWING + np.where(np.arange(T.size) >= i, lost * STEP, 0.0), STEP)
    assert found.steps.tolist() == [i]
    assert found.step_sizes[0] == pytest.approx(lost * STEP, abs=PACE)


def test_a_spike_is_no_lost_count():
    x = SWING.copy()
    x[[500, 1300]] += (60 * STEP, -200 * STEP)
    found = jumps(T, x, STEP)
    assert found.spikes.tolist() == [500, 1300]
    assert found.steps.size == 0


def test_a_reading_taken_one_sample_late_is_neither():
    x = SWING.copy()
    x[400] = x[401]  # as the servo of a public crane log does
    found = jumps(T, x, STEP)
    assert found.spikes.size == found.steps.size == 0


def test_a_sensor_that_freezes_in_motion_is_told_from_a_body_that_comes_to_rest():
    i = int(np.argmax(np.abs(np.diff(SWING)))) + 300
    assert frozen_from(np.where(np.arange(T.size) < i, SWING, SWING[i]), STEP)[0] == i
    sliding = np.maximum(3.0 - 2.0 * T, 0.0)  # speed of a body that dry friction stops
    rest = np.round(np.cumsum(sliding) * 2e-3 / STEP) * STEP
    assert frozen_from(rest, STEP)[0] == -1


def frozen(last: list[int], rest: int, rows: int) -> int:
    """Of a column that goes up a step a row, ends on these changes in steps and never moves again."""
    steps = np.r_[np.ones(rows - 1 - len(last) - rest), last, np.zeros(rest)]
    return frozen_from(STEP * np.r_[0.0, np.cumsum(steps)], STEP)[0]


@pytest.mark.parametrize(
    ("last", "found"), [([1, 1, 1, 1, 3], True), ([3, 1, 1, 1, 1], True), ([1, 1, 1, 1, 1], False)]
)
def test_full_motion_is_more_than_a_step_a_row_over_the_last_five_changes(last, found):
    assert frozen(last, 20, 400) == (379 if found else -1)


@pytest.mark.parametrize(("still", "rows"), [(8, 300), (8, 400), (20, 1000), (24, 1200)])
def test_a_column_is_frozen_from_eight_rows_or_two_percent_on(still, rows):
    """Rows that read the same, the one at which it stopped among them."""
    assert frozen([3] * 5, still - 1, rows) == rows - still
    assert frozen([3] * 5, still - 2, rows) == -1


def test_a_row_written_twice_is_found_where_the_body_moves():
    fast = np.flatnonzero(np.abs(np.diff(SWING)) > 0.7 * PACE)
    rows = fast[50:-50:90] + 1
    x = SWING.copy()
    x[rows] = x[rows - 1]
    assert doubled_rows([(x, STEP)]).tolist() == rows.tolist()


@pytest.mark.parametrize(
    ("pace", "cut"), [(0.1, False), (0.45, False), (0.55, True), (1.0, True), (2.9, True), (3.2, False)]
)
def test_what_comes_to_a_level_half_as_fast_as_before_turns_by_itself(pace: float, cut: bool) -> None:
    """It leaves as a parabola does; what comes three times as fast as before jumps there."""
    level = 20.0 + 4 * pace
    x = np.concatenate([
        np.arange(21.0), 20.0 + pace * np.arange(1, 5), np.full(9, level), level - 0.05 * np.arange(1, 30) ** 2
    ])  # fmt: skip
    low, high, share = clipped(x, 0.0, inertia=False)
    assert (share > 0) == cut
    assert math.isnan(low)
    assert math.isnan(high) != cut
    # what has inertia does neither
    assert clipped(x, 0.0, inertia=True)[2] == 0.0


@pytest.mark.parametrize("limit", [0.5, 0.9])
def test_a_sine_that_is_cut_off_is_told_from_one_that_turns(limit):
    sine = np.sin(3 * T)
    low, high, share = clipped(np.clip(sine, -limit, limit), 0.0, inertia=False)
    assert (low, high) == (-limit, limit)
    inside = np.abs(sine) >= limit
    assert share == pytest.approx(float(inside.mean()), abs=0.05)  # the ends of the record are left out
    steps = np.repeat([0.0, 1.0, 0.0, -1.0] * 5, T.size // 20)  # commanded so, and not cut off
    assert clipped(steps, 0.0, inertia=False)[2] == 0
    coarse = np.round(50 * sine)  # turns on a plateau of its converter
    assert clipped(coarse, 1.0, inertia=False)[2] == 0
