"""Coordinates in which the numbers of a response are sought, and which of its points speak."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from upright.errors import BadInput
from upright.identification import GreyBox, Parameter
from upright.identification.frequency.fitting import STICKS, coordinates, usable
from upright.identification.frequency.response import FrequencyResponse
from upright.physics import Pendulum

NUMBERS = {
    "m_p": Parameter(name="m_p", value=0.2),
    "l_cg": Parameter(name="l_cg", value=0.3, uncertainty=0.03),  # known to a tenth of itself
    "J_p": Parameter(name="J_p", value=2e-3, estimate=True),
    "b_2": Parameter(name="b_2", value=4e-3, estimate=True),
    "b_2c": Parameter(name="b_2c", value=1e-3, estimate=True),
    "actuator.gain": Parameter(name="actuator.gain", value=0.5, estimate=True),
    "actuator.delay": Parameter(name="actuator.delay", value=5e-3, estimate=True),
}
RIG = GreyBox(plant=Pendulum, parameters=NUMBERS)


def test_what_cannot_vanish_is_sought_by_its_logarithm_and_the_rest_down_to_zero():
    """A length and the drive's gain lie above zero; friction, a rod's own inertia and a delay may be none."""
    space = coordinates(RIG)
    assert space.names == ("l_cg", "J_p", "b_2", "b_2c", "actuator.gain", "actuator.delay")
    assert space.log.tolist() == [True, False, False, False, True, False]
    assert space.lower.tolist() == [-math.inf, 0.0, 0.0, 0.0, -math.inf, 0.0]
    assert space.values(space.start) == pytest.approx({n: p.value for n, p in NUMBERS.items()})
    halved = space.values(np.where(space.log, math.log(0.5), 0.5))
    assert halved == pytest.approx({n: p.value * (1.0 if n == "m_p" else 0.5) for n, p in NUMBERS.items()})
    lanes = space.values(np.array([space.start, space.start + 1.0]))
    assert lanes["b_2"] == pytest.approx([4e-3, 8e-3])
    assert lanes["actuator.gain"] == pytest.approx([0.5, 0.5 * math.e])


def test_the_slope_of_the_values_is_their_derivative():
    space = coordinates(RIG)
    z = space.start + np.linspace(-0.3, 0.4, space.start.size)
    step = 1e-6
    assert space.slope(z) == pytest.approx((space.sizes(z + step) - space.sizes(z - step)) / (2 * step), rel=1e-8)


def test_what_was_known_is_off_by_so_many_of_its_tolerances():
    space = coordinates(RIG)
    assert space.bounded == ("l_cg",)
    z = space.start.copy()
    z[0] += 0.25
    assert space.known(z[None]) == pytest.approx(np.array([[2.5]]))


def test_other_starts_scatter_by_factors_and_those_known_by_their_tolerance():
    """Of 4000 starts the logarithms have the standard deviation asked, to 4 standard errors of 1.1 %."""
    space = coordinates(RIG)
    rng = np.random.default_rng(1)
    starts = np.array([space.sizes(space.scattered(rng, 0.35)) for _ in range(4000)])
    expected = [0.1, *[0.35] * 5]
    assert np.std(np.log(starts), axis=0) == pytest.approx(expected, rel=0.045)
    assert np.median(starts, axis=0) == pytest.approx(space.size, rel=0.03)
    wide = np.array([space.scattered(rng, 30.0) for _ in range(200)])
    assert wide[:, ~space.log].min() == 1e-3  # a start at nothing would stay there


def test_a_magnitude_shows_neither_dry_friction_nor_delay_and_knows_nothing_beforehand():
    space = coordinates(RIG, magnitude=True)
    assert space.names == ("J_p", "b_2", "actuator.gain")
    assert space.log.all()
    assert space.bounded == ()
    assert (space.base["b_2c"], space.base["l_cg"], space.base["actuator.delay"]) == (0.0, 0.3, 5e-3)


@pytest.mark.parametrize("guess", [0.0, -1.0, math.inf, math.nan])
def test_a_guess_that_is_no_size_is_refused(guess):
    rig = replace(RIG, parameters=NUMBERS | {"b_2": Parameter(name="b_2", value=guess, estimate=True)})
    with pytest.raises(BadInput, match="b_2 is sought and needs a guess above 0"):
        coordinates(rig)


def test_nothing_to_seek_is_refused():
    with pytest.raises(BadInput, match="nothing is sought"):
        coordinates(GreyBox(plant=Pendulum, parameters={"m_p": NUMBERS["m_p"]}))


def test_points_drowned_in_noise_or_of_a_joint_that_sticks_are_left_out_and_told():
    omega = np.array([1.0, 2.0, 3.0, 4.0])
    data = FrequencyResponse(
        omega=omega, response=np.ones((4, 2), dtype=complex), outputs=("psi", "theta"),
        coherence=np.array([[1.0, 0.51], [0.49, 1.0], [1.0, 1.0], [0.4, 0.9]]),
        still=np.array([[0.03, 0.03], [0.03, 0.03], [0.03, STICKS + 0.01], [STICKS + 0.01, STICKS - 0.01]]),
    )  # fmt: skip
    good, notes = usable(data)
    assert good.tolist() == [True, False, False, False]
    assert notes == (
        "Left out at 3, 4 rad/s: a joint sticks there for part of each period.",
        "Left out at 2 rad/s: it is mostly noise.",
    )
    # where there is no dry friction nothing sticks
    good, notes = usable(data, dry=False)
    assert good.tolist() == [True, False, True, False]
    assert notes == ("Left out at 2, 4 rad/s: it is mostly noise.",)


def test_a_response_is_told_in_decibels_with_the_relative_error_of_its_size():
    """Half of the mean square of a complex error is along the response, and its size errs by that."""
    data = FrequencyResponse(
        omega=np.array([1.0, 2.0]), response=np.array([[10.0], [-0.1j]]), outputs=("theta",),
        variance=np.array([[0.02], [2e-6]]),
    )  # fmt: skip
    assert data.magnitude_dB == pytest.approx(np.array([[20.0], [-20.0]]))
    assert data.error == pytest.approx(np.array([[0.01], [0.01]]))
    assert len(data.only([1])) == 1
    assert data.only(data.omega > 1.5).error.tolist() == data.error[1:].tolist()
