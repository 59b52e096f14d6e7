"""A double pendulum: two rods, the second hinged to the end of the first. Angles from hanging.

upright identify study.toml        with  plant = "double_pendulum.py:DoublePendulum"  under [rig]
"""

import math

from sympy import cos, sin

from upright.physics import Coordinate, Input, Joint, Plant
from upright.quantities import quantity


class DoublePendulum(Plant):
    """Two rigid rods in one vertical plane; the second angle is measured from the first rod, as encoders do."""

    m_1: float = quantity("kg", "mass of the first rod", above=0)
    m_2: float = quantity("kg", "mass of the second rod", above=0)
    l_1: float = quantity("m", "first hinge to second hinge", above=0)
    a_1: float = quantity("m", "first hinge to centre of gravity of the first rod", at_least=0)
    a_2: float = quantity("m", "second hinge to centre of gravity of the second rod", at_least=0)
    J_1: float = quantity("kg m^2", "inertia of the first rod about its centre of gravity", default=0.0, at_least=0)
    J_2: float = quantity("kg m^2", "inertia of the second rod about its centre of gravity", default=0.0, at_least=0)
    b_1: float = quantity("N m s/rad", "viscous friction of the first hinge", default=0.0, at_least=0)
    b_2: float = quantity("N m s/rad", "viscous friction of the second hinge", default=0.0, at_least=0)
    b_1c: float = quantity("N m", "Coulomb friction of the first hinge", default=0.0, at_least=0)
    g: float = quantity("m/s^2", "gravity", default=9.81, above=0)

    coordinates = (
        Coordinate("theta", "rad", "first rod, 0 hanging"),
        Coordinate("phi", "rad", "second rod from first, 0 straight"),
    )
    inputs = (Input("T", "N m", "torque on the first rod", on="theta"),)
    joints = (Joint("theta", coulomb="b_1c"),)
    equilibria = {"hanging": {}, "inverted": {"theta": math.pi}, "folded": {"phi": math.pi}}

    @staticmethod
    def energies(p, q, v):
        """Kinetic, potential, dissipated."""
        (theta, phi), (theta_dot, phi_dot) = q, v
        turn = theta_dot + phi_dot
        x = p.l_1 * cos(theta) * theta_dot + p.a_2 * cos(theta + phi) * turn
        y = p.l_1 * sin(theta) * theta_dot + p.a_2 * sin(theta + phi) * turn
        T = ((p.J_1 + p.m_1 * p.a_1**2) * theta_dot**2 + p.m_2 * (x**2 + y**2) + p.J_2 * turn**2) / 2
        V = -p.g * (p.m_1 * p.a_1 * cos(theta) + p.m_2 * (p.l_1 * cos(theta) + p.a_2 * cos(theta + phi)))
        return T, V, (p.b_1 * theta_dot**2 + p.b_2 * phi_dot**2) / 2
