"""Does the pump feed the swing, is the catch as sure as its theorem says, and does a hanging pendulum get up?"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from upright.control import design_swing_up
from upright.control.swing_up import AWAY, FADE, HOLDING, PARAMETERS, TRIPPED, body, swing_and_hold, swing_up
from upright.errors import BadInput
from upright.rig.makes import make_rig

MAKES = ("furuta", "linear")


@cache
def designed(make):
    return design_swing_up(make_rig(make))


@pytest.fixture(params=MAKES)
def law(request):
    return designed(request.param)


def frictionless(make):
    plant = make_rig(make).plant
    return replace(make_rig(make), plant=plant.replace(**{n: 0.0 for n in plant.names() if n.startswith("b_")}))


def crane(rig):
    """Lagrange's equations typed by hand: accelerations of the Furuta pendulum or of the one on a cart."""
    p = rig.plant
    m, l, J_A = p.m_p, p.l_cg, p.J_p + p.m_p * p.l_cg**2

    def rates(x, force):
        _, v, theta, w = x
        s, c = math.sin(theta), math.cos(theta)
        if rig.name.startswith("ECP 205"):
            spin = J_A - p.J_a
            M = [[p.J_d + m * p.r**2 + J_A * s**2 + p.J_a * c**2, -m * p.r * l * c], [-m * p.r * l * c, J_A]]
            f = [force - 2 * w * v * s * c * spin - m * l * p.r * s * w**2, -m * p.g * l * s + s * c * v**2 * spin]
        else:
            M = [[p.m_c + m, m * l * c], [m * l * c, J_A]]
            f = [force + m * l * s * w**2, -m * p.g * l * s]
        a = np.linalg.solve(M, f)
        return [v, a[0], w, a[1]]

    return rates


@pytest.mark.parametrize("make", MAKES)
def test_the_pump_always_feeds_the_swing(make):
    """With the middle's spring and damper off, the pivot's acceleration does work on the swing wherever that lacks
    energy, and takes it out beyond: dE/dt has the sign of E_upright - E, whatever the state."""
    rig = frictionless(make)
    law = replace(designed(make), body=body(rig), centre=0.0, damp=0.0, memory=0.0)
    rates, rng, T = crane(rig), np.random.default_rng(3), rig.period
    numbers = law.rule(rig, rig.plant.state()).parameters
    for _ in range(200):
        v, theta, w = rng.uniform(-1, 1), rng.uniform(-3, 3), rng.uniform(-12, 12)
        (u,), _ = swing_and_hold(0.0, (0.0, theta), (), (-v * T, theta - w * T, v, w, 0.0, 0.0, 0.0, 0.0), numbers)
        _, a, _, turning = rates([0.0, v, theta, w], rig.gain * u)
        lack = -float(law.body.energy(theta, w))
        fed = float(law.body.power(theta, w, a))
        if make == "linear":  # where nothing spins, dE/dt = J theta' theta'' + weight sin(theta) theta'
            assert fed == pytest.approx((law.body.J * turning + law.body.weight * math.sin(theta)) * w, abs=1e-9)
        if abs(math.cos(theta)) > 0.2 and abs(w) > 0.5 and abs(u) < rig.limit:
            assert np.sign(fed) == np.sign(lack)


def test_upright_at_rest_is_where_the_pump_wants_the_energy(law):
    assert law.body.energy(math.pi, 0.0) == 0.0
    assert law.body.energy(0.0, 0.0) == -2 * law.body.weight
    # on a resting pivot a pendulum with that energy passes the bottom with 2 omega (separatrix of the pendulum)
    assert law.body.energy(0.0, 2 * law.body.omega) == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("make", MAKES)
def test_the_catch_is_the_ellipsoid_of_twice_the_limit(make):
    rig = make_rig(make)
    law, model = designed(make), rig.linear("inverted")
    K = (model.B.T @ law.P)[0] * (rig.limit / 2) ** 2  # least cost with R = (2/limit)^2
    rng = np.random.default_rng(1)
    x = rng.normal(size=(4, 4000))
    x *= np.sqrt(law.sure / np.einsum("in,ij,jn->n", x, law.P, x))
    top = np.linalg.solve(law.P, K)
    top *= math.sqrt(law.sure / (top @ law.P @ top))
    assert np.abs(K @ x).max() <= 2 * rig.limit * (1 + 1e-9)
    assert K @ top == pytest.approx(2 * rig.limit)
    # all of it falls into x'Px less, if saturation leaves at least half the command
    for left in (0.5, 0.7, 1.0):
        A = model.A - left * model.B @ K[None]
        assert np.linalg.eigvalsh(law.P @ A + A.T @ law.P).max() <= 1e-9 * np.linalg.norm(law.P @ A)
    assert 0 < law.size <= 0.8 * law.sure


def test_every_rig_of_the_make_gets_up_and_stays(law):
    make = "furuta" if law.body.spin > 0 else "linear"
    for seed in range(1, 4):
        run = swing_up(make_rig(make, seed), law, seconds=10.0)
        assert run.up < 5.0  # so that five seconds are seen
        assert run.tripped == math.inf
        assert run.travel < law.travel
        assert run.peak <= law.limit


@pytest.mark.slow
@pytest.mark.parametrize("make", MAKES)
def test_scipy_finds_the_same_first_swings(make):
    """The commands of the law, held, through the equations of motion typed by hand."""
    rig = frictionless(make).replace(delay=0.0, lag=0.0, converter=0.0)
    run = swing_up(rig, replace(designed(make), body=body(rig)), seconds=0.8).trial
    rates, T = crane(rig), rig.period
    x = run.x[0]
    for k in range(run.t.size - 1):
        force = rig.gain * run.u[k]
        x = solve_ivp(lambda t, x, f=force: rates(x, f), (0, T), x, rtol=1e-10, atol=1e-12).y[:, -1]
    assert np.abs(run.x[:, 2]).max() > 0.5  # it did swing
    assert np.allclose(x, run.x[-1], rtol=0, atol=1e-6)
    if make == "linear":  # nothing but the drive pushes along the rail
        p = rig.plant
        along = (p.m_c + p.m_p) * x[1] + p.m_p * p.l_cg * math.cos(x[2]) * x[3]
        assert along == pytest.approx(rig.gain * run.u[:-1].sum() * T, abs=1e-8)


@pytest.mark.parametrize("longer", [0.9, 1.15])
def test_a_model_of_another_energy_is_made_up_for(longer, monkeypatch):
    """The model's energy of upright is 10 to 15 % off: a swing that turns short asks for more until one stands."""
    rig = make_rig("linear").changed(l_cg=longer * make_rig("linear").plant.l_cg)
    assert swing_up(rig, designed("linear"), seconds=10.0).up < 5.0
    monkeypatch.setattr("upright.control.swing_up.LEARN", 0.0)
    assert swing_up(rig, designed("linear"), seconds=10.0).up == math.inf


def test_a_pendulum_pushed_over_is_swung_up_again():
    rig = make_rig("furuta", 1)
    law, push = designed("furuta"), np.zeros(5300)
    push[4500:4600] = 12.0 * rig.limit  # for a tenth of a second, against whatever the law says
    run = swing_up(rig, law, seconds=12.0, pushes=push)
    assert len(run.falls) == 1
    fall = round(run.falls[0] / rig.period)
    assert abs(run.angle[fall]) == pytest.approx(AWAY, abs=0.05)
    assert run.falls[0] < run.handovers[-1] < run.up < 10.0


def test_the_handover_makes_no_step_in_the_command(law):
    make = "furuta" if law.body.spin > 0 else "linear"
    run = swing_up(make_rig(make), law, seconds=5.0)
    k = int(np.flatnonzero(run.mode == HOLDING)[0])
    steps = np.abs(np.diff(run.trial.u))
    later = steps[k + 1 : k + round(10 * FADE / law.period)].max()  # counts through the differences
    assert steps[k - 1 : k + 1].max() <= later


def test_the_end_of_the_travel_switches_the_drive_off_for_good():
    rig = make_rig("linear")
    law = replace(designed("linear"), travel=0.05)
    run = swing_up(rig, law, seconds=5.0)
    off = run.trial.t >= run.tripped
    assert run.tripped < 3.0
    assert np.all(run.trial.u[off] == 0.0)
    assert np.all(run.mode[off] == TRIPPED)


def test_the_numbers_of_the_law_are_named(law):
    rule = law.rule(make_rig("linear"), np.zeros(4))
    numbers = dict(zip(PARAMETERS, np.asarray(rule.parameters), strict=True))
    assert numbers["kappa"] == law.body.kappa
    assert numbers["p23"] == law.P[2, 3]


def test_only_a_pendulum_on_a_driven_body_is_swung_up():
    with pytest.raises(BadInput, match="needs a pendulum theta on a driven body"):
        design_swing_up(make_rig("torsional"))
    with pytest.raises(BadInput, match="allow more"):
        design_swing_up(make_rig("linear"), travel=1e-3)
