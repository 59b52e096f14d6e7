"""Plants small enough to solve by hand, written as the text that physics hands to simulation."""

from __future__ import annotations

import pytest

from upright.physics.equations import Derived, DryJoint


def block_on_a_spring() -> Derived:
    """m x'' = F - k x - c x' - m g_s, with dry friction; g_s is the share of gravity along the slope."""
    return Derived(
        name="Block",
        coordinates=("x",),
        inputs=("F",),
        parameters=("m", "k", "c", "g_s", "F_c", "c_q", "F_s", "v_s", "delta"),
        lumps=("m", "k", "c", "m*g_s"),
        trig=(),
        steps=(),
        mass=("k0",),
        force=("F - k1*x - k2*x_dot - k3",),
        joints=(
            DryJoint(
                direction=(1.0,),
                coulomb="F_c",
                quadratic="c_q",
                stiction="F_s",
                stribeck_speed="v_s",
                presliding="delta",
            ),
        ),
        stiffness=("k",),
        damping=("c",),
        gain=("1",),
        kinetic="m*x_dot*x_dot/2",
        potential="k*x*x/2 + m*g_s*x",
        power_lost="c*x_dot*x_dot",
    )


def two_blocks() -> Derived:
    """Two blocks joined by a spring k, the first tied to the wall by k_w; dry friction under both."""
    return Derived(
        name="TwoBlocks",
        coordinates=("x1", "x2"),
        inputs=("F",),
        parameters=("m_1", "m_2", "k", "k_w", "F_1", "F_2", "S_1", "S_2"),
        lumps=("m_1", "m_2", "k", "k_w"),
        trig=(),
        steps=(("w0", "k2*(x2 - x1)"),),
        mass=("k0", "0", "k1"),
        force=("F + w0 - k3*x1", "-w0"),
        joints=(
            DryJoint(direction=(1.0, 0.0), coulomb="F_1", stiction="S_1"),
            DryJoint(direction=(0.0, 1.0), coulomb="F_2", stiction="S_2"),
        ),
        stiffness=("k + k_w", "-k", "-k", "k"),
        damping=("0", "0", "0", "0"),
        gain=("1", "0"),
        kinetic="(m_1*x1_dot*x1_dot + m_2*x2_dot*x2_dot)/2",
        potential="k*(x2 - x1)*(x2 - x1)/2 + k_w*x1*x1/2",
        power_lost="0",
    )


def furuta() -> Derived:
    """Furuta pendulum, eq. (3) with its errata put right, without tilt."""
    return Derived(
        name="Rotary",
        coordinates=("psi", "theta"),
        inputs=("T",),
        parameters=("m_p", "l_cg", "r", "J_d", "J_p", "J_a", "b_1", "b_2", "b_1c", "b_2c", "g"),
        lumps=(
            "J_d + m_p*r*r + J_a",
            "J_p + m_p*l_cg*l_cg - J_a",
            "m_p*r*l_cg",
            "J_p + m_p*l_cg*l_cg",
            "m_p*g*l_cg",
            "b_1",
            "b_2",
        ),
        trig=(("s0", "c0", "theta"),),
        steps=(("w0", "s0*c0*k1"),),
        mass=("k0 + k1*s0*s0", "-k2*c0", "k3"),
        force=(
            "T - 2*w0*psi_dot*theta_dot - k2*s0*theta_dot**2 - k5*psi_dot",
            "-k4*s0 + w0*psi_dot**2 - k6*theta_dot",
        ),
        joints=(DryJoint(direction=(1.0, 0.0), coulomb="b_1c"), DryJoint(direction=(0.0, 1.0), coulomb="b_2c")),
        stiffness=("0", "0", "0", "g*l_cg*m_p*cos(theta)"),
        damping=("b_1", "0", "0", "b_2"),
        gain=("1", "0"),
        kinetic=(
            "(J_d + m_p*r*r + (J_p + m_p*l_cg*l_cg)*sin(theta)**2 + J_a*cos(theta)**2)*psi_dot**2/2"
            " + (J_p + m_p*l_cg*l_cg)*theta_dot**2/2 - m_p*r*l_cg*cos(theta)*psi_dot*theta_dot"
        ),
        potential="-m_p*g*l_cg*cos(theta)",
        power_lost="b_1*psi_dot**2 + b_2*theta_dot**2",
    )


FURUTA = {
    "m_p": 0.2,
    "l_cg": 0.15,
    "r": 0.12,
    "J_d": 0.008,
    "J_p": 1e-4,
    "J_a": 2e-5,
    "b_1": 0.0,
    "b_2": 0.0,
    "b_1c": 0.0,
    "b_2c": 0.0,
    "g": 9.81,
}
BLOCK = {"m": 1.0, "k": 0.0, "c": 0.0, "g_s": 0.0}


@pytest.fixture(scope="session")
def block() -> Derived:
    return block_on_a_spring()


@pytest.fixture(scope="session")
def pair() -> Derived:
    return two_blocks()


@pytest.fixture(scope="session")
def rotary() -> Derived:
    return furuta()
