"""Are the steps of a clock and of a column those that its program rounded to?"""

from __future__ import annotations

import math
import re

import numpy as np
import pytest

from upright.readers.inspection import inspect_record
from upright.readers.resolution import (
    Resolution,
    _levels,
    counts_per_rev,
    decimal_step,
    is_epoch,
    is_index,
    rebuild,
    resolution_of,
    rounding,
)
from upright.records import Record


@pytest.mark.parametrize(
    ("count", "made"),
    [
        (2000, True), (200, True), (100, False), (199, False), (1024, True), (1025, False), (2050, False),
        (4096, True), (1 << 20, True), (1 << 21, False), (1_048_600, False),
    ],
)  # fmt: skip
def test_encoders_are_made_in_hundreds_and_in_powers_of_two(count, made):
    """From 200 counts to 20 bits."""
    assert counts_per_rev(2 * math.pi / count) == (count if made else None)


@pytest.mark.parametrize(("off", "seen"), [(1e-4, True), (-1e-4, True), (3e-4, False), (-3e-4, False)])
def test_a_step_tells_its_encoder_when_it_is_right_to_two_parts_in_ten_thousand(off, seen):
    assert counts_per_rev(2 * math.pi / 2000 * (1 + off)) == (2000 if seen else None)


@pytest.mark.parametrize("outside", ["below", "above", "both"])
def test_a_step_is_found_from_the_middle_of_very_many_levels(outside):
    """Of 7000 levels the 4000 in the middle are counts; what lies further out may be bent, as scales are."""
    step = 2 * math.pi / 20000
    levels = step * np.arange(-3500, 3500)
    bent = levels + 0.3 * step * np.sin(np.arange(7000) ** 2)  # off the grid by up to 0.3 of a step
    far = {"below": levels < -2001 * step, "above": levels > 2001 * step, "both": np.abs(levels) > 2001 * step}
    found = resolution_of(np.random.default_rng(2).permutation(np.where(far[outside], bent, levels)))
    assert found.step == pytest.approx(step, rel=1e-9)
    assert found.counts_per_rev == 20000


def test_the_middle_matters_not_the_ends():
    step = 2 * math.pi / 20000
    levels = step * np.arange(-3500, 3500)
    bent = levels + 0.3 * step * np.sin(np.arange(7000) ** 2)
    assert resolution_of(np.where(np.abs(levels) < 1500 * step, bent, levels)).step == 0.0


@pytest.mark.parametrize("middle", [0.0, 3.0])
def test_a_step_is_found_although_most_levels_are_far_apart(middle):
    """Five decimals know the step of a few neighbours to a part in a thousand: too little to count to 16384 with."""
    count = np.array([0, 1, 2, 3, 4, *(1 << np.arange(3, 15))])
    step = 2 * math.pi / 2000
    found = resolution_of(np.round(middle + step * np.concatenate([-count[1:], count]), 5))
    assert found.counts_per_rev == 2000
    assert found.step == pytest.approx(step, rel=1e-5 / (16384 * step))


def test_decimals_are_the_texts_when_values_come_again_and_again():
    """180 levels of 4000 samples; of 300 samples that hardly ever repeat nobody knows."""
    t = 2e-3 * np.arange(4000)
    found = resolution_of(np.round(0.9 * np.exp(-0.3 * t) * np.cos(5 * t), 2))
    assert (found.step, found.decimals) == (0.01, True)
    assert resolution_of(np.round(np.random.default_rng(3).normal(size=300), 6)).step == 0
    assert resolution_of(np.array([0.25, 0.5] * 9)).step == 0  # two levels are no grid


def test_where_no_step_is_seen_its_bound_is_that_of_the_digits_or_of_the_noise():
    """Rounding to q errs by q/sqrt(12), rms: noise of sigma hides steps up to sqrt(12) sigma. 4000 samples tell a
    standard deviation by the median of overlapping fourth differences to some percent."""
    t, rng = 2e-3 * np.arange(4000), np.random.default_rng(5)
    swing = np.sin(3 * t) * np.exp(-0.1 * t)
    fine, noisy = (resolution_of(x) for x in (np.round(swing, 5), swing + 1e-3 * rng.normal(size=t.size)))
    assert (fine.step, noisy.step) == (0, 0)
    assert fine.hidden == pytest.approx(1e-5)
    assert noisy.hidden == pytest.approx(math.sqrt(12) * 1e-3, rel=0.1)


@pytest.mark.parametrize("counts", [2000, 4096, 10_000, 16_384])
def test_an_angles_counts_are_the_same_in_degrees_and_in_radians(counts):
    """A unit is how an angle is written, and no other encoder."""
    t = 5e-3 * np.arange(2000)
    turns = np.round(counts * 0.15 * np.sin(4 * t) * np.exp(-0.1 * t)) / counts
    signals = {"theta_rad": 2 * math.pi * turns, "theta_deg": 360 * turns}
    written = {n: np.array([float(f"{x:.9g}") for x in v]) for n, v in signals.items()}
    seen = inspect_record(Record(t=t, signals=written, units={"theta_rad": "rad", "theta_deg": "deg"}))
    assert {c.name: c.resolution.counts_per_rev for c in seen.columns} == dict.fromkeys(signals, counts)


@pytest.mark.parametrize(
    ("resolution", "words"),
    [
        (Resolution(), ""),
        (Resolution(step=2 * math.pi / 2000, counts_per_rev=2000), "2 pi/2000 = 0.003142"),
        (Resolution(step=0.01, decimals=True), "0.01 (decimals)"),
        (Resolution(step=0.0195312), "0.01953"),
    ],
)
def test_a_step_is_spelt_with_where_it_comes_from(resolution, words):
    assert str(resolution) == words


@pytest.mark.parametrize(
    ("values", "step"),
    [
        ([0.0, 3.0, 7.0], 1.0),
        ([0.0, 0.3, 0.7], 0.1),
        ([0.25, 0.5], 0.01),
        ([1.0, 1.001], 1e-3),
        ([0.0, 1.2345678], 0.0),
        ([-2.0, 0.5], 0.1),
        ([2e12, 2e12 + 0.14501953125], 0.0),  # float64 has no thousandths there
    ],
)
def test_the_coarsest_decimal_is_found(values, step):
    assert decimal_step(np.array(values), 6, 1e-9) == pytest.approx(step)


def clock(period, step, n=400):
    return np.round(np.arange(n) * period / step) * step


def test_a_rounded_clock_is_rebuilt_with_its_period():
    t = clock(1.1275e-3, 1e-3)
    assert rounding(t) == 1e-3
    found, sentence = rebuild(t)
    # the ends are rounded by half a millisecond each at most
    assert np.diff(found) == pytest.approx(np.full(399, 1.1275e-3), abs=1e-3 / 399)
    assert np.ptp(np.diff(found)) < 1e-12
    assert found[[0, -1]] == pytest.approx(t[[0, -1]], abs=1e-15)
    assert "Time was rounded to 1 ms; rebuilt from the sample index with a period of 1.12" in sentence
    (wander,) = re.findall(r"wander up to (\S+) ms", sentence)
    assert 0.4 < float(wander) < 1.0  # half a millisecond, and what the ends are off


def test_rows_that_are_missing_leave_a_gap_of_their_number():
    index = np.delete(np.arange(400.0), [50, 51, 200])
    t = clock(1.1275e-3, 1e-3)[index.astype(int)]
    found, sentence = rebuild(t, 100 + index)  # wherever the count begins
    assert sentence
    assert found[[0, -1]] == pytest.approx(t[[0, -1]], abs=1e-12)
    assert np.diff(found) == pytest.approx(np.diff(index) * 1.1275e-3, abs=5e-6)


@pytest.mark.parametrize(
    "t",
    [
        clock(1.1275e-3, 1e-3, 7),  # too few
        clock(2e-3, 1e-3),  # nothing was rounded
        clock(1.1275e-3, 1e-5),  # by less than a fiftieth of the period
        np.cumsum(np.random.default_rng(0).uniform(0.8e-3, 1.2e-3, 400)),  # jitter
        np.cumsum(np.random.default_rng(0).choice([1e-3, 2e-3, 3e-3], 400)),  # jitter in whole milliseconds
        np.cumsum(np.tile([1e-3, 1e-3, 4e-3], 99)),
    ],
    ids=["few", "whole", "fine", "jitter", "rounded jitter", "late"],
)
def test_a_clock_without_evidence_of_rounding_stays_as_it_is(t):
    found, sentence = rebuild(t)
    assert found is t
    assert sentence == ""


def test_an_index_is_named_so_whole_and_rising():
    count = np.arange(5.0)
    assert is_index("Sample", count)
    assert is_index("k", 3 * count)
    assert not is_index("theta", count)
    assert not is_index("k", count / 2)
    assert not is_index("k", count[::-1])
    assert not is_index("k", np.zeros(5))


def test_a_clock_that_reads_more_than_eleven_days_counts_from_an_epoch():
    assert is_epoch(np.array([1.7e9]))
    assert is_epoch(np.array([-1.7e9, 0.0]))
    assert not is_epoch(np.array([11.5 * 86400]))
    assert is_epoch(np.array([11.6 * 86400]))
    assert not is_epoch(np.zeros(0))


@pytest.mark.parametrize(("digits_apart", "levels"), [(2, 100), (1, 1)])
def test_levels_two_digits_of_a_text_apart_are_levels_and_one_digit_apart_they_are_one(digits_apart, levels):
    assert _levels(np.round(0.001 * digits_apart * np.arange(100), 3), 0.001).size == levels
