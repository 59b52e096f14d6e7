"""What first motions tell of a rig's wiring, held against motions that scipy integrates from the printed equations."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import upright as up
from upright.control.exploration import exploration
from upright.control.wiring import WiringCheck, check_wiring

CART = up.CartPendulum(m_c=0.6, m_p=0.14, l_cg=0.19, J_p=6e-4, b_1=1.2, b_2=3e-5)
GAIN, PERIOD, SECONDS = 5.25, 1e-3, 12.0
RIG = up.Rig.known(CART, gain=GAIN, limit=5.0, period=PERIOD, counts=(200_000, 4096), travel=0.3)


@cache
def moved(dead_zone: float = 0.0, gain: float = GAIN, late: float = 0.0):
    """Time, cart and pendulum, and the command: eq. of the paper's appendix on a cart, pushed by two sines."""
    p = CART
    J = p.J_p + p.m_p * p.l_cg**2

    def command(t: float) -> float:
        return 0.9 * math.sin(5.0 * t) + 0.8 * math.sin(8.1 * t + 1.0)

    def slope(t: float, x: np.ndarray) -> list[float]:
        _, v, theta, w = x
        u = command(max(t - late, 0.0))
        force = gain * math.copysign(max(abs(u) - dead_zone, 0.0), u)
        s, c = math.sin(theta), math.cos(theta)
        # (m_c + m_p) x'' + m_p l cos theta'' = F + m_p l sin theta'^2 - b_1 x'
        # m_p l cos x'' + J theta'' = -m_p g l sin - b_2 theta'
        M = np.array([[p.m_c + p.m_p, p.m_p * p.l_cg * c], [p.m_p * p.l_cg * c, J]])
        f = [force + p.m_p * p.l_cg * s * w**2 - p.b_1 * v, -p.m_p * p.g * p.l_cg * s - p.b_2 * w]
        a = np.linalg.solve(M, f)
        return [v, float(a[0]), w, float(a[1])]

    t = np.arange(round(SECONDS / PERIOD)) * PERIOD
    x = solve_ivp(slope, (0.0, SECONDS), [0.0, 0.0, 0.0, 0.0], t_eval=t, max_step=4 * PERIOD, rtol=1e-7, atol=1e-9).y
    return t, x[[0, 2]].T, np.array([command(s) for s in t])


def counted(q: np.ndarray, *scales: float) -> np.ndarray:
    """What encoders show that are scaled, in whole counts."""
    step = RIG.resolution
    return np.round(q * np.array(scales) / step) * step


@pytest.mark.parametrize(
    ("signs", "named"),
    [
        ((1, 1, 1), ""), ((-1, 1, 1), "motor leads swapped"), ((1, -1, 1), "encoder channels of x swapped"),
        ((1, 1, -1), "encoder channels of theta swapped"), ((-1, -1, 1), "encoder channels of theta swapped"),
        ((-1, 1, -1), "encoder channels of x swapped"), ((1, -1, -1), "motor leads swapped"), ((-1, -1, -1), ""),
    ],
)  # fmt: skip
def test_what_is_turned_round_against_the_two_others_is_named(signs, named):
    t, q, u = moved()
    drive, x, theta = signs
    found = check_wiring(
        RIG, t, counted(drive * q, x, theta), u
    )  # the mirrored motion is the one of the mirrored command
    assert [what for what, _ in found.wrong] == ([named] if named else [])


@pytest.mark.parametrize(("x", "theta"), [(1.0, 2000 / 4096), (0.5, 1.0), (2.0, 4.0), (0.25, 0.25)])
def test_counts_of_both_encoders_follow_from_gravity_and_the_period_of_large_swings(x, theta):
    t, q, u = moved()
    assert np.abs(q[:, 1]).max() > math.radians(50)  # what tells the scale of theta
    found = check_wiring(RIG, t, counted(q, x, theta), u)
    assert found.scale == pytest.approx((x, theta), rel=0.01)
    for value, error, true in zip(found.scale, found.error, (x, theta), strict=True):
        assert abs(value - true) < 4 * error
    wrong = " ".join(what for what, _ in found.wrong)
    assert ("theta: counts per turn 2000, not 4096" in wrong) == (theta == 2000 / 4096)


@pytest.mark.parametrize("dead_zone", [0.0, 0.1, 0.4])
@pytest.mark.parametrize("share", [1.0, pytest.param(0.5, marks=pytest.mark.slow)])
def test_gain_and_dead_zone_of_the_drive_follow_beside_each_other(dead_zone, share):
    t, q, u = moved(dead_zone, share * GAIN)
    found = check_wiring(RIG, t, counted(q, 1.0, 1.0), u)
    assert abs(found.drive - share) < 4 * found.drive_error < 0.1
    assert abs(found.dead_zone - dead_zone) < 4 * found.dead_error < 0.06
    assert ("supply at half" in found.weak) == (share == 0.5)


def test_a_late_drive_is_late_by_as_much():
    """By whole samples, of which the nearest is found."""
    t, q, u = moved(late=0.012)
    found = check_wiring(RIG, t, counted(q, 1.0, 1.0), u)
    assert found.delay == pytest.approx(0.012, abs=PERIOD / 2)
    prompt = check_wiring(RIG, *moved()[:1], counted(moved()[1], 1.0, 1.0), u)
    assert prompt.delay == 0.0


def test_an_encoder_that_shows_nothing_is_named_instead_of_its_sign():
    t, q, u = moved()
    assert check_wiring(RIG, t, counted(q, 1.0, 0.0), u).wrong[0][0] == "encoder of theta shows nothing"
    assert check_wiring(RIG, t, counted(q, 0.0, 1.0), u).wrong[0][0] == "encoder of x shows nothing"
    assert check_wiring(RIG, t, counted(q, 0.0, 0.0), u).wrong[0][0] == "nothing moves"


def test_the_exploration_asks_for_no_more_than_the_rig_may_be_given():
    rule = exploration(RIG, RIG.travel)
    rng = np.random.default_rng(1)
    wild = np.cumsum(rng.normal(size=(20_000, 2)), axis=0) * RIG.resolution * 50
    commands, _ = rule.follow(wild, PERIOD)
    assert np.abs(commands).max() <= RIG.limit
    assert not commands[-200:].any()  # and ends at zero


LINES = (100, 200, 250, 256, 300, 360, 400, 500, 512, 600, 720, 1000, 1024, 1250, 1800, 2000, 2048, 2500, 3600, 4000,
         4096, 5000)  # fmt: skip
"""Of catalogues: US Digital's E5, Omron's E6B2, CUI's AMT10."""


def counted_as(described, true, turns=True, error=1e-4):
    """What is said of a pendulum's encoder that has other counts than described, the body's as they should be."""
    scale = true / described
    found = WiringCheck(
        names=("x", "theta"), unit="V", described=(1.0, described), turns=(False, turns), moves=1.0, swings=1.0,
        scale=(1.0, scale), error=(0.0, error * scale),
    )  # fmt: skip
    return [what for what, _ in found.wrong]


@pytest.mark.parametrize("edges", [1, 2, 4])
def test_counts_that_encoders_have_are_named_by_the_number_in_their_catalogue(edges):
    """A scale is taken for the number that it is within 0.5 % of; described is one that lies near none of them."""
    for lines in LINES:
        assert counted_as(1100, 1.002 * edges * lines) == [f"theta: counts per turn {edges * lines}, not 1100"]


def test_counts_that_no_encoder_has_are_told_as_they_are_seen():
    assert counted_as(777, 1333.0) == ["theta: counts per turn 1330, not 777"]
    assert counted_as(777, 4 * 777 * 1.001) == ["theta: counts per turn 3108, not 777"]  # edges counted otherwise
    assert counted_as(777, 777 / 4) == ["theta: counts per turn 194, not 777"]
    assert counted_as(3000, 2048.0, turns=False) == ["theta: counts per metre 2050, not 3000"]  # of a rail no table
    assert counted_as(3000, 1500.0, turns=False) == ["theta: counts per metre 1500, not 3000"]
    # an error of 1 % leaves two that it may be, and one of 15 % more than anybody wants to read
    assert counted_as(777, 1010.0, error=0.01) == ["theta: counts per turn 1000 or 1024, not 777"]
    assert counted_as(300, 2000.0, error=0.15) == ["theta: counts per turn 2000, not 300"]
    # five percent are borne, and what is less than four standard errors off
    for true, error, named in ((1045.0, 1e-4, 0), (1060.0, 1e-4, 1), (1060.0, 0.02, 0), (950.0, 1e-4, 1)):
        assert len(counted_as(1000, true, error=error)) == named
