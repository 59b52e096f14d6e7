"""Are the makes rigs one could build, and do they stand where the paper's tables put its rigs?"""

import numpy as np
import pytest

from upright.errors import BadInput
from upright.rig.makes import MAKES, BrassPendulum, make_rig


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
    with pytest.raises(BadInput, match="furuta, linear, rectilinear, torsional"):
        make_rig("spherical")


def test_a_bare_tube_has_the_inertia_of_a_tube():
    rod = BrassPendulum(bore=9.52e-3, weight_diameter=9.53e-3).parameters()
    assert rod["l_cg"] == pytest.approx(0.330 / 2)
    radius = 9.525e-3 / 2
    assert rod["J_p"] == pytest.approx(rod["m_p"] * (0.330**2 / 12 + radius**2 / 2), rel=1e-5)  # wall of 5 um
    assert rod["J_a"] == pytest.approx(rod["m_p"] * radius**2, rel=1e-3)


def test_the_weight_obeys_the_parallel_axes():
    with_weight, bare = BrassPendulum(), BrassPendulum(weight_diameter=9.53e-3)
    p, q = with_weight.parameters(), bare.parameters()
    weight = p["m_p"] - q["m_p"]
    about_hinge = [x["J_p"] + x["m_p"] * x["l_cg"] ** 2 for x in (p, q)]
    own = weight * (0.044**2 + 9.53e-3**2) / 16 + weight * 6e-3**2 / 12
    assert about_hinge[0] - about_hinge[1] == pytest.approx(own + weight * 0.200**2, rel=1e-9)
