"""Does an own plant with elementary functions and kinks move as Euler and Lagrange have it, on every path?"""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp
from scipy.integrate import solve_ivp

from tests.physics.bumpers import BUMPERS
from upright.errors import NotIdentifiable
from upright.physics import Coordinate, Plant
from upright.physics.equations import mass_and_force, small_motions
from upright.physics.lagrange import energies, symbols
from upright.quantities import quantity
from upright.simulation import simulate

STARTS = np.random.default_rng(3).uniform(-1.0, 1.0, (20, 4)) * [0.08, 1.5, 0.6, 2.0]


def second_engine(plant):
    """Mass matrix and forces by SymPy's own differentiation and NumPy's functions, kinks as SymPy states them."""
    p, q, v, u = symbols(type(plant))
    T, V, D = (e.subs({getattr(p, n): x for n, x in plant.parameters().items()}) for e in energies(type(plant)))
    L = T - V
    f = [sp.diff(L, a) - sum(sp.diff(L, b, c) * w for b, c, w in zip([d] * len(q), q, v, strict=True)) - sp.diff(D, d)
         for a, d in zip(q, v, strict=True)]  # fmt: skip
    f[0] += u[0]
    return sp.lambdify([*q, *v, *u], [sp.hessian(T, v), sp.Matrix(f)], "numpy")


def test_equations_are_those_of_sympy_on_numbers_and_arrays():
    theirs = second_engine(BUMPERS)
    derived = BUMPERS.derived()
    names = ("x", "x_dot", "phi", "phi_dot")
    arrays = mass_and_force(derived, {**BUMPERS.parameters(), **dict(zip(names, STARTS.T, strict=True)), "F": 0.3})
    for k, x in enumerate(STARTS):
        M, f = theirs(x[0], x[2], x[1], x[3], 0.3)
        state = dict(zip(names, x.tolist(), strict=True))
        numbers = mass_and_force(derived, {**BUMPERS.parameters(), **state, "F": 0.3})
        for got in (numbers, (arrays[0][k], arrays[1][k])):
            assert got[0] == pytest.approx(M, rel=1e-13)
            assert got[1] == pytest.approx(f.ravel(), rel=1e-11, abs=1e-13)


@pytest.mark.parametrize("lanes", [1, 20])
def test_motion_is_that_of_scipy(lanes):
    """A step over a kink errs by at most h^2/8 times the jump of the acceleration's slope: ten kinks of 1000 m/s^3."""
    theirs = second_engine(BUMPERS)

    def rate(t, x):
        M, f = theirs(x[0], x[2], x[1], x[3], 0.0)
        a = np.linalg.solve(M, f.ravel())
        return [x[1], a[0], x[3], a[1]]

    ours = simulate(BUMPERS, {}, STARTS[:lanes], None, 1e-3, samples=301, substeps=100)
    assert np.sum(np.diff(np.sign(ours[:, 1, 0])) != 0) >= 3  # it bounces
    for k in range(0, lanes, 9):
        t = np.linspace(0, 0.3, 6)
        exact = solve_ivp(rate, (0, 0.3), STARTS[k], "DOP853", t, rtol=1e-11, atol=1e-12, max_step=2e-3)
        assert ours[::60, :, k] == pytest.approx(exact.y.T, abs=1e-7)


def test_a_drag_that_levels_off_stays_finite_at_any_speed():
    """At 10^4 times the speed where it has levelled off it takes its whole force: x = x_0 + v t - b t^2 / 2 m."""

    class Slide(Plant):
        """A mass on a rough floor, friction smoothed."""

        m: float = quantity("kg", "mass", above=0)
        b: float = quantity("N", "drag")
        w: float = quantity("m/s", "speed where it levels off", above=0)
        coordinates = (Coordinate("x", "m", "place"),)

        @staticmethod
        def energies(p, q, v):
            return p.m * v[0] ** 2 / 2, 0, p.b * p.w * sp.log(sp.cosh(v[0] / p.w))

    slide = Slide(m=2.0, b=3.0, w=1e-3)
    t = np.arange(101) * 1e-3
    motion = simulate(slide, {}, [0.0, 10.0], None, 1e-3, samples=101)
    assert motion[:, 0, 0] == pytest.approx(10.0 * t - 0.75 * t**2, rel=1e-12)
    assert slide.power_lost(motion[0, :, 0]) == pytest.approx(30.0)
    assert slide.linear().A[1, 1] == pytest.approx(-3.0 / 1e-3 / 2.0)


def test_energy_of_many_states_is_that_of_each():
    assert BUMPERS.energy(STARTS) == pytest.approx([float(BUMPERS.energy(x)) for x in STARTS], rel=1e-14)


def test_a_kink_at_rest_has_no_linear_model_and_one_elsewhere_has():
    class Stop(Plant):
        """A mass on a spring, beside a stop."""

        m: float = quantity("kg", "mass", above=0)
        k: float = quantity("N/m", "spring", above=0)
        stop: float = quantity("N/m", "stop", above=0)
        gap: float = quantity("m", "gap")
        coordinates = (Coordinate("x", "m", "place"),)

        @staticmethod
        def energies(p, q, v):
            return p.m * v[0] ** 2 / 2, p.k * q[0] ** 2 / 2 + p.stop * sp.Max(q[0] - p.gap, 0) ** 2 / 2, 0

    values = {"m": 2.0, "k": 8.0, "stop": 100.0}
    assert Stop(**values, gap=0.1).linear().A[1, 0] == pytest.approx(-4.0)
    with pytest.raises(NotIdentifiable, match=r"no linear model at .*differ to either side in x; name an equilibrium"):
        Stop(**values, gap=0.0).linear()
    assert [Stop(**values, gap=0.0).linear(side=d).A[1, 0] for d in (-1e-6, 1e-6)] == pytest.approx([-4.0, -54.0])
    stiffness = small_motions(Stop.derived(), {**values, "gap": 0.0, "x": np.array([-1.0, 1.0])}, (2,))[2]
    assert stiffness.ravel() == pytest.approx([8.0, 108.0])
