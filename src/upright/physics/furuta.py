"""Furuta's pendulum, which swings on a rotating arm: the paper's equation (3) follows from its energies.

Angle 0 hangs, pi stands.
"""

from __future__ import annotations

import math
from typing import Any

from upright.physics.outline import Outline, circle, tip
from upright.physics.plant import Plant
from upright.physics.statement import Coordinate, Input, Joint
from upright.quantities import quantity


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
    g: float = quantity("m/s^2", "gravity", default=9.81, above=0)

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
