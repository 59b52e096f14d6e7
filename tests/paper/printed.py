"""The paper's formulas and tables exactly as printed, mistakes included (ASEE 2006-1008).

Symbols are real; the appendix counts from (1) again, its models are called A1 and A2 here.
"""

from types import SimpleNamespace

import sympy as sp

INERTIAS = ["m_p", "l_cg", "r", "J_d", "J_p", "J_a", "J_xx", "J_zz", "m_c"]
OTHERS = ["b_1", "b_2", "b_1c", "b_2c", "g", "K_1", "K_2", "psi", "theta", "psi_dot", "theta_dot"]
p = SimpleNamespace(**{name: sp.Symbol(name, real=True) for name in [*INERTIAS, *OTHERS]})
s = sp.Symbol("s")
J_A = p.J_p + p.m_p * p.l_cg**2

# eqs. (1) and (2)
D_2 = J_A * (p.J_d + p.m_p * p.r**2) + p.m_p**2 * p.l_cg**2 * p.r**2


def A_1(D_2=D_2):
    """Furuta pendulum, crane mode."""
    return sp.Matrix(
        [
            [0, 1, 0, 0],
            [0, -J_A * p.b_1 / D_2, -(p.m_p**2) * p.l_cg**2 * p.r * p.g / D_2, -p.m_p * p.l_cg * p.r * p.b_2 / D_2],
            [0, 0, 0, 1],
            [
                0,
                -p.m_p * p.l_cg * p.b_1 / D_2,
                -(p.m_p * p.r**2 + p.J_d) * p.m_p * p.l_cg * p.g / D_2,
                -(p.m_p * p.r**2 + p.J_d) * p.b_2 / D_2,
            ],
        ]
    )


def B_1(D_2=D_2):
    return sp.Matrix([0, J_A / D_2, 0, p.m_p * p.l_cg * p.r / D_2])


def A_2(D_2=D_2):
    """Furuta pendulum, inverted mode."""
    return sp.Matrix(
        [
            [0, 1, 0, 0],
            [0, -J_A * p.b_1 / D_2, -(p.m_p**2) * p.l_cg**2 * p.r * p.g / D_2, p.m_p * p.l_cg * p.r * p.b_2 / D_2],
            [0, 0, 0, 1],
            [
                0,
                p.m_p * p.l_cg * p.b_1 / D_2,
                (p.m_p * p.r**2 + p.J_d) * p.m_p * p.l_cg * p.g / D_2,
                -(p.m_p * p.r**2 + p.J_d) * p.b_2 / D_2,
            ],
        ]
    )


def B_2(D_2=D_2):
    return sp.Matrix([0, J_A / D_2, 0, -p.m_p * p.l_cg * p.r / D_2])


C = sp.Matrix([[p.K_1, 0, 0, 0], [0, 0, p.K_2, 0]])


def Delta_2(D_2=D_2, D=None):
    """System determinant; its leading coefficient is printed as D^2, D being defined in the appendix only."""
    D = sp.Symbol("D", real=True) if D is None else D
    return (
        D**2 * s**3
        + (D_2 * p.b_2 * p.m_p * p.r**2 + D_2 * (J_A * p.b_1 + p.J_d * p.b_2)) * s**2
        + (
            D_2 * p.m_p * p.g * p.l_cg * (p.m_p * p.r**2 + p.J_d)
            + J_A * p.b_1 * p.b_2 * (p.m_p * p.r**2 + p.J_d)
            - p.m_p**2 * p.l_cg**2 * p.r**2 * p.b_1 * p.b_2
        )
        * s
        + J_A * p.b_1 * p.m_p * p.g * p.l_cg * (p.m_p * p.r**2 + p.J_d)
        - p.m_p**3 * p.l_cg**3 * p.r**2 * p.b_1 * p.g
    )


def psi_over_T(D_2=D_2, D=None):
    numerator = (
        J_A * D_2 * s**2
        + (J_A * p.b_2 * (p.m_p * p.r**2 + p.J_d) - p.m_p**2 * p.l_cg**2 * p.b_2 * p.r**2) * s
        + J_A * p.m_p * p.g * p.l_cg * (p.m_p * p.r**2 + p.J_d)
        - p.m_p**3 * p.l_cg**3 * p.g * p.r**2
    )
    return p.K_1 * numerator / (s * Delta_2(D_2, D))


def theta_over_T(D_2=D_2, D=None):
    return -p.K_2 * p.m_p * p.l_cg * p.r * D_2 * s / Delta_2(D_2, D)


# eq. (3)
def mass_3():
    s_theta, c_theta = sp.sin(p.theta), sp.cos(p.theta)
    coupling = -p.m_p * p.r * p.l_cg * c_theta
    turning = p.m_p * p.r**2 + (p.m_p * p.l_cg**2 + p.J_zz) * s_theta**2 + p.J_xx * c_theta**2 + p.J_d
    return sp.Matrix([[turning, coupling], [coupling, p.m_p * p.l_cg**2 + p.J_zz]])


def force_3():
    """Right-hand side of eq. (3) without its Coulomb terms; the free response has no torque."""
    s_theta, c_theta = sp.sin(p.theta), sp.cos(p.theta)
    gyro = p.m_p * p.l_cg**2 + p.J_zz - p.J_xx
    return sp.Matrix(
        [
            -2 * p.theta_dot * p.psi_dot * s_theta * c_theta * gyro
            - p.m_p * p.l_cg * p.r * s_theta * p.theta_dot**2
            - p.b_1 * p.psi_dot,
            -p.m_p * p.g * p.l_cg * s_theta + s_theta * c_theta * p.psi_dot**2 * gyro - p.b_2 * p.theta_dot,
        ]
    )


# appendix
D_A = J_A * (p.m_c + p.m_p) - p.m_p**2 * p.l_cg**2


def A_A1():
    """Pendulum on a cart, crane mode."""
    return sp.Matrix(
        [
            [0, 1, 0, 0],
            [0, -J_A * p.b_1 / D_A, p.m_p**2 * p.l_cg**2 * p.g / D_A, p.m_p * p.l_cg * p.b_2 / D_A],
            [0, 0, 0, 1],
            [
                0,
                p.m_p * p.l_cg * p.b_1 / D_A,
                -(p.m_c + p.m_p) * p.m_p * p.l_cg * p.g / D_A,
                -(p.m_c + p.m_p) * p.b_2 / D_A,
            ],
        ]
    )


def B_A1():
    return sp.Matrix([0, J_A / D_A, 0, -p.m_p * p.l_cg / D_A])


def A_A2():
    """Pendulum on a cart, inverted mode."""
    return sp.Matrix(
        [
            [0, 1, 0, 0],
            [0, -J_A * p.b_1 / D_A, p.m_p**2 * p.l_cg**2 * p.g / D_A, -p.m_p * p.l_cg * p.b_2 / D_A],
            [0, 0, 0, 1],
            [
                0,
                -p.m_p * p.l_cg * p.b_1 / D_A,
                (p.m_c + p.m_p) * p.m_p * p.l_cg * p.g / D_A,
                -(p.m_c + p.m_p) * p.b_2 / D_A,
            ],
        ]
    )


def B_A2():
    return sp.Matrix([0, J_A / D_A, 0, p.m_p * p.l_cg / D_A])


# Table 1: Furuta pendulum, inverted; Table 2: ECP 210, two carts. Rows are sets 1 to 4.
TABLE_1 = (
    (-4.1484 + 1.6341j, -4.1484 - 1.6341j, -16.8545, -3.2220),
    (-4.4305 + 2.0497j, -4.4305 - 2.0497j, -21.915, -2.9234),
    (-4.5628 + 2.2419j, -4.5628 - 2.2419j, -29.5357, -2.8285),
    (-4.6314 + 2.3357j, -4.6314 - 2.3357j, -40.7029, -2.7882),
)
TABLE_2 = (
    (-7.533 + 27.28j, -7.533 - 27.28j, -18.53 + 10.35j, -18.53 - 10.35j),
    (-8.7164 + 26.7j, -8.7164 - 26.7j, -23.59 + 9.53j, -23.59 - 9.53j),
    (-9.3632 + 26.0j, -9.3632 - 26.0j, -35.1, -26.96),
    (-9.6046 + 25.516j, -9.6046 - 25.516j, -60.124, -22.841),
)

# Table 3: percentages per question, from "strongly agree" to "I don't know".
TABLE_3 = ((46, 54, 0, 0, 0), (29, 65, 6, 0, 0), (48, 45, 6, 0, 0))
STUDENTS = 53

# Table 4: knowledge and confidence before, knowledge and confidence after, scale 1 to 4, as printed.
TABLE_4 = (
    ("3.27", "2.98", "3.88", "3.58"),
    ("2.98", "2.50", "3.58", "3.25"),
    ("3.15", "2.79", "3.75", "3.42"),
    ("2.54", "2.23", "3.83", "3.46"),
    ("1.60", "1.50", "3.02", "2.69"),
    ("2.26", "2.04", "3.44", "2.96"),
)
