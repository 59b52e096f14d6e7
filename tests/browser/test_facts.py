"""Is what a student is to predict what the rig's physics says, in closed form?"""

from __future__ import annotations

import math

import pytest

from upright.browser.facts import facts
from upright.rig.makes import make_rig


def frictionless(key):
    rig = make_rig(key)
    return rig.changed(**{n: 0.0 for n in rig.plant.parameters() if n.startswith(("b_", "c_"))})


def test_of_a_rotary_pendulum_frequency_pole_and_zero_are_those_of_the_derivation():
    """Eq. (1) with erratum 1: hanging and upright the same number; the zero is that of a held arm."""
    rig = frictionless("furuta")
    p = rig.plant
    J_A, J = p.J_p + p.m_p * p.l_cg**2, p.J_d + p.m_p * p.r**2 + p.J_a
    D_2 = J_A * J - (p.m_p * p.l_cg * p.r) ** 2
    told = facts(rig, "inverted", 0)
    assert told["hanging"] == pytest.approx(math.sqrt(J * p.m_p * p.g * p.l_cg / D_2), rel=1e-9)
    assert told["unstable"] == pytest.approx(told["hanging"], rel=1e-6)
    assert told["zero"] == pytest.approx(math.sqrt(p.m_p * p.g * p.l_cg / J_A), rel=1e-6)
    assert [len(poles) for poles in told["sets"]] == [4] * 4  # Table 1
    assert all(re < 0 for poles in told["sets"] for re, _ in poles)


def test_of_a_cart_likewise_by_the_paper_s_appendix():
    rig = frictionless("linear")
    p = rig.plant
    J_A, m = p.J_p + p.m_p * p.l_cg**2, p.m_c + p.m_p
    told = facts(rig, "inverted", 0)
    frequency = math.sqrt(m * p.m_p * p.g * p.l_cg / (J_A * m - (p.m_p * p.l_cg) ** 2))
    assert (told["hanging"], told["unstable"]) == pytest.approx((frequency, frequency), rel=1e-6)
    assert told["zero"] == pytest.approx(math.sqrt(p.m_p * p.g * p.l_cg / J_A), rel=1e-6)
    assert told["sets"] == []


def test_friction_holds_a_pendulum_back_where_it_falls():
    assert (
        0
        < facts(make_rig("furuta"), "inverted", 0)["unstable"]
        < facts(frictionless("furuta"), "inverted", 0)["unstable"]
    )


@pytest.mark.parametrize("key", ["torsional", "rectilinear"])
def test_a_shaft_neither_hangs_nor_goes_the_wrong_way(key):
    assert facts(make_rig(key), "rest", 1) == {"sets": [], "zero": None}
