"""What is drawn between the frequencies, and what the verdict says, of a response explained."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from tests.identification.frequency.test_frequency import FURUTA, GUESS, asked, smooth
from upright.identification.frequency.answer import FrequencyFit, _fit, curves, digits, explain, key_value, verdict
from upright.identification.frequency.balance import Balance
from upright.identification.frequency.response import FrequencyResponse
from upright.identification.model.fit import Estimate
from upright.physics import Furuta


@cache
def answer() -> FrequencyFit:
    return explain(asked(**{n: GUESS[n] for n in ("J_d", "b_1")}), "hanging", smooth())


def test_curves_between_the_frequencies_are_those_of_the_transfer_function() -> None:
    (w, squares), (same, simplex) = curves(answer())
    assert np.array_equal(w, same)
    assert w[[0, -1]] == pytest.approx([2.0, 40.0])
    expected = smooth(omega=w).response
    assert squares == pytest.approx(expected, rel=1e-3)
    assert simplex == pytest.approx(expected, rel=0.05)


def test_only_least_squares_knows_dry_friction_between_the_frequencies() -> None:
    """Sizes along a power of the frequency and phases along its logarithm lie on straight lines, so nothing is lost."""
    found = answer()
    values = {**found.squares.way.values, "b_1c": 1e-3, "b_2c": 1e-3}

    def friction(w: np.ndarray) -> np.ndarray:
        return np.column_stack([3 / w, 0.2 * w**0.5]) * np.exp(1j * np.log(w / 2))[:, None]

    used = replace(found.used, dry=friction(found.used.omega))
    rough = replace(
        found, used=used, squares=replace(found.squares, way=replace(found.squares.way, values=values)),
        simplex=replace(found.simplex, values={**values, "J_d": 0.01}),
    )  # fmt: skip
    (w, squares), (_, simplex) = curves(rough)
    there = FrequencyResponse(
        omega=w, response=smooth(omega=w).response, outputs=used.outputs, drive=np.full(w.size, 1e-9), dry=friction(w),
    )  # fmt: skip
    assert squares == pytest.approx(Balance(plant=Furuta, at="hanging", data=there).response(values)[0], rel=1e-6)
    free = smooth(replace(FURUTA, J_d=0.01, b_1=values["b_1"]), omega=w).response
    assert simplex == pytest.approx(free, rel=1e-6)
    assert np.abs(squares / simplex - 1).max() > 0.1  # otherwise there would be nothing to tell apart


def test_what_a_response_cannot_see_correlates_with_nothing() -> None:
    """Without the motion's dry friction two numbers have no say: zero, not 0/0; a number goes with itself by one."""
    found = explain(asked(J_d=GUESS["J_d"], b_1=GUESS["b_1"], b_1c=1e-3, b_2c=1e-3), "hanging", smooth())
    size = found.fit.correlation
    seen = np.array([n in ("J_d", "b_1") for n in found.fit.names])
    assert np.diag(size)[seen] == pytest.approx(1.0)
    assert np.array_equal(size[~seen], np.zeros((2, 4)))
    blind = [found.fit.estimates[n] for n in ("b_1c", "b_2c")]
    assert [(e.status, e.interval) for e in blind] == [("unseen", (-math.inf, math.inf))] * 2


def test_the_pole_that_matters_is_the_one_by_which_it_falls() -> None:
    at, what, _ = answer().key
    assert (at, what) == ("inverted", "unstable pole")
    truth = float(FURUTA.linear("inverted").poles()[0].real)
    assert key_value(answer().key).value == pytest.approx(truth, rel=1e-3)
    assert answer().simplex_pole == pytest.approx(truth, rel=0.02)
    assert answer().fit.trusted


@pytest.mark.parametrize(
    ("value", "width", "expected"),
    # digits up to the decade of the width, and two more; 3 at least, 8 at most
    [(5.0, 0.1, 4), (5.0, 1e-4, 7), (5.0, 5.0, 3), (5.0, 1e-12, 8), (5.0, 0.0, 4), (0.0, 1.0, 4), (5.0, math.inf, 4)],
)
def test_digits_follow_from_the_interval(value: float, width: float, expected: int) -> None:
    number = Estimate(
        value=value, stderr=0.0, interval=(value - width / 2, value + width / 2), unit="1/s", status="well determined"
    )
    assert digits(number) == expected


def test_a_verdict_trusts_no_response_that_is_not_explained() -> None:
    found = answer()
    wide = replace(found.key[2].real, interval=(0.9 * found.key[2].real.value, 1.1 * found.key[2].real.value))
    for change, key, said in (
        ({"misfit": 9.1}, found.key, "leaves 3.0 times the errors stated unexplained"),
        ({"surprise": {"m_p": -4.1, "J_d": 1.0}}, found.key, "contradicts what is known of m_p"),
        ({"starts": 5, "reached": 2}, found.key, "Only 2 of 5 starts"),
        ({}, (*found.key[:2], replace(found.key[2], real=wide)), "That is 10 % either way"),
    ):
        text, trusted = verdict(replace(found.squares, **change), key)
        assert said in text
        assert not trusted
    for change in ({"misfit": 8.9}, {"surprise": {"J_d": -3.9}}, {"starts": 4, "reached": 2}):
        assert verdict(replace(found.squares, **change), found.key)[1]


@pytest.mark.parametrize(
    ("width", "status"),
    [
        (0.99, "well determined"),
        (1.01, "poorly determined"),
        (4.0, "poorly determined"),
        (1e-11, "well determined"),
        (1e-13, "poorly determined"),
    ],
)
def test_an_interval_wider_than_its_value_or_narrower_than_rounding_is_weak(width: float, status: str) -> None:
    """`width` of the whole interval, of the value; it ends at zero, which no asked number passes."""
    found, q = answer(), 2.0
    names, values = found.squares.names, found.squares.way.values
    sigma = np.array([width * values[n] / (2 * q) for n in names])
    squares = replace(found.squares, covariance=np.diag(sigma**2))
    fit = _fit(found.rig, squares, {}, found.key, q, ())
    for n, s in zip(names, sigma, strict=True):
        e = fit.estimates[n]
        assert (e.value, e.stderr, e.status) == (values[n], pytest.approx(s), status)
        assert e.interval == pytest.approx((max(0.0, values[n] - q * s), values[n] + q * s))


def test_a_number_that_ended_below_a_millionth_of_its_guess_is_at_its_bound() -> None:
    found = answer()
    way = found.squares.way
    small = {n: 0.9e-6 * GUESS[n] if n == "b_1" else v for n, v in way.values.items()}
    squares = replace(found.squares, way=replace(way, values=small), covariance=1e-20 * np.eye(2))
    fit = _fit(found.rig, squares, {}, found.key, 2.0, ())
    assert (fit.estimates["b_1"].status, fit.estimates["J_d"].status) == ("at bound", "well determined")


def test_what_the_response_does_not_depend_on_correlates_with_nothing() -> None:
    """Its row of the pseudo-inverse is zero; of the other two the correlation is 3 / (2 * 2)."""
    found = answer()
    way = replace(found.squares.way, values=found.squares.way.values | {"b_2": 1e-3})
    C = 1e-12 * np.array([[4.0, 3.0, 0.0], [3.0, 4.0, 0.0], [0.0, 0.0, 0.0]])
    squares = replace(found.squares, way=way, names=("J_d", "b_1", "b_2"), covariance=C)
    told = _fit(found.rig, squares, {}, found.key, 2.0, ()).correlation
    assert told == pytest.approx(np.array([[1.0, 0.75, 0.0], [0.75, 1.0, 0.0], [0.0, 0.0, 0.0]]))
