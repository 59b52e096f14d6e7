"""Is a design whose command is busy at rest told of as one, and one that rests as quiet?"""

from __future__ import annotations

import math

import numpy as np
import pytest

from upright.control.effort import QUIET_RMS
from upright.designing.chapter import chapter
from upright.designing.proposal import design_unasked
from upright.designing.run import DesignRequest, design_for
from upright.gains.requests import read_poles
from upright.paper.reproduce import TABLE_1
from upright.rig.makes import make_rig


def asked(counts, *, which=1, speed="plain", **more):
    """A request for set 2 of the paper on a Furuta pendulum without dry friction, its encoders of so many counts."""
    rig = make_rig("furuta").changed(b_1c=1e-15, b_2c=1e-15).replace(counts=(counts, counts))
    return rig, DesignRequest(
        at="inverted", poles=read_poles(TABLE_1[which]), period=rig.period, speed=speed,
        resolution=tuple(rig.resolution.tolist()), limit=rig.limit, on=rig, **more,
    )  # fmt: skip


@pytest.mark.parametrize("counts", [16_000, 1_000])
def test_a_design_is_green_where_the_rounding_it_differences_is_a_tenth_of_the_limit_at_most(counts):
    """Differences of two independent roundings of both encoders: K_d q/(T sqrt 6), 3.6 and 57 % of the limit."""
    rig, wish = asked(counts)
    done = design_for(rig, wish)
    speeds = math.hypot(done.K[0, 1], done.K[0, 3])
    rms = speeds * math.tau / counts / rig.period / math.sqrt(6) / rig.limit
    told = chapter(done)
    assert done.holding.quiet is (rms < QUIET_RMS)
    assert ("reservations" in told.verdict) is (rms > QUIET_RMS)
    assert ("the command at rest has an rms of" in told.verdict) is (rms > QUIET_RMS)
    assert told.numbers["at_rest"]["rms"] < 1.1 * rms  # slow motion crosses fewer counts than independent samples


def test_rounding_noise_alone_is_a_reservation_where_nothing_can_be_simulated():
    rig, wish = asked(1_000)
    blind = DesignRequest(**{**vars(wish), "on": None})
    done = design_for(rig, blind)
    assert done.holding is None
    assert "reservations: the rounding of encoders gives the command an rms of" in done.verdict


def test_a_filter_makes_the_same_gains_quiet():
    """A Kalman filter on the same encoders; found by the linear loop and by simulation alike."""
    rig, wish = asked(4_000)
    plain = design_for(rig, wish)
    kalman = design_for(rig, DesignRequest(**{**vars(wish), "speed": "kalman"}))
    assert plain.chosen.command_noise / rig.limit > QUIET_RMS > kalman.chosen.command_noise / rig.limit
    assert kalman.holding.effort.rms < plain.holding.effort.rms
    assert kalman.holding.quiet


def test_a_design_without_a_limit_says_nothing_about_effort():
    rig, wish = asked(1_000)
    done = design_for(rig, DesignRequest(**{**vars(wish), "limit": None}))
    assert done.holding is None
    assert "the command" not in done.verdict


def test_what_is_proposed_is_quiet_where_some_pace_is():
    rig, wish = asked(4_000, speed="filtered")
    done = design_unasked(rig, DesignRequest(**{**vars(wish), "poles": None}))
    assert done.holding.quiet
    assert np.isfinite(done.peak_sampled)
