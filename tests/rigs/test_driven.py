"""Is an arm's encoder that is dead, or the wrong way round, told from dry friction and from a hand at the pendulum?"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from tests.rigs.test_supervisor import DUTY, LAW, MODEL, RIG, Scene
from upright.errors import RigStopped
from upright.experiments.nonideal import nonideal
from upright.rig.makes import make_rig
from upright.rigs import Fault
from upright.rigs.driven import DrivenScale, StillDrive
from upright.rigs.law import RunningLaw

PROMPT = RIG.replace(delay=0.0, lag=0.0)
FAST = 15.0
"""rad/s, of the pendulum's swing."""


def swinging(lean=0.03, seconds=1.0):
    """Arm, pendulum and command of a pendulum that swings about upright, in closed form.

    Its own equation, r psi'' = g theta - (J_p + m_p l^2) / (m_p l) theta'', gives the arm's motion; friction is none.
    """
    p, t = RIG.plant, np.arange(round(seconds / RIG.period)) * RIG.period
    theta = lean * np.sin(FAST * t)
    psi = -theta * (p.g / (p.r * FAST**2) + (p.J_p + p.m_p * p.l_cg**2) / (p.m_p * p.l_cg * p.r))
    # the arm's own row of the model, solved for the command
    command = (-(FAST**2) * psi - MODEL.A[1, 2] * theta) / MODEL.B[1, 0]
    return psi, theta, command


def rounded(angles):
    return np.round(angles * RIG.per_unit[0]) / RIG.per_unit[0]


def told(shown, theta, command):
    """The first thing that is wrong."""
    scale = DrivenScale(PROMPT, "inverted")
    rows = zip(rounded(shown).tolist(), rounded(theta).tolist(), command.tolist(), strict=True)
    return next((said for q, lean, u in rows if (said := scale.sees([q, lean], u))), "")


@pytest.mark.parametrize(("share", "said"), [(1.0, ""), (0.7, ""), (1.5, ""), (0.0, "dead"), (-1.0, "wrong way round")])
def test_what_the_arms_encoder_shows_of_its_motion_is_found(share, said):
    psi, theta, command = swinging()
    assert told(share * psi, theta, command) == said


def test_an_arm_that_friction_holds_is_not_called_dead():
    """The command says that it moves; the pendulum, which falls about a hinge that stands, says that it does not."""
    _, theta, command = swinging()
    p, t = RIG.plant, np.arange(theta.size) * RIG.period
    falls = math.sqrt(p.m_p * p.g * p.l_cg / (p.J_p + p.m_p * p.l_cg**2))
    assert told(np.zeros_like(theta), 1e-4 * np.exp(falls * t), command) == ""


def test_a_hand_that_moves_the_pendulum_of_a_resting_arm_is_not_called_a_dead_encoder():
    _, theta, command = swinging()
    assert told(np.zeros_like(theta), theta, 0.0 * command) == ""


@pytest.mark.parametrize("share", [0.0, -1.0])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_arm_is_stopped_well_within_its_travel(seed, share):
    scene = Scene(truth=nonideal(make_rig("furuta", seed), seed)).started(tilt=0.08)
    with pytest.raises(RigStopped, match=r"psi|Psi"):
        scene.run(4.0, then=lambda p: p.encoders.scaled(0, share))
    # with nobody beside it the loop lets it go 1.5 rad (wrong way round) to 10 rad (dead)
    assert abs(scene.port.x[0] - scene.beside.target[0]) < 0.7


@pytest.mark.parametrize(("share", "what"), [(0.0, "dead"), (-1.0, "wrong way round")])
def test_what_command_and_pendulum_both_say_stops_the_rig_in_that_tick(share, what):
    """Before anything else has noticed; asked of the same samples beside the supervisor."""
    scene = Scene().started(tilt=0.05)
    law, scale = RunningLaw(scene.beside.law, RIG.period), DrivenScale(RIG, "inverted")
    tick, said = scene.rig.exchange(0.0), ""
    for k in range(2000):
        if k == 340:
            scene.port.encoders.scaled(0, share)
        readings = scene.beside.readings(tick)
        away = [q - t for q, t in zip(readings, scene.beside.target, strict=True)]
        if said := scale.sees(away, law.step(readings)):
            break
        tick = scene.rig.exchange(scene.beside.step(tick))
    assert said == what
    with pytest.raises(RigStopped, match=r"psi|Psi"):
        scene.beside.step(tick)
    assert scene.beside.faults == (Fault.ENCODER if what == "dead" else Fault.MODEL)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_nonideal_rig_that_is_pushed_is_not_stopped(seed):
    scene = Scene(replace(DUTY, watch=False), nonideal(make_rig("furuta", seed), seed)).started(tilt=0.03, law=LAW)
    scale, still = DrivenScale(RIG, "inverted"), StillDrive(RIG, "inverted")
    tick = scene.rig.exchange(0.0)
    for k in range(2500):
        if 1000 <= k < 1100:
            scene.port.push([0.0, (-1) ** seed * 8.0 * RIG.period])  # a finger for 0.09 s
        command = scene.beside.step(tick)
        away = [q - t for q, t in zip(scene.beside.readings(tick), scene.beside.target, strict=True)]
        assert scale.sees(away, command) == ""
        assert not still.sees(away[0], away, command)
        tick = scene.rig.exchange(command)
