"""What does a drive do that trips, brakes while it is powered and loses force at speed?"""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from tests.simulation.conftest import BLOCK, FURUTA
from upright.laws import state_feedback
from upright.simulation import ACTUATOR, Simulator, choose, ensemble, simulate

IDLE = {name: what.default for name, what in ACTUATOR.items()}


def piecewise(t, v0, pieces):
    """Speed at `t` under v' = F - r v, for pieces (begin, end, F, r)."""
    v = np.full(np.shape(t), v0)
    for begin, end, F, r in pieces:
        d = np.clip(t - begin, 0.0, end - begin)
        v = F / r + (v - F / r) * np.exp(-r * d)
    return v


@pytest.mark.slow
@pytest.mark.parametrize(
    ("start", "zero", "end", "tolerance"),
    [
        # every switch between two substeps: Runge-Kutta alone, (r h)^5/120 in each of 100 steps
        (0.12, 0.6, 1.04, 2e-10),
        # inside one: mean and first moment are right, so (r h)^3 remains of the switch
        (0.1133, 0.6, 1.0377, 2e-6),
    ],
)
def test_speed_dies_at_three_rates_commanded_idle_and_tripped(block, start, zero, end, tolerance):
    dt, n = 0.02, 101
    t = np.arange(n) * dt
    p = {**BLOCK, "c": 0.1, "actuator.gain": 2.0, "actuator.damping": 0.8, "actuator.standby": 0.3}
    p |= {"actuator.start": start, "actuator.end": end}
    truth = piecewise(
        t, 0.5, [(0, start, 0.0, 0.4), (start, zero, 2.0, 1.2), (zero, end, 0.0, 0.4), (end, 9.0, 0.0, 0.1)]
    )
    for lanes in (1, 3):
        x = simulate(block, p, [[0.0, 0.5]] * lanes, np.where(t < zero - 1e-9, 1.0, 0.0), dt, samples=n, substeps=2)
        assert np.allclose(x[:, 1].T, truth, rtol=0, atol=tolerance)


def test_an_idle_drive_brakes_less_only_once_its_delayed_command_is_zero(block):
    # the command ends at 0.5 s and arrives 0.03 s later, at the border of a sample
    t = np.arange(60) * 0.02
    p = {**BLOCK, "actuator.damping": 0.8, "actuator.standby": 0.3, "actuator.delay": 0.02, "actuator.offset": -1.0}
    x = simulate(block, p, [0.0, 1.0], np.where(t < 0.499, 1.0, 0.0), 0.02, samples=60)
    # with the offset there is no force before, and -1 after; whether it is commanded does not depend on the offset
    assert np.allclose(x[:, 1, 0], piecewise(t, 1.0, [(0, 0.52, 0.0, 1.1), (0.52, 9, -1.0, 0.3)]), rtol=0, atol=1e-9)


@pytest.mark.parametrize("name", ["start", "end"])
def test_the_force_given_grows_in_proportion_to_the_time_alive(block, name):
    # a free mass: speed and place are the first and second integral of the force, exactly
    dt, n, F = 0.02, 51, 1.5
    moments = np.linspace(0.3, 0.4, 1001)
    p = {**BLOCK, "actuator.gain": F, f"actuator.{name}": moments}
    x = simulate(block, p, [0.0, 0.0], np.ones(n), dt, samples=n, substeps=3)[-1]
    T = (n - 1) * dt
    alive = moments if name == "end" else T - moments
    place = moments * (T - moments / 2) if name == "end" else alive**2 / 2
    assert np.allclose(x[1], F * alive, rtol=0, atol=1e-13)
    assert np.allclose(x[0], F * place, rtol=0, atol=1e-13)


def test_the_slope_with_respect_to_the_trip_is_the_closed_form(block):
    # v(T) = v(e) exp(-c (T-e)) with v(e) = F/r (1 - exp(-r e)): what a fit of the trip's moment descends
    dt, n, F, r, c = 0.02, 61, 2.0, 1.4, 0.2
    end = np.linspace(0.5, 0.6, 501)
    p = {**BLOCK, "c": c, "actuator.gain": F, "actuator.damping": r - c, "actuator.end": end}
    v = simulate(block, p, [0.0, 0.0], np.ones(n), dt, samples=n, substeps=2)[-1, 1]
    at_trip = F / r * -np.expm1(-r * end)
    slope = (F - (r - c) * at_trip) * np.exp(-c * ((n - 1) * dt - end))
    # within the substep that holds the trip the slope is right to the order (r h)^2
    assert np.allclose(np.gradient(v, end)[1:-1], slope[1:-1], rtol=(r * dt / 2) ** 2, atol=0)


def curve(F, v, knee, fade):
    """Force left of `F` at speed `v`."""
    lost = fade * max(math.copysign(v, F * v) - knee, 0.0)
    return math.copysign(max(abs(F) - lost, 0.0), F)


@pytest.mark.parametrize(("F", "v0"), [(3.0, 0.0), (-3.0, 0.0), (3.0, 4.5), (-3.0, -4.5), (3.0, -4.5)])
def test_force_falls_beyond_the_knee_and_never_turns(block, F, v0):
    knee, fade, c, dt, n, substeps = 1.0, 1.2, 0.3, 0.02, 101, 20
    kinks = [knee, -knee, knee + abs(F) / fade, -knee - abs(F) / fade]
    t, truth, x = np.arange(n) * dt, [], np.array([v0])
    for _ in range(n):  # scipy stops at nothing: one piece per sample, kinks located to its tightest tolerance
        truth.append(x[0])
        left, now = dt, x
        while left > 1e-15:
            events = [lambda _, y, k=k: y[0] - k for k in kinks if abs(now[0] - k) > 1e-12]
            for e in events:
                e.terminal = True
            s = solve_ivp(
                lambda _, y: [curve(F, y[0], knee, fade) - c * y[0]], (0, left), now, events=events,
                method="DOP853", rtol=1e-13, atol=1e-13,
            )  # fmt: skip
            now, left = s.y[:, -1], left - s.t[-1]
        x = now
    p = {**BLOCK, "c": c, "actuator.gain": F, "actuator.knee": knee, "actuator.fade": fade}
    v = simulate(block, p, [0.0, v0], np.ones(n), dt, samples=n, substeps=substeps)[:, 1, 0]
    # a kink inside a step costs at most the jump of v'' over the step: fade |v'| h^2 / 2, at two kinks
    assert np.allclose(v, truth, rtol=0, atol=fade * (abs(F) + c * abs(v0)) * (dt / substeps) ** 2)
    assert t.size == len(truth)


def test_a_fading_drive_trips_in_the_middle_of_a_sample(block):
    # v' = F - fade (v - knee) until the trip, then coasting
    F, knee, fade, end = 3.0, 0.5, 2.0, 0.7131
    t = np.arange(60) * 0.02
    p = {**BLOCK, "actuator.gain": F, "actuator.knee": knee, "actuator.fade": fade, "actuator.end": end}
    v = simulate(block, p, [0.0, knee], np.ones(60), 0.02, samples=60, substeps=2)[:, 1, 0]
    # (fade h)^3 of the switch inside a substep
    assert np.allclose(v, knee + F / fade * -np.expm1(-fade * np.minimum(t, end)), rtol=0, atol=1e-5)


def test_order_of_convergence_away_from_kinks(block):
    # the speed keeps its sign, so that the torque-speed curve has no kink on the way
    p = {**BLOCK, "c": 0.3, "actuator.damping": 0.9, "actuator.standby": 0.4, "actuator.lag": 0.1}
    p |= {"actuator.knee": 1e-9, "actuator.fade": 0.5, "actuator.start": 0.2, "actuator.end": 0.8}
    u = 2.0 + np.cos(np.arange(40) * 0.4)

    def end(substeps):
        return simulate(block, p, [0.1, 1.0], u, 0.05, samples=40, substeps=substeps)[-1, :, 0]

    error = [np.abs(end(n) - end(243)).max() for n in (1, 3, 9)]
    assert np.log(error[0] / error[2]) / np.log(9) > 3.8, error


@pytest.mark.slow
def test_a_tripped_joint_slides_to_a_stop_where_it_should(block):
    F, F_c, end = 2.0, 0.7, 0.5077
    p = {**BLOCK, "F_c": F_c, "actuator.gain": F, "actuator.end": end}
    for lanes in (1, 2):
        x = simulate(block, p, np.zeros((lanes, 2)), np.ones(151), 0.02, samples=151, substeps=2)[-1]
        v = (F - F_c) * end
        assert np.allclose(x[0], v * end / 2 + v * v / (2 * F_c), rtol=0, atol=1e-12)
        assert (x[1] == 0.0).all()


@pytest.mark.slow
def test_a_braking_drive_and_dry_friction_stop_a_block_together(block):
    # v' = -d v - F_c ends at t = ln(1 + d v0/F_c)/d, after v0/d - F_c/d^2 ln(1 + d v0/F_c)
    v0, d, F_c = 2.0, 1.5, 0.4
    p = {**BLOCK, "F_c": F_c, "actuator.standby": d}
    x = simulate(block, p, [0.0, v0], None, 0.01, samples=300, substeps=2)[:, :, 0]
    log = math.log1p(d * v0 / F_c)
    assert np.isclose(x[-1, 0], v0 / d - F_c / d**2 * log, rtol=0, atol=1e-10)
    assert np.count_nonzero(x[:, 1]) == math.ceil(log / d / 0.01)


@pytest.mark.slow
@pytest.mark.parametrize("moved", [False, True])
def test_the_drive_brakes_an_arm_whose_pendulum_is_held(rotary, moved):
    # J psi'' = T - D psi' with the pendulum hanging still
    from upright.simulation import Held

    p = {**FURUTA, "actuator.damping": 0.02, "actuator.standby": 0.01, "actuator.end": 0.5}
    J = p["J_d"] + p["m_p"] * p["r"] ** 2 + p["J_a"]
    n, T = 101, 0.04
    x = simulate(
        rotary, p, np.zeros(4), np.full(n, T), 0.01, samples=n, substeps=2,
        held={"theta": Held(q=np.zeros(n)) if moved else Held()},
    )  # fmt: skip
    rate = 0.03 / J
    t = np.minimum(np.arange(n) * 0.01, 0.5)
    assert np.allclose(x[:, 1, 0], T / 0.03 * -np.expm1(-rate * t), rtol=0, atol=1e-7)


@pytest.mark.slow
def test_moments_count_from_the_first_sample_of_the_record(block):
    u = np.random.default_rng(0).standard_normal(120)
    p = {**BLOCK, "k": 20.0, "F_c": 0.05, "actuator.lag": 0.03, "actuator.start": 0.203, "actuator.end": 0.777}
    p |= {"actuator.damping": 0.5, "actuator.standby": 0.2, "actuator.knee": 0.02, "actuator.fade": 3.0}
    whole = simulate(block, p, [0.1, 0.0], u, 0.01, samples=121, substeps=2)[:, :, 0]
    start = np.array([0, 10, 50, 75, 90])
    x = simulate(block, p, whole[start], u, 0.01, samples=31, substeps=2, start=start)
    for i, s in enumerate(start):
        assert np.allclose(x[:, :, i], whole[s : s + 31], rtol=0, atol=1e-12)


@pytest.mark.slow
def test_a_drive_at_its_defaults_does_nothing(block):
    p = {**BLOCK, "k": 5.0, "F_c": 0.1}
    u = np.sin(np.arange(80) * 0.2)
    assert choose(block, {**p, **IDLE}) == choose(block, p)
    plain = simulate(block, p, [0.1, 0.0], u, 0.02, samples=80, substeps=2)[:, :, 0]
    flavour = choose(block, {**p, **IDLE}, free=list(IDLE))
    assert flavour.gate
    assert flavour.damping
    assert flavour.curve
    for lanes in (1, 17):
        s = Simulator(derived=block, flavour=flavour, dt=0.02, substeps=2)
        x = s.run(s.table(p, lanes), np.tile([[0.1], [0.0]], lanes), u[:, None], samples=80)
        assert np.allclose(np.moveaxis(x, 2, 0), plain, rtol=0, atol=1e-13)


@pytest.mark.parametrize(
    "name",
    ["start", "end", "damping", "standby", "knee", "fade", "relaxation", "droop", "force_limit", "damping_rise",
     "dead_zone"],
)  # fmt: skip
def test_a_lane_whose_drive_is_not_a_number_says_so(block, name):
    p = {**BLOCK, **IDLE, "actuator.fade": 1.0, "actuator.knee": 2.0, "actuator.damping": 0.5}
    p |= {f"actuator.{name}": np.array([math.nan, 0.5])}
    x = simulate(block, p, [0.1, 0.0], np.ones(10), 0.02, samples=10)
    assert np.isnan(x[-1, 0, 0])
    assert np.isfinite(x[:, :, 1]).all()


@pytest.mark.slow
def test_a_loop_that_trips_leaves_the_plant_to_itself(block):
    dt, K, n, trip = 0.02, np.array([6.0, 1.2]), 100, 50
    p = {**BLOCK, "m": 0.8, "k": 12.0, "c": 0.4, "actuator.damping": 0.6, "actuator.end": trip * dt}
    A = np.array([[0.0, 1.0], [-15.0, -0.5]])
    powered = A - np.diag([0.0, 0.6 / 0.8])
    step = expm(np.vstack([np.column_stack([powered, [0.0, 1.25]]), np.zeros((1, 3))]) * dt)
    x, before, path = np.array([0.3, 0.1]), 0.3, []
    for k in range(n):
        u, before = -K @ [x[0], (x[0] - before) / dt], x[0]
        path.append([*x, u])
        x = step[:2, :2] @ x + step[:2, 2] * u if k < trip else expm(A * dt) @ x
    loop = state_feedback(K, dt)
    y = simulate(block, p, [[0.3, 0.1]] * 2, None, dt, samples=n, substeps=10, loop=loop)
    # the command is recorded although nobody obeys it
    assert np.allclose(y.transpose(2, 0, 1), path, rtol=0, atol=1e-8)
    e = ensemble(block, p, [[0.3, 0.1]] * 2, None, dt, samples=n, substeps=10, loop=loop)
    assert np.allclose(e.final.T, path[-1][:2], rtol=0, atol=1e-8)


def wound(t, x0, pieces, k, c, relaxation):
    """Place and speed of a unit mass on a spring whose drive brakes by b, relaxation b' + b = D v; from b = 0."""
    x, out, reached = np.array([*x0, 0.0]), np.empty((t.size, 2)), 0.0
    for begin, end, F, D in pieces:
        A = np.array([[0, 1, 0], [-k, -c, -1], [0, D / relaxation, -1 / relaxation]])
        rest = -np.linalg.solve(A, [0, F, 0])
        for i in np.flatnonzero((t >= begin - 1e-12) & (t <= end + 1e-12)):
            out[i] = (rest + expm(A * (t[i] - begin)) @ (x - rest))[:2]
        x = rest + expm(A * (end - begin)) @ (x - rest)
        reached = end
    assert reached >= t[-1]
    return out


@pytest.mark.slow
@pytest.mark.parametrize("relaxation", [1e-3, 0.08, 5.0])
def test_braking_builds_up_and_fades_as_the_current_of_a_winding(block, relaxation):
    k, c, D, F, dt, n, off = 80.0, 0.3, 2.0, 1.5, 0.01, 201, 0.9
    t = np.arange(n) * dt
    truth = wound(t, (0.02, 0.0), [(0.0, off, F, D), (off, 3.0, 0.0, 0.0)], k, c, relaxation)
    p = {**BLOCK, "k": k, "c": c, "actuator.gain": F, "actuator.damping": D, "actuator.relaxation": relaxation}
    missed = []
    for substeps in (4, 8, 16):
        for lanes in (1, 3):
            x = simulate(block, p, [[0.02, 0.0]] * lanes, np.where(t < off - 1e-9, 1.0, 0.0), dt, samples=n,
                         substeps=substeps)  # fmt: skip
            assert np.array_equal(x[:, :, :1].repeat(lanes, 2), x)
        missed.append(np.abs(x[:, :, 0] - truth).max(axis=0) / np.abs(truth).max(axis=0))
    # the speed is taken to go on as in the substep before: second order in the substep
    assert np.all(missed[-1] < missed[0] / 8)
    assert np.all(missed[-1] < 1e-3)


def test_braking_that_needs_no_time_is_damping(block):
    dt, n = 0.01, 101
    u = np.ones(n)
    p = {**BLOCK, "k": 80.0, "actuator.damping": 0.7, "actuator.standby": 0.4}
    plain = simulate(block, p, [0.02, 0.0], u, dt, samples=n, substeps=16)
    quick = simulate(block, {**p, "actuator.relaxation": 1e-9}, [0.02, 0.0], u, dt, samples=n, substeps=16)
    # what the extrapolated speed misses: D (w h)^2 of the motion
    assert np.allclose(quick, plain, rtol=0, atol=1.1 * 80 * (dt / 16) ** 2 * np.abs(plain).max())


def test_a_mass_with_dry_friction_stops_although_its_braking_relaxes(block):
    # v' = F - F_c - b until it stops; scipy's own event finds when
    F_c, D, T, v0 = 0.5, 1.2, 0.15, 1.0
    s = solve_ivp(lambda _, y: [y[1], -F_c - y[2], (D * y[1] - y[2]) / T], (0, 9), [0, v0, 0],
                  events=stops, method="DOP853", rtol=1e-12, atol=1e-12)  # fmt: skip
    p = {**BLOCK, "F_c": F_c, "actuator.gain": 1e-12, "actuator.damping": D, "actuator.relaxation": T}
    x = simulate(block, p, [0.0, v0], np.ones(301), 0.01, samples=301, substeps=4)[:, :, 0]
    assert s.t_events[0].size == 1
    assert x[-1, 0] == pytest.approx(s.y_events[0][0][0], rel=1e-4)
    assert np.all(x[int(s.t_events[0][0] / 0.01) + 2 :, 1] == 0.0)


def stops(_, y):
    """Speed, at whose zero scipy ends."""
    return y[1]


stops.terminal = True


def test_a_commanded_drive_brakes_no_harder_beyond_the_knee(block):
    # v' = F - D v to the knee, then F - D v_k, a straight line; idle again, D' v however fast
    dt, n, F, D, S, knee, off = 0.02, 91, 2.0, 0.3, 0.4, 1.4, 1.4
    t = np.arange(n) * dt
    p = {**BLOCK, "actuator.gain": F, "actuator.damping": D, "actuator.standby": S, "actuator.knee": knee}
    x = simulate(block, p, [0.0, 0.0], np.where(t < off - 1e-9, 1.0, 0.0), dt, samples=n, substeps=2)
    r = D + S
    there = -math.log(1 - knee * r / F) / r
    assert there < 1.2
    v_off = knee + (F - r * knee) * (off - there)
    rise = np.where(t < there, F / r * -np.expm1(-r * t), knee + (F - r * knee) * (t - there))
    truth = np.where(t < off, rise, v_off * np.exp(-S * (t - off)))
    # the kink at the knee lies inside a substep h: slope off by r^2 (v - v_k) there, h^2/8 of it remains
    assert np.allclose(x[:, 1, 0], truth, rtol=0, atol=r * F * (dt / 2) ** 2)


def test_a_servo_pulls_at_its_limit_until_it_has_its_speed(block):
    # gain u - slope v beyond the limit: the limit alone, v = F t/m; then the slope's own approach to gain u/slope
    gain, slope, most, dt, n = 8.0, 4.0, 2.0, 0.01, 300
    p = {**BLOCK, "m": 1.0, "k": 0.0, "c": 0.0}
    p |= {"actuator.gain": gain, "actuator.slope": slope, "actuator.force_limit": most}
    t = np.arange(n) * dt
    until = (gain / slope - most / slope) / most
    then = gain / slope - (most / slope) * np.exp(-slope * (t - until))
    v = simulate(block, p, [0.0, 0.0], np.ones(n), dt, samples=n, substeps=20)[:, 1, 0]
    # a substep of 0.5 ms holds the corner
    assert np.allclose(v, np.where(t < until, most * t, then), rtol=0, atol=1e-6)
    assert until == pytest.approx(0.75)


def test_braking_that_the_command_takes_away(block):
    # D = 0.6 - 0.5 |u|: commands of 1 and 0.4 in turn, after which 0.2 of standby is left
    p = {**BLOCK, "m": 1.0, "k": 0.0, "c": 0.0, "actuator.gain": 0.0, "actuator.damping": 0.6}
    p |= {"actuator.damping_rise": -0.5, "actuator.standby": 0.2}
    t = np.arange(151) * 0.02
    u = np.select([t < 0.999, t < 1.999], [1.0, -0.4], 0.0)
    truth = piecewise(t, 1.0, [(0, 1.0, 0.0, 0.3), (1.0, 2.0, 0.0, 0.6), (2.0, 9.0, 0.0, 0.2)])
    v = simulate(block, p, [0.0, 1.0], u, 0.02, samples=151, substeps=4)[:, 1, 0]
    assert np.allclose(v, truth, rtol=0, atol=1e-9)


def test_a_gain_that_falls_with_the_command(block):
    # a free unit mass: what each command of one second adds to the speed is gain u/(1 + droop |u|)
    p = {**BLOCK, "m": 1.0, "k": 0.0, "c": 0.0, "actuator.gain": 1.432, "actuator.droop": 0.684}
    u = np.repeat([0.2, -1.0, 0.5], 50)
    v = simulate(block, p, [0.0, 0.0], u, 0.02, samples=151)[::50, 1, 0]
    assert np.diff(v) == pytest.approx([1.432 * w / (1 + 0.684 * abs(w)) for w in (0.2, -1.0, 0.5)], abs=1e-12)


def test_a_dead_zone_takes_as_much_of_a_command_from_either_side(block):
    # a free unit mass: what each command of one second adds to the speed; the offset is added before
    p = {**BLOCK, "m": 1.0, "k": 0.0, "c": 0.0, "actuator.gain": 1.432, "actuator.dead_zone": 0.3}
    u = np.repeat([0.2, -1.0, 0.5, -0.25], 50)
    v = simulate(block, p, [0.0, 0.0], u, 0.02, samples=201)[::50, 1, 0]
    assert np.diff(v) == pytest.approx([0.0, -1.432 * 0.7, 1.432 * 0.2, 0.0], abs=1e-12)
    shifted = simulate(block, {**p, "actuator.offset": -0.1}, [0.0, 0.0], u, 0.02, samples=201)[::50, 1, 0]
    assert np.diff(shifted) == pytest.approx([0.0, -1.432 * 0.8, 1.432 * 0.1, -1.432 * 0.05], abs=1e-12)


def test_a_sine_through_a_dead_zone_moves_a_mass_as_its_integral_says(block):
    # momentum of half a period: the integral of what is above the dead zone, by hand
    lost, size, w, dt = 0.4, 1.0, 2 * math.pi, 1e-3
    p = {**BLOCK, "m": 1.0, "k": 0.0, "c": 0.0, "actuator.dead_zone": lost}
    t = np.arange(501) * dt
    v = simulate(block, p, [0.0, 0.0], size * np.sin(w * t), dt, samples=501)[-1, 1, 0]
    first = math.asin(lost / size)
    assert v == pytest.approx((2 * size * math.cos(first) - lost * (math.pi - 2 * first)) / w, abs=2e-3 * size * dt * w)
