"""Is an encoder that shows not a single count told from dry friction and from a hand?"""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from tests.rigs.test_supervisor import DUTY, LAW, MODEL, RIG, Scene
from upright.control.dead_encoder import LEAST_SWUNG, SWUNG, UNSEEN, WITHIN, StillDrive, StillPendulum
from upright.control.watch import HELD_BY, OUT_OF_TRUE, sticking
from upright.errors import RigStopped
from upright.experiments.nonideal import nonideal
from upright.rig.makes import make_rig
from upright.rigs import Fault

T = RIG.period
RHO = MODEL.B[1, 0] / MODEL.B[3, 0]
P = RIG.plant
GRAVITY = P.m_p * P.g * P.l_cg / (P.J_p + P.m_p * P.l_cg**2)
"""g/l of the pendulum on a wall: of eq. (3), second row, with psi'' prescribed."""


def test_a_command_within_friction_moves_nothing_for_as_long_as_it_lasts():
    still = StillDrive(RIG, "inverted")
    assert not any(still.sees(0.0, [0.0, 0.0], 0.99 * HELD_BY * sticking(RIG)) for _ in range(20_000))


@pytest.mark.parametrize("times", [3.0, 10.0])
def test_a_command_beyond_friction_is_believed_to_have_moved_it_after_forty_counts(times):
    """From rest under a constant excess a the way is a t^2/2."""
    still, command = StillDrive(RIG, "inverted"), times * HELD_BY * sticking(RIG)
    excess = abs(MODEL.B[1, 0]) * (command - HELD_BY * sticking(RIG))
    shown = 2.5 / RIG.per_unit[1]  # its pendulum goes up and down, as on all that moves
    k = next(k for k in range(5000) if still.sees(0.0, [0.0, (k % 2 - 0.5) * shown], command))
    assert k * T == pytest.approx(math.sqrt(2 * UNSEEN / RIG.per_unit[0] / excess), abs=2 * T)


@pytest.mark.parametrize("lean", [0.0, 0.028])
def test_an_arm_that_a_hand_holds_against_its_command_is_not_taken_for_one_with_a_dead_encoder(lean):
    """A hand pushed a sound Furuta's arm with 1.9 rad/s^2 and held it against 3.0 of command and lean; its pendulum
    stood as still as the arm did, to a count. On an arm that moves it does not."""
    still, command = StillDrive(RIG, "inverted"), 3 * HELD_BY * sticking(RIG)
    count = 1 / RIG.per_unit[1]
    assert not any(still.sees(0.4, [0.4, lean + count * (k % 2)], command) for k in range(2000))
    assert still.sees(0.4, [0.4, lean + math.radians(0.5)], command)


@pytest.mark.parametrize("lean", [-0.05, 0.0, 0.004, 0.05])
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_the_pendulum_on_an_arm_that_shows_nothing_tells_whether_it_rests_or_moves_unseen(lean, way):
    """theta'' = g/l theta + psi''/rho with psi'' = 0 or what the command makes, solved from rest; in whole counts.

    True friction is half of what is allowed for, so that the arm goes farther than it must have.
    """
    command, growth = 10 * way * HELD_BY * sticking(RIG), math.sqrt(GRAVITY)
    psi = MODEL.B[1, 0] * (command - way * sticking(RIG))
    for moves in (False, True):
        still, carried = StillDrive(RIG, "inverted"), moves * psi / RHO / GRAVITY
        for k in range(500):
            theta = (lean + carried) * math.cosh(growth * k * T) - carried
            if still.sees(0.0, [0.0, round(theta * RIG.per_unit[1]) / RIG.per_unit[1]], command):
                break
        else:  # at rest and upright nothing moves at all, and nobody can tell
            assert (lean, moves) == (0.0, False)
            continue
        assert still.rests is not moves


def test_a_drive_that_gives_nothing_is_not_taken_for_a_dead_encoder():
    scene = Scene(truth=nonideal(make_rig("furuta", 2), 2)).started(tilt=0.08)
    with pytest.raises(RigStopped, match="the drive"):
        scene.run(4.0, then=lambda p: setattr(p, "write", lambda _: type(p).write(p, 0.0)))
    assert scene.beside.faults == Fault.MODEL


@pytest.mark.parametrize("speed", [0.0, 0.5])
def test_a_pendulum_must_swing_when_what_carries_it_leaves_its_straight_line(speed):
    """psi = v t + a t^2/2 and a pendulum that shows nothing: it must have swung by psi'' / rho t^2/2."""
    still, a = StillPendulum(RIG, "inverted"), 8.0
    seen = [k for k in range(400) if still.sees([speed * k * T + 0.5 * a * max(0, k - 100) ** 2 * T**2, 0.0])]
    swung = max(SWUNG, LEAST_SWUNG / RIG.per_unit[1])
    least = a / abs(RHO) - GRAVITY * OUT_OF_TRUE  # upright may be so far from where it seems to be
    # behind a corner of 60 rad/s everything is seen later by about its time constant
    assert (seen[0] - 100) * T == pytest.approx(math.sqrt(2 * swung / least) + 1 / 60, abs=0.02)
    assert (seen[0] - 100) * T < WITHIN


@pytest.mark.parametrize("lean", [0.0, 0.03, 0.2])
def test_a_pendulum_may_rest_on_a_body_that_catches_its_fall(lean):
    """J_A theta'' = m_p l_cg (g theta - r psi'') upright, eq. (3): what leans steadily is carried along steadily."""
    still, a = StillPendulum(RIG, "inverted"), P.g / P.r * lean
    assert not any(still.sees([0.5 * a * (k * T) ** 2, lean]) for k in range(1000))


@pytest.mark.parametrize("speed", [0.0, 0.3, 3.0])
def test_a_pendulum_may_rest_on_a_body_that_goes_on_straight(speed):
    still = StillPendulum(RIG, "inverted")
    for k in range(200):
        still.sees([speed * k * T, 0.01 * (k % 2)])  # counts come until it stands
    assert not any(still.sees([speed * k * T, 0.0]) for k in range(200, 4000))


@pytest.mark.parametrize("lean", [0.03, 0.2])
def test_where_body_and_pendulum_both_stand_still_nobody_can_tell_however_far_it_leans(lean):
    """A hand leans on the pendulum, its hinge and the body's friction hold the rest: 1 of 30 Furutas was stopped so
    within 5 hours. A lean that is shown at all, of a body that moves as little as a count, is no evidence."""
    still = StillPendulum(RIG, "inverted")
    assert not any(still.sees([-0.47 - (k > 300) / RIG.per_unit[0], lean]) for k in range(1000))
    # a tenth of what carries a pendulum that leans so, though, must have swung it
    a = 0.1 * P.g / P.r * 0.2
    assert any(still.sees([0.5 * a * (k * T) ** 2, 0.2]) for k in range(1000))


@pytest.mark.parametrize("channel", [0, 1])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_dead_encoder_stops_the_rig_within_its_travel(seed, channel):
    scene = Scene(truth=nonideal(make_rig("furuta", seed), seed)).started(tilt=0.08)
    with pytest.raises(RigStopped, match="not a single count"):
        scene.run(4.0, then=lambda p: p.encoders.dead(channel))
    # with nobody beside it the loop lets it go 10 rad
    assert abs(scene.port.x[0] - scene.beside.target[0]) < 1.3
    assert scene.beside.faults == Fault.ENCODER


@pytest.mark.parametrize("tap", [0.3, 0.6, 1.0, 1.5])
@pytest.mark.parametrize("seed", [1, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (2, 3))])
def test_a_sound_rig_that_is_tapped_at_rest_is_not_stopped(seed, tap):
    """10 of 62 such runs were, as an encoder that shows not a single count (20 ms of stillness inside friction)."""
    scene = Scene(truth=nonideal(make_rig("furuta", seed), seed)).started(tilt=0.01)
    scene.run(1.0)
    for sign in (1.0, -1.0):
        scene.port.push([0.0, sign * tap])
        scene.run(0.8)
        scene.port.push([sign * tap, 0.0])
        scene.run(0.8)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_worn_rig_that_is_pushed_is_not_stopped(seed):
    scene = Scene(replace(DUTY, watch=False), nonideal(make_rig("furuta", seed), seed)).started(tilt=0.03, law=LAW)
    still, pendulum = StillDrive(RIG, "inverted"), StillPendulum(RIG, "inverted")
    tick = scene.rig.exchange(0.0)
    for k in range(2500):
        if 1000 <= k < 1100:
            scene.port.push([0.0, (-1) ** seed * 8.0 * RIG.period])  # a finger for 0.09 s
        command = scene.beside.step(tick)
        away = [q - t for q, t in zip(scene.beside.readings(tick), scene.beside.target, strict=True)]
        assert not pendulum.sees(away)
        assert not still.sees(away[0], away, command)
        tick = scene.rig.exchange(command)
