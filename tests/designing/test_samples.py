"""Are poles of a model that is known at its samples where they were asked, told in 1/s?"""

import numpy as np
import pytest

from upright.designing.run import DesignRequest, design_for
from upright.systems import StateSpace


@pytest.mark.parametrize("T", [0.01, 0.1])
def test_poles_of_samples_are_attained_where_they_were_asked(T):
    """A double integrator; the poles of A - B K by numpy, as their logarithms over T."""
    model = StateSpace(A=[[1.0, T], [0.0, 1.0]], B=[[T**2 / 2], [T]], C=np.eye(2), dt=T)
    asked = np.array([-2 - 1j, -2 + 1j])
    found = design_for(model, DesignRequest(at="", poles=tuple(asked), period=T, speed="measured"))
    placed = np.log(np.linalg.eigvals(model.A - model.B @ np.atleast_2d(found.K)).astype(complex)) / T
    assert np.sort_complex(placed) == pytest.approx(asked, rel=1e-6)
    assert np.sort_complex(found.placement.attained) == pytest.approx(asked, rel=1e-6)
    assert found.placement.miss < 1e-6
