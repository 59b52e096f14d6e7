"""What swings: a pendulum on a fixed pivot and on a cart; on a rotating arm, `furuta`.

Angle 0 hangs, pi stands. ``J_A = J_p + m_p l_cg^2`` never has to be typed: it follows from the energies.
"""

from __future__ import annotations

import math
from typing import Any

from upright.physics.outline import Outline, box, point_beyond, tip
from upright.physics.plant import Plant
from upright.physics.statement import Coordinate, Input, Joint
from upright.quantities import quantity

_G = 9.81


class Pendulum(Plant):
    """Pendulum on a fixed pivot. A free swing sees only the ratios of its parameters to ``J_p + m_p l_cg^2``."""

    m_p: float = quantity("kg", "mass of the pendulum", above=0)
    l_cg: float = quantity("m", "pivot to centre of gravity", above=0)
    J_p: float = quantity("kg m^2", "inertia of the pendulum about its centre of gravity", default=0.0, at_least=0)
    b_2: float = quantity("N m s/rad", "viscous friction of the pivot", default=0.0, at_least=0)
    b_2c: float = quantity("N m", "Coulomb friction of the pivot", default=0.0, at_least=0)
    b_2q: float = quantity("N m s^2/rad^2", "quadratic drag of the pendulum", default=0.0, at_least=0)
    b_2s: float = quantity("N m", "break-away torque of the pivot (0: as Coulomb)", default=0.0, at_least=0)
    v_2s: float = quantity("rad/s", "Stribeck speed of the pivot", default=0.0, at_least=0)
    delta_2: float = quantity("rad", "presliding length of the pivot (Dahl)", default=0.0, at_least=0)
    g: float = quantity("m/s^2", "gravity", default=_G, above=0)

    coordinates = (Coordinate("theta", "rad", "angle of the pendulum, 0 hanging"),)
    inputs = (Input("T", "N m", "torque at the pivot", on="theta"),)
    joints = (Joint("theta", "b_2c", "b_2q", "b_2s", "v_2s", "delta_2"),)
    equilibria = {"hanging": {"theta": 0.0}, "inverted": {"theta": math.pi}}

    @staticmethod
    def energies(p: Any, q: Any, v: Any) -> tuple[Any, Any, Any]:
        """Rigid pendulum about its pivot."""
        from sympy import cos

        T = (p.J_p + p.m_p * p.l_cg**2) * v[0] ** 2 / 2
        V = -p.m_p * p.g * p.l_cg * cos(q[0])
        return T, V, p.b_2 * v[0] ** 2 / 2

    @staticmethod
    def outline(p: Any, q: Any) -> Outline:
        """A uniform rod: its centre of gravity is half way."""
        return [("theta", [(0, 0, 0), tip(2 * p.l_cg, q[0])])]


class CartPendulum(Plant):
    """Pendulum on a cart, eqs. (A1) and (A2): the cart moves along x, the pendulum swings in the same plane."""

    m_c: float = quantity("kg", "mass of the cart", above=0)
    m_p: float = quantity("kg", "mass of the pendulum", above=0)
    l_cg: float = quantity("m", "hinge to centre of gravity of the pendulum", above=0)
    J_p: float = quantity("kg m^2", "inertia of the pendulum about its centre of gravity", default=0.0, at_least=0)
    b_1: float = quantity("N s/m", "viscous friction of the cart", default=0.0, at_least=0)
    b_2: float = quantity("N m s/rad", "viscous friction of the hinge", default=0.0, at_least=0)
    b_1c: float = quantity("N", "Coulomb friction of the cart", default=0.0, at_least=0)
    b_2c: float = quantity("N m", "Coulomb friction of the hinge", default=0.0, at_least=0)
    b_1q: float = quantity("N s^2/m^2", "quadratic drag of the cart", default=0.0, at_least=0)
    b_2q: float = quantity("N m s^2/rad^2", "quadratic drag of the pendulum", default=0.0, at_least=0)
    b_1s: float = quantity("N", "break-away force of the cart (0: as Coulomb)", default=0.0, at_least=0)
    b_2s: float = quantity("N m", "break-away torque of the hinge (0: as Coulomb)", default=0.0, at_least=0)
    v_1s: float = quantity("m/s", "Stribeck speed of the cart", default=0.0, at_least=0)
    v_2s: float = quantity("rad/s", "Stribeck speed of the hinge", default=0.0, at_least=0)
    delta_1: float = quantity("m", "presliding length of the cart (Dahl)", default=0.0, at_least=0)
    delta_2: float = quantity("rad", "presliding length of the hinge (Dahl)", default=0.0, at_least=0)
    k_x: float = quantity("N/m", "spring from cart to ground", default=0.0, at_least=0)
    g: float = quantity("m/s^2", "gravity", default=_G, above=0)

    coordinates = (
        Coordinate("x", "m", "position of the cart"),
        Coordinate("theta", "rad", "angle of the pendulum, 0 hanging"),
    )
    inputs = (Input("F", "N", "force on the cart", on="x"),)
    joints = (
        Joint("x", "b_1c", "b_1q", "b_1s", "v_1s", "delta_1"),
        Joint("theta", "b_2c", "b_2q", "b_2s", "v_2s", "delta_2"),
    )
    equilibria = {"hanging": {"theta": 0.0}, "inverted": {"theta": math.pi}}

    @staticmethod
    def energies(p: Any, q: Any, v: Any) -> tuple[Any, Any, Any]:
        """Fig. A1: the centre of gravity moves with ``x' + l_cg cos(theta) theta'``."""
        from sympy import cos, sin

        (x, theta), (x_dot, theta_dot) = q, v
        horizontal = x_dot + p.l_cg * cos(theta) * theta_dot
        vertical = p.l_cg * sin(theta) * theta_dot
        T = (p.m_c * x_dot**2 + p.m_p * (horizontal**2 + vertical**2) + p.J_p * theta_dot**2) / 2
        V = -p.m_p * p.g * p.l_cg * cos(theta) + p.k_x * x**2 / 2
        return T, V, (p.b_1 * x_dot**2 + p.b_2 * theta_dot**2) / 2

    @staticmethod
    def outline(p: Any, q: Any) -> Outline:
        """Rail, cart, uniform rod."""
        (x, theta), size = q, p.l_cg
        rod = [(x, 0, 0), point_beyond((x, 0, 0), tip(2 * size, theta))]
        return [("", [(-4 * size, 0, 0), (4 * size, 0, 0)]), ("x", box(x, size / 1.5, size / 3)), ("theta", rod)]
