"""Is the response of sines that are put out blindly that of Newton's law, and does the drive keep its travel?"""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import signal

from upright.errors import BadInput
from upright.experiments.frequency_1b.one_by_one import (
    LEFT,
    SLOWEST,
    modelled,
    response_of_sines,
    settling,
    sine,
    stepped_sines,
)
from upright.experiments.stand.twin import TwinStand
from upright.rig.makes import MAKES, make_rig

SMOOTH = {"f_1c": 0.0, "f_2c": 0.0}


def two_disks(p, gain, w):
    """Angles per volt of two disks on a shaft, from Newton's law of each."""
    s = 1j * w
    own = [p[f"J_{i}"] * s**2 + (p[f"c_{i}"] + p["c_12"]) * s + p["k_12"] for i in (1, 2)]
    across = p["c_12"] * s + p["k_12"]
    return gain * np.array([own[1], across]) / (own[0] * own[1] - across**2)


def drive(rig, w):
    """What a held, late and lagging command is of the one that was asked for."""
    T = rig.period
    held = (1 - np.exp(-1j * w * T)) / (1j * w * T)
    return held * np.exp(-1j * w * rig.delay) / (1 + 1j * w * rig.lag)


def swept(stand, tmp_path):
    plan = stepped_sines(stand)
    record = stand.run(plan.samples.tolist(), tmp_path, "sweep")
    y = np.column_stack([record[name] for name in stand.names])
    u = record["u_applied"]
    sines = [sine(plan, k, stand.rig, y[a:b], u[a:b]) for k, (a, b) in enumerate(plan.windows)]
    return plan, y, sines


def test_without_dry_friction_every_point_is_that_of_newtons_law(tmp_path):
    rig = make_rig("torsional", 2).changed(**SMOOTH)
    plan, _, sines = swept(TwinStand(rig=rig, make=MAKES["torsional"]), tmp_path)
    response = response_of_sines(sines, rig).response
    expected = np.array([two_disks(rig.plant.parameters(), rig.gain, w) * drive(rig, w) for w in plan.omega])
    assert modelled(rig, "rest", plan.omega) == pytest.approx(expected, rel=1e-9)
    # off by the size, at either disk, of the smaller of what each shows; where disk 1 stands nearly still it is a count
    scale = np.maximum(np.abs(expected), 0.1 * np.abs(expected).max(axis=1, keepdims=True))
    assert (np.abs(response - expected) / scale).max() < 0.02
    assert len(plan.omega) >= 8


@pytest.mark.parametrize("make", ["furuta", "rectilinear"])
def test_each_sine_is_measured_over_whole_periods_and_the_drive_keeps_its_travel(make, tmp_path):
    stand = TwinStand(rig=make_rig(make, 3), make=MAKES[make])
    plan, y, sines = swept(stand, tmp_path)
    assert [(b - a) % n for (a, b), n in zip(plan.windows, plan.lengths, strict=True)] == [0] * len(sines)
    assert all(a < b <= c for (a, b), (c, _) in zip(plan.windows, plan.windows[1:], strict=False))
    assert np.abs(plan.samples).max() <= 0.8 * stand.rig.limit
    assert plan.samples[[0, -1]].tolist() == [0.0, 0.0]
    driven = np.abs(y[:, 0]).max()
    assert driven < 0.5 * min(stand.travel, 2.0)  # of 0.25 of the travel that are asked for
    assert plan.seconds < 180
    # the last ones lie far above every mode, and settle
    assert sines[-1].settled
    last = response_of_sines(sines, stand.rig)
    assert np.abs(last.response[-1] / modelled(stand.rig, stand.resting, last.omega[-1:])[0] - 1).max() < 0.1


def test_a_rig_that_would_fall_is_not_swept():
    stand = TwinStand(rig=make_rig("furuta"), make=MAKES["furuta"], zero="inverted")
    with pytest.raises(BadInput, match="hangs or stands"):
        stepped_sines(stand)


def test_near_a_mode_a_sine_is_measured_where_its_free_swing_decays_in_time_as_harmonic_balance_has_it(tmp_path):
    rig = make_rig("torsional", 3)
    plan, _, sines = swept(TwinStand(rig=rig, make=MAKES["torsional"]), tmp_path)
    p, response = rig.plant.parameters(), response_of_sines(sines, rig).response
    (mode,) = (abs(z) for z in rig.linear("rest").poles() if z.imag > 1.0)
    near = [k for k, w in enumerate(plan.omega) if abs(w / mode - 1) < 0.1]
    assert (plan.omega[near] / mode) == pytest.approx([0.95, 1.0, 1.05], abs=0.003)
    for k in near:
        speeds = plan.omega[k] * np.abs(sines[k].tone.lines[0])
        damped = {f"c_{i}": p[f"c_{i}"] + 4 * p[f"f_{i}c"] / (math.pi * v) for i, v in zip((1, 2), speeds, strict=True)}
        expected = two_disks({**p, **damped}, rig.gain, plan.omega[k]) * drive(rig, plan.omega[k])
        assert np.abs(response[k] / expected - 1).max() < 0.01  # 7 % from the same without dry friction
    assert plan.gaps == ()


@pytest.mark.parametrize(("omega", "zeta"), [(8.0, 0.018), (27.0, 0.028), (27.0, 0.1)])
def test_a_mode_settles_when_a_simulation_of_it_does(omega, zeta):
    wait = settling(omega * complex(-zeta, math.sqrt(1 - zeta**2)))
    t = np.linspace(0.0, SLOWEST[0] + wait + math.pi / omega, 20_001)  # half a period more
    grown = (1 - np.cos(np.pi * np.minimum(t / SLOWEST[0], 1.0))) / 2
    mode = signal.lti([2 * zeta * omega**2], [1.0, 2 * zeta * omega, omega**2])  # -1j at its own frequency
    _, y, _ = signal.lsim(mode, grown * np.sin(omega * t), t)
    last = t > t[-1] - 2 * math.pi / omega
    assert 1 - np.ptp(y[last]) / 2 == pytest.approx(LEFT, abs=0.004)


@pytest.mark.parametrize("make", sorted(MAKES))
def test_what_would_not_settle_in_time_is_left_out_and_named(make):
    stand = TwinStand(rig=make_rig(make), make=MAKES[make])
    poles = [p for p in stand.rig.linear(stand.resting).poles() if p.imag > 0]
    plan = stepped_sines(stand)
    for pole in poles:
        near = np.abs(np.log(plan.omega / abs(pole))) < math.log(1.1)
        slow = -1 / pole.real > 5.0  # seconds
        assert (near.sum(), abs(pole) in dict(plan.gaps)) == ((0, True) if slow else (3, False))
