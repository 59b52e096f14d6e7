"""Is what a kernel computes as small as its parameters ask, and as large?"""

from __future__ import annotations

import math
from dataclasses import asdict, replace

import numpy as np
import pytest

from tests.simulation.conftest import BLOCK
from upright.laws import state_feedback
from upright.simulation import choose

DRIVE = {
    "start": {"gate"},
    "end": {"gate"},
    "damping": {"damping"},
    "standby": {"damping"},
    "damping_rise": {"damping", "rising"},
    "lag": set(),
    "delay": set(),
    "slope": set(),
    "force_limit": {"capped"},
}
"""Numbers that bring the course of the drive through a sample, and the terms each brings besides."""


def terms(block, values, **how):
    """Names of the terms compiled in."""
    return {name for name, value in asdict(choose(block, {**BLOCK, **values}, **how)).items() if value} - {"record"}


@pytest.mark.parametrize("name", DRIVE)
def test_a_number_of_the_drive_brings_its_own_term(block, name):
    """Braking grows no more beyond a knee, and builds up in its relaxation; nothing else has to do with either."""
    number, own = {f"actuator.{name}": 0.3}, {"dynamic", *DRIVE[name]}
    braking = "damping" in own
    assert terms(block, number) == own
    assert terms(block, number | {"actuator.knee": 0.5}) == own | ({"curve"} if braking else set())
    assert terms(block, number | {"actuator.relaxation": 0.1}) == own | ({"relaxation"} if braking else set())


def test_a_force_fades_beyond_a_knee_that_is_somewhere(block):
    assert terms(block, {"actuator.fade": 0.3}) == set()
    assert terms(block, {"actuator.fade": 0.3, "actuator.knee": 0.5}) == {"dynamic", "curve"}


@pytest.mark.parametrize("name", ["gain", "offset", "limit", "knee", "relaxation"])
def test_a_number_that_only_scales_or_limits_brings_none(block, name):
    assert terms(block, {f"actuator.{name}": 0.3}) == set()


def test_a_dead_zone_needs_no_course_through_the_sample(block):
    assert terms(block, {"actuator.dead_zone": 0.3}) == {"dead"}


def test_a_gain_that_falls_with_the_command_needs_no_course_through_the_sample(block):
    assert terms(block, {"actuator.droop": 0.3}) == {"droop"}


@pytest.mark.parametrize("value", [0.3, np.array([0.0, 0.3]), np.array([0.3, 0.3])])
def test_one_lane_that_has_a_term_brings_it_for_all(block, value):
    assert terms(block, {"F_c": value}) == {"dry"}
    assert terms(block, {"c_q": value}) == {"drag"}
    assert terms(block, {"actuator.slope": value}) == {"dynamic"}


@pytest.mark.parametrize("idle", [0.0, np.zeros(3)])
def test_terms_at_nothing_are_left_out_but_for_those_that_will_vary(block, idle):
    assert terms(block, {"F_c": idle, "c_q": idle, "actuator.slope": idle}) == set()
    assert terms(block, {"actuator.end": math.inf, "actuator.start": -math.inf}) == set()
    assert terms(block, {"F_c": idle}, free=["F_c"]) == {"dry"}
    assert terms(block, {}, free=["F_s", "c_q", "actuator.end"]) == {"dry", "drag", "gate", "dynamic"}


@pytest.mark.parametrize(
    ("values", "kinds"),
    [
        ({"F_c": 0.1}, {"dry"}),
        ({"F_s": 0.2}, {"dry"}),
        ({"F_c": 0.1, "delta": 1e-3}, {"dahl"}),
        ({"F_c": 0.1, "F_s": 0.2, "v_s": 0.01}, {"dry", "stribeck"}),
        ({"F_c": 0.1, "F_s": 0.2, "v_s": 0.01, "delta": 1e-3}, {"dahl", "stribeck"}),
        # speeds and deflections of a friction that is not there
        ({"v_s": 0.01, "delta": 1e-3}, set()),
        ({"c_q": 0.1}, {"drag"}),
    ],
)
def test_a_joint_sticks_or_deflects_and_only_one_with_friction(block, values, kinds):
    assert terms(block, values) == kinds


def test_a_joint_that_is_held_has_no_friction_to_compute_but_the_other_has(pair):
    values = dict.fromkeys(pair.parameters, 1.0)
    assert choose(pair, values).dry == (0, 1)
    still = choose(pair, values, held=["x1"])
    assert (still.held, still.dry) == ((0,), (1,))


def test_a_law_that_is_late_needs_the_course_through_the_sample(block):
    law = state_feedback(np.array([6.0, 1.2]), 0.02)
    assert terms(block, {}, loop=law) == {"loop"}
    assert terms(block, {}, loop=replace(law, delay=0.25)) == {"loop", "dynamic"}
    assert choose(block, BLOCK, record=False).record is False
