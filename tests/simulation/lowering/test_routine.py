"""Does a function that was bound to arrays read and write them, time after time, and take only what it can read?"""

from __future__ import annotations

import gc

import numpy as np
import pytest

from upright.simulation.lowering.routine import Routine

TEXT = """
@exact
def fold(weights, factor, first, x, y):
    for i in range(y.size):
        total = 0.0
        for j in range(first, weights.shape[1]):
            total += weights[i, j] * x[j]
        y[i] = factor * total
    x[0] = y[0]
"""


def test_it_works_on_its_arrays_whenever_it_is_called():
    weights, x, y = np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]), np.array([1.0, 1.0, 1.0]), np.zeros(2)
    routine = Routine(TEXT, "fold", weights, 2.0, 0, x, y)
    for _ in range(3):
        expected = 2.0 * weights @ x
        routine()
        np.testing.assert_array_equal(y, expected)
        assert x[0] == expected[0]
    part = Routine(TEXT, "fold", weights, 1.0, 2, x, y)
    part()
    np.testing.assert_array_equal(y, weights[:, 2] * x[2])


def test_its_arrays_live_as_long_as_it_does():
    y = np.zeros(1)
    routine = Routine(TEXT, "fold", np.full((1, 1), 3.0), 1.0, 0, np.full(1, 2.0), y)
    gc.collect()
    rubbish = [np.full((1, 1), 99.0) for _ in range(100)]
    routine()
    assert y[0] == 6.0
    assert len(rubbish) == 100


@pytest.mark.parametrize("x", [np.ones(6)[::2], np.ones(3, dtype=np.float32), np.ones(3, dtype=np.int32)])
def test_what_machine_code_would_misread_is_refused(x):
    with pytest.raises(TypeError, match="one behind the other"):
        Routine(TEXT, "fold", np.ones((1, 3)), 1.0, 0, x, np.zeros(1))
