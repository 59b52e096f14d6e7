"""Do the twins stand where the paper's tables put its rigs?"""

import numpy as np
import pytest

from upright.errors import BadInput
from upright.lab.rigs.makes import MAKES, make_rig


@pytest.mark.parametrize("make", ["linear", "furuta"])
def test_a_pendulum_falls_as_fast_as_the_paper_s(make):
    """Table 1 comes from s^2 (s^2 - 63.698): an unstable pole at 7.981 rad/s, no friction."""
    rig = make_rig(make)
    free = rig.plant.replace(b_1=0.0, b_2=0.0).linear("inverted").poles().real.max()
    assert free == pytest.approx(np.sqrt(63.698), rel=0.01)


@pytest.mark.parametrize("make", ["rectilinear", "torsional"])
def test_two_inertias_swing_against_each_other_as_the_paper_s(make):
    """Table 2 comes from s (s + 1.94)(s^2 + 2.04 s + 734.96)."""
    poles = make_rig(make).linear("rest").poles()
    flexible = poles[np.argmax(poles.imag)]
    assert abs(flexible) == pytest.approx(np.sqrt(734.96), rel=0.01)
    assert -2 * flexible.real == pytest.approx(2.04, rel=0.3)


@pytest.mark.parametrize("make", MAKES)
def test_every_seed_is_another_rig_of_the_make(make):
    first, second, again = (make_rig(make, seed) for seed in (1, 2, 1))
    assert first == again
    assert first.plant != second.plant
    for name, value in make_rig(make).plant.parameters().items():
        drawn = np.array([make_rig(make, s).plant.parameters()[name] for s in range(1, 40)])
        assert np.all(drawn >= 0 if value == 0 else drawn > 0)
        assert np.median(drawn) == pytest.approx(value, rel=0.1)


def test_an_unknown_make_is_refused():
    with pytest.raises(BadInput, match="linear, furuta, rectilinear, torsional"):
        make_rig("spherical")
