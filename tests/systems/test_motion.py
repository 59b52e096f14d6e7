"""Does a linear model march as its difference equation does, within a limit, and stop where no number is left?"""

from __future__ import annotations

import numpy as np
import pytest

from upright.systems.motion import march


def test_a_constant_command_is_answered_by_a_geometric_series():
    """x[k] = b (1 - a^k)/(1 - a) from rest, and a^k x0 without a command."""
    a, b, k = 0.8, 0.5, np.arange(30)
    states, applied = march(np.array([[a]]), np.array([[b]]), np.ones((30, 1)), np.zeros(1))
    assert states[:, 0] == pytest.approx(b * (1 - a**k) / (1 - a))
    assert applied.tolist() == [[1.0]] * 30
    free, _ = march(np.array([[a]]), np.array([[b]]), np.zeros((30, 1)), np.array([3.0]))
    assert free[:, 0] == pytest.approx(3.0 * a**k)


@pytest.mark.parametrize("limit", [np.inf, 2.0])
def test_a_feedback_of_the_first_states_is_added_and_limited(limit):
    """Gains on one state of two; by numpy's recursion, written out."""
    A, B, gains = np.array([[1.0, 0.1], [0.3, 0.9]]), np.array([[0.0], [0.1]]), np.array([[4.0]])
    commands = np.where(np.arange(40) < 20, 5.0, -1.0)[:, None]
    states, applied = march(A, B, commands, np.array([1.0, 0.0]), gains, limit)
    x = np.array([1.0, 0.0])
    for k in range(40):
        u = min(max(commands[k, 0] - 4.0 * x[0], -limit), limit)
        assert states[k] == pytest.approx(x)
        assert applied[k, 0] == pytest.approx(u)
        x = A @ x + B[:, 0] * u
    assert (np.abs(applied).max() == 2.0) == (limit == 2.0)
    cut = march(A, B, commands, np.zeros(2), limit=limit)[1]
    assert cut[:, 0].tolist() == np.clip(commands[:, 0], -limit, limit).tolist()


def test_a_motion_that_left_all_numbers_ends_with_the_sample_at_which_it_did():
    states, applied = march(np.array([[1e200]]), np.array([[1.0]]), np.ones((9, 1)), np.array([1.0]))
    assert states.shape == applied.shape == (3, 1)
    assert states[:2, 0].tolist() == [1.0, 1e200]
    assert np.isinf(states[2, 0])
