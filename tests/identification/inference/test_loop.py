"""Rigs drawn from a covariance meet one loop: the share that it holds has a closed form for a point pendulum."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats
from scipy.signal import place_poles

from tests.identification.twins import FURUTA, rig, swing
from upright.identification import GreyBox, Parameter
from upright.identification.inference.covariance import Optimum, assess
from upright.identification.inference.loop import driven_plant, matrix_root, placed, standing
from upright.identification.inference.poles import poles
from upright.identification.problem.residuals import formulate
from upright.physics import Furuta, Pendulum, chain

POINT = {"m_p": 0.2, "l_cg": 0.25, "J_p": 0.0, "b_2": 0.0, "b_2c": 0.0, "b_2q": 0.0}
OMEGA = math.sqrt(9.81 / POINT["l_cg"])


def uncertain(name: str, relative: float, asked: GreyBox) -> Optimum:
    """An optimum of which one shared number alone is uncertain, by a share of its value."""
    problem = formulate(asked, [swing(POINT, seconds=2.0, angle=0.5)])
    best = assess(problem, problem.start)
    place = [u.name for u in problem.unknowns].index(name)
    u = problem.unknowns[place]
    sigma = np.zeros(best.x.size)
    sigma[place] = relative * (1.0 if u.log else abs(best.values[place]))
    return replace(best, covariance=np.diag(sigma**2))


def driven(gain: float = 0.5) -> GreyBox:
    asked = rig(Pendulum, POINT, {})
    drive = Parameter(name="actuator.gain", value=gain, unit="N m/V", estimate=True)
    return replace(asked, parameters={**asked.parameters, "actuator.gain": drive})


@pytest.mark.parametrize("relative", [0.3, 0.5, 1.0])
def test_the_share_that_a_loop_holds_is_that_of_the_gains_above_its_margin(relative: float) -> None:
    """Poles at -w and -1.25 w ask for s^2 + 2.25 w s + 1.25 w^2; with k times the gain it is s^2 + 2.25 k w s +
    (2.25 k - 1) w^2, which is stable from k = 4/9 on."""
    found = standing(uncertain("actuator.gain", relative, driven()))
    assert found is not None
    assert found.at == "inverted"
    assert found.growth.value == pytest.approx(OMEGA)
    expected = stats.norm.cdf((1 - 1 / 2.25) / relative)
    assert found.share == pytest.approx(expected, abs=3 * math.sqrt(expected * (1 - expected) / 400) + 0.0025)


@pytest.mark.parametrize("relative", [0.25, 0.8])
def test_a_length_moves_what_the_loop_meets_to_first_order(relative: float) -> None:
    """w^2 = g/l and the input 1/(m l^2) become 1 - z and 1 - 2 z times theirs: s^2 + 2.25 (1 - 2 z) w s +
    (2.25 (1 - 2 z) - (1 - z)) w^2 is stable up to z = 1.25/3.5."""
    asked = rig(Pendulum, {n: v for n, v in POINT.items() if n != "l_cg"}, {"l_cg": POINT["l_cg"]})
    found = standing(uncertain("l_cg", relative, asked))
    assert found is not None
    expected = stats.norm.cdf(1.25 / 3.5 / relative)
    assert found.share == pytest.approx(expected, abs=3 * math.sqrt(expected * (1 - expected) / 400) + 0.0025)


def test_nothing_stands_that_no_drive_moves_or_that_cannot_fall() -> None:
    assert standing(uncertain("actuator.gain", 0.1, driven(gain=0.0))) is None  # no gain reaches the poles
    three = chain(2)
    given = {"m_1": 1.0, "m_2": 2.0, "k_1": 30.0, "k_12": 20.0}
    y = np.column_stack([np.sin(np.arange(300) * 0.05), np.cos(np.arange(300) * 0.05)])
    run = replace(swing(POINT, seconds=2.99), y=y, measured=("x_1", "x_2"))
    problem = formulate(rig(three, given, {"c_1": 0.5}), [run])
    assert standing(assess(problem, problem.start)) is None


def test_gains_put_the_poles_where_they_are_wanted() -> None:
    """Ackermann's formula beside scipy's robust placement, which for one input is the same gain."""
    A = np.array([[0.0, 1.0, 0.0, 0.0], [2.0, -0.1, 0.5, 0.0], [0.0, 0.0, 0.0, 1.0], [-1.0, 0.2, 3.0, -0.3]])
    b = np.array([0.0, 1.0, 0.0, -0.7])
    wanted = -np.array([1.0, 1.25, 1.5, 1.75])
    K = placed(A, b, wanted)
    assert np.allclose(K, place_poles(A, b[:, None], wanted).gain_matrix[0], rtol=1e-6)
    assert placed(A, np.zeros(4), wanted) is None
    assert placed(np.diag([1.0, 1.0]), np.array([1.0, 1.0]), wanted[:2]) is None  # two alike, one input


def test_a_root_of_a_covariance_gives_it_back() -> None:
    chance = np.random.default_rng(3)
    M = chance.normal(size=(3, 3)) * [[1e-6], [1.0], [1e4]]
    C = M @ M.T
    assert matrix_root(C) @ matrix_root(C).T == pytest.approx(C, rel=1e-9)
    assert matrix_root(np.zeros((2, 2))) == pytest.approx(0.0, abs=1e-100)
    # a correlation of 1.5 has the eigenvalues 2.5 and -0.5; of the nearest one the second is 0
    L = matrix_root(np.array([[4.0, 3.0], [3.0, 1.0]]))
    assert np.allclose(L @ L.T, np.array([[4.0, 2.0], [2.0, 1.0]]) * 1.25)


def test_a_drive_pushes_by_its_gain_and_brakes_by_its_slope() -> None:
    plant = Furuta(**FURUTA)
    linear = plant.linear("inverted")
    values = {**plant.parameters(), "actuator.gain": 3.0, "actuator.slope": 0.02}
    A, B = driven_plant(rig(Furuta, FURUTA, {}), values, "inverted")
    # a torque -0.02 psi_dot on the arm
    assert np.allclose(A, linear.A - 0.02 * linear.B @ np.array([[0.0, 1.0, 0.0, 0.0]]))
    assert np.allclose(B, 3.0 * linear.B)
    told = poles(rig(Furuta, FURUTA, {}), values, [], np.zeros((0, 0)), 2.0)["inverted"]
    eigenvalues = np.linalg.eigvals(A)
    assert max(p.real.value for p in told) == pytest.approx(eigenvalues.real.max())


@pytest.mark.parametrize(("spread", "ends"), [(0.2, None), (0.6, (0.0, 2.2))])
def test_a_growth_that_may_be_none_has_an_interval_from_zero(spread: float, ends: tuple[float, float] | None) -> None:
    """Upright the rate is sqrt(g/l), uncertain by half as much as l; beyond its own size the interval ends at 0."""
    asked = rig(Pendulum, POINT, {})
    values = {**Pendulum(**POINT).parameters()}
    sigma = 2 * spread * POINT["l_cg"]
    (fast, *_) = poles(asked, values, ["l_cg"], np.array([[sigma**2]]), 2.0)["inverted"]
    low, high = ends or (math.exp(-2 * spread), math.exp(2 * spread))
    assert fast.real.interval == pytest.approx((low * OMEGA, high * OMEGA), rel=1e-3)
    assert fast.real.stderr == pytest.approx(spread * OMEGA, rel=1e-3)
    assert (fast.real.unit, fast.imag.unit) == ("1/s", "rad/s")


def test_poles_are_told_the_fastest_growing_first_and_of_a_pair_the_upper_one() -> None:
    values = Furuta(**FURUTA).parameters()
    told = poles(rig(Furuta, FURUTA, {}), values, [], np.zeros((0, 0)), 2.0)
    for at, found in told.items():
        eigenvalues = np.linalg.eigvals(Furuta(**FURUTA).linear(at).A)
        upper = sorted(eigenvalues[eigenvalues.imag > -1e-9], key=lambda p: -p.real)
        assert np.allclose([complex(p.real.value, p.imag.value) for p in found], upper, atol=1e-9)
    assert poles(rig(Furuta, FURUTA, {}), values, ["J_d"], np.array([[math.inf]]), 2.0) == {}
