"""Do the intervals of gains hold what least squares and bounded errors say, where both can be had by hand?"""

from __future__ import annotations

import numpy as np
import pytest

from upright.closed_loop.intervals import averaged, gains_with_intervals, least_worst, range_of, sharpen
from upright.closed_loop.regression import Columns, Family, Regression, Signals


def proportional(x, gain=0.0):
    """A law of one gain on one signal; its pole has no influence."""
    X = np.asarray(x, dtype=float).reshape(-1, 1)
    columns = Columns(terms=(("kp", 0),), X=X, slope=np.zeros_like(X))
    return Regression(family=Family(), pole=0.0, columns=columns, gains=np.array([gain]), missed=0.0)


def rounded(u, resolution):
    """Gain and its interval of a command that is the gain itself, in rows that were rounded."""
    u = np.array(u, dtype=float)
    best, width = sharpen(proportional(np.ones(u.size)), u, np.ones(u.size, dtype=bool), resolution)
    value, (below, above) = float(best.gains[0]), width(np.array([1.0, 0.0]))
    return value, value - below, value + above


@pytest.mark.parametrize(
    ("u", "low", "high"),
    [
        ([2.0, 2.0], 1.5, 2.5),  # half a step to either side
        ([2.0, 2.6], 2.1, 2.5),  # what both rows allow
        ([2.0, 3.0], 2.5, 2.5),  # the middle alone
        ([2.0, 5.0], 2.5, 4.5),  # missed by 1.5, 1 more than half a step: 1 to either side
        ([2.0, 2.0, 2.0, 5.0], 2.5, 4.5),  # how many rows say so does not matter
    ],
)
def test_a_rounded_row_bounds_the_gain_by_half_a_step(u, low, high):
    value, found_low, found_high = rounded(u, 1.0)
    assert value == pytest.approx((min(u) + max(u)) / 2, abs=1e-8)
    # the bound has a millionth to spare for the arithmetic
    assert (found_low, found_high) == pytest.approx((low, high), abs=5e-6)


def test_each_of_two_gains_has_the_interval_of_its_own_rows():
    """Three rows show the first, three the second, six times as large."""
    X = np.kron(np.diag([1.0, 6.0]), np.ones((3, 1)))
    both = Regression(
        family=Family(), pole=0.0, gains=np.zeros(2), missed=0.0,
        columns=Columns(terms=(("kp", 0), ("ki", 0)), X=X, slope=np.zeros_like(X)),
    )  # fmt: skip
    best, width = sharpen(both, np.array([2.0, 2.0, 2.0, 12.0, 12.0, 12.0]), np.ones(6, dtype=bool), 1.0)
    assert width(np.array([1.0, 0.0, 0.0])) == pytest.approx(
        (0.5 + best.gains[0] - 2, 0.5 - best.gains[0] + 2), abs=1e-5
    )
    low, high = width(np.array([0.0, 1.0, 0.0]))
    assert low + high == pytest.approx(1 / 6, abs=1e-5)
    assert sum(width(np.array([1.0, 1.0, 0.0]))) == pytest.approx(1 + 1 / 6, abs=1e-5)


def test_rows_that_are_left_out_bound_nothing():
    best, width = sharpen(proportional(np.ones(3)), np.array([2.0, 2.0, 9.0]), np.array([True, True, False]), 1.0)
    assert best.gains == pytest.approx([2.0], abs=1e-8)
    assert width(np.array([1.0, 0.0])) == pytest.approx((0.5, 0.5), abs=5e-6)


def test_an_averaged_gain_has_the_textbooks_interval():
    """White residuals of size 1 at 64 rows where the signal is 2: standard error 1/sqrt(64 4)."""
    u = 2.0 * 3.0 + np.resize([1.0, -1.0], 64)
    width = averaged(proportional(np.full(64, 2.0), 3.0), u, np.ones(64, dtype=bool))
    assert width(np.array([1.0, 0.0])) == pytest.approx((1.96 / 16, 1.96 / 16))
    half = np.arange(64) < 32
    assert averaged(proportional(np.full(64, 2.0), 3.0), u, half)(np.array([1.0, 0.0]))[0] == pytest.approx(
        1.96 / 16 * np.sqrt(2)
    )


def test_a_law_that_misses_nothing_is_known_exactly():
    width = averaged(proportional(np.full(64, 2.0), 3.0), np.full(64, 6.0), np.ones(64, dtype=bool))
    assert width(np.array([1.0, 0.0])) == (0.0, 0.0)


def test_the_nearest_line_misses_three_points_alike():
    """Chebyshev's: a triangle of height 1 is missed by 1/2 at each corner; in other units by as much."""
    X = np.array([[1.0, -1e3], [1.0, 0.0], [1.0, 1e3]])
    gains, largest = least_worst(X, np.array([-3.0, 1.0, 3.0]))  # on a slope of 3 in 1000
    assert gains == pytest.approx([0.5, 3e-3], abs=1e-9)
    assert largest == pytest.approx(0.5)
    # the slope alone may go down to where the rounded ends are missed by 1: 3 +- 1 in 1000, the constant free
    assert range_of(X, np.array([-3.0, 1.0, 3.0]), np.array([0.0, 1.0]), 1.0) == pytest.approx((2e-3, 4e-3))


@pytest.mark.parametrize("at", [0, 7, 2501, 4999])
def test_one_row_among_thousands_bounds_a_gain(at):
    """Rows are tried some at a time; whichever tells most has to be among them."""
    u = np.zeros(5000)
    u[at] = 1.0
    gains, largest = least_worst(np.ones((5000, 1)), u)
    assert (gains[0], largest) == pytest.approx((0.5, 0.5))
    assert range_of(np.ones((5000, 1)), u, np.array([1.0]), 0.7) == pytest.approx((0.3, 0.7))


def test_a_sum_of_gains_is_known_where_neither_is():
    """Two signals that are one: what each takes is open, what they make together is not."""
    X = np.ones((9, 2))
    low, high = range_of(X, np.full(9, 4.0), np.array([1.0, 1.0]), 0.25)
    assert (low, high) == pytest.approx((3.75, 4.25))
    assert np.diff(range_of(X, np.full(9, 4.0), np.array([1.0, 0.0]), 0.25))[0] > 1e6


def told(smoothing, terms, gains, pole=0.0, *, on="error", names=("a",)):
    """Every number, and how it changes with each gain and the pole, as its interval is asked for."""
    asked = []

    def width(v):
        asked.append(v)
        return 1.0, 3.0

    one = np.zeros(4)
    columns = Columns(terms=terms, X=np.zeros((4, len(terms))), slope=np.zeros((4, len(terms))))
    family = Family(on=on, smoothing=smoothing)
    best = Regression(family=family, pole=pole, columns=columns, gains=np.array(gains), missed=0.0)
    signals = Signals(
        names=names, pairs=((one, None),) * len(names), feedforward=(("f", one),), period=0.01, every=1, moving=one
    )
    return gains_with_intervals(best, signals, width), asked


def slopes(value, at, h=1e-6):
    """Central differences."""
    return [(value(at + h * e) - value(at - h * e)) / (2 * h) for e in np.eye(len(at))]


def test_numbers_change_with_gains_as_their_differences_say():
    """kd is both taps together, the second tap its share; a filter's time constant is T a/(1 - a) for its pole a."""
    terms = (("kp", 0), ("kd", 0), ("kd2", 0), ("ff", 0), ("1", 0))
    at = np.array([2.0, 0.3, 0.1, 0.7, 5.0, 0.0])
    found, asked = told("two taps", terms, at[:-1])
    of = {"kp": lambda x: x[0], "kd": lambda x: x[1] + x[2], "second tap": lambda x: x[2] / (x[1] + x[2]),
          "factor f": lambda x: x[3]}  # fmt: skip
    assert list(found) == list(of)
    for (name, value), v in zip(of.items(), asked, strict=True):
        assert found[name].value == pytest.approx(value(at))
        assert v == pytest.approx(slopes(value, at), abs=1e-8)
        # one below and three above are four, of two times 1.96 standard errors
        assert found[name].interval == pytest.approx((value(at) - 1, value(at) + 3))
        assert found[name].stderr == pytest.approx(4 / 3.92)
    at = np.array([2.0, 0.3, 0.1, 0.7, 0.8])
    found, asked = told("filter", (("kp", 0), ("ki", 0), ("kd", 0), ("ff", 0)), at[:-1], 0.8)
    assert list(found) == ["kp", "ki", "kd", "tau", "factor f"]
    assert found["tau"].value == pytest.approx(0.04)
    assert asked[3] == pytest.approx(slopes(lambda x: 0.01 * x[4] / (1 - x[4]), at), abs=1e-8)
    assert found["tau"].meaning == "low pass of the difference [s], corner 3.979 Hz"  # 1/(2 pi 0.04 s)
    assert told("filter", (("kd", 0), ("ff", 0)), [1.0, 0.0])[0]["tau"].meaning == "low pass of the difference [s]"


def test_numbers_of_two_channels_bear_the_names_of_their_signals():
    terms = (("kp", 0), ("kd", 0), ("kd2", 0), ("ki", 1), ("ff", 0))
    found, _ = told("two taps", terms, [2.0, 0.3, 0.1, 4.0, 0.0], on="measurement", names=("a", "b"))
    assert list(found) == ["kp a", "kd a", "second tap a", "ki b", "factor f"]
    assert found["kd a"].meaning == "on the rate of a [s]"
    assert found["kp a"].meaning == "on the error of a"
    assert found["ki b"].meaning == "on the sum of the error of b [1/s]"
