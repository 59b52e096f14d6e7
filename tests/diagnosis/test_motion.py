"""Slopes of effort, gravity, throw and spring are those of the equations of motion, signs and sizes."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

from tests.diagnosis.cases import case
from upright.diagnosis.motion import SmoothedMotion, driven_row, motion_of, quiet_width, sign_terms
from upright.physics import CartPendulum, Furuta, Pendulum, Plant, find
from upright.simulation import simulate

DT, N = 1e-3, 4001
T = np.arange(N) * DT


@dataclass(frozen=True)
class Rig:
    """A plant, a torque or force that moves it well, where it is released, and the slopes of its equations by hand."""

    plant: Plant
    size: float
    release: dict[str, float]
    slopes: dict[tuple[str, str], float]


ROD = {"m_p": 0.2, "l_cg": 0.3, "J_p": 2e-3, "b_2": 2e-3}
J_A, MGL, ML = 2e-3 + 0.2 * 0.3**2, 0.2 * 9.81 * 0.3, 0.2 * 0.3
RIGS = {
    # J_A theta'' = u - m g l sin(theta)
    "pendulum": Rig(
        Pendulum(**ROD), 0.2, {"theta": 1.0}, {("effort", "theta"): 1 / J_A, ("theta", "theta"): MGL / J_A}
    ),
    # (m_c + m_p) x'' + m l (cos theta'' - sin theta'^2) = u;  J_A theta'' = -m l cos x'' - m g l sin
    "cart-pendulum": Rig(
        CartPendulum(**ROD, m_c=0.5, b_1=0.3), 3.0, {"theta": 1.0},
        {("effort", "x"): 1 / 0.7, ("theta", "theta"): MGL / J_A, ("x", "theta"): ML / J_A, ("theta", "x"): ML / 0.7},
    ),
    # (J_d + m r^2 + J_A sin^2) psi'' + 2 J_A sin cos psi' theta' - m r l (cos theta'' - sin theta'^2) = u
    # J_A theta'' = m r l cos psi'' + J_A sin cos psi'^2 - m g l sin
    "furuta": Rig(
        Furuta(**ROD, r=0.2, J_d=0.02, b_1=5e-3), 0.4, {"theta": 1.0},
        {("effort", "psi"): 1 / (0.02 + 0.2 * 0.2**2), ("theta", "theta"): MGL / J_A,
         ("psi", "theta"): 0.2 * ML / J_A, ("theta", "psi"): 0.2 * ML / (0.02 + 0.2 * 0.2**2)},
    ),
    # (J_1 + m_1 l_c1^2 + m_2 l_1^2) theta_1'' + (J_2 + m_2 l_c2^2) (theta_1'' + theta_2'')
    #   + m_2 l_1 l_c2 (cos theta_2 (2 theta_1'' + theta_2'') - sin theta_2 (2 theta_1' + theta_2') theta_2')
    #   + (m_1 l_c1 + m_2 l_1) g sin theta_1 + m_2 l_c2 g sin(theta_1 + theta_2) = u
    # (J_2 + m_2 l_c2^2) (theta_1'' + theta_2'') + m_2 l_1 l_c2 (cos theta_2 theta_1'' + sin theta_2 theta_1'^2)
    #   + m_2 l_c2 g sin(theta_1 + theta_2) = 0
    "double-pendulum": Rig(
        find("double-pendulum")(m_1=0.3, m_2=0.2, l_1=0.3, l_c1=0.15, l_c2=0.12, J_1=3e-3, J_2=2e-3, b_2=1e-3), 0.3,
        {"theta_1": 1.0},
        {("effort", "theta_1"): 1 / 0.02775, ("theta_1", "theta_1"): 9.81 * 0.105 / 0.02775,
         ("theta_2", "theta_1"): 0.0072 / 0.02775, ("theta_1", "theta_2"): 0.0072 / 4.88e-3},
    ),
    # m_1 x_1'' = u - k_1 x_1 - k_12 (x_1 - x_2);  m_2 x_2'' = -k_12 (x_2 - x_1) - k_2 x_2
    "rectilinear-2": Rig(
        find("rectilinear-2")(m_1=2.0, m_2=1.5, k_1=200.0, k_12=400.0, k_2=100.0, c_1=2.0, c_2=1.0), 8.0, {},
        {("effort", "x_1"): 1 / 2.0, ("x_2", "x_1"): 400 / 2.0, ("x_1", "x_2"): 400 / 1.5},
    ),
    "torsional-2, to ground": Rig(
        find("torsional-2")(J_1=0.01, J_2=0.008, k_12=1.4, k_1=1.0, c_1=0.007, c_2=0.001), 0.3, {},
        {("effort", "theta_1"): 1 / 0.01, ("theta_2", "theta_1"): 1.4 / 0.01, ("theta_1", "theta_2"): 1.4 / 0.008},
    ),
    # J_1 theta_1'' = u - k_12 (theta_1 - theta_2), no spring to ground
    "torsional-2": Rig(
        find("torsional-2")(J_1=0.01, J_2=0.008, k_12=1.4, c_1=0.007, c_2=0.001), 0.3, {},
        {("effort", "theta_1"): 1 / 0.01, ("theta_2", "theta_1"): 1.4 / 0.01, ("theta_1", "theta_2"): 1.4 / 0.008},
    ),
}  # fmt: skip


def moved(rig: Rig) -> SmoothedMotion:
    """Motion as simulated, its accelerations by central differences: off by (w dt)^2/6, 1e-4 at the most."""
    u = rig.size * (np.sin(3.1 * T) + 0.7 * np.sin(7.3 * T + 1) + 0.5 * np.sin(13.7 * T + 2))
    names = [c.name for c in rig.plant.coordinates]
    x0 = [rig.release.get(n, 0.0) for n in rig.plant.state_names()]
    x = simulate(rig.plant, {}, x0, u[:, None], DT, samples=N, substeps=2)[:, :, 0].T
    q, v = x[::2], x[1::2]
    mean = (u + np.roll(u, 1)) / 2  # a held command acts half a sample late
    a = np.gradient(v, DT, axis=1)
    inner = slice(5, -5)
    return SmoothedMotion(
        plant=type(rig.plant), t=T[inner], q=q[:, inner], v=v[:, inner], a=a[:, inner], u=mean[inner],
        fades=np.maximum(0.02 * np.std(v, axis=1), 1e-9), rows=tuple(range(len(names))),
        samples=np.arange(N)[inner], dt=DT, command=u, weights=np.ones(1),
    )  # fmt: skip


@pytest.mark.parametrize("name", RIGS)
def test_slopes_are_those_of_the_equations_of_motion(name: str) -> None:
    found = {term.who: term for term in sign_terms(moved(RIGS[name]))}
    assert {who: t.slope for who, t in found.items()} == pytest.approx(RIGS[name].slopes, rel=0.01)
    for term in found.values():
        assert term.total < 1e-4  # nothing of the acceleration is left
        assert 0.99 < term.share <= 1  # and without the term it is
        # with all other terms taken out acceleration and term lie on the line that a picture shows
        assert np.std(term.target - term.slope * term.alone) < 0.1 * np.std(term.target)


@pytest.mark.parametrize("name", RIGS)
def test_the_driven_row_leaves_the_effort_over_the_inertia(name: str) -> None:
    motion = moved(RIGS[name])
    here = np.arange(motion.t.size) % 3 > 0
    a, columns = driven_row(motion, here)[-1]
    assert a == pytest.approx(motion.a[0][here], rel=1e-12)
    A = np.column_stack([motion.u[here], columns])
    solution, *_ = np.linalg.lstsq(A, a, rcond=None)
    assert np.std(a - A @ solution) < 0.01 * np.std(a)
    names = [c.name for c in motion.plant.coordinates]
    assert solution[0] == pytest.approx(RIGS[name].slopes["effort", names[0]], rel=0.01)


def test_dry_friction_leaves_the_slopes_as_they_are() -> None:
    rig = RIGS["pendulum"]
    dry = replace(rig, plant=Pendulum(**ROD, b_2c=0.03))
    found = {term.who: term for term in sign_terms(moved(dry))}
    assert {who: t.slope for who, t in found.items()} == pytest.approx(rig.slopes, rel=0.02)
    # b_2c/J_A is a tenth of the acceleration, of whose variance 1 % would be left; what is left are its switches
    assert all(t.total < 1e-3 for t in found.values())


def test_an_unmoved_body_has_no_row_and_throws_nobody() -> None:
    motion = moved(RIGS["cart-pendulum"])
    assert driven_row(replace(motion, rows=(1,)), np.ones(motion.t.size, bool)) == []
    # a cart that was not measured may have been thrown about: what it did is no term
    assert {term.who for term in sign_terms(replace(motion, rows=(1,)))} == {("theta", "theta")}
    still = replace(motion, u=0 * motion.u)
    assert ("effort", "x") not in {term.who for term in sign_terms(still)}


def test_a_body_slides_where_it_is_fast_or_speeds_up() -> None:
    """Of a cosine, below 2 % of its deviation in speed and 5 % in acceleration at once, only rest is still."""
    motion = moved(RIGS["pendulum"])
    t = motion.t
    v = np.where(t < 2, np.sin(3 * t), 0.0)
    a = np.select([t < 2, t < 2.5], [3 * np.cos(3 * t), 0.11], 0.0)  # of a deviation of 1.5: about to move
    resting = replace(motion, v=v[None], a=a[None], fades=np.array([0.02 * np.std(v)]))
    assert np.array_equal(resting.slides(0), t < 2.5)
    # where hardly anything moves, everything counts
    assert replace(resting, v=0 * v[None], a=0 * a[None]).slides(0).all()


@pytest.mark.parametrize("sigma", [0.0, 1e-2])
def test_smoothing_reaches_as_far_as_noise_asks_and_no_further(sigma: float) -> None:
    """Least an eighth of the period, most a 15th of the record; noise is then a hundredth of the variance."""
    dt, n = 5e-3, 4000
    t = np.arange(n) * dt
    clean = np.sin(2 * np.pi * 2.0 * t)
    width = quiet_width(clean + sigma * np.random.default_rng(1).normal(size=n), dt)
    assert width % 2 == 1
    if sigma == 0:
        # an eighth of 0.5 s is 12.5 samples
        assert width == 13
    else:
        assert 13 < width < 50  # a polynomial over half a period would bend
    assert quiet_width(np.random.default_rng(1).normal(size=n), dt) == pytest.approx(n // 15, abs=2)


@pytest.mark.parametrize("first", [True, False])
def test_of_a_record_with_a_gap_the_longest_stretch_is_the_motion(first: bool) -> None:
    """x = sin(5 t) and its derivatives, whose last reading before the gap is the last that counts."""
    t = np.arange(1200) * 0.01
    t = np.delete(t, slice(800, 900) if first else slice(300, 400))
    made = case(x=0.1 * np.sin(5 * t), u=np.cos(3 * t), drive="u", measured=("x",), t=t)
    made = replace(made, plant=find("rectilinear-1"), places={"x_1": made.places["q_x"]})
    found = motion_of(made)
    assert isinstance(found, SmoothedMotion)
    begin, end = (0.0, 7.99) if first else (4.0, 11.99)
    edge = 0.01 * (found.weights.size // 2)
    assert found.t[[0, -1]] == pytest.approx([begin + edge, end - edge], abs=1.5 * 0.01)
    assert found.command.size == 800
    assert found.q[0] == pytest.approx(0.1 * np.sin(5 * found.t), abs=2e-5)
    assert found.v[0] == pytest.approx(0.5 * np.cos(5 * found.t), abs=2e-3)
    assert found.a[0] == pytest.approx(-2.5 * np.sin(5 * found.t), abs=0.05)
    assert found.command == pytest.approx(np.cos(3 * (begin + 0.01 * np.arange(800))), abs=1e-9)
