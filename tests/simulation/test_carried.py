"""Does a motion that is taken up where another ended go on as if it had never stopped, lane by lane?"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.simulation.conftest import BLOCK
from upright.simulation import choose
from upright.simulation.simulator import Simulator

WHAT = {
    "presliding": {"F_c": 0.5, "delta": 5e-3},
    "relaxation": {"actuator.gain": 2.0, "actuator.damping": 3.0, "actuator.relaxation": 0.05},
    "both, beyond a knee": {
        "F_c": 0.5, "delta": 5e-3, "actuator.gain": 2.0, "actuator.damping": 3.0, "actuator.relaxation": 0.05,
        "actuator.knee": 0.02, "actuator.fade": 1.0,
    },
}  # fmt: skip


@pytest.mark.parametrize("lanes", [1, 20])
@pytest.mark.parametrize("what", WHAT)
def test_a_motion_goes_on_where_another_ended(block, what, lanes):
    values = {**BLOCK, "k": 40.0, **WHAT[what]}
    plain = choose(block, values)
    simulator, forgetful = (
        Simulator(derived=block, flavour=f, dt=2e-3, substeps=2) for f in (replace(plain, carried=True), plain)
    )
    assert simulator.carried
    x0 = np.vstack([np.linspace(0.02, 0.05, lanes), np.zeros(lanes)])
    u = np.where(np.arange(200) % 60 < 25, 0.6, 0.0)[:, None]
    table = simulator.table(values, lanes)
    begin = np.vstack([x0, np.zeros((simulator.carried, lanes))])
    whole = simulator.run(table, begin, u, samples=200)
    # what is carried is carried beside the motion, and changes nothing of it
    np.testing.assert_array_equal(whole[:, :2], forgetful.run(table, x0, u, samples=200))
    first = simulator.run(table, begin, u, samples=91)
    second = simulator.run(table, first[-1].copy(), u, samples=110, start=np.full(lanes, 90, dtype=np.int64))
    size = np.ptp(whole[:, :2], axis=0)
    assert np.all(np.abs(second - whole[90:])[:, :2] < 1e-12 * size)
    lost = forgetful.run(table, first[-1, :2].copy(), u, samples=110, start=np.full(lanes, 90, dtype=np.int64))
    assert np.all(np.abs(lost - whole[90:, :2]).max(axis=0) > 1e-4 * size)
