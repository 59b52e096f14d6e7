"""Dry friction between two bodies that both move: a block on a plank, and where the joint's direction is a mixture."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from upright.errors import BadInput
from upright.physics import Coordinate, Input, Joint, Plant
from upright.quantities import quantity
from upright.simulation import Held, simulate

FRICTION = ("F_c", "c_q", "F_s", "v_s", "delta")


class Friction(Plant, abstract=True):
    m_1: float = quantity("kg", "mass of the plank", default=1.7, above=0)
    m_2: float = quantity("kg", "mass of the block", default=0.4, above=0)
    k: float = quantity("N/m", "spring between the plank and the wall", default=0.0, at_least=0)
    F_1: float = quantity("N", "Coulomb friction under the plank", default=0.0, at_least=0)
    F_c: float = quantity("N", "Coulomb friction between them", default=0.0, at_least=0)
    c_q: float = quantity("N s^2/m^2", "quadratic drag between them", default=0.0, at_least=0)
    F_s: float = quantity("N", "stiction between them", default=0.0, at_least=0)
    v_s: float = quantity("m/s", "Stribeck's speed", default=0.0, at_least=0)
    delta: float = quantity("m", "presliding length", default=0.0, at_least=0)
    inputs = (Input("F", "N", "force on the plank", on="x"),)


class BlockOnPlank(Friction):
    coordinates = (Coordinate("y", "m", "place of the block"), Coordinate("x", "m", "place of the plank"))
    joints = (Joint("x", "F_1"), Joint("y - x", *FRICTION))

    @staticmethod
    def energies(p: Any, q: Any, v: Any) -> tuple[Any, Any, Any]:
        return (p.m_1 * v[1] ** 2 + p.m_2 * v[0] ** 2) / 2, p.k * q[1] ** 2 / 2, 0


class BlockFromPlank(Friction):
    """The same in the joint's own coordinate."""

    coordinates = (Coordinate("z", "m", "place of the block on the plank"), Coordinate("x", "m", "place of the plank"))
    joints = (Joint("x", "F_1"), Joint("z", *FRICTION))

    @staticmethod
    def energies(p: Any, q: Any, v: Any) -> tuple[Any, Any, Any]:
        return (p.m_1 * v[1] ** 2 + p.m_2 * (v[0] + v[1]) ** 2) / 2, p.k * q[1] ** 2 / 2, 0


@pytest.mark.parametrize("lanes", [1, 3])
def test_a_block_thrown_onto_a_free_plank_takes_it_along(lanes):
    m_1, m_2, v, F_c = 1.7, 0.4, 1.3, 0.9
    x0 = np.tile([0.0, v, 0.0, 0.0], (lanes, 1))
    x = simulate(BlockOnPlank(F_c=F_c), {}, x0, None, 0.01, samples=101)
    t = 0.01 * np.arange(101)
    common, together = m_2 * v / (m_1 + m_2), v / (F_c * (1 / m_1 + 1 / m_2))  # momentum; relative speed used up
    slides = np.minimum(t, together)
    np.testing.assert_allclose(x[:, 1].T, np.tile(v - F_c / m_2 * slides, (lanes, 1)), rtol=0, atol=1e-13)
    np.testing.assert_allclose(x[:, 3].T, np.tile(F_c / m_1 * slides, (lanes, 1)), rtol=0, atol=1e-13)
    assert np.all(x[t > together, 1] == x[t > together, 3])
    np.testing.assert_allclose(x[-1, 3], common, rtol=1e-13)


def test_a_block_lets_go_when_the_plank_runs_away_faster_than_stiction_can_pull_it():
    m_1, m_2, F_c, F_s = 1.7, 0.4, 0.5, 0.8
    ramp, dt = 6.0, 1e-3  # force on the plank, N/s, held between the samples
    x = simulate(BlockOnPlank(F_c=F_c, F_s=F_s), {}, [0.0] * 4, ramp * dt * np.arange(1001), dt, samples=1001)[:, :, 0]
    away = F_s * (m_1 + m_2) / m_2 / ramp  # 0.7 s: there m_2 a = F_s
    t = dt * np.arange(1001)
    apart = x[:, 1] != x[:, 3]
    assert away < t[apart][0] < away + 3 * dt
    after = slice(int(np.argmax(apart)) + 1, None)
    np.testing.assert_allclose(np.diff(x[after, 1]), F_c / m_2 * dt, rtol=1e-9)


@pytest.mark.parametrize("kinds", [("F_c",), ("F_c", "F_s", "v_s"), ("F_c", "c_q"), ("F_c", "delta"), ("c_q",)])
@pytest.mark.parametrize("under", [0.0, 0.15])
def test_the_joint_s_own_coordinate_and_a_difference_give_one_motion(kinds, under):
    level = {"F_c": 0.4, "F_s": 0.55, "v_s": 0.05, "c_q": 0.7, "delta": 2e-3}
    p = {"k": 30.0, "F_1": under} | {name: level[name] for name in kinds}
    rng = np.random.default_rng(3)
    y, ydot, x, xdot = rng.uniform(-0.3, 0.3, (4, 20))
    push = 1.5 * np.sin(0.02 * np.arange(300))
    a = simulate(BlockOnPlank(**p), {}, np.vstack([y, ydot, x, xdot]).T, push, 0.01, samples=300, substeps=4)
    b = simulate(
        BlockFromPlank(**p), {}, np.vstack([y - x, ydot - xdot, x, xdot]).T, push, 0.01, samples=300, substeps=4
    )
    np.testing.assert_allclose(a[:, 2:], b[:, 2:], rtol=0, atol=1e-11)
    np.testing.assert_allclose(a[:, 0] - a[:, 2], b[:, 0], rtol=0, atol=1e-11)


def test_a_block_on_a_locked_plank_slides_as_on_the_ground():
    x = simulate(BlockOnPlank(F_c=0.9), {}, [0.0, 1.3, 0.0, 0.0], None, 0.01, samples=101, held={"x": Held()})
    np.testing.assert_allclose(x[-1, 0, 0], 0.4 * 1.3**2 / (2 * 0.9), rtol=1e-13)


def test_friction_on_a_plank_that_is_moved_from_outside_is_refused():
    moved = {"x": Held(q=0.01 * np.arange(101))}
    with pytest.raises(BadInput, match="between y and x is not computed while x is moved from outside; lock it"):
        simulate(BlockOnPlank(F_c=0.9), {}, [0.0, 1.3, 0.0, 0.0], None, 0.01, samples=101, held=moved)
    free = simulate(BlockOnPlank(), {}, [0.0, 1.3, 0.0, 0.0], None, 0.01, samples=101, held=moved)
    assert free[-1, 1, 0] == 1.3


def test_two_joints_that_move_as_one_are_refused():
    with pytest.raises(BadInput, match="do not move independently; state all friction of one joint in one Joint"):
        type("Twice", (Friction,), {
            "coordinates": BlockOnPlank.coordinates, "energies": BlockOnPlank.energies,
            "joints": (Joint("y - x", "F_c"), Joint("x - y", "", "c_q")), "__annotations__": {},
        })  # fmt: skip
    one = replace(BlockOnPlank.derived(), joints=BlockOnPlank.derived().joints[::-1])
    x = simulate(one, BlockOnPlank(F_c=0.9).parameters(), [0.0, 1.3, 0.0, 0.0], None, 0.01, samples=101)
    y = simulate(BlockOnPlank(F_c=0.9), {}, [0.0, 1.3, 0.0, 0.0], None, 0.01, samples=101)
    assert np.array_equal(x, y)  # the order in which joints are stated does not matter
