"""What has two links: a double pendulum, whose first joint may be driven (Pendubot), and a link that bends.

Angle 0 hangs, pi stands. Encoders at the joints measure relative angles; a camera, or encoders that are carried along
by belts, absolute ones.
"""

from __future__ import annotations

import math
from typing import Any

from upright.physics.outline import Outline, point_beyond, tip
from upright.physics.plant import Plant
from upright.physics.statement import Coordinate, Input, Joint
from upright.quantities import quantity

_G = 9.81


class TwoLinks(Plant, abstract=True):
    """Two rigid links in a vertical plane, whichever way their angles are counted."""

    m_1: float = quantity("kg", "mass of the first link", above=0)
    m_2: float = quantity("kg", "mass of the second link", above=0)
    l_1: float = quantity("m", "first joint to second joint", above=0)
    l_c1: float = quantity("m", "first joint to centre of gravity of the first link", at_least=0)
    l_c2: float = quantity("m", "second joint to centre of gravity of the second link", above=0)
    J_1: float = quantity("kg m^2", "inertia of the first link about its centre of gravity", default=0.0, at_least=0)
    J_2: float = quantity("kg m^2", "inertia of the second link about its centre of gravity", default=0.0, at_least=0)
    b_1: float = quantity("N m s/rad", "viscous friction of the first joint", default=0.0, at_least=0)
    b_2: float = quantity("N m s/rad", "viscous friction of the second joint", default=0.0, at_least=0)
    b_1c: float = quantity("N m", "Coulomb friction of the first joint", default=0.0, at_least=0)
    b_1q: float = quantity("N m s^2/rad^2", "quadratic drag of the first joint", default=0.0, at_least=0)
    b_2c: float = quantity("N m", "Coulomb friction of the second joint", default=0.0, at_least=0)
    b_2q: float = quantity("N m s^2/rad^2", "quadratic drag of the second joint", default=0.0, at_least=0)
    g: float = quantity("m/s^2", "gravity", default=_G, above=0)

    inputs = (Input("T", "N m", "torque at the first joint", on="theta_1"),)


def _two_links(p: Any, theta: Any, theta_dot: Any, second: Any, second_dot: Any) -> tuple[Any, Any]:
    """Kinetic and potential energy of two rigid links at absolute angles."""
    from sympy import cos, sin

    x = p.l_1 * cos(theta) * theta_dot + p.l_c2 * cos(second) * second_dot
    y = p.l_1 * sin(theta) * theta_dot + p.l_c2 * sin(second) * second_dot
    T = ((p.J_1 + p.m_1 * p.l_c1**2) * theta_dot**2 + p.m_2 * (x**2 + y**2) + p.J_2 * second_dot**2) / 2
    V = -p.g * ((p.m_1 * p.l_c1 + p.m_2 * p.l_1) * cos(theta) + p.m_2 * p.l_c2 * cos(second))
    return T, V


def _two_lines(p: Any, theta: Any, second: Any) -> Outline:
    """Two links at absolute angles, the second one uniform."""
    elbow = tip(p.l_1, theta)
    return [("theta_1", [(0, 0, 0), elbow]), ("theta_2", [elbow, point_beyond(elbow, tip(2 * p.l_c2, second))])]


class DoublePendulum(TwoLinks):
    """Two rigid links in a vertical plane, the second angle counted from the first link; a Pendubot when driven."""

    coordinates = (
        Coordinate("theta_1", "rad", "angle of the first link, 0 hanging"),
        Coordinate("theta_2", "rad", "angle of the second link from the first, 0 straight"),
    )
    joints = (Joint("theta_1", "b_1c", "b_1q"), Joint("theta_2", "b_2c", "b_2q"))
    equilibria = {
        "hanging": {"theta_1": 0.0, "theta_2": 0.0},
        "inverted": {"theta_1": math.pi, "theta_2": 0.0},
        "folded": {"theta_1": math.pi, "theta_2": math.pi},
        "elbow up": {"theta_1": 0.0, "theta_2": math.pi},
    }

    @staticmethod
    def energies(p: Any, q: Any, v: Any) -> tuple[Any, Any, Any]:
        """Two links; the second turns with the first."""
        T, V = _two_links(p, q[0], v[0], q[0] + q[1], v[0] + v[1])
        return T, V, (p.b_1 * v[0] ** 2 + p.b_2 * v[1] ** 2) / 2

    @staticmethod
    def outline(p: Any, q: Any) -> Outline:
        """The second angle is counted from the first link."""
        return _two_lines(p, q[0], q[0] + q[1])


class DoublePendulumAbsolute(TwoLinks):
    """Two rigid links in a vertical plane, both angles counted from hanging."""

    coordinates = (
        Coordinate("theta_1", "rad", "angle of the first link, 0 hanging"),
        Coordinate("theta_2", "rad", "angle of the second link, 0 hanging"),
    )
    joints = (Joint("theta_1", "b_1c", "b_1q"), Joint("theta_2 - theta_1", "b_2c", "b_2q"))
    equilibria = {
        "hanging": {"theta_1": 0.0, "theta_2": 0.0},
        "inverted": {"theta_1": math.pi, "theta_2": math.pi},
        "folded": {"theta_1": math.pi, "theta_2": 0.0},
        "elbow up": {"theta_1": 0.0, "theta_2": math.pi},
    }

    @staticmethod
    def energies(p: Any, q: Any, v: Any) -> tuple[Any, Any, Any]:
        """Two links; the second joint turns by the difference of the angles."""
        T, V = _two_links(p, q[0], v[0], q[1], v[1])
        return T, V, (p.b_1 * v[0] ** 2 + p.b_2 * (v[1] - v[0]) ** 2) / 2

    @staticmethod
    def outline(p: Any, q: Any) -> Outline:
        """Both angles are counted from hanging."""
        return _two_lines(p, q[0], q[1])


class FlexibleLink(Plant):
    """A hub that turns in the plane and a link on it that bends, its first mode lumped into a spring at the hub."""

    J_h: float = quantity("kg m^2", "inertia of hub and drive", above=0)
    J_l: float = quantity("kg m^2", "inertia of the link about the hub's axis", above=0)
    k_s: float = quantity("N m/rad", "stiffness of the link", at_least=0)
    b_1: float = quantity("N m s/rad", "viscous friction of the hub", default=0.0, at_least=0)
    b_2: float = quantity("N m s/rad", "damping of the link", default=0.0, at_least=0)
    b_1c: float = quantity("N m", "Coulomb friction of the hub", default=0.0, at_least=0)
    b_1q: float = quantity("N m s^2/rad^2", "quadratic drag of the hub", default=0.0, at_least=0)

    coordinates = (
        Coordinate("theta", "rad", "angle of the hub"),
        Coordinate("alpha", "rad", "deflection of the link from the hub"),
    )
    inputs = (Input("T", "N m", "torque on the hub", on="theta"),)
    joints = (Joint("theta", "b_1c", "b_1q"),)
    equilibria = {"rest": {"theta": 0.0, "alpha": 0.0}}

    @staticmethod
    def energies(p: Any, q: Any, v: Any) -> tuple[Any, Any, Any]:
        """Hub, and the link that turns with it and bends."""
        T = (p.J_h * v[0] ** 2 + p.J_l * (v[0] + v[1]) ** 2) / 2
        return T, p.k_s * q[1] ** 2 / 2, (p.b_1 * v[0] ** 2 + p.b_2 * v[1] ** 2) / 2

    @staticmethod
    def outline(p: Any, q: Any) -> Outline:
        """The link from above, its first half as the hub turns, the other as it bends; lengths are for the eye."""
        from sympy import cos, sin

        middle = (0.15 * cos(q[0]), 0.15 * sin(q[0]), 0)
        end = (middle[0] + 0.15 * cos(q[0] + q[1]), middle[1] + 0.15 * sin(q[0] + q[1]), 0)
        return [("theta", [(0, 0, 0), middle]), ("alpha", [middle, end])]
