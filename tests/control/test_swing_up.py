"""Does the pump feed the swing, is the catch as sure as its theorem says, and does a hanging pendulum get up?"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from upright.control import Trial, design_swing_up, trial
from upright.control.swing_up import (
    AWAY,
    FADE,
    HOLDING,
    PARAMETERS,
    SWINGING,
    TRAVEL,
    TRIPPED,
    UPRIGHT,
    Ascent,
    Body,
    _within,
    ascent_of,
    body,
    swing_and_hold,
)
from upright.errors import BadInput, RigStopped
from upright.records import Record
from upright.rig.makes import make_rig
from upright.rigs import Board, Limits, TwinPort
from upright.rigs.protocol import Fault
from upright.rigs.supervisor import Duty, Supervisor

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


def swing_up(rig, law, *, seconds, pushes=None):
    """What the law comes to on a rig that hangs at rest."""
    plant = rig.plant
    rule, start = law.rule(rig, plant.state("hanging")), plant.state("hanging") - plant.state("inverted")
    return ascent_of(trial(rig, rule, at="inverted", start=start, seconds=seconds, pushes=pushes), law, rule)


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


def test_where_all_of_the_sure_ellipsoid_rests_the_catch_is_four_fifths_of_it():
    """A feedback that knows the speeds, held from sample to sample and cut at the limit, typed by hand on eq. (3)."""
    rig = frictionless("linear")
    law, p = designed("linear"), rig.plant
    rng, J_A = np.random.default_rng(4), p.J_p + p.m_p * p.l_cg**2
    rose = rng.normal(size=(4, 20_000))
    x = np.linalg.inv(np.linalg.cholesky(law.P)).T @ (rose / np.linalg.norm(rose, axis=0)) * math.sqrt(law.sure)
    caught = (np.abs(x[2]) <= 0.5) & (np.abs(x[1]) <= law.fast) & (np.abs(x[0]) <= law.travel / 2)
    x = x[:, caught][:, :100]

    def rates(x, force):
        s, c = np.sin(math.pi + x[2]), np.cos(math.pi + x[2])
        push, turn = force + p.m_p * p.l_cg * s * x[3] ** 2, -p.m_p * p.g * p.l_cg * s
        D = (p.m_c + p.m_p) * J_A - (p.m_p * p.l_cg * c) ** 2
        a, alpha = J_A * push - p.m_p * p.l_cg * c * turn, (p.m_c + p.m_p) * turn - p.m_p * p.l_cg * c * push
        return np.array([x[1], a / D, x[3], alpha / D])

    for _ in range(round(2.5 / rig.period)):
        force, h = rig.gain * np.clip(-law.K @ x, -rig.limit, rig.limit), rig.period
        middle = x + h / 2 * rates(x, force)
        x = x + h * rates(middle, force)  # the midpoint rule: (omega h)^2 is 1e-4
        assert np.abs(x[0]).max() < law.travel
    assert np.abs(x[2]).max() < 0.1
    assert law.size == pytest.approx(0.8 * law.sure)


@pytest.mark.parametrize("make", MAKES)
def test_a_pump_of_bounded_acceleration_moves_its_body_no_faster_than_that_allows(make):
    """Spring and damper pushed by any signal within ``reach``: its size times the integral of the absolute impulse
    response bounds place and speed, coth(pi s/(2 sqrt(1 - s^2)))/centre for a place with damping s."""
    law = designed(make)
    w, s = math.sqrt(law.centre), law.damp / (2 * math.sqrt(law.centre))
    wd = w * math.sqrt(1 - s**2)
    t = np.linspace(0, 20 / (s * w), 200_001)
    place = np.exp(-s * w * t) * np.sin(wd * t) / wd
    assert np.trapezoid(np.abs(place), t) == pytest.approx(
        1 / law.centre / math.tanh(math.pi * s / 2 / math.sqrt(1 - s**2)), rel=1e-4
    )
    speed = law.reach * np.trapezoid(np.abs(np.gradient(place, t)), t)
    rig = frictionless(make).replace(limit=100.0 * make_rig(make).limit)  # the force is never short
    run = swing_up(rig, replace(law, body=body(rig), limit=rig.limit), seconds=1.5)
    assert np.all(run.mode == SWINGING)
    x = run.trial.x
    assert np.abs(x[:, 1]).max() <= speed
    assert np.abs(x[:, 0]).max() <= law.reach / law.centre / math.tanh(math.pi * s / 2 / math.sqrt(1 - s**2))
    # a square wave at the pendulum's own frequency, by its first harmonic: no swing keeps the pump slower
    omega = law.body.omega
    slowest = 4 / math.pi * law.reach * omega / math.hypot(law.centre - omega**2, law.damp * omega)
    assert np.abs(x[:, 1]).max() >= slowest


TIGHT = {"furuta": (1.3, 8.0), "linear": (0.15, 0.44)}
"""Travel and speed at which the law for the whole travel would be stopped."""


@cache
def tight(make):
    travel, speed = TIGHT[make]
    return design_swing_up(make_rig(make), travel=travel, speeds=(speed, 20.0))


def supervised(make, seed, law, stop_at=math.inf):
    """Farthest and fastest of the body of a drawn rig that swings up beside its supervisor, how it ended, and whether
    it stands; with a stop that brakes after a time, and then until it has come to rest."""
    travel, speed = TIGHT[make]
    known = make_rig(make)
    limits = Limits(travel=(travel, math.inf), speed=(speed, math.inf), start=(math.inf,) * 2, command=known.limit)
    port = TwinPort(make_rig(make, seed))
    rig = Board(port)
    beside = Supervisor(rig, Duty(limits=limits, model=known, at="inverted", zero="hanging", watch=False))
    beside.prepare()
    beside.aim(law.rule(known, known.plant.state("hanging")))
    beside.start()
    tick, far, fast, said = rig.exchange(0.0), 0.0, 0.0, ""
    for k in range(round(8.0 / known.period)):
        try:
            if k * known.period >= stop_at:
                beside.give_up(Fault.SATURATION, "asked for")
            tick = rig.exchange(beside.step(tick))
        except RigStopped as stop:
            said = str(stop)
            break
        far, fast = max(far, abs(port.x[0])), max(fast, abs(port.x[1]))
    for _ in range(round(0.35 / known.period) if said else 0):
        rig.alone(known.period)
        far = max(far, abs(port.x[0]))
    return far, fast, said, abs(math.remainder(port.x[2] - math.pi, math.tau)) < UPRIGHT


@pytest.mark.slow
@pytest.mark.parametrize("make", MAKES)
def test_a_designed_swing_up_is_not_stopped_where_one_for_the_whole_travel_is(make):
    travel, speed = TIGHT[make]
    for seed in (1, 2):
        far, fast, said, stands = supervised(make, seed, tight(make))
        assert (said, stands) == ("", True), seed
        assert far < travel
        assert fast < speed
    whole = _within(make_rig(make), body(make_rig(make)), travel, travel, 0.8)
    assert any(supervised(make, seed, whole)[2] for seed in (1, 2))


@pytest.mark.parametrize("make", MAKES)
@pytest.mark.slow
def test_a_swing_up_that_is_stopped_at_any_moment_ends_within_its_travel(make):
    rng = np.random.default_rng(4)
    for moment in rng.uniform(0.5, 4.0, 4):
        far, _, said, _ = supervised(make, 2, tight(make), moment)
        assert said.startswith("Asked for")
        assert far <= TIGHT[make][0], moment


@pytest.mark.slow
def test_where_no_swing_up_can_be_stopped_in_time_a_sentence_says_what_is_missing():
    rig = make_rig("linear")
    with pytest.raises(BadInput, match=r"with 0\.\d+ m/s, of 0\.2, .* allow more travel or speed"):
        design_swing_up(rig, speeds=(0.2, math.inf))
    omega = designed("linear").body.omega
    with pytest.raises(BadInput, match=f"passes the bottom with {2 * omega:.3g} rad/s"):
        design_swing_up(rig, speeds=(math.inf, 2.05 * omega))


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


def oracle(t, y, z, p):
    """The pump and the feedback as the docstrings of `swing_and_hold` and `Body` state them, in matrices."""
    n = dict(zip(PARAMETERS, p, strict=True))
    q, theta = y[0] * n["scale_q"], y[1] * n["scale_theta"]
    v, w = (n["memory"] * z[2 + i] + (1 - n["memory"]) * (x - z[i]) / n["period"] for i, x in enumerate((q, theta)))

    def upright(angle):
        return math.remainder(angle - math.pi, math.tau)

    phi, before = upright(theta), upright(z[1])
    x = np.array([q, v, phi, w])
    P = np.array([[n[f"p{min(i, j)}{max(i, j)}"] for j in range(4)] for i in range(4)])
    hold = float(np.clip(-np.array([n[f"k{i}"] for i in range(4)]) @ x, -n["limit"], n["limit"]))
    missing = n["weight"] * (1 + z[6] + math.cos(theta)) - n["J"] * w**2 / 2
    aim, event = z[6], z[7]
    if t - event > n["pause"] and math.cos(theta) < 0 and missing < 5 * n["learn"] * n["weight"]:
        if w * z[3] < 0:
            aim, event = min(aim + n["learn"], 10 * n["learn"]), t
        elif phi * before < 0:
            aim, event = max(aim - n["learn"], -10 * n["learn"]), t
    along = -np.sign(n["kappa"] * math.cos(theta) * w) or 1.0
    a = float(np.clip(n["sharp"] * missing / n["weight"], -1, 1)) * n["reach"] * along - n["centre"] * q - n["damp"] * v
    s, c = math.sin(theta), math.cos(theta)
    # unknown: the pendulum's acceleration and the force, of the two equations of `Body`
    _, force = np.linalg.solve(
        [[n["kappa"] * c, -1.0], [n["J"], 0.0]],
        [-(n["M"] + n["spin"] * s**2) * a + n["kappa"] * s * w**2 - 2 * n["spin"] * s * c * w * v - n["viscous"] * v,
         -n["kappa"] * c * a - n["weight"] * s + n["spin"] * s * c * v**2],
    )  # fmt: skip
    swing = float(np.clip((force + (n["dry"] if a > 0 else -n["dry"])) / n["gain"], -n["limit"], n["limit"]))
    mode, bump = z[4], z[5] * n["fade"]
    if mode == SWINGING:
        u = swing
        if x @ P @ x <= n["size"] and abs(phi) <= n["near"] and abs(v) <= n["fast"]:
            mode, bump, aim = HOLDING, swing - hold, 0.0
    elif abs(phi) > n["away"]:
        mode, bump, u = SWINGING, 0.0, swing
    else:
        u = hold + bump
    u += n["lost"] * float(np.clip(u / (0.05 * n["limit"]), -1, 1))
    if abs(q) > n["allowed"] or z[4] == TRIPPED:
        mode, u = TRIPPED, 0.0
    return float(np.clip(u, -n["limit"], n["limit"])), (q, theta, v, w, mode, bump, aim, event)


def test_one_sample_of_the_law_is_what_its_equations_say():
    """Numbers without anything in common, so that none stands in for another; states about every one of its edges."""
    rng, seen = np.random.default_rng(8), []
    for case in range(900):
        numbers = dict(zip(PARAMETERS, rng.uniform(0.3, 1.7, len(PARAMETERS)), strict=True))
        numbers |= {
            "period": 0.1, "memory": rng.uniform(0, 0.9), "learn": 0.1, "kappa": rng.choice([-0.7, 0.8]),
            "limit": rng.choice([2.0, 50.0]), "size": rng.uniform(0.1, 3.0), "near": 0.5, "away": 0.7,
            "allowed": rng.choice([0.6, 3.0]), "scale_theta": rng.uniform(0.9, 1.1), "gain": rng.choice([-1.2, 1.3]),
            "sharp": 4.0, "pause": 0.4,
        }  # fmt: skip
        p = [numbers[n] for n in PARAMETERS]
        about = rng.choice([0.0, math.pi, -math.pi, 3 * math.pi])
        theta = (about + rng.normal() * 0.5) / numbers["scale_theta"]
        w = rng.normal() * 2
        z = (
            rng.normal() * 0.4, theta * numbers["scale_theta"] - 0.1 * w, rng.normal() * 0.5, rng.normal() * 2,
            rng.choice([SWINGING, HOLDING, TRIPPED], p=[0.6, 0.35, 0.05]), rng.normal() * 0.3,
            rng.choice([0.0, 0.05, 0.95, 1.0, -0.95]), 0.0,
        )  # fmt: skip
        t, y = rng.uniform(0, 0.8), (rng.normal() * 0.4, theta)
        (u,), after = swing_and_hold(t, y, (), z, p)
        expected, state = oracle(t, y, z, p)
        assert u == pytest.approx(expected, rel=1e-9, abs=1e-9), case
        assert after == pytest.approx(state, rel=1e-9, abs=1e-9), case
        seen.append((z[4], after[4], after[6] - z[6] if after[4] == SWINGING else 0.0))
    # every change of what it does came about, and it learnt up and down
    pairs = {(a, b) for a, b, _ in seen}
    assert pairs == {(SWINGING, SWINGING), (SWINGING, HOLDING), (SWINGING, TRIPPED), (HOLDING, SWINGING),
                     (HOLDING, HOLDING), (HOLDING, TRIPPED), (TRIPPED, TRIPPED)}  # fmt: skip
    assert {round(learnt, 3) for *_, learnt in seen} >= {0.0, 0.1, 0.05, -0.1, -0.05}


@pytest.mark.parametrize(("theta", "wanted"), [(math.pi + 0.5, 1.0), (math.pi + 0.5 + 1e-9, 0.0)])
def test_the_catch_reaches_to_its_bounds_and_the_hold_to_its_own(theta, wanted):
    numbers = dict.fromkeys(PARAMETERS, 0.0) | {"scale_q": 1.0, "scale_theta": 1.0, "period": 1.0, "memory": 1.0}
    numbers |= {"J": 1.0, "weight": 1.0, "gain": 1.0, "limit": 1.0, "away": 0.7}
    numbers |= {"allowed": 0.3}
    near = (math.pi + 0.5) - math.pi
    p = [(numbers | {"near": near})[n] for n in PARAMETERS]
    assert swing_and_hold(0.0, (0.0, theta), (), (0.0,) * 8, p)[1][4] == wanted
    # the travel's end itself is still within
    assert swing_and_hold(0.0, (0.3, 0.0), (), (0.0,) * 8, p)[1][4] == SWINGING
    assert swing_and_hold(0.0, (0.3 + 1e-9, 0.0), (), (0.0,) * 8, p)[1][4] == TRIPPED


def test_a_body_is_eq_3_with_the_rig_s_numbers():
    cart = make_rig("linear")
    p = cart.plant
    made = body(cart)
    J_A = p.J_p + p.m_p * p.l_cg**2
    assert pytest.approx(p.m_c + p.m_p) == made.M
    assert made.spin == pytest.approx(0.0, abs=1e-12)
    assert (made.kappa, made.J) == pytest.approx((p.m_p * p.l_cg, J_A))
    assert made.weight == pytest.approx(p.m_p * p.g * p.l_cg)
    assert (made.viscous, made.dry) == pytest.approx((p.b_1, p.b_1c))
    arm = make_rig("furuta")
    p = arm.plant
    made = body(arm)
    J_A = p.J_p + p.m_p * p.l_cg**2
    assert pytest.approx(p.J_d + p.m_p * p.r**2 + p.J_a) == made.M
    assert made.spin == pytest.approx(J_A - p.J_a)
    assert (made.kappa, made.J) == pytest.approx((-p.m_p * p.r * p.l_cg, J_A))
    assert made.weight == pytest.approx(p.m_p * p.g * p.l_cg)
    assert (made.viscous, made.dry) == pytest.approx((p.b_1, p.b_1c))
    assert made.omega == pytest.approx(math.sqrt(p.m_p * p.g * p.l_cg / J_A))


def test_energy_and_power_of_a_swing_are_those_of_a_pendulum_on_a_moved_pivot():
    made = Body(M=1.0, spin=0.0, kappa=0.3, J=0.5, weight=2.0, viscous=0.0, dry=0.0)
    assert made.energy(math.pi / 2, 3.0) == pytest.approx(0.25 * 9 - 2.0)
    assert made.power(math.pi / 3, 2.0, 5.0) == pytest.approx(-0.3 * 0.5 * 2.0 * 5.0)


def test_the_law_begins_where_the_encoders_stand():
    rig = make_rig("furuta").replace(scales=(1.0, -2.0), counts=(100 * math.tau, 1000 * math.tau), converter=0.25)
    law = designed("furuta")
    still, held = law.rule(rig, [0.5, 0.1, 0.3, 0.2]), law.rule(rig, [0.5, 0.1, 0.3, 0.2], holding=True)
    # zeros where it hangs, in what is shown; switched on while it swings, speeds are not known, and no event was
    assert np.asarray(still.initial).ravel() == pytest.approx([0.5, -0.6, 0.0, 0.0, SWINGING, 0.0, 0.0, -1.0])
    assert np.asarray(held.initial).ravel() == pytest.approx([0.5, -0.6, 0.1, 0.2, HOLDING, 0.0, 0.0, -1.0])
    assert np.asarray(still.resolution) == pytest.approx([0.01, 0.0005])
    assert (still.command_resolution, still.measured, still.period) == (0.25, ("psi", "theta"), law.period)
    lanes = law.rule(rig, [[0.5, 0.1, 0.3, 0.2], [-0.25, 0.0, 0.1, 0.0]], holding=True)
    assert np.asarray(lanes.initial)[:, 1] == pytest.approx([-0.25, -0.2, 0.0, 0.0, HOLDING, 0.0, 0.0, -1.0])
    numbers = dict(zip(PARAMETERS, np.asarray(still.parameters), strict=True))
    of_law = ("period", "memory", "gain", "limit", "reach", "sharp", "centre", "damp", "size", "fast")
    assert {n: numbers[n] for n in of_law} == {n: getattr(law, n) for n in of_law}
    of_body = ("M", "spin", "kappa", "J", "weight", "viscous", "dry")
    assert {n: numbers[n] for n in of_body} == {n: getattr(law.body, n) for n in of_body}
    assert [numbers[f"k{i}"] for i in range(4)] == law.K.tolist()
    assert {f"p{i}{j}": numbers[f"p{i}{j}"] for i in range(4) for j in range(i, 4)} == {
        f"p{i}{j}": law.P[i, j] for i in range(4) for j in range(i, 4)
    }
    assert (numbers["scale_q"], numbers["scale_theta"], numbers["allowed"]) == (1.0, -2.0, law.travel)
    # a handover's step has fallen to 1/e after its time constant
    assert numbers["fade"] ** (FADE / law.period) == pytest.approx(1 / math.e)


def test_a_design_takes_limit_and_travel_from_the_rig_and_its_feedback_is_of_least_cost():
    rig = make_rig("linear")
    law = design_swing_up(rig.replace(travel=0.15, more={"actuator.force_limit": 0.8 * rig.limit * rig.gain}))
    assert law.travel == 0.15
    assert TRAVEL["rad"] == math.tau  # one turn of a cable, where no rig says
    assert law.limit == pytest.approx(0.8 * rig.limit)
    assert (law.period, law.gain) == (rig.period, rig.gain)
    # Bryson: a quarter of the travel, half a radian and half the limit cost alike
    model = rig.linear("inverted")
    Q, r = np.diag([(4 / law.travel) ** 2, 0, 1 / 0.5**2, 0]), 1 / (law.limit / 2) ** 2
    left = model.A.T @ law.P + law.P @ model.A - law.P @ model.B @ model.B.T @ law.P / r + Q
    assert np.abs(left).max() < 1e-6 * np.abs(Q).max()


def ascent(theta, mode, w=None, u=None, rig=None):
    """A run of a second a sample, as logged."""
    rig = rig or make_rig("linear")
    n = len(theta)
    t, x = np.arange(n, dtype=float), np.zeros((n, 4))
    x[:, 0] = -0.02 * np.arange(n)
    run = Trial(
        rig=rig, at="inverted", t=t, x=x, u=np.zeros(n) if u is None else np.array(u), rest=np.zeros(2),
        record=Record(t=t, signals={"u": t}),
    )  # fmt: skip
    speeds = np.column_stack([np.full(n, 9.0), np.zeros(n) if w is None else w])
    return Ascent(
        trial=run, law=designed("linear"), mode=np.array(mode, dtype=float), angle=np.array(theta), speeds=speeds,
        energy=np.zeros(n),
    )  # fmt: skip


def test_the_times_of_an_ascent_are_read_off_its_log():
    ten = math.radians(10)
    run = ascent([3.0, 2.0, ten, -1.0, ten, -ten, 0.0], [0, 0, 1, 0, 1, 1, 1], u=[0.0, 1.0, -3.0, 2.0, 0.0, 0.0, 0.0])
    assert run.up == 4.0  # ten degrees themselves are up
    assert run.handovers == (2.0, 4.0)
    assert run.falls == (3.0,)
    assert run.tripped == math.inf
    assert run.peak == 3.0
    assert run.travel == pytest.approx(0.12)
    assert ascent([0.0, 0.1], [1, 1]).up == 0.0
    assert ascent([0.0, 0.1, 2.0], [1, 1, 1]).up == math.inf
    assert ascent([0.0, 0.1, 2.0, 2.0], [0, 1, 2, 2]).tripped == 2.0


def test_half_swings_are_counted_to_the_first_handover():
    w = [0.0, 1.0, 0.2, 1.0, -1.0, -0.1, -2.0, 1.0, -1.0]
    assert ascent([0.0] * 9, [0] * 9, w).swings == 4
    assert ascent([0.0] * 9, [0] * 7 + [1] * 2, w).swings == 2
    assert ascent([0.0] * 9, [0] * 9, np.full(9, 0.2)).swings == 0


def test_saturation_of_an_ascent_is_that_of_the_drive_s_force():
    rig = make_rig("linear")
    weak = rig.replace(more={"actuator.force_limit": 0.5 * rig.limit * rig.gain})
    u = 0.5 * rig.limit * np.array([1.0, -1.0, 0.99, 0.0, 1.5])
    assert ascent([0.0] * 5, [0] * 5, u=u, rig=weak).saturated == pytest.approx(3 / 5)


def test_what_a_run_of_a_swing_up_shows_is_what_the_law_knew_after_each_sample():
    """A pendulum turned by hand at 2 rad/s, its encoder the wrong way round, and no filter."""
    rig = make_rig("linear").replace(scales=(1.0, -1.0), converter=0.0)
    law = replace(designed("linear"), memory=0.0)
    t = np.arange(5) * rig.period
    theta = 0.1 + 2.0 * t
    record = Record(
        t=t, signals={"x": 0.5 * t, "theta": -theta, "u": 0 * t}, units={"x": "m", "theta": "rad", "u": "V"},
        inputs=("u",), outputs=("x", "theta"),
    )  # fmt: skip
    run = Trial(rig=rig, at="inverted", t=t, x=np.zeros((5, 4)), u=0 * t, rest=np.zeros(2), record=record)
    found = ascent_of(run, law, law.rule(rig, [0.0, 0.0, 0.1, 0.0]))
    assert found.angle == pytest.approx(np.mod(-theta, math.tau) - math.pi)
    assert found.mode == pytest.approx(np.zeros(5))
    assert found.energy[1:] == pytest.approx(law.body.energy(theta[1:], np.full(4, 2.0)), rel=1e-3)
    assert found.speeds[1:] == pytest.approx(np.tile([0.5, -2.0], (4, 1)))
