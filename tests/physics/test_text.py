"""Has the text of an expression the value of the expression, on numbers and element by element on arrays?"""

from __future__ import annotations

import math
from itertools import product

import numpy as np
import pytest
import sympy as sp

from upright.physics import Coordinate, Plant
from upright.physics.equations import evaluated, small_motions
from upright.physics.lagrange import python_source
from upright.quantities import quantity

X = sp.Symbol("x", real=True)
POWERS = [-4, -3, -2, -1, 1, 2, 3, 4, 5, 6, *(sp.Rational(k, 2) for k in (-5, -3, -1, 1, 3, 5, 7, 9, 11))]
THIRDS = [sp.Rational(k, 3) for k in (-4, -1, 1, 2, 4, 5, 7, 8, 10, 11)]


@pytest.mark.parametrize(
    ("number", "value"),
    [
        (sp.pi, math.pi), (sp.E, math.e), (sp.GoldenRatio, (1 + math.sqrt(5)) / 2),
        (sp.pi / 2 + 3 * sp.E, math.pi / 2 + 3 * math.e),
    ],
)  # fmt: skip
def test_a_number_with_a_name_keeps_its_value(number, value):
    assert evaluated(python_source(number), {}) == pytest.approx(value, rel=1e-15)


@pytest.mark.parametrize("base", [X, X + 1])
@pytest.mark.parametrize("power", [*POWERS, *THIRDS])
def test_a_power_is_the_power(base, power):
    """However it is written: as a product, with a root, or as a power."""
    x = 1.7
    expected = (x if base is X else x + 1) ** float(power)
    assert evaluated(python_source(base**power), {"x": x}) == pytest.approx(expected, rel=1e-14)


@pytest.mark.parametrize("power", POWERS)
def test_powers_up_to_the_fourth_become_products_and_halves_roots(power):
    plain = 0 < power < 5 or power in (-1, -sp.S.Half)
    assert ("**" in python_source(X**power)) == (not plain)


def test_a_spring_of_e_newtons_per_metre_pulls_like_one():
    class Spring(Plant):
        """A mass on a spring."""

        m: float = quantity("kg", "mass", above=0)
        coordinates = (Coordinate("x", "m", "place"),)

        @staticmethod
        def energies(p, q, v):
            return p.m * v[0] ** 2 / 2, sp.E * q[0] ** 2 / 2, sp.pi * v[0] ** 2 / 2

    np.testing.assert_allclose(Spring(m=2.0).linear().A, [[0, 1], [-math.e / 2, -math.pi / 2]], rtol=1e-15)


TRUTH = list(product((-1.0, 1.0), repeat=3))
CONDITIONS = {
    "x > 0 and y > 0 and z > 0": [0, 0, 0, 0, 0, 0, 0, 1],
    "x > 0 or y > 0 or z > 0": [0, 1, 1, 1, 1, 1, 1, 1],
    "x > 0 and y > 0 or z > 0": [0, 1, 0, 1, 0, 1, 1, 1],
    "x > 0 and (y > 0 or z > 0)": [0, 0, 0, 0, 0, 1, 1, 1],
}


@pytest.mark.parametrize("condition", CONDITIONS)
def test_conditions_hold_where_the_truth_table_says(condition):
    expression = f"(2.0 if {condition} else 5.0)"
    expected = [2.0 if holds else 5.0 for holds in CONDITIONS[condition]]
    arrays = dict(zip("xyz", np.array(TRUTH).T, strict=True))
    assert evaluated(expression, arrays).tolist() == expected
    assert [float(evaluated(expression, dict(zip("xyz", row, strict=True)))) for row in TRUTH] == expected


def test_what_is_not_chosen_need_not_exist():
    """x log x, continued by 0 to where the logarithm is none."""
    with np.errstate(all="raise"):
        found = evaluated("(x * log(x) if x > 0 else 0.0)", {"x": np.array([-1.0, 0.0, 2.0])})
        alone = evaluated("(1 / x if x > 0 else 0.0)", {"x": 0.0})
    assert found.tolist() == [0.0, 0.0, 2 * math.log(2)]
    assert alone == 0.0
    with np.errstate(all="raise"), pytest.raises(FloatingPointError):  # where there is no choice, it has to
        evaluated("1 / x", {"x": np.array([0.0])})


def test_a_wedge_is_steep_only_where_both_conditions_hold():
    class Wedge(Plant):
        """A mass held by a spring in one quarter of the plane, by a softer one beside it."""

        m: float = quantity("kg", "mass", above=0)
        coordinates = (Coordinate("x", "m", "across"), Coordinate("y", "m", "along"))

        @staticmethod
        def energies(p, q, v):
            x, y = q
            hard = sp.Piecewise((8 * x**2 * y**2, sp.And(x > 0, y > 0)), (0, True))
            soft = sp.Piecewise((3 * x**2 * y**2, sp.Or(x > 0, y > 0)), (0, True))
            return p.m * (v[0] ** 2 + v[1] ** 2) / 2, hard + soft, 0

    x, y = np.array([[1.0, 1.0, -1.0, -1.0], [1.0, -1.0, 1.0, -1.0]])
    stiffness = small_motions(Wedge.derived(), {"m": 1.0, "x": x, "y": y}, (4,))[2]
    # d2/dx2 of a x^2 y^2 is 2 a y^2: 8 + 3, 3, 3 and none
    assert stiffness[:, 0, 0].tolist() == [22.0, 6.0, 6.0, 0.0]
