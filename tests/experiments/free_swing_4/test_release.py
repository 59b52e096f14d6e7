"""Does a freed rig swing as mechanics says, and does its log show it?"""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

from upright.errors import BadInput
from upright.experiments.free_swing_4 import release as drift
from upright.experiments.free_swing_4.chapter import chapter
from upright.experiments.free_swing_4.release import Release, freed, motion, release_log
from upright.experiments.free_swing_4.run import FreeSwing, losses
from upright.experiments.weighing_1a.run import Known
from upright.rig.makes import COUNTS, MAKES, MOTOR_AND_BELT, NOMINAL, SERVO, make_rig


def twin(seed):
    return freed(make_rig("furuta", seed))


def with_plant(plant):
    return replace(twin(0), plant=plant)


FRICTIONLESS = dict.fromkeys(("b_1", "b_1c", "b_2", "b_2c"), 0.0)


@pytest.mark.parametrize("seed", range(6))
def test_upright_it_falls_about_as_fast_as_the_paper_s_rig(seed):
    # Table 1 comes from an undamped pole of 7.981 rad/s; parts differ by a percent or two
    rig = twin(seed).plant.replace(**FRICTIONLESS)
    assert rig.linear("inverted").poles()[0].real == pytest.approx(7.981, rel=0.04)
    hanging = math.sqrt(rig.m_p * rig.g * rig.l_cg / (rig.J_p + rig.m_p * rig.l_cg**2))
    assert 6.4 < hanging < 7.98  # the range in which Table 1's weights are reachable


def test_seeds_are_rigs_of_their_own_that_can_be_had_again():
    assert twin(3) == twin(3)
    assert twin(3) != twin(4)
    # as designed, without motor and belt: their friction, and their inertia of 5e-4
    assert twin(0).plant.J_d == pytest.approx(NOMINAL.J_d - MOTOR_AND_BELT)
    for name in ("m_p", "l_cg", "r", "J_p", "b_1", "b_1c", "b_2", "b_2c"):
        assert getattr(twin(0).plant, name) == pytest.approx(getattr(NOMINAL, name))


def test_a_log_holds_whole_counts_at_the_servo_s_beat():
    record = release_log(twin(1), seconds=1.0, every=4)
    assert record.period == pytest.approx(4 * SERVO)
    for name in ("psi", "theta"):
        assert record.units[name] == "counts"
        assert np.all(record[name] == np.round(record[name]))
    assert record["theta"][0] == pytest.approx(COUNTS / 4, abs=4 * 0.01 / (2 * math.pi) * COUNTS)


def test_a_repetition_differs_as_a_hand_differs():
    first, again, other = (release_log(twin(1), seconds=1.0, shot=s)["theta"] for s in (1, 1, 2))
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)


def test_motion_agrees_with_another_integrator():
    rig = twin(2).changed(b_1c=0.0, b_2c=0.0)
    p = rig.plant
    t, x = motion(rig, Release(push=0.2), seconds=3.0)

    def eq_3(_, state):  # eq. (3) by hand, errata corrected
        psi_dot, theta, theta_dot = state[1:]
        s, c = math.sin(theta), math.cos(theta)
        transverse, first = p.J_p + p.m_p * p.l_cg**2, p.m_p * p.r * p.l_cg
        m = [[p.J_d + p.m_p * p.r**2 + transverse * s**2 + p.J_a * c**2, -first * c], [-first * c, transverse]]
        f = [
            -2 * theta_dot * psi_dot * s * c * (transverse - p.J_a) - first * s * theta_dot**2 - p.b_1 * psi_dot,
            -p.m_p * p.g * p.l_cg * s + s * c * psi_dot**2 * (transverse - p.J_a) - p.b_2 * theta_dot,
        ]
        a = np.linalg.solve(m, f)
        return [psi_dot, a[0], theta_dot, a[1]]

    other = solve_ivp(eq_3, (0, t[-1]), x[0], t_eval=t, rtol=1e-10, atol=1e-12).y.T
    assert np.abs(x - other).max() < 1e-6  # RK4 at 0.884 ms: (8 rad/s x h)^4 x a few swings


def test_what_friction_took_is_what_the_motion_lost():
    rig = twin(5)
    t, x = motion(rig, seconds=6.0, every=1)
    stored = rig.plant.energy(x)
    taken = sum(losses(rig.plant, t, x).values())
    assert stored[0] - stored == pytest.approx(taken, abs=2e-5 * (stored[0] - stored[-1]) + 1e-9)


def test_without_friction_nothing_is_taken():
    rig = with_plant(NOMINAL.replace(**FRICTIONLESS))
    t, x = motion(rig, seconds=2.0)
    assert losses(rig.plant, t, x) == {}


def test_a_level_free_disk_keeps_its_momentum():
    rig = with_plant(NOMINAL.replace(**FRICTIONLESS))
    _, x = motion(rig, Release(push=0.3), seconds=5.0)
    p = drift.momentum(rig.plant, x)
    assert np.ptp(p) < 1e-8 * p[0]  # RK4's error over 5 s


def test_released_at_rest_the_disk_is_where_the_pendulum_says():
    # p = 0 integrates to psi(theta): with s = sin(theta) and M_11 = a + b s^2 it is an arctangent
    p = NOMINAL.replace(**FRICTIONLESS)
    _, x = motion(with_plant(p), seconds=5.0)
    a = p.J_d + p.m_p * p.r**2 + p.J_a
    b = p.J_p + p.m_p * p.l_cg**2 - p.J_a
    closed = lambda s: p.m_p * p.r * p.l_cg / math.sqrt(a * b) * np.arctan(s * math.sqrt(b / a))  # noqa: E731
    assert x[:, 0] == pytest.approx(closed(np.sin(x[:, 2])) - closed(1.0), abs=1e-7)


def test_a_push_drifts_as_its_momentum_over_the_mean_inertia():
    # no friction: one swing with a small momentum p moves the disk by p times the integral of dt / M_11
    p = NOMINAL.replace(**FRICTIONLESS)
    push = 0.01
    t, x = motion(with_plant(p), Release(push=push), seconds=30.0)
    transverse, first = p.J_p + p.m_p * p.l_cg**2, p.m_p * p.r * p.l_cg
    m_11 = lambda a: p.J_d + p.m_p * p.r**2 + transverse * math.sin(a) ** 2 + p.J_a * math.cos(a) ** 2  # noqa: E731

    def dwell(phi, weight):  # theta = (pi/2) sin(phi) takes the root out of dt = d theta / theta'
        a = math.pi / 2 * math.sin(phi)
        inertia = transverse - (first * math.cos(a)) ** 2 / m_11(a)
        speed = math.sqrt(2 * p.m_p * p.g * p.l_cg * math.cos(a) / inertia)
        return math.pi / 2 * math.cos(phi) / speed * weight(a)

    ends = (-math.pi / 2 + 1e-9, math.pi / 2 - 1e-9)
    swing, turned = (quad(dwell, *ends, args=(w,))[0] for w in (lambda a: 1.0, lambda a: 1 / m_11(a)))
    expected = m_11(math.pi / 2) * push * turned / swing
    assert drift.slope(t, x[:, 0]) == pytest.approx(expected, rel=0.02)  # ends of the line fall anywhere in a swing


def test_viscous_friction_alone_stops_a_push_after_momentum_over_friction():
    # p' = -b_1 psi' integrates to psi(end) - psi(0) = p(0) / b_1
    p = NOMINAL.replace(b_1=4e-3, b_1c=0.0, b_2=2e-3, b_2c=0.0)
    _, x = motion(with_plant(p), Release(push=0.5), seconds=60.0)
    assert x[-1, 0] == pytest.approx(drift.momentum(p, x)[0] / p.b_1, rel=1e-6)


def test_out_of_level_gravity_begins_with_the_lever_of_the_arm():
    # everything at rest, no friction: M (psi'', theta'') = m_p g (r, -l_cg) tilt, the sideways weight at its levers
    lean = 1e-4
    p = NOMINAL.replace(**FRICTIONLESS, tilt_y=lean)
    t, x = motion(with_plant(p), Release(angle=0.0), seconds=0.01, every=1)
    torque = np.array([p.m_p * p.g * p.r * lean, -p.m_p * p.g * p.l_cg * lean])
    first = np.linalg.solve(NOMINAL.mass_matrix("hanging"), torque)[0]
    assert x[-1, 0] == pytest.approx(first * t[-1] ** 2 / 2, rel=0.01)  # (8 rad/s x 0.01 s)^2, what theta has moved


def test_the_spring_brings_home_what_a_lean_drags_away():
    wanders = {w.name: w for w in drift.drift_paths(twin(0))}
    free, held = wanders["out of level by 0.25°"], wanders["spring, out of level by 0.25°"]
    assert abs(math.degrees(free.end)) > 45
    # at rest the spring's torque is gravity's: k_psi psi = m_p g r tilt; what remains still swings, hence 3 times
    home = NOMINAL.m_p * NOMINAL.g * NOMINAL.r * math.sin(drift.TILT) / MAKES["furuta"].anchor
    assert abs(held.end) < 4 * home
    assert abs(held.slope) < abs(free.slope) / 30


@pytest.mark.parametrize(("make", "body", "unit"), [("furuta", "disk", "rad/s"), ("linear", "cart", "m/s")])
def test_every_release_is_told_with_its_push_and_once_more_with_the_spring(make, body, unit):
    """A disk is pushed by an angular speed and may lean by a quarter degree; a cart by a speed, and it sticks."""
    ways = [f"free {body}, level", f"pushed at release, {MAKES[make].push:g} {unit}"]
    held = ["spring, level", "spring, pushed at release"]
    if body == "disk":
        ways.append("out of level by 0.25°")
        held.append("spring, out of level by 0.25°")
    paths = drift.drift_paths(freed(make_rig(make)), seconds=2.5)
    assert [(w.name, w.remedy) for w in paths] == [(n, False) for n in ways] + [(n, True) for n in held]
    # one servo step after the release: a pushed body moves at its push, one left at rest has hardly begun
    for w in paths:
        speed = (w.psi[1] - w.psi[0]) / (w.t[1] - w.t[0])
        assert abs(speed - ("pushed" in w.name) * MAKES[make].push) < 0.5 * MAKES[make].push


@pytest.mark.parametrize(("make", "body"), [("furuta", "disk"), ("linear", "cart")])
def test_the_chapter_says_how_fast_the_twin_would_fall_and_what_is_known_of_it(make, body, tmp_path):
    """Four figures of the growing eigenvalue; weighed in experiment 1a, or known to 1 % from the bench."""
    rig = freed(make_rig(make, 3))
    pole = np.linalg.eigvals(rig.plant.linear("inverted").A).real.max()
    done = FreeSwing(rig=rig, folder=tmp_path)
    told = chapter(done)
    twin, known = told.parts[0].content
    assert twin.startswith(f"The rig is a digital twin of {rig.name}, seed 3.")
    assert f"falls with {pole:#.4g} 1/s (unstable pole)." in twin
    assert ("The drive belt is off" if body == "disk" else "The motor is silent, pulled along by the cart") in twin
    assert f"the {body}'s inertia to 1 %, the lengths from a ruler" in known
    assert f"Why does the {body} wander" in told.question
    assert told.verdict == "The experiment was stopped before the first fit."
    assert not told.sound
    weighed = replace(done, weighed=Known(name="J_d", value=1e-3, stderr=1e-6))
    assert f"the {body}'s inertia from experiment 1a, the lengths" in chapter(weighed).parts[0].content[1]


@pytest.mark.parametrize(
    ("make", "case", "ends", "sentence"),
    [
        ("furuta", "out of level by 0.25°", (-math.pi / 3, math.pi / 90),
         "A lean of 0.25° drags the free disk away by 60°; a soft spring keeps it within 2°."),
        ("linear", "pushed at release", (0.031, -0.004),
         "A push of 0.05 m/s at the release leaves the cart 3.1 cm away, where dry friction holds it; a soft spring "
         "brings it back to 0.4 cm."),
    ],
)  # fmt: skip
def test_the_chapter_says_how_far_a_carrier_went_and_what_the_spring_makes_of_it(make, case, ends, sentence, tmp_path):
    """Paths by hand: only the case that matters for the body is told, in degrees or cm, whichever side it went."""
    t = np.linspace(0.0, 3.0, 301)

    def path(name, end, remedy):
        psi = end * t / t[-1]
        return drift.DriftPath(name=name, remedy=remedy, t=t, psi=psi, centre=psi, slope=end / t[-1], end=end)

    free, held = ends
    drifts = (
        path("level", 9.0, False), path(case, free, False), path("spring, level", 9.0, True),
        path(f"spring, {case}", held, True),
    )  # fmt: skip
    done = FreeSwing(rig=freed(make_rig(make)), folder=tmp_path, drifts=drifts)
    assert chapter(done).detail == sentence
    assert chapter(replace(done, interrupted=True)).detail == (
        f"Interrupted: this is what was finished by then. {sentence}"
    )


def test_a_cart_s_momentum_is_what_its_release_gave_it():
    # no friction: p = (m_c + m_p) x' + m_p l_cg cos(theta) theta' is constant, so the cart drifts at p over the mass
    rig = freed(make_rig("linear")).changed(**FRICTIONLESS)
    p = rig.plant
    _, x = motion(rig, Release(push=0.05), seconds=5.0)
    momentum = (p.m_c + p.m_p) * x[:, 1] + p.m_p * p.l_cg * np.cos(x[:, 2]) * x[:, 3]
    assert momentum == pytest.approx((p.m_c + p.m_p) * 0.05, rel=1e-7)  # RK4's error over 5 s


def test_what_has_no_pendulum_cannot_swing_one():
    with pytest.raises(BadInput, match="needs a pendulum"):
        freed(make_rig("rectilinear"))


def test_a_path_ends_where_it_is_from_where_it_was_let_go(monkeypatch):
    """From 0.3 to 0.3 + 0.5 in its last two seconds, wherever it was in between."""
    t = np.arange(0.0, 10.0, 0.01)
    psi = np.where(t > t[-1] - 2.0, 0.8, 5.0)
    psi[0] = 0.3
    monkeypatch.setattr(drift, "motion", lambda rig, release, *, seconds: (t, np.column_stack([psi, psi])))
    path = drift.drift_path("free", twin(0), None, seconds=10.0)
    assert path.end == pytest.approx(0.5)
    assert path.slope == pytest.approx(np.polyfit(t, psi, 1)[0])
    assert not path.remedy
