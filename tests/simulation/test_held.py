"""Is a prescribed motion the one that its positions come from, speeds and accelerations too, at every half substep?"""

from __future__ import annotations

import numpy as np
import pytest

from upright.errors import BadInput
from upright.simulation import Held

DT, SUBSTEPS = 0.1, 4


def half_substeps(samples):
    return DT / SUBSTEPS / 2 * np.arange(2 * SUBSTEPS * (samples - 1) + 1)


@pytest.mark.parametrize(("samples", "order"), [(2, 1), (3, 1), (3, 2), (4, 3), (5, 3), (60, 3), (60, 1)])
def test_a_polynomial_is_met_between_its_samples(samples, order):
    """Two samples make a line, three a parabola, more a spline of third order."""
    p = np.polynomial.Polynomial([0.3, -1.0, 0.5, 2.0][: order + 1])
    t = half_substeps(samples)
    grid = Held(q=p(DT * np.arange(samples))).grid(DT, SUBSTEPS)
    assert grid == pytest.approx(np.column_stack([p(t), p.deriv(1)(t), p.deriv(2)(t)]), abs=1e-9)


def test_a_swing_is_followed_without_ringing():
    """A cubic spline errs by h^4/384 times the fourth derivative inside: 0.05^4 3^4/384 = 1.3e-6."""
    t = 0.05 * np.arange(201)
    fine = 0.05 / SUBSTEPS / 2 * np.arange(2 * SUBSTEPS * 200 + 1)
    grid = Held(q=np.sin(3 * t)).grid(0.05, SUBSTEPS)
    inside = (fine > 0.5) & (fine < 9.5)
    assert np.abs(grid[inside, 0] - np.sin(3 * fine[inside])).max() < 1.5e-6
    assert np.abs(grid[inside, 2] + 9 * np.sin(3 * fine[inside])).max() < 0.03
    assert np.abs(grid[:, 0]).max() < 1.001


def test_what_is_given_whole_is_used_as_it_is():
    q, v, a = np.random.default_rng(1).normal(size=(3, 9))
    assert Held(q=q, v=v, a=a).grid(DT, SUBSTEPS).tolist() == np.stack([q, v, a], axis=1).tolist()


def test_a_locked_coordinate_stays():
    assert Held().locked
    assert not Held(q=[0.0, 0.0]).locked
    assert Held().grid(DT, SUBSTEPS).tolist() == [[0.0, 0.0, 0.0]]


@pytest.mark.parametrize(
    ("held", "sentence"),
    [
        (Held(q=[1.0]), r"at least two finite positions in one array, got shape \(1,\)"),
        (Held(q=[1.0, np.nan]), "at least two finite positions"),
        (Held(q=np.zeros((3, 2))), r"one array, got shape \(3, 2\)"),
        (Held(q=np.zeros(5), v=np.zeros(4), a=np.zeros(5)), r"one length, got \(5,\), \(4,\) and \(5,\)"),
        (Held(q=np.zeros(5), v=np.zeros(5), a=np.zeros(6)), "one length"),
    ],
)
def test_a_motion_that_cannot_be_prescribed_is_refused(held, sentence):
    with pytest.raises(BadInput, match=sentence):
        held.grid(DT, SUBSTEPS)
