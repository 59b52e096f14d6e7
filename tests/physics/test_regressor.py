"""Are the columns and base parameters of a plant those of its equations of motion?"""

import numpy as np
import pytest

from tests.physics.bumpers import Bumpers
from tests.physics.specimens import EXAMPLES, SPECIMENS
from upright.physics import CartPendulum, Furuta, find
from upright.physics.equations import needed_force
from upright.physics.regressor import regressor

mujoco = pytest.importorskip("mujoco")


def motions(coordinates: int, count: int = 30) -> np.ndarray:
    """Positions, speeds and accelerations, made or not, shape (3, coordinates, count)."""
    return np.random.default_rng(4).normal(size=(3, coordinates, count)) * np.array([1.0, 3.0, 20.0])[:, None, None]


@pytest.mark.parametrize("name", SPECIMENS)
def test_columns_times_base_parameters_are_the_forces_of_mujocos_inverse_dynamics(name: str) -> None:
    """Both are closed forms: they differ by rounding, some 1e-14 of the largest force."""
    plant, model = SPECIMENS[name].plant, mujoco.MjModel.from_xml_string(SPECIMENS[name].mjcf)
    data = mujoco.MjData(model)
    q, v, a = motions(len(plant.coordinates))
    equations = regressor(type(plant))
    ours = np.tensordot(equations.values(plant.parameters()), equations.columns(q, v, a), 1)
    for k in range(q.shape[1]):
        data.qpos, data.qvel, data.qacc = q[:, k], v[:, k], a[:, k]
        mujoco.mj_inverse(model, data)
        np.testing.assert_allclose(ours[:, k], data.qfrc_inverse, atol=1e-11 * np.abs(ours).max())
    assert not equations.rest(q, v, a).any()


def test_columns_of_the_furuta_are_those_of_equation_3() -> None:
    """PHYSICS, section 2, sorted by hand by what each combination of parameters multiplies."""
    q, v, a = motions(2)
    (_, theta), (w, theta_dot), (psi_ddot, theta_ddot) = q, v, a
    s, c, no = np.sin(theta), np.cos(theta), 0 * theta
    by_hand = {
        "J_d + m_p*r*r": (psi_ddot, no),
        "J_p + l_cg*l_cg*m_p": (s**2 * psi_ddot + 2 * s * c * theta_dot * w, theta_ddot - s * c * w**2),
        "J_a": (c**2 * psi_ddot - 2 * s * c * theta_dot * w, s * c * w**2),
        "l_cg*m_p*r": (-c * theta_ddot + s * theta_dot**2, -c * psi_ddot),
        "g*l_cg*m_p": (no, s), "k_psi": (q[0], no), "b_1": (w, no), "b_2": (no, theta_dot),
    }  # fmt: skip
    equations = regressor(Furuta, frozenset(Furuta.optional))
    assert {b.text for b in equations.base} == by_hand.keys()
    for b, columns in zip(equations.base, equations.columns(q, v, a), strict=True):
        np.testing.assert_allclose(columns, np.array(by_hand[b.text]), atol=1e-12 * 20, err_msg=b.text)
    assert all(b.positive for b in equations.base)  # inertias, stiffnesses and products of positive numbers


@pytest.mark.parametrize("name", SPECIMENS)
def test_no_base_parameter_does_what_others_do(name: str) -> None:
    """Identifiable each: columns over all coordinates and motions are linearly independent."""
    equations = regressor(type(SPECIMENS[name].plant))
    Y = equations.columns(*motions(len(SPECIMENS[name].plant.coordinates), 100))
    table = Y.reshape(len(equations.base), -1)
    assert np.linalg.matrix_rank(table / np.linalg.norm(table, axis=1)[:, None]) == len(equations.base)


def test_parameters_at_zero_are_left_out_where_they_multiply_and_only_there() -> None:
    """What leans is a part of the level rig's gravity, ``sqrt(1 - tilt_x^2 - tilt_y^2)``, and does not take it away."""
    one = regressor(Furuta, frozenset({"tilt_x", "J_a"}))
    names = frozenset[str]().union(*(b.names for b in one.base if "sqrt" not in b.text))
    assert not names & {"tilt_x", "J_a"}
    assert any("sqrt" in b.text and not b.positive for b in one.base)
    springs = [{b.text for b in regressor(CartPendulum, zero).base} for zero in (frozenset[str](), frozenset({"k_x"}))]
    assert springs[0] - springs[1] == {"k_x"}


def test_what_does_not_multiply_a_column_is_fixed_and_has_to_be_known() -> None:
    """A contact's gap and what is chosen with it; all terms together are still the forces of the motion."""
    plant = Bumpers(m=0.7, J=0.02, k=300.0, gap=0.05, b=0.4)
    q, v, a = motions(2)
    equations = regressor(Bumpers)
    assert {"gap", "k"} <= {text for _, text in equations.fixed}
    columns = equations.columns(q, v, a, plant.parameters())
    ours = np.tensordot(equations.values(plant.parameters()), columns, 1) + equations.rest(q, v, a, plant.parameters())
    theirs = needed_force(Bumpers.derived(), plant.parameters(), q, v, a)
    np.testing.assert_allclose(ours, theirs, atol=1e-12 * np.abs(theirs).max())


def test_a_motors_constant_is_torque_per_current_and_voltage_per_speed() -> None:
    """A user's own plant, in its own file: ``J psi'' = k_t i``, ``L_m i' = V - R_m i - k_t psi'``."""
    motor = find("qube_motor.py:QubeMotor", EXAMPLES)
    q, v, a = motions(3)
    equations = regressor(motor, frozenset(motor.optional))
    (constant,) = (i for i, b in enumerate(equations.base) if "k_t" in b.names)
    np.testing.assert_allclose(equations.columns(q, v, a)[constant], np.array([-v[2], 0 * v[1], v[0]]), atol=1e-10)


def test_a_bodys_own_inertia_is_what_its_acceleration_multiplies_alone() -> None:
    """Of the Furuta's arm the rod's share changes with its angle; of a double pendulum's links both have one."""
    found = {name: regressor(find(name), frozenset(find(name).optional)) for name in ("furuta", "double-pendulum")}
    texts = {name: [e.base[e.own(i) or 0].text for i in range(2)] for name, e in found.items()}
    assert texts == {
        "furuta": ["J_d + m_p*r*r", "J_p + l_cg*l_cg*m_p"],
        "double-pendulum": ["J_1 + l_1*l_1*m_2 + l_c1*l_c1*m_1", "J_2 + l_c2*l_c2*m_2"],
    }
    assert regressor(Bumpers).own(1) is None


def test_a_column_is_an_inertias_or_a_forces_or_not_in_the_row() -> None:
    equations = regressor(Furuta, frozenset(Furuta.optional))
    roles = {b.text: (equations.roles(0)[k], equations.roles(1)[k]) for k, b in enumerate(equations.base)}
    assert roles["l_cg*m_p*r"] == ("inertia", "inertia")
    assert roles["k_psi"] == ("force", "")
    assert roles["g*l_cg*m_p"] == ("", "force")
    # throw, gravity, viscous friction and the axial inertia's centrifugal force; about the arm that inertia is left out
    q, v, a = motions(2)
    assert [len(equations.acting(i, q, v, a)) for i in (0, 1)] == [4, 4]


def test_what_may_be_left_out_is_told_from_what_is_always_there() -> None:
    """An anchor or an axial inertia may be none; a centroidal inertia may be none, that about the hinge not."""
    equations = regressor(Furuta, frozenset(Furuta.optional))
    assert {b.text for b in equations.base if not b.always} == {"J_a", "k_psi", "b_1", "b_2"}
    assert {b.text for b in regressor(find("torsional-2")).base if b.always} == {"J_1 + a_1", "J_2 + a_2", "k_12"}
