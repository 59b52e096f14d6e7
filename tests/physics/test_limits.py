"""Do the plants reduce to what mechanics knows in closed form?"""

import math
from dataclasses import FrozenInstanceError

import numpy as np
import pytest
import sympy as sp

from upright.errors import BadInput, ImpossiblePhysics, NotIdentifiable
from upright.physics import CartPendulum, Coordinate, Furuta, Pendulum, Plant, added_inertia, chain, find
from upright.quantities import quantity

FURUTA = Furuta(m_p=0.2, l_cg=0.15, r=0.2, J_d=0.01, J_p=5e-4)


class Slide(Plant):
    m: float = quantity("kg", "mass", above=0)

    coordinates = (Coordinate("x", "m", "downhill"),)

    @staticmethod
    def energies(p, q, v):
        return p.m * v[0] ** 2 / 2, -p.m * 9.81 * q[0], 0


def frequencies(plant, at=None):
    """Distinct undamped frequencies [rad/s], rising."""
    found = np.sort(np.abs(plant.linear(at).poles().imag))
    return found[::2]


def test_pendulum_without_length_of_its_own_swings_at_sqrt_g_over_l():
    assert frequencies(Pendulum(m_p=0.3, l_cg=0.4))[0] == pytest.approx(np.sqrt(9.81 / 0.4), rel=1e-12)


def test_furuta_with_a_vanishing_arm_is_a_pendulum():
    swing = frequencies(FURUTA.replace(r=1e-9))[-1]
    alone = frequencies(Pendulum(m_p=0.2, l_cg=0.15, J_p=5e-4))[0]
    assert swing == pytest.approx(alone, rel=1e-12)


@pytest.mark.parametrize("rig", [FURUTA.replace(J_d=1e9), CartPendulum(m_c=1e9, m_p=0.2, l_cg=0.15, J_p=5e-4)])
def test_a_base_too_heavy_to_move_leaves_a_pendulum(rig):
    alone = frequencies(Pendulum(m_p=0.2, l_cg=0.15, J_p=5e-4))[0]
    assert frequencies(rig)[-1] == pytest.approx(alone, rel=1e-6)


def test_furuta_with_a_massless_rod_is_a_disk():
    slow, fast = frequencies(FURUTA.replace(m_p=1e-12, J_p=0.0, k_psi=0.7))
    assert slow == pytest.approx(np.sqrt(9.81 / FURUTA.l_cg), rel=1e-6)  # what is left of the rod
    assert fast == pytest.approx(np.sqrt(0.7 / FURUTA.J_d), rel=1e-6)


def test_furuta_with_a_long_arm_is_a_pendulum_on_a_cart():
    """Arm radius R to infinity: the hinge moves on a straight line by x = R psi, against the cart's theta."""
    R = 1e6
    far = FURUTA.replace(r=R, J_d=0.5 * R**2)
    assert frequencies(far)[-1] == pytest.approx(
        frequencies(CartPendulum(m_c=0.5, m_p=0.2, l_cg=0.15, J_p=5e-4))[-1], rel=1e-9
    )


@pytest.mark.parametrize("kind", ["rectilinear", "torsional"])
def test_two_free_inertias_have_one_rigid_and_one_flexible_mode(kind):
    letter = "m" if kind == "rectilinear" else "J"
    pair = chain(2, kind)(**{f"{letter}_1": 0.8, f"{letter}_2": 0.5, "k_12": 226.0, "a_2": 0.1})
    rigid, flexible = frequencies(pair)
    assert rigid == pytest.approx(0, abs=1e-6)
    assert flexible == pytest.approx(np.sqrt(226 * (1 / 0.8 + 1 / 0.6)), rel=1e-12)


@pytest.mark.parametrize("bodies", [3, 5])
def test_a_uniform_chain_between_walls_has_the_frequencies_of_a_beaded_string(bodies):
    """omega_j = 2 sqrt(k/m) sin(j pi / (2 (n + 1)))."""
    k, m = 200.0, 0.7
    ends = {"k_1": k, f"k_{bodies}": k}
    links = {f"k_{i}{i + 1}": k for i in range(1, bodies)}
    string = chain(bodies)(**{f"m_{i}": m for i in range(1, bodies + 1)}, **ends, **links)
    j = np.arange(1, bodies + 1)
    np.testing.assert_allclose(
        frequencies(string), 2 * np.sqrt(k / m) * np.sin(j * np.pi / (2 * (bodies + 1))), rtol=1e-9
    )


def test_torsional_and_rectilinear_chains_are_one_plant_in_two_sets_of_units():
    """m and J, k and k_t, c and c_t, F and T."""
    values = {"k_12": 2.7, "k_1": 1.0, "c_1": 0.01, "c_12": 0.02}
    disks = chain(2, "torsional")(J_1=0.01, J_2=0.02, **values).linear()
    carts = chain(2, "rectilinear")(m_1=0.01, m_2=0.02, **values).linear()
    np.testing.assert_array_equal(disks.A, carts.A)
    np.testing.assert_array_equal(disks.B, carts.B)


def test_brass_masses_obey_the_parallel_axis_theorem():
    """A solid cylinder has m R^2/2 about its own axis and m d^2 more about another one."""
    assert added_inertia(4, 0.09) == pytest.approx(4 * 0.5 * 0.0081)
    assert added_inertia(2, 0.06, mass_radius=0.025) == pytest.approx(2 * 0.5 * (0.0036 + 0.025**2 / 2))
    # integrated over a disk cut in little squares
    x, y = np.meshgrid(*2 * [np.linspace(-0.025, 0.025, 801)])
    inside = x**2 + y**2 <= 0.025**2
    integrated = 0.5 * np.mean(((x + 0.06) ** 2 + y**2)[inside])
    assert added_inertia(1, 0.06, mass_radius=0.025) == pytest.approx(integrated, rel=1e-3)


def test_a_leaning_rig_points_its_arm_downhill():
    """Out of level towards psi = atan2(tilt_y, tilt_x): there the centre of gravity is lowest."""
    rest = FURUTA.replace(tilt_x=0.02, tilt_y=0.01).linear("hanging").point
    assert rest["psi"] == pytest.approx(np.arctan2(0.01, 0.02), abs=1e-9)
    assert rest["theta"] == pytest.approx(0, abs=1e-9)


def test_a_leaning_anchored_rig_balances_spring_and_weight():
    """Arm locked hard: the rod hangs along gravity, tan(theta) = -tilt_y over the level part, where psi = 0."""
    rest = FURUTA.replace(tilt_y=0.1, k_psi=1e9).linear("hanging").point
    assert rest["psi"] == pytest.approx(0, abs=1e-8)
    assert np.tan(rest["theta"]) == pytest.approx(-0.1 / np.sqrt(1 - 0.01), rel=1e-6)


def test_the_downhill_arm_swings_like_a_pendulum_in_weak_gravity():
    """Rod massive and held by its weight at r only: psi'' (J_d + m r^2) = -m g r tilt psi for a short rod."""
    rig = FURUTA.replace(tilt_x=0.03, l_cg=1e-7, J_p=1e-12)
    slow = np.sqrt(rig.m_p * 9.81 * rig.r * 0.03 / (rig.J_d + rig.m_p * rig.r**2))
    assert frequencies(rig)[0] == pytest.approx(slow, rel=1e-5)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"m_p": -0.1}, r"m_p \(mass of the pendulum\) must be > 0 kg, got -0.1"),
        ({"r": 0.0}, r"r \(.*\) must be > 0 m, got 0"),
        ({"b_1": -1e-3}, r"b_1 .* must be >= 0 N m s/rad"),
        ({"J_d": float("nan")}, r"J_d .* got nan"),
        ({"tilt_x": 0.7}, r"tilt_x .* <= 0.5"),
    ],
)
def test_impossible_parameters_are_refused_in_a_sentence(change, sentence):
    with pytest.raises(ImpossiblePhysics, match=sentence):
        FURUTA.replace(**change)


def test_a_plant_is_a_value():
    with pytest.raises(FrozenInstanceError):
        FURUTA.m_p = 1.0
    assert FURUTA.replace(m_p=0.3).m_p == 0.3
    assert FURUTA.m_p == 0.2
    assert FURUTA.replace(m_p=0.2) == FURUTA


@pytest.mark.parametrize(
    ("ask", "sentence"),
    [
        (lambda: FURUTA.replace(mp=1.0), "no parameter 'mp'; did you mean 'm_p'"),
        (lambda: FURUTA.linear("upside down"), "no equilibrium 'upside down'; valid names: hanging, inverted"),
        (lambda: FURUTA.state(phi=1.0), "no state 'phi'"),
        (lambda: find("furuto"), "did you mean 'furuta'"),
        (lambda: find("chain-12"), "1 to 9 bodies, got 12"),
        (lambda: chain(2, "linear"), "'rectilinear' or 'torsional', got 'linear'"),
    ],
)
def test_a_wrong_name_is_answered_with_the_right_one(ask, sentence):
    with pytest.raises(BadInput, match=sentence):
        ask()


class Shelf(Plant):
    """A slope with a spring at its lower end, on whichever side that lies."""

    m: float = quantity("kg", "mass", above=0)
    k: float = quantity("N/m", "spring", above=0)
    side: float = quantity("1", "where it goes down", at_least=-1, at_most=1)

    coordinates = (Coordinate("x", "m", "to the right"),)

    @staticmethod
    def energies(p, q, v):
        down = p.side * q[0]
        pressed = sp.Max(down - 0.3, 0)
        return p.m * v[0] ** 2 / 2, -p.m * 9.81 * down + p.k * pressed**2 / 2, 0


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_what_floats_at_its_nominal_place_rests_where_something_holds_it_on_either_side(side):
    """Half a metre aside the spring is pressed, until it carries the weight: k (x - 0.3) = m g."""
    found = Shelf(m=0.2, k=40.0, side=side).linear()
    assert found.point["x"] == pytest.approx(side * (0.3 + 0.2 * 9.81 / 40.0), rel=1e-9)
    assert found.poles().imag.max() == pytest.approx(math.sqrt(40.0 / 0.2))


def test_a_rig_with_nowhere_to_rest_says_so():
    """A chain without springs pushed by nothing rests anywhere; a slope without stop offers no rest."""
    assert chain(1)(m_1=1.0).linear().point == {"x_1": 0.0}
    with pytest.raises(NotIdentifiable, match="no equilibrium near"):
        Slide(m=1.0).linear()
