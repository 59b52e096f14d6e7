"""Is a rig that goes on being driven after its stop told from one that coasts?"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from tests.rigs.test_supervisor import DUTY, RIG, Scene
from upright.errors import RigStopped
from upright.experiments.nonideal import nonideal
from upright.rig.makes import make_rig
from upright.rigs import Fault
from upright.rigs.still_driven import LOOKED, energy_risen
from upright.simulation import simulate

N = round(LOOKED / RIG.period)


def after(rig, x0, command):
    """Coordinates of a rig left to a command."""
    x = simulate(rig.plant, rig.drive, np.asarray(x0), np.full(N, command), rig.period, samples=N)[:, 0::2, 0]
    return np.arange(N) * rig.period, np.round(x * rig.per_unit) / rig.per_unit


@pytest.mark.parametrize("make", ["furuta", "linear"])
@pytest.mark.parametrize("seed", range(1, 9))
def test_a_rig_of_other_numbers_that_coasts_and_falls_gains_nothing(make, seed):
    known, rng = make_rig(make), np.random.default_rng(seed)
    fast = {"furuta": 12.0, "linear": 1.0}[make]
    truth = nonideal(make_rig(make, seed), seed)
    x0 = [0.0, rng.uniform(-fast, fast), math.pi + rng.uniform(-0.5, 0.5), rng.uniform(-3, 3)]
    assert not energy_risen(known, *after(truth, x0, 0.0))


@pytest.mark.parametrize("make", ["furuta", "linear"])
@pytest.mark.parametrize("share", [-1.0, -0.4, 0.4, 1.0])
def test_a_rig_that_is_driven_on_gains_energy(make, share):
    truth = make_rig(make, 3)
    assert energy_risen(make_rig(make), *after(truth, [0.0, 0.0, math.pi + 0.1, 0.0], share * truth.limit))


def test_a_drive_that_does_not_obey_is_said_after_its_stop():
    scene = Scene(replace(DUTY, watch=False)).started()
    scene.port.push([0.0, 1.0])
    scene.run(0.04)
    scene.port.write = scene.port.enable = lambda *_: None
    with pytest.raises(
        RigStopped, match=r"^By hand\. It gains energy .* the drive does not obey; press the stop button\."
    ):
        scene.beside.give_up(Fault.STOP, "By hand.")
    assert Fault.MODEL in scene.beside.faults


def test_of_a_drive_that_obeys_nothing_is_said():
    scene = Scene(replace(DUTY, watch=False)).started()
    scene.port.push([0.0, 1.0])
    scene.run(0.04)
    with pytest.raises(RigStopped, match=r"^By hand\.$"):
        scene.beside.give_up(Fault.STOP, "By hand.")
