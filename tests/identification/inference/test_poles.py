"""A frequency is positive, and so is its interval, or it is said that the data do not tell it."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.identification.twins import rig
from upright.identification.inference.poles import poles
from upright.physics import Pendulum

SIMPLE = {"m_p": 0.2, "l_cg": 0.25, "J_p": 0.0}
TWO_SIGMA = 2.0


def upper(spread: float):
    """The hanging pole above the real axis of a simple pendulum whose length is known to a share `spread`."""
    values = {**SIMPLE, "b_2": 0.0, "g": 9.81}
    covariance = np.array([[(spread * SIMPLE["l_cg"]) ** 2]])
    simple = rig(Pendulum, SIMPLE, {})
    found = poles(simple, {**simple.plant(**SIMPLE).parameters(), **values}, ["l_cg"], covariance, TWO_SIGMA)
    (pole,) = found["hanging"]
    return pole.imag


@pytest.mark.parametrize("spread", [0.01, 0.1, 0.5, 0.9])
def test_the_interval_of_a_frequency_is_that_of_its_logarithm(spread: float) -> None:
    # omega = sqrt(g/l), so that log omega is uncertain by half of what log l is
    omega, off = math.sqrt(9.81 / SIMPLE["l_cg"]), TWO_SIGMA * spread / 2
    e = upper(spread)
    assert e.value == pytest.approx(omega)
    assert e.interval == pytest.approx((omega * math.exp(-off), omega * math.exp(off)), rel=1e-3)


def test_a_frequency_that_may_be_zero_has_an_interval_from_zero() -> None:
    assert upper(2.0).interval[0] == 0.0
