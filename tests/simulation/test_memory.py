"""A motion written into memory that is used again is the motion."""

from __future__ import annotations

import numpy as np
import pytest

from upright.errors import BadInput
from upright.physics import Pendulum
from upright.simulation import Simulator, choose


def test_memory_used_again_changes_no_motion() -> None:
    values = {"m_p": 0.2, "l_cg": 0.3, "J_p": 2e-3, "b_2c": 2e-3}
    derived = Pendulum.derived_for(values)
    stepper = Simulator(derived=derived, flavour=choose(derived, values, free=["b_2c"]), dt=0.01)
    memory = np.full(50 * 2 * 32, np.nan)
    for lanes in (1, 3, 17):
        x0 = np.stack([np.linspace(0.5, 1.5, lanes), np.zeros(lanes)])
        params = stepper.table(values, lanes)
        fresh = stepper.run(params, x0, samples=50)
        again = stepper.run(params, x0, samples=50, memory=memory)
        assert np.array_equal(again, fresh)
        assert np.shares_memory(again, memory)
    with pytest.raises(BadInput, match="at least 3200 contiguous"):
        stepper.run(params, x0, samples=50, memory=memory[:3199])
