"""Is smooth motion integrated to the order that is claimed, in every lane alike?"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tests.simulation.conftest import BLOCK, FURUTA
from upright.errors import BadInput
from upright.physics.equations import Derived
from upright.simulation import Held, ensemble, simulate


def lagrange(_, x, p):
    """Eq. (3) with its errata put right, typed out here as an independent check."""
    psi_d, th, th_d = x[1], x[2], x[3]
    s, c = np.sin(th), np.cos(th)
    J_A = p["J_p"] + p["m_p"] * p["l_cg"] ** 2
    e = p["m_p"] * p["r"] * p["l_cg"]
    M = [[p["J_d"] + p["m_p"] * p["r"] ** 2 + J_A * s * s + p["J_a"] * c * c, -e * c], [-e * c, J_A]]
    f = [
        -2 * th_d * psi_d * s * c * (J_A - p["J_a"]) - e * s * th_d**2 - p["b_1"] * psi_d,
        -p["m_p"] * p["g"] * p["l_cg"] * s + s * c * psi_d**2 * (J_A - p["J_a"]) - p["b_2"] * th_d,
    ]
    a = np.linalg.solve(M, f)
    return [psi_d, a[0], th_d, a[1]]


def test_a_rotary_pendulum_follows_an_independent_integrator(rotary):
    p = {**FURUTA, "b_1": 5e-3, "b_2": 2e-4}
    x0 = [0.1, 1.0, 1.5, -2.0]
    r = solve_ivp(lagrange, (0, 2), x0, args=(p,), method="DOP853", rtol=1e-13, atol=1e-13)
    x = simulate(rotary, p, x0, None, 1e-3, samples=2001, substeps=4)
    assert np.allclose(x[-1, :, 0], r.y[:, -1], rtol=0, atol=1e-9)


def test_halving_the_step_divides_the_error_by_16(rotary):
    p, x0 = {**FURUTA, "b_1": 5e-3}, [0.0, 1.0, 1.5, 0.0]
    fine = simulate(rotary, p, x0, None, 0.02, samples=51, substeps=256)[-1]
    error = [np.abs(simulate(rotary, p, x0, None, 0.02, samples=51, substeps=n)[-1] - fine).max() for n in (8, 16, 32)]
    order = np.log2(np.array(error[:-1]) / error[1:])
    assert np.all(order > 3.8), order


@pytest.mark.parametrize("friction", [0.0, 2e-3])
def test_lanes_equal_the_path_of_a_single_motion(rotary, friction):
    rng = np.random.default_rng(1)
    x0 = rng.uniform(-1, 1, (19, 4))
    p = {**FURUTA, "m_p": rng.uniform(0.1, 0.3, 19), "b_1c": friction, "b_2c": friction}
    u = 0.05 * rng.standard_normal(300)
    together = simulate(rotary, p, x0, u, 2e-3, samples=301)
    for i in (0, 15, 16, 18):
        alone = simulate(rotary, {**p, "m_p": p["m_p"][i]}, x0[i], u, 2e-3, samples=301)
        # the order of additions may differ between the two: rounding, amplified over 0.6 s
        assert np.allclose(together[:, :, i], alone[:, :, 0], rtol=0, atol=1e-11)


@pytest.mark.parametrize("friction", [0.0, 2e-3])
def test_a_lane_that_diverges_stays_alone_and_is_seen(rotary, friction):
    x0 = np.tile([0.1, 0.2, 0.3, 0.4], (20, 1))
    x0[7, 2] = np.nan
    m_p = np.full(20, 0.2)
    m_p[11] = np.inf
    p = {**FURUTA, "b_1c": friction}
    x = simulate(rotary, {**p, "m_p": m_p}, x0, None, 1e-3, samples=101)
    alone = simulate(rotary, p, x0[0], None, 1e-3, samples=101)
    good = [i for i in range(20) if i not in (7, 11)]
    assert np.allclose(x[:, :, good], alone, rtol=0, atol=1e-13)
    assert not np.isfinite(x[-1, :, [7, 11]]).all(axis=1).any()
    e = ensemble(rotary, {**p, "m_p": m_p}, x0, None, 1e-3, samples=101)
    assert np.array_equal(np.isfinite(e.final).all(axis=0), np.isfinite(x[-1]).all(axis=0))
    assert np.array_equal(np.isnan(e.largest[0]), ~np.isfinite(x[-1]).all(axis=0))


def probe(argument: str) -> Derived:
    """Its coordinate y is accelerated by sin(x), its coordinate z by cos(x), x itself stands still."""
    return Derived(
        name="Probe",
        coordinates=("x", "y", "z"),
        inputs=("F",),
        parameters=("one",),
        lumps=("one",),
        trig=(("s0", "c0", argument),),
        steps=(),
        mass=("k0", "0", "0", "k0", "0", "k0"),
        force=("0*F", "s0", "c0"),
        stiffness=("0",) * 9,
        damping=("0",) * 9,
        gain=("0", "0", "0"),
        kinetic="0",
        potential="0",
        power_lost="0",
    )


@pytest.mark.parametrize(("reach", "bound"), [(1e3, 2.3e-16), (1e5, 2.3e-16)])
def test_sine_and_cosine_are_right_to_rounding(reach, bound):
    # constant acceleration over one step of one second: the velocity is the sine itself (to one more rounding)
    rng = np.random.default_rng(0)
    x = np.concatenate([rng.uniform(-reach, reach, 4000), np.arange(-40, 41) * np.pi / 4, [reach, -reach]])
    x0 = np.zeros((x.size, 6))
    x0[:, 0] = x
    v = simulate(probe("x"), {"one": 1.0}, x0, None, 1.0, samples=2)[1]
    assert np.abs(v[3] - np.sin(x)).max() <= 2 * bound
    assert np.abs(v[5] - np.cos(x)).max() <= 2 * bound


def test_energy_is_conserved_without_friction(rotary):
    x = simulate(rotary, FURUTA, [0.0, 3.0, 2.0, 0.0], None, 1e-3, samples=1001, substeps=4, every=10)
    scope = {**FURUTA, "sin": np.sin, "cos": np.cos}
    names = ("psi", "psi_dot", "theta", "theta_dot")
    energy = eval(f"({rotary.kinetic}) + ({rotary.potential})", scope, {n: x[:, i, 0] for i, n in enumerate(names)})
    assert np.ptp(energy) < 1e-9 * np.abs(energy).max()


def test_a_pendulum_on_a_pivot_held_in_harmonic_motion_swings_as_computed_by_hand(pair):
    # block 2 hangs by a spring k on block 1, which is moved as A sin(w t): x2'' = k/m (A sin(w t) - x2)
    A, w, k, m, dt, n = 0.1, 3.0, 20.0, 0.8, 5e-3, 401
    p = {"m_1": 1.0, "m_2": m, "k": k, "k_w": 0.0}
    t = np.arange(n) * dt
    w0 = np.sqrt(k / m)
    c = A * w0**2 / (w0**2 - w**2)
    exact = c * (np.sin(w * t) - w / w0 * np.sin(w0 * t))
    half = np.arange(2 * (n - 1) + 1) * dt / 2
    given = Held(q=A * np.sin(w * half), v=A * w * np.cos(w * half), a=-A * w * w * np.sin(w * half))
    # RK4 leaves (w0 dt)^5/120 of the amplitude per step, 400 steps: 3e-9; the spline (w dt)^4 of A at its ends
    for held, tolerance in ((given, 1e-8), (Held(q=A * np.sin(w * t)), 1e-6)):
        x = simulate(pair, p, [0.0, 0.0, 0.0, 0.0], None, dt, samples=n, held={"x1": held})
        assert np.allclose(x[:, 2, 0], exact, rtol=0, atol=tolerance)
        assert np.allclose(x[:, 0, 0], A * np.sin(w * t), rtol=0, atol=1e-15)


def test_the_others_feel_the_acceleration_of_a_held_coordinate(rotary):
    # hanging pendulum, arm accelerated constantly: small about the tilted rest tan(theta) = r a / g for small psi_dot
    a, dt, n = 0.5, 1e-3, 101
    t = np.arange(2 * (n - 1) + 1) * dt / 2
    held = {"psi": Held(q=a * t * t / 2, v=a * t, a=np.full(t.size, a))}
    x = simulate(rotary, FURUTA, [0, 0, 0, 0], None, dt, samples=n, held=held)
    J_A = FURUTA["J_p"] + FURUTA["m_p"] * FURUTA["l_cg"] ** 2
    e, w2 = FURUTA["m_p"] * FURUTA["r"] * FURUTA["l_cg"], FURUTA["m_p"] * 9.81 * FURUTA["l_cg"] / J_A
    rest = e * a / (J_A * w2)
    exact = rest * (1 - np.cos(np.sqrt(w2) * t[::2]))
    # neglected: sin(theta) - theta and the centrifugal term, both of third order in 6e-3 rad and 5e-2 rad/s
    assert np.allclose(x[:, 2, 0], exact, rtol=0, atol=2e-5 * rest)


def test_a_locked_arm_leaves_a_plain_pendulum(rotary):
    x = simulate(rotary, FURUTA, [[0.3, 0, 1.0, 0], [0.7, 0, 1.0, 0]], None, 1e-3, samples=501, held={"psi": Held()})
    J_A = FURUTA["J_p"] + FURUTA["m_p"] * FURUTA["l_cg"] ** 2
    w2 = FURUTA["m_p"] * 9.81 * FURUTA["l_cg"] / J_A
    r = solve_ivp(lambda _, y: [y[1], -w2 * np.sin(y[0])], (0, 0.5), [1.0, 0.0], rtol=1e-12, atol=1e-12)
    assert np.allclose(x[-1, 2], r.y[0, -1], rtol=0, atol=1e-9)
    assert np.all(x[:, 0] == [0.3, 0.7])


def test_lanes_may_start_anywhere_in_the_record(rotary):
    rng = np.random.default_rng(2)
    u, x0 = 0.02 * rng.standard_normal(200), rng.uniform(-0.5, 0.5, (4, 4))
    start = np.array([0, 31, 77, 150])
    p = {**FURUTA, "b_2c": 1e-4}
    x = simulate(rotary, p, x0, u, 2e-3, samples=41, start=start)
    for i, s in enumerate(start):
        alone = simulate(rotary, p, x0[i], u[s:], 2e-3, samples=41)
        assert np.allclose(x[:, :, i], alone[:, :, 0], rtol=0, atol=1e-12)


def test_threads_change_nothing(rotary):
    x0 = np.random.default_rng(3).uniform(-1, 1, (200, 4))
    one = simulate(rotary, FURUTA, x0, None, 1e-3, samples=51)
    assert np.array_equal(one, simulate(rotary, FURUTA, x0, None, 1e-3, samples=51, threads=2))


def test_threads_change_nothing_in_an_ensemble_that_sticks(rotary):
    x0 = np.random.default_rng(4).uniform(-1, 1, (200, 4))
    p = {**FURUTA, "b_1c": 3e-2, "b_2c": 1e-2}
    one = ensemble(rotary, p, x0, None, 1e-3, samples=101, threads=1)
    two = ensemble(rotary, p, x0, None, 1e-3, samples=101, threads=2)
    for name in ("largest", "error", "saturated", "final"):
        assert np.array_equal(getattr(one, name), getattr(two, name))


def test_wrong_calls_are_answered_in_sentences(rotary, block):
    with pytest.raises(BadInput, match="did you mean 'm_p'"):
        simulate(rotary, {**FURUTA, "mp": 1.0}, [0, 0, 0, 0], None, 1e-3, samples=2)
    with pytest.raises(BadInput, match="needs a value for m_p"):
        simulate(rotary, {}, [0, 0, 0, 0], None, 1e-3, samples=2)
    with pytest.raises(BadInput, match=r"x0 needs shape \(4,\)"):
        simulate(rotary, FURUTA, [0, 0], None, 1e-3, samples=2)
    with pytest.raises(BadInput, match="u needs shape"):
        simulate(block, BLOCK, [0, 0], np.zeros((5, 3)), 1e-3, samples=2)
    with pytest.raises(BadInput, match="has 2 lanes where others have 3"):
        simulate(block, {**BLOCK, "m": np.ones(3)}, np.zeros((2, 2)), None, 1e-3, samples=2)
    with pytest.raises(BadInput, match="no coordinate 'phi'"):
        simulate(block, BLOCK, [0, 0], None, 1e-3, samples=2, held={"phi": Held()})


def test_a_plant_whose_every_coordinate_is_moved_by_hand_follows_the_hand():
    from upright.physics import Pendulum

    t = np.arange(101) * 0.01
    q = np.sin(3.0 * t)
    x = simulate(Pendulum(m_p=0.2, l_cg=0.3, J_p=1e-3), {}, [0.0, 3.0], None, 0.01, samples=t.size,
                 held={"theta": Held(q=q)})[:, :, 0]  # fmt: skip
    np.testing.assert_allclose(x[:, 0], q, atol=1e-12)
    # a cubic spline's slope on steps h is off by less than its end conditions' h^3 max|q''''| / 24
    np.testing.assert_allclose(x[:, 1], 3.0 * np.cos(3.0 * t), atol=0.01**3 * 81 / 24)
