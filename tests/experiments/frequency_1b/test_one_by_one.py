"""Is the response of sines that are put out blindly that of Newton's law, and does the drive keep its travel?"""

from __future__ import annotations

import math

import numpy as np
import pytest

from upright.errors import BadInput
from upright.experiments.frequency_1b.one_by_one import modelled, response_of_sines, sine, stepped_sines
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


def test_near_a_mode_no_sine_is_asked_for_as_none_would_settle():
    for make in sorted(MAKES):
        stand = TwinStand(rig=make_rig(make), make=MAKES[make])
        modes = [abs(p) for p in stand.rig.linear(stand.resting).poles() if p.imag > 0]
        ratio = np.abs(np.log(stepped_sines(stand).omega[:, None] / modes))
        assert ratio.min() > math.log(1.1)
