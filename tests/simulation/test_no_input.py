"""Does a plant that nothing drives move, and can it be identified, as the same plant with an idle drive?"""

import math
from typing import Any

import numpy as np
import pytest

from tests.identification.twins import noisy, rig
from upright.identification import Run
from upright.identification.estimate import identify
from upright.physics import Pendulum
from upright.physics.plant import Plant
from upright.physics.statement import Coordinate, Joint
from upright.quantities import quantity
from upright.simulation import simulate


class Undriven(Plant):
    """A pendulum without a drive."""

    m_p: float = quantity("kg", "mass", above=0)
    l_cg: float = quantity("m", "length", above=0)
    b_2: float = quantity("N m s/rad", "viscous friction", default=0.0, at_least=0)
    b_2c: float = quantity("N m", "Coulomb friction", default=0.0, at_least=0)
    g: float = quantity("m/s^2", "gravity", default=9.81, above=0)

    coordinates = (Coordinate("theta", "rad", "angle, 0 hanging"),)
    inputs = ()
    joints = (Joint("theta", "b_2c"),)
    equilibria = {"hanging": {"theta": 0.0}, "inverted": {"theta": math.pi}}

    @staticmethod
    def energies(p: Any, q: Any, v: Any) -> tuple[Any, Any, Any]:
        """Point mass on a massless rod."""
        from sympy import cos

        return p.m_p * p.l_cg**2 * v[0] ** 2 / 2, -p.m_p * p.g * p.l_cg * cos(q[0]), p.b_2 * v[0] ** 2 / 2


TRUTH = {"m_p": 0.2, "l_cg": 0.3, "b_2": 1e-3, "b_2c": 2e-3}


@pytest.mark.parametrize("lanes", [1, 19])
def test_it_moves_as_one_with_an_idle_drive(lanes):
    start = np.array([[1.0 + 0.01 * k, 0.0] for k in range(lanes)])
    free, idle = (simulate(plant(**TRUTH), {}, start, None, 0.01, samples=400) for plant in (Undriven, Pendulum))
    np.testing.assert_allclose(free, idle, rtol=0, atol=1e-13)


def test_it_is_identified():
    t = np.arange(600) * 0.01
    x = simulate(Undriven(**TRUTH), {}, [1.0, 0.0], None, 0.01, samples=t.size, substeps=2)
    run = Run(label="swing", role="fit", t=t, u=np.zeros((t.size, 0)), y=x[:, [0], 0], measured=("theta",))
    fit = identify(rig(Undriven, TRUTH, {"l_cg": 0.25, "b_2": 5e-4, "b_2c": 1e-3}), [noisy(run, 1e-4, seed=2)])
    assert fit.trusted
    for name in ("l_cg", "b_2", "b_2c"):
        # four standard errors: one miss in 16,000
        assert abs(fit.estimates[name].value - TRUTH[name]) < 4 * fit.estimates[name].stderr
