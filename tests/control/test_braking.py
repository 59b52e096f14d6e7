"""Does a stop end within the travel while the drive obeys, wherever the rig was and whatever it was drawn to be?"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.hazards.sound import law_for
from upright.control.braking import GRACE, SHARE, Braking
from upright.errors import RigStopped
from upright.experiments.nonideal import nonideal
from upright.rig.makes import make_rig
from upright.rigs import Board, Limits, Mode, TwinPort
from upright.rigs.supervisor import Duty, Supervisor
from upright.simulation import simulate

TRAVEL = {"furuta": 1.2, "linear": 0.15}
COAST = 0.35  # s, in which a pendulum falls through the bottom


def stopped(make, seed, during):
    """How far the body truly was from zero, at the farthest, until it has coasted; what was said; its speed at zero."""
    known, truth = make_rig(make), nonideal(make_rig(make, seed), seed)
    limits = Limits(travel=(TRAVEL[make], math.inf), speed=(math.inf,) * 2, start=(math.inf,) * 2, command=known.limit)
    port = TwinPort(truth)
    rig = Board(port)
    beside = Supervisor(rig, Duty(limits=limits, model=known, at="inverted", zero="hanging", lean=math.radians(25),
                                  near=math.radians(15)))  # fmt: skip
    beside.prepare()
    port.hold("inverted", [0.0, 0.0, 0.03, 0.0])
    beside.aim(law_for(known))
    beside.start()
    port.let_go()
    tick, farthest = rig.exchange(0.0), 0.0
    said = ""
    for k in range(round(3.0 / known.period)):
        during(k * known.period, port, beside)
        try:
            tick = rig.exchange(beside.step(tick))
        except RigStopped as stop:
            said = str(stop)
            break
        farthest = max(farthest, abs(port.x[0]))
    assert said
    speed = abs(float(port.x[1]))
    for _ in range(round(COAST / known.period)):
        rig.alone(known.period)
        farthest = max(farthest, abs(port.x[0]))
    assert rig.sample.applied == 0.0
    return farthest, said, speed


def blow(at, body, pendulum):
    done = []

    def during(t, port, beside):
        if t >= at and not done:
            done.append(t)
            port.push([body, pendulum])

    return during


@pytest.mark.parametrize("make", ["furuta", "linear"])
@pytest.mark.parametrize("seed", [1, 2, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(3, 9))])
def test_a_body_that_is_struck_towards_its_end_stops_within_its_travel(make, seed):
    rng = np.random.default_rng([seed, 5])
    way = rng.choice([-1.0, 1.0])
    hard = way * rng.uniform(1.5, 4.0)
    strike = blow(rng.uniform(0.2, 0.5), 0.0, hard)
    farthest, why, _ = stopped(make, seed, strike)
    assert farthest <= TRAVEL[make], why


@pytest.mark.parametrize("make", ["furuta", "linear"])
@pytest.mark.parametrize("seed", range(1, 5))
def test_a_pendulum_shown_the_wrong_way_round_leaves_its_body_within_its_travel(make, seed):
    def during(t, port, beside):
        if t >= 0.3:
            port.encoders.scaled(1, -1.0)

    farthest, why, _ = stopped(make, seed, during)
    assert farthest <= TRAVEL[make], why


@pytest.mark.parametrize("seed", range(1, 5))
def test_a_brake_that_drives_the_body_on_is_let_go(seed):
    """Its encoder turns round just before: what a brake may add is bounded by `GRACE` and the drive's delay."""
    known = make_rig("furuta")
    first = []

    def during(t, port, beside):
        if t >= 0.3 and not first:
            port.push([0.0, 8.0])
            port.encoders.scaled(0, -1.0)
            first.append(t)

    _, why, speed = stopped("furuta", seed, during)
    strongest = SHARE * known.limit * known.linear("inverted").B[1, 0]
    before = 15.0  # rad/s, what the law gave it until the pendulum had left by 25 degrees
    assert speed < before + 1.3 * strongest * (GRACE + known.delay + known.lag + 6 * known.period), why


@pytest.mark.parametrize(("make", "carried"), [("furuta", True), ("linear", True), ("linear", False)])
def test_a_body_under_its_pendulum_needs_its_speed_squared_over_twice_its_deceleration(make, carried):
    rig = make_rig(make).replace(delay=0.003, lag=0.002)
    p = rig.plant
    arm = make == "furuta"
    M = p.J_d + p.m_p * p.r**2 + p.J_a if arm else p.m_c + p.m_p
    share = (p.m_p * p.r * p.l_cg if arm else p.m_p * p.l_cg) / M if carried else 0.0
    braking = Braking(rig, "inverted", rig.limit, falls=carried)
    x = np.zeros((3, 4))
    x[:, 2] = math.pi
    x[:, :2] = [[0.1, 2.0], [-0.1, -2.0], [0.1, -2.0]]
    a = 0.5 * rig.limit * rig.gain / M
    sway = min(1.5 * share, 0.5 * 3.0)
    away = 0.1 + 2.0 * (0.005 + 6 * rig.period) + 2.0**2 / (2 * a) + sway
    assert braking.farthest(x, 3.0) == pytest.approx([away, away, 0.1 + sway], rel=1e-9)
    # what comes to rest is the momentum of both, and upright the two masses' coupling has the other sign than hanging
    way = 1.0 if arm else -1.0
    x[:, 3] = 0.5
    p = 2.0 + way * share * 0.5
    moved = 0.1 + p * (0.005 + 6 * rig.period) + p**2 / (2 * a) + sway
    assert braking.farthest(x, 3.0)[0] == pytest.approx(moved, rel=1e-9)


@pytest.mark.parametrize(("make", "v", "far"), [("furuta", 5.0, 9.0), ("linear", 0.5, 0.15)])
def test_a_body_without_its_drive_coasts_as_far_as_its_friction_lets_it(make, v, far):
    """``M v' = -b v - T``; the firmware's page prints these. The pendulum that hangs on it swings 2 % of that away."""
    rig = make_rig(make)
    p, arm = rig.plant, make == "furuta"
    M = p.J_d + p.m_p * p.r**2 + p.J_a if arm else p.m_c + p.m_p
    expected = M / p.b_1 * (v - p.b_1c / p.b_1 * math.log(1 + p.b_1 * v / p.b_1c))
    x0 = p.state("hanging")
    x0[1] = v
    x = simulate(p, rig.drive, x0, np.zeros(2), 1e-3, samples=20_000, substeps=2)[:, 0, 0]
    assert x.max() == pytest.approx(expected, rel=0.03)
    assert expected == pytest.approx(far, rel=0.01)


def started(pressed):
    """A held Furuta twin whose stop is pressed when the list holds something; its port, rig and supervisor."""
    known = make_rig("furuta")
    limits = Limits(travel=(2.0, math.inf), speed=(math.inf,) * 2, start=(math.inf,) * 2, command=known.limit)
    port = TwinPort(known)
    rig = Board(port)
    beside = Supervisor(rig, Duty(limits=limits, model=known, at="inverted", zero="hanging", lean=1.0, near=0.3),
                        stopped=lambda: "Stopped by hand." if pressed else "")  # fmt: skip
    beside.prepare()
    port.hold("inverted", [0.0, 0.0, 0.05, 0.0])
    beside.aim(law_for(known))
    beside.start()
    port.let_go()
    return port, rig, beside


def test_who_stops_it_by_hand_means_now():
    pressed = []
    port, rig, beside = started(pressed)
    tick = rig.exchange(0.0)
    for _ in range(100):
        tick = rig.exchange(beside.step(tick))
    assert abs(port.x[1]) > 0.1
    pressed.append(True)
    last, outputs = rig.sample.tick, []
    rig.exchange, exchange = (lambda u: outputs.append(u) or exchange(u)), rig.exchange
    with pytest.raises(RigStopped, match="by hand"):
        beside.step(tick)
    assert not any(outputs)
    assert rig.sample.tick >= last


def test_a_first_sample_beyond_the_travel_ends_with_zero():
    """Nothing has been seen then that a speed could be told from."""
    _, rig, beside = started([])
    first = rig.exchange(0.0)
    beyond = replace(first, counts=(10**6, *first.counts[1:]))
    with pytest.raises(RigStopped, match="beyond its travel"):
        beside.step(beyond)
    assert (rig.sample.mode, rig.sample.applied) == (Mode.FAULT, 0.0)


def test_a_stop_that_is_pressed_while_it_brakes_ends_that():
    pressed, brakes = [], []
    port, rig, beside = started(pressed)
    tick = rig.exchange(0.0)
    for _ in range(100):
        tick = rig.exchange(beside.step(tick))
    port.push([12.0, 0.0])
    exchange = rig.exchange

    def within_a_step(u):
        brakes.append(u)
        pressed.append(True)
        return exchange(u)

    def driven(tick):
        for _ in range(400):
            tick = exchange(beside.step(tick))

    rig.exchange = within_a_step
    with pytest.raises(RigStopped):
        driven(tick)
    assert brakes[0] != 0.0
    assert not any(brakes[1:])
    assert rig.sample.applied == 0.0
