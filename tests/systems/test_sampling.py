"""Limits of sampled models, signals chosen from a model, and poles as they are asked for and written."""

from __future__ import annotations

import math

import numpy as np
import pytest

from upright.errors import BadInput
from upright.gains.requests import conjugate_poles, lost_modes, matched, weak_modes, written
from upright.gains.velocity import stationary
from upright.systems import StateSpace
from upright.systems.discretization import to_s

BODY = StateSpace([[0.0, 1.0], [0.0, 0.0]], [0.0, 1.0], [[1.0, 0.0]])
TWO = StateSpace(
    np.diag([-1.0, -2.0, -3.0]), [[1.0, 0.0], [0.0, 2.0], [3.0, 4.0]], np.arange(6.0).reshape(2, 3),
    [[0.0, 7.0], [0.0, 8.0]], states=("a", "b", "c"), inputs=("u", "v"), outputs=("y", "z"),
    units={"a": "m", "z": "rad", "u": "V"},
)  # fmt: skip


@pytest.mark.parametrize(
    ("delay", "lag", "remembered", "names"),
    [
        (0.0, 0.0, 0, ()),
        (1e-13, 0.0, 0, ()),
        (0.5, 0.0, 1, ("u[0] 1 ago",)),
        (1.0, 0.0, 1, ("u[0] 1 ago",)),
        (2.0, 0.0, 2, ("u[0] 1 ago", "u[0] 2 ago")),
        (1.5, 0.01, 3, ("u[0] given", "u[0] 1 ago", "u[0] 2 ago")),
        (0.0, 0.01, 1, ("u[0] given",)),
    ],
)
def test_a_sampled_model_has_a_state_for_what_a_drive_gives_and_for_each_command_on_its_way(
    delay: float, lag: float, remembered: int, names: tuple[str, ...]
) -> None:
    model = BODY.to_sampled(0.1, delay, lag)
    assert model.remembered == remembered
    assert model.states == ("x[0]", "x[1]", *names)
    assert (model.period, model.delay, model.lag) == (0.1, delay, lag)
    assert model.continuous is BODY


@pytest.mark.parametrize("delay", [0.0, 0.3, 1.0, 1.7, 2.0])
@pytest.mark.parametrize("method", ["zoh", "foh"])
def test_a_body_answers_a_late_command_in_closed_form(delay: float, method: str) -> None:
    """A unit command from sample 0 on; held it acts from `delay` T on, run straight to it from a sample before."""
    if method == "foh" and delay % 1:
        with pytest.raises(BadInput, match="whole samples"):
            BODY.to_sampled(0.1, delay, method=method)
        return
    model = BODY.to_sampled(0.1, delay, method=method)
    x, y = np.zeros(len(model.A)), []
    for _ in range(8):
        y.append((model.C @ x + model.D[:, 0])[0])
        x = model.A @ x + model.B[:, 0]
    since = 0.1 * np.maximum(np.arange(8) - delay, 0.0)
    if method == "zoh":
        assert y == pytest.approx(since**2 / 2)
    else:  # a ramp before: speed T/2 and place T^2/6 when the command has come
        there = np.arange(8) >= delay
        assert y == pytest.approx(np.where(there, 0.01 / 6 + 0.05 * since + since**2 / 2, 0.0))


def test_a_drive_that_lags_gives_less_at_first_and_what_shows_the_command_at_once_shows_the_drive() -> None:
    """A unit command through 1/(lag s + 1) into an integrator: t - lag (1 - exp(-t/lag)), and its speed beside it."""
    lag = 0.25
    model = StateSpace([[0.0]], [1.0], [[1.0], [0.0]], [[0.0], [1.0]]).to_sampled(0.1, lag=lag)
    x, y = np.zeros(2), []
    for _ in range(8):
        y.append(model.C @ x + model.D[:, 0])
        x = model.A @ x + model.B[:, 0]
    t = 0.1 * np.arange(8)
    given = 1 - np.exp(-t / lag)
    assert np.array(y) == pytest.approx(np.column_stack([t - lag * given, given]))


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((0.0,), "above 0 s"), ((-1.0,), "above 0 s"), ((math.inf,), "above 0 s"), ((math.nan,), "above 0 s"),
        ((0.1, -1e-9), "between 0 and 1000"), ((0.1, 1000.5), "between 0 and 1000"),
        ((0.1, 0.0, -1e-9), "at least 0 s"), ((0.1, 0.0, math.inf), "at least 0 s"),
    ],
)  # fmt: skip
def test_what_no_model_can_be_sampled_with_is_refused(arguments: tuple[float, ...], words: str) -> None:
    with pytest.raises(BadInput, match=words):
        BODY.to_sampled(*arguments)


def test_a_sampled_model_takes_whole_samples_of_its_own_period_once() -> None:
    sampled = StateSpace([[0.5]], [2.0], dt=0.1)
    late = sampled.to_sampled(0.1, 2)
    assert np.allclose(late.A, [[0.5, 0.0, 2.0], [0.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    assert np.allclose(late.B, [[0.0], [1.0], [0.0]])
    assert late.dt == 0.1
    for arguments, words in (
        ((0.2,), "another"), ((0.1, 0.5), "whole samples"), ((0.1, 1.0, 0.01), "got 10 ms and 1"),
    ):  # fmt: skip
        with pytest.raises(BadInput, match=words):
            sampled.to_sampled(*arguments)
    with pytest.raises(BadInput, match="already"):
        late.to_sampled(0.1, 1)
    with pytest.raises(BadInput, match="no period"):
        _ = BODY.period
    for dt in (0.0, -0.1, math.inf, math.nan):
        with pytest.raises(BadInput, match="above 0"):
            StateSpace([[0.5]], [2.0], dt=dt)


def test_signals_are_chosen_by_name_or_number() -> None:
    one = TWO["z", "v"]
    assert np.array_equal(one.B, [[0.0], [2.0], [4.0]])
    assert np.array_equal(one.C, [[3.0, 4.0, 5.0]])
    assert np.array_equal(one.D, [[8.0]])
    assert (one.outputs, one.inputs, one.states) == (("z",), ("v",), ("a", "b", "c"))
    assert np.array_equal(TWO[1, 0].D, [[0.0]])
    assert TWO["z"].inputs == ("u", "v")
    named = StateSpace(TWO.A, TWO.B, TWO.C, TWO.D, outputs=("y1", "y2"))
    assert named["y2"].outputs == ("y2",)  # two letters are one name
    assert TWO[["z", 0], :].outputs == ("z", "y")
    assert TWO[1:, "u"].outputs == ("z",)
    assert len(TWO[:4]) == 4
    for key, words in (((2, 0), "from 0 to 1"), ((-1, 0), "from 0 to 1"), (("x", "u"), "no output 'x'")):
        with pytest.raises(BadInput, match=words):
            TWO[key]
    assert (TWO.unit, TWO.state_units, TWO.output_units) == ("V", ["m", "1", "1"], ["1", "rad"])
    sampled = TWO.to_sampled(0.1)
    assert sampled["z", "v"].continuous.outputs == ("z",)
    assert len(tuple(sampled)) == 5
    assert len(tuple(TWO)) == 4


def test_a_pole_at_rest_is_damped_wholly_and_others_by_their_angle() -> None:
    model = StateSpace([[0.0, 1.0, 0.0], [-25.0, -6.0, 0.0], [0.0, 0.0, 0.0]], [0.0, 1.0, 1.0])
    size, ratio, poles = model.damping()
    assert poles == pytest.approx([0.0, -3 - 4j, -3 + 4j])
    assert size == pytest.approx([0.0, 5.0, 5.0])
    assert ratio == pytest.approx([1.0, 0.6, 0.6])
    sampled = model.to_sampled(0.02)
    assert sampled.damping()[0] == pytest.approx([0.0, 5.0, 5.0], abs=1e-9)
    assert to_s(sampled.poles(), 0.02) == pytest.approx(poles, abs=1e-9)
    assert to_s([0.0], 0.1).real == -math.inf


@pytest.mark.parametrize(
    ("poles", "text"),
    [
        ([-4.14844, -16.855, 0.0], "-4.1484, -16.855, 0"),
        ([-4 - 2j, -4 + 2j], "-4±2j"),
        ([-4 + 2j], "-4+2j"),
        ([-4 - 2j, 3.0], "-4-2j, 3"),
        ([1e-14, -1.0], "0, -1"),
        ([1e-12, -1.0], "1e-12, -1"),
        ([-1 + 2j, -1 - 2.00001j], "-1+2j, -1-2j"),
        ([-1 + 2j, -1 - 2.000001j], "-1±2j"),
        ([], ""),
    ],
)
def test_poles_are_written_with_pairs_once(poles: list[complex], text: str) -> None:
    assert written(poles) == text


def test_pairs_are_made_exactly_conjugate_and_kept_in_order() -> None:
    asked = conjugate_poles([-4 + 2j, -1.0, -4 - 2j * (1 + 1e-10)], 3)
    assert asked[2] == asked[0].conjugate()
    assert asked[1] == -1.0
    for poles, words in (
        ([-4 + 2j, -4 - 2j * (1 + 1e-8)], "comes without"), ([-1.0], "needs 2 poles, got 1"),
        ([-1.0, math.nan], "finite"), ([-1.0, -4 + 2j], r"write the pair as -4\+-2j"),
    ):  # fmt: skip
        with pytest.raises(BadInput, match=words):
            conjugate_poles(poles, 2)


def test_roots_are_laid_beside_those_asked_the_closest_first() -> None:
    """-2.1 is nearest to -2, so -1 takes what is left."""
    asked, found = np.array([-1.0, -2.0], dtype=complex), np.array([-2.1, -4.0], dtype=complex)
    assert matched(asked, found).tolist() == [-4.0, -2.1]
    assert matched(asked[::-1], found).tolist() == [-2.1, -4.0]


def test_a_mode_that_no_input_moves_is_lost_as_often_as_it_stands() -> None:
    A, B = np.diag([-1.0, -1.0, -3.0]), np.array([[1.0], [2.0], [0.0]])
    assert sorted(p.real for p in lost_modes(A, B)) == pytest.approx([-3.0, -1.0])
    assert lost_modes(np.diag([-1.0, -2.0]), np.array([[1.0], [1.0]])) == []
    # of diag(-1, -2) with the input (1, e) the second lies e/sqrt(2) from being lost, over the size of both
    (reach, pole), *_ = weak_modes(np.diag([-1.0, -2.0]), np.array([[1.0], [1e-5]]))
    assert pole == pytest.approx(-2.0)
    size = np.linalg.norm([[-1.0, 0.0, 1.0], [0.0, -2.0, 1e-5]], 2)
    assert reach == pytest.approx(1e-5 / math.sqrt(2) / size, rel=1e-6)


def test_noise_settles_at_the_sum_of_what_is_left_of_it() -> None:
    """``P = a^2 P + b^2``; none in a loop that is not stable, nor in one that stays."""
    assert stationary(np.array([[0.9]]), np.array([[2.0]])) == pytest.approx(4.0 / (1 - 0.81))
    assert stationary(np.array([[0.9999]]), np.array([[1.0]])) == pytest.approx(1 / (1 - 0.9999**2))
    for a in (1.0, 1.1):
        with pytest.raises(BadInput, match="not stable"):
            stationary(np.array([[a]]), np.array([[1.0]]))
