"""What of a log moves is known, and so is the share of it that windows keep."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.kept import DT, MAKES, NOISE, cases, moving, share_kept, twin


def test_a_swing_between_two_rests_moves_there_and_nowhere_else() -> None:
    t = np.arange(1000) * DT
    theta = np.where((t > 1) & (t < 4), np.sin(6 * (t - 1)), 0.0)
    at = t[moving(theta[:, None], np.zeros(1))]
    assert at[0] == pytest.approx(1.0, abs=0.02)
    assert at[-1] == pytest.approx(4.0, abs=0.02)
    assert np.diff(at).max() == pytest.approx(DT)


def test_noise_hides_what_moves_less_than_itself() -> None:
    t = np.arange(1000) * DT
    both = np.stack([np.sin(6 * t), np.where(t < 2, 0.0, 1e-3 * np.sin(6 * t))], axis=1)
    both[:, 0] *= t > 3
    assert moving(both, np.zeros(2))[500]
    assert not moving(both, np.full(2, 0.01))[500]


def test_a_window_over_half_of_the_motion_keeps_half_of_it() -> None:
    t = np.arange(1000) * DT
    moves = (t >= 1) & (t < 3)
    assert share_kept(t, moves, [(0.0, 2.0)]) == pytest.approx(0.5, abs=0.01)
    assert share_kept(t, moves, [(0.0, 1.5), (1.4, 2.0), (2.5, 3.0)]) == pytest.approx(0.75, abs=0.01)
    assert share_kept(t, moves, [(3.5, 5.0)]) == 0.0


def test_every_condition_meets_every_other_one_and_every_noise_on_each_plant() -> None:
    every = cases(64)
    assert len({(c.place, c.driven, c.before, c.after, c.named, c.noise) for c in every}) == 16 * len(NOISE) * len(
        MAKES
    )


@pytest.mark.parametrize("number", range(8))
def test_a_twin_rests_and_moves_as_its_case_says(number: int) -> None:
    case = next(c for c in cases(8) if MAKES[c.place].plant == "pendulum" and c.number == number)
    made = twin(case)
    at = made.source.t[made.moves]
    assert (at[0] > 0.9) == case.before
    assert (made.source.t[-1] - at[-1] > 0.9) == case.after


def test_a_hand_that_brings_a_pendulum_back_is_not_what_moves() -> None:
    case = next(c for c in cases(16) if c.again and MAKES[c.place].plant == "pendulum" and c.before)
    made = twin(case)
    t, theta = made.source.t, made.source.columns["theta"][1]
    begins = t[1:][made.moves[1:] & ~made.moves[:-1]]
    assert begins.size == 3
    angles = theta[np.searchsorted(t, begins)]
    assert angles == pytest.approx([1.5, -1.05, 1.275], abs=0.05)  # as RELEASES says of 1.5 rad, less what began it
