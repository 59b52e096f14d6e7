"""How many Runge-Kutta steps does a servo period need for a motion that errs by far less than an encoder's count?"""

from __future__ import annotations

import numpy as np
import pytest

import upright as up
from tests.physics.specimens import SPECIMENS
from upright.control.trial import steps_in_period
from upright.rig.makes import make_rig
from upright.simulation import simulate

SHIPPED = {
    name: s.plant for name, s in SPECIMENS.items()
    if type(s.plant).__module__.startswith("upright.") and len(s.plant.coordinates) < 4
}  # fmt: skip
COUNT = {"rad": 2 * np.pi / 16_000, "m": 0.0706 / 16_000}  # of the makes, the finest encoders of the laboratory


def rig(plant, period="1 ms"):
    unit = plant.inputs[0].unit
    return up.Rig.known(plant, gain=f"1 ({unit})/V", limit="1 V", period=period, counts=16_000)


def errors(rig, substeps, *, at, seconds=2.0, drive=None):
    """Largest error of each coordinate [count] of a rig let go aside, beside steps that are eight times shorter."""
    away = np.array([part for c in rig.plant.coordinates for part in (0.05 if c.unit == "m" else 0.3, 0.0)])
    rows = round(seconds / rig.period)
    t = np.arange(rows) * rig.period
    command = 0.3 * rig.limit * np.sin(8.0 * t) if rig.plant.inputs else None
    known = {"actuator.gain": rig.gain} if drive is None else drive
    start = rig.plant.state(at) + away
    coarse, fine = (
        simulate(rig.plant, known, start, command, rig.period, samples=rows, substeps=n)[:, 0::2, 0]
        for n in (substeps, 8 * substeps)
    )
    return np.abs(coarse - fine).max(axis=0) / [COUNT[c.unit] for c in rig.plant.coordinates]


@pytest.mark.parametrize("plant", SHIPPED.values(), ids=SHIPPED)
def test_one_step_a_millisecond_errs_by_a_thousandth_of_a_count(plant):
    made = rig(plant)
    assert steps_in_period(made) == 1
    assert errors(made, 1, at=next(iter(plant.equilibria))).max() < 1e-3


@pytest.mark.parametrize("name", ["furuta", "linear", "rectilinear", "torsional"])
def test_with_dry_friction_and_a_slow_drive_one_step_errs_by_a_fifth_of_a_count(name):
    made = make_rig(name)
    assert (steps_in_period(made), made.period < 1e-3) == (1, True)
    assert errors(made, 1, at=next(iter(made.plant.equilibria)), drive=made.drive).max() < 0.2


def test_halving_the_step_leaves_a_sixteenth_of_its_error():
    """The order of Runge and Kutta's method, where neither friction nor rounding hides it."""
    made = rig(SHIPPED["torsional-2"], "4 ms")
    once, twice = errors(made, 1, at="rest"), errors(made, 2, at="rest")
    assert np.log2(once / twice) == pytest.approx([4.0, 4.0], abs=0.2)


@pytest.mark.parametrize(("period", "stiffer", "least"), [("10 ms", 1.0, 10), ("1 ms", 400.0, 10)])
def test_a_long_period_or_a_fast_mode_takes_more_steps(period, stiffer, least):
    """With one step the error is more than a count, with as many as the rule takes a hundredth of one."""
    link = SHIPPED["flexible-link"]
    made = rig(link.replace(k_s=link.k_s * stiffer), period)
    assert steps_in_period(made) >= least
    assert errors(made, 1, at="rest").max() > 0.5
    assert errors(made, steps_in_period(made), at="rest").max() < 0.05
