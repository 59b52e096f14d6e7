"""Is a motion the same in one run and sample by sample in one memory?"""

import numpy as np
import pytest

from upright.physics import Pendulum
from upright.simulation import Simulator, choose

VALUES = {"m_p": 0.2, "l_cg": 0.3, "J_p": 4e-3, "g": 9.81, "b_2": 2e-3, "b_2c": 2e-3}


@pytest.mark.parametrize("lanes", [1, 5, 32])
def test_a_motion_stepped_sample_by_sample_is_that_of_one_run(lanes):
    """Nothing is remembered from one sample to the next but the state; dry friction included."""
    derived = Pendulum.derived_for(VALUES)
    solver = Simulator(derived=derived, flavour=choose(derived, VALUES), dt=5e-3)
    start = np.vstack([np.linspace(0.3, 2.5, lanes), np.zeros(lanes)])
    table = solver.table({n: np.full(lanes, v) for n, v in VALUES.items()}, lanes)
    u = np.zeros((0, len(derived.inputs)))
    whole = solver.run(table, start, u, samples=200)
    stepping = solver.stepping(table.copy(), start.copy(), u)
    for k in range(1, 200):
        stepping.go()
        np.testing.assert_allclose(stepping.after, whole[k], rtol=0, atol=1e-12)
        stepping.state[:] = stepping.after
