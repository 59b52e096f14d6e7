"""What swings: a pendulum on a fixed pivot, on a cart, on a rotating arm (Furuta).

Angle 0 hangs, pi stands. ``J_A = J_p + m_p l_cg^2`` never has to be typed: it follows from the energies.
"""

from __future__ import annotations

import math
from typing import Any

from upright.physics.outline import Outline, box, circle, point_beyond, tip
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


class Furuta(Plant):
    """Pendulum on a rotating arm, eq. (3), fig. 3a signs (errata 1 to 3 corrected by derivation)."""

    m_p: float = quantity("kg", "mass of the pendulum", above=0)
    l_cg: float = quantity("m", "hinge to centre of gravity of the pendulum", above=0)
    r: float = quantity("m", "axis of the arm to axis of the pendulum", above=0)
    J_d: float = quantity("kg m^2", "inertia of disk and arm about the vertical", above=0)
    J_p: float = quantity("kg m^2", "transverse inertia of the pendulum about its centre of gravity", at_least=0)
    J_a: float = quantity("kg m^2", "axial inertia of the pendulum", default=0.0, at_least=0)
    b_1: float = quantity("N m s/rad", "viscous friction of the arm", default=0.0, at_least=0)
    b_2: float = quantity("N m s/rad", "viscous friction of the hinge", default=0.0, at_least=0)
    b_1c: float = quantity("N m", "Coulomb friction of the arm", default=0.0, at_least=0)
    b_2c: float = quantity("N m", "Coulomb friction of the hinge", default=0.0, at_least=0)
    b_1q: float = quantity("N m s^2/rad^2", "quadratic drag of the arm", default=0.0, at_least=0)
    b_2q: float = quantity("N m s^2/rad^2", "quadratic drag of the pendulum", default=0.0, at_least=0)
    b_1s: float = quantity("N m", "break-away torque of the arm (0: as Coulomb)", default=0.0, at_least=0)
    b_2s: float = quantity("N m", "break-away torque of the hinge (0: as Coulomb)", default=0.0, at_least=0)
    v_1s: float = quantity("rad/s", "Stribeck speed of the arm", default=0.0, at_least=0)
    v_2s: float = quantity("rad/s", "Stribeck speed of the hinge", default=0.0, at_least=0)
    delta_1: float = quantity("rad", "presliding length of the arm (Dahl)", default=0.0, at_least=0)
    delta_2: float = quantity("rad", "presliding length of the hinge (Dahl)", default=0.0, at_least=0)
    k_psi: float = quantity("N m/rad", "torsional stiffness that anchors the arm to ground", default=0.0, at_least=0)
    tilt_x: float = quantity("1", "sine of the axis' lean towards psi = 0", default=0.0, at_least=-0.5, at_most=0.5)
    tilt_y: float = quantity("1", "sine of the axis' lean towards psi = pi/2", default=0.0, at_least=-0.5, at_most=0.5)
    g: float = quantity("m/s^2", "gravity", default=_G, above=0)

    coordinates = (
        Coordinate("psi", "rad", "angle of the arm"),
        Coordinate("theta", "rad", "angle of the pendulum, 0 hanging"),
    )
    inputs = (Input("T", "N m", "torque on the arm", on="psi"),)
    joints = (
        Joint("psi", "b_1c", "b_1q", "b_1s", "v_1s", "delta_1"),
        Joint("theta", "b_2c", "b_2q", "b_2s", "v_2s", "delta_2"),
    )
    equilibria = {"hanging": {"theta": 0.0}, "inverted": {"theta": math.pi}}
    optional = ("tilt_x", "tilt_y")

    @staticmethod
    def energies(p: Any, q: Any, v: Any) -> tuple[Any, Any, Any]:
        """Disk, centre of gravity, spin about it; gravity leans by tilt_x, tilt_y in the base's frame."""
        from sympy import cos, sin, sqrt

        (psi, theta), (psi_dot, theta_dot) = q, v
        s, c = sin(theta), cos(theta)
        tangential = p.r * psi_dot - p.l_cg * c * theta_dot
        cg_speed_2 = tangential**2 + (p.l_cg * s * theta_dot) ** 2 + (p.l_cg * s * psi_dot) ** 2
        spin = p.J_p * (theta_dot**2 + (s * psi_dot) ** 2) + p.J_a * (c * psi_dot) ** 2
        T = (p.J_d * psi_dot**2 + p.m_p * cg_speed_2 + spin) / 2
        # centre of gravity in the base's frame; the vertical leans, the disk itself is balanced
        x = p.r * cos(psi) + p.l_cg * s * sin(psi)
        y = p.r * sin(psi) - p.l_cg * s * cos(psi)
        z = -p.l_cg * c
        upright = sqrt(1 - p.tilt_x**2 - p.tilt_y**2)
        V = p.m_p * p.g * (upright * z - p.tilt_x * x - p.tilt_y * y) + p.k_psi * psi**2 / 2
        return T, V, (p.b_1 * psi_dot**2 + p.b_2 * theta_dot**2) / 2

    @staticmethod
    def outline(p: Any, q: Any) -> Outline:
        """Column, way of the arm, arm, uniform rod at right angles to it."""
        from sympy import cos, sin

        psi, theta = q
        x, y = p.r * cos(psi), p.r * sin(psi)
        across, _, down = tip(2 * p.l_cg, theta)
        rod = [(x, y, 0), (x + across * sin(psi), y - across * cos(psi), down)]
        column = [(0, 0, -2.4 * p.l_cg), (0, 0, 0)]
        return [("", column), ("", circle(p.r, 0.0)), ("psi", [(0, 0, 0), (x, y, 0)]), ("theta", rod)]
