"""Do the first motions find their way on a cart of any wiring, within what it may be given, and leave it calm?"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from itertools import groupby

import numpy as np
import pytest

import upright as up
from upright.control.exploration import (
    BRAKES,
    CALMS,
    COASTS,
    ENDS,
    FALLS,
    KICKS,
    PUMPS,
    RESTS,
    RISES,
    SECONDS,
    STOPS,
    SWING,
    WAITS,
    exploration,
)

CART = up.CartPendulum(m_c=0.6, m_p=0.14, l_cg=0.19, J_p=6e-4, b_1=1.2, b_2=3e-5)
GAIN, DRY, LIMIT, TRAVEL, PERIOD = 5.25, 0.8, 5.0, 0.4, 4e-3
RIG = up.Rig.known(CART, gain=GAIN, limit=LIMIT, period=PERIOD, counts=(200_000, 4096), travel=TRAVEL)
BOUND = 0.15 * TRAVEL
assert BOUND == 0.06
NAMES = (
    "mode", "since", "q0", "h0", "v0", "w0", "marked", "q", "h", "v", "w", "v_slow", "w_slow", "side", "sign", "level",
    "gain", "up", "down", "way", "began",
)  # fmt: skip
ORDER = [WAITS, RISES, RESTS, FALLS, STOPS, KICKS, PUMPS, BRAKES, COASTS, CALMS, ENDS]
WIRED = [(1, 1, 1), (-1, 1, 1), (1, -1, 1), (1, 1, -1)]
J = CART.J_p + CART.m_p * CART.l_cg**2
M, KAPPA, WEIGHT = CART.m_c + CART.m_p, CART.m_p * CART.l_cg, CART.m_p * CART.g * CART.l_cg


@dataclass(frozen=True, eq=False)
class Explored:
    """Command, true coordinates with their speeds, and what the rule remembered, sample by sample."""

    t: np.ndarray
    u: np.ndarray
    x: np.ndarray
    memory: dict[str, np.ndarray]

    def during(self, phase):
        """Samples after which it was that."""
        return np.flatnonzero(self.memory["mode"] == phase)

    def energy(self, k):
        """Of the swing, over that of hanging [J]."""
        return J * self.x[k, 3] ** 2 / 2 + WEIGHT * (1 - math.cos(self.x[k, 2]))


@cache
def explored(drive=1.0, body=1.0, pendulum=1.0, dry=DRY, gain=GAIN):
    """Eq. of the paper's appendix on a cart that sticks, typed by hand; drive and encoders times their factors."""
    rule = exploration(RIG, TRAVEL)
    z, p = tuple(rule.initial.tolist()), tuple(rule.parameters)

    def slope(x, force):
        s, c = math.sin(x[2]), math.cos(x[2])
        push = force + KAPPA * s * x[3] ** 2 - CART.b_1 * x[1]
        push -= dry * max(-1.0, min(1.0, x[1] / 1e-3)) if abs(x[1]) > 1e-9 or abs(push) > dry else push
        turn = -WEIGHT * s - CART.b_2 * x[3]
        D = M * J - (KAPPA * c) ** 2
        return np.array([x[1], (J * push - KAPPA * c * turn) / D, x[3], (M * turn - KAPPA * c * push) / D])

    x, steps = np.zeros(4), RIG.resolution.tolist()
    rows = []
    for k in range(round(SECONDS / PERIOD)):
        shown = [round(s * x[i] / step) * step for i, s, step in ((0, body, steps[0]), (2, pendulum, steps[1]))]
        (u,), z = rule.function(k * PERIOD, shown, (), z, p)
        rows.append((u, *x, *z))
        h = PERIOD / 4
        for _ in range(4):
            x = x + h * slope(x + h / 2 * slope(x, drive * gain * u), drive * gain * u)
    table = np.array(rows)
    memory = dict(zip(NAMES, table[:, 5:].T, strict=True))
    return Explored(np.arange(len(rows)) * PERIOD, table[:, 0], table[:, 1:5], memory)


def phases(e):
    """What it did, each with how long [s]."""
    return [(int(phase), sum(1 for _ in group) * PERIOD) for phase, group in groupby(e.memory["mode"])]


@pytest.mark.parametrize("wired", WIRED)
def test_signs_are_found_and_the_motion_is_the_same_whatever_is_turned_round(wired):
    drive, body, pendulum = wired
    e, straight = explored(*wired), explored()
    assert e.memory["side"][-1] == drive * body
    assert e.memory["sign"][-1] == -body * pendulum  # a cart that is pushed throws its pendulum the other way
    np.testing.assert_array_equal(np.abs(e.x), np.abs(straight.x))
    np.testing.assert_array_equal(np.abs(e.u), np.abs(straight.u))


def test_every_phase_comes_once_and_lasts_as_it_should():
    found = phases(explored())
    assert [phase for phase, _ in found] == ORDER
    lasts = dict(found)
    for phase, seconds in {WAITS: 0.3, RESTS: 0.5, STOPS: 0.5, PUMPS: 7.0, BRAKES: 0.3, COASTS: 3.0}.items():
        assert lasts[phase] == pytest.approx(seconds, abs=1.5 * PERIOD)
    assert sum(seconds for _, seconds in found[:-1]) == pytest.approx(SECONDS - 0.3, abs=1.5 * PERIOD)


def test_ramps_grow_with_the_cube_of_time_until_what_sticks_breaks_away():
    e = explored()
    for phase, side, name in ((RISES, 1, "up"), (FALLS, -1, "down")):
        k = e.during(phase)
        np.testing.assert_allclose(e.u[k], side * LIMIT * ((e.t[k] - e.t[k[0]]) / 4) ** 3, atol=1e-9)
        assert DRY / GAIN < e.memory[name][-1] < 1.75 * DRY / GAIN
    still = np.flatnonzero(np.abs(e.x[:, 1]) > 1e-6)[0]
    assert abs(e.u[still - 1]) == pytest.approx(DRY / GAIN, rel=0.05)


def test_a_kick_tells_what_the_drive_gives_by_the_way_of_the_cart():
    """From rest s = a t^2/2, with a = force (J / (M J - kappa^2)); what sticks is found before."""
    true = GAIN / (M - KAPPA**2 / J)
    assert explored().memory["gain"][-1] == pytest.approx(true, rel=0.2)
    assert explored(body=0.25).memory["gain"][-1] == pytest.approx(true / 4, rel=0.3)


def test_the_drive_rests_while_nothing_is_asked_of_it():
    e = explored()
    for phase in (WAITS, RESTS, STOPS, COASTS, ENDS):
        assert not e.u[e.during(phase)].any()


def test_the_pendulum_is_swung_to_its_angle_or_as_far_as_seven_seconds_bring_it():
    e = explored(body=0.25)  # a cart that goes four times as far as it shows has seconds to spare
    k = e.during(PUMPS)
    assert dict(phases(e))[PUMPS] < 7.0
    assert np.abs(e.x[k[:-1], 2]).max() <= SWING < np.abs(e.x[k[-1] : k[-1] + 2, 2]).max() + 0.02
    k = explored().during(PUMPS)
    swing = np.abs(explored().x[k, 2])
    assert swing[-200:].max() > 3 * swing[:100].max()  # fed, not only moved


def test_the_cart_stays_within_its_share_of_the_travel_and_with_an_encoder_that_shows_a_quarter_within_all_of_it():
    for e in (explored(), explored(dry=0.0)):
        assert 0.8 * BOUND < np.abs(e.x[e.during(PUMPS), 0]).max() < 1.5 * BOUND
    assert np.abs(explored(body=0.25).x[:, 0]).max() < TRAVEL


def test_calming_takes_the_swing_away_that_coasting_leaves():
    for dry, left in ((0.0, 0.01), (DRY, 0.25)):  # beyond what sticks the cart does not follow a small swing
        e = explored(dry=dry)
        k = e.during(CALMS)
        assert e.energy(k[-1]) < left * e.energy(k[0])
    e = explored()
    assert e.energy(e.during(COASTS)[-1]) > 0.9 * e.energy(e.during(COASTS)[0])


def test_without_dry_friction_what_coasts_on_is_not_taken_for_driven():
    e = explored(dry=0.0)
    assert (e.memory["side"][-1], e.memory["sign"][-1]) == (1, -1)
    assert max(e.memory["up"][-1], e.memory["down"][-1]) < 0.02 * LIMIT


def test_where_nothing_moves_both_ramps_end_at_the_limit_and_nothing_follows():
    e = explored(gain=0.0)
    found = phases(e)
    assert [phase for phase, _ in found] == [WAITS, RISES, RESTS, FALLS, STOPS, ENDS]
    assert [dict(found)[p] for p in (RISES, FALLS)] == pytest.approx([4.0, 4.0], abs=1.5 * PERIOD)
    assert (e.u.max(), e.u.min()) == pytest.approx((LIMIT, -LIMIT), rel=0.01)
    assert np.abs(e.u).max() <= LIMIT


def test_kicks_double_and_alternate_for_four_seconds_where_the_pendulum_shows_nothing():
    e = explored(pendulum=0.0)
    assert [phase for phase, _ in phases(e)] == [WAITS, RISES, RESTS, FALLS, STOPS, KICKS, ENDS]
    assert dict(phases(e))[KICKS] == pytest.approx(4.0, abs=1.5 * PERIOD)
    kicks = [(u, sum(1 for _ in group) * PERIOD) for u, group in groupby(e.u[e.during(KICKS)])]
    first = 1.5 * max(e.memory["up"][-1], e.memory["down"][-1])
    struck = [(u, seconds) for u, seconds in kicks if u]
    assert [u for u, _ in struck[:6]] == pytest.approx([first, -2 * first, 4 * first, -8 * first, LIMIT, -LIMIT])
    assert [seconds for _, seconds in struck[:6]] == pytest.approx([0.2] * 6, abs=1.5 * PERIOD)
    assert [seconds for u, seconds in kicks[1:12:2]] == pytest.approx([0.2] * 6, abs=1.5 * PERIOD)


def test_a_body_that_shows_nothing_is_not_kicked_though_its_pendulum_leans():
    e = explored(body=0.0)
    assert [phase for phase, _ in phases(e)] == [WAITS, RISES, RESTS, FALLS, STOPS, ENDS]
    assert e.memory["side"][-1] == 0.0
    assert np.abs(e.u).max() < 0.1 * LIMIT
