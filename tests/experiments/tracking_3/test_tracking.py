"""Does the far body follow as linear theory, friction and the analogy of carts and disks say it must?"""

from __future__ import annotations

import json
import math
import tomllib
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from upright.control import trial
from upright.errors import BadInput
from upright.experiments.tracking_3 import laws as pd
from upright.experiments.tracking_3 import run as tracking
from upright.experiments.tracking_3.laws import AT, EXTRA, closed_by, paper_sets, tracker, with_sum
from upright.experiments.tracking_3.pulses import fitted, identify_shaft, pulses, rig_of_file, shaft_study
from upright.experiments.tracking_3.run import (
    RESERVE,
    attempt,
    choose_step,
    levels_of,
    run_tracking,
    stiffest_damped,
    track_on,
)
from upright.experiments.weighing_1a.run import Known
from upright.gains import place, prefilter
from upright.gains.loop import swing
from upright.identification.estimate import identify
from upright.physics import chain
from upright.rig.makes import MAKES, SHAFTS, make_rig
from upright.study.load import load_study
from upright.units import parse

FRICTIONLESS = {"f_1c": 0.0, "f_2c": 0.0}


def test_the_far_body_ends_at_the_reference_without_friction():
    """Final value theorem: k_pf makes the static gain one, whatever poles, seed and encoders."""
    for kind in SHAFTS:
        rig = make_rig(kind, 3).changed(**FRICTIONLESS)
        for law in paper_sets(rig):
            step = 0.5 * rig.limit / law.k_pf
            done = trial(rig, law.law, at=AT, start=np.zeros(4), seconds=2.0, reference=np.full(1, step))
            # a count of each encoder by its gain, a step of the converter
            blur = np.abs(law.K[::2]) @ rig.resolution / law.k_pf + rig.converter / law.k_pf
            assert done.x[-1, 2] == pytest.approx(step, abs=blur)
            assert np.abs(done.u).max() == pytest.approx(law.k_pf * step, abs=rig.converter)


def test_the_sampled_model_with_delay_and_lag_moves_as_the_kernel():
    """Without friction and rounding the loop is linear: two substeps of Runge-Kutta are right to 1e-6 of the start."""
    rig = make_rig("rectilinear").changed(**FRICTIONLESS).replace(counts=(1e12, 1e12), converter=0.0)
    law = paper_sets(rig, (4,))[0].law
    start = np.array([1e-3, 0.0, -2e-3, 0.02])
    sampled = rig.linear(AT).to_sampled(rig.period, rig.delay / rig.period, rig.lag)
    states, commands = swing(sampled, law, start, 400)
    done = trial(rig, law, at=AT, start=start, seconds=399 * rig.period)
    np.testing.assert_allclose(done.x, states[:, :4], atol=1e-6 * np.abs(states[:, :4]).max())
    np.testing.assert_allclose(done.u, commands[:, 0], atol=1e-5 * np.abs(commands).max())


def held(rig, law, offset, force):
    """How far the far body creeps when let go at rest, the spring and the drive pulling by shares of friction."""
    p = rig.plant.parameters()
    fine = rig.replace(counts=(1e12, 1e12), converter=0.0)
    d = offset * p["f_2c"] / p["k_12"]  # x_1 - x_2
    # of gain (k_pf (r - x_1) + K_3 d) - k d = force f_1, about x_1 = 0
    u = (force * p["f_1c"] + p["k_12"] * d) / rig.gain
    r = (u + law.K[2] * -d) / law.k_pf
    done = trial(fine, law.law, at=AT, start=[0, 0, -d, 0], seconds=0.4, reference=np.full(1, r))
    return abs(done.x[-1, 2] - done.x[0, 2]), r + d


@pytest.mark.parametrize("kind", SHAFTS)
def test_friction_holds_the_far_body_off_up_to_the_bound_and_no_farther(kind):
    rig = make_rig(kind)
    for law in paper_sets(rig, (1, 4)):
        crept, error = held(rig, law, 0.999, 0.999)
        assert crept == 0.0
        assert error == pytest.approx(0.999 * law.play, rel=1e-9)
        assert held(rig, law, 1.01, 0.99)[0] > 0  # the spring pulls the far body loose
        assert held(rig, law, 0.99, 1.05)[0] > 0  # the drive moves the near one, and the spring follows


def test_pd_of_the_near_encoder_is_stable_for_all_gains():
    """Drive and encoder at one body make a passive pair (no delay): every kp, kd > 0 stabilizes."""
    rng = np.random.default_rng(0)
    for _ in range(300):
        m_1, m_2, k, kp, kd = np.exp(rng.normal(0, 1.5, 5))
        model = chain(2, "rectilinear")(m_1=m_1, m_2=m_2, k_12=k).linear(AT)
        assert np.linalg.eigvals(model.A - model.B @ np.array([[kp, kd, 0, 0]])).real.max() < 0


def test_pd_of_the_far_encoder_is_unstable_for_all_gains():
    """Without natural damping m_1 m_2 s^4 + k (m_1 + m_2) s^2 + k kd s + k kp lacks s^3: not Hurwitz."""
    rng = np.random.default_rng(1)
    for _ in range(300):
        m_1, m_2, k, kp, kd = np.exp(rng.normal(0, 1.5, 5))
        model = chain(2, "rectilinear")(m_1=m_1, m_2=m_2, k_12=k).linear(AT)
        assert np.linalg.eigvals(model.A - model.B @ np.array([[0, 0, kp, kd]])).real.max() > 0


def test_pd_of_the_near_encoder_decays_no_faster_than_half_the_root_of_k_over_m_1():
    """The bound is met at kp = k m_1/m_2, kd = 2 sqrt(k m_1), where (s^2 + b s + k/m_2)^2 with b = kd/(2 m_1)."""
    rng = np.random.default_rng(2)
    for _ in range(20):
        m_1, m_2, k = np.exp(rng.normal(0, 0.4, 3))
        bound = 0.5 * math.sqrt(k / m_1)
        model = chain(2, "rectilinear")(m_1=m_1, m_2=m_2, k_12=k).linear(AT)
        kp = k * m_1 / m_2 * np.geomspace(0.05, 20, 41)
        assert pd.best_decay(pd.continuous(model), kp, most=50.0).max() <= bound * (1 + 1e-9)
        best = np.array([[k * m_1 / m_2, 2 * math.sqrt(k * m_1), 0, 0]])
        poles = np.poly(model.A - model.B @ best)
        quadratic = [1, math.sqrt(k / m_1), k / m_2]
        np.testing.assert_allclose(poles, np.polymul(quadratic, quadratic), rtol=1e-9)


def test_the_loop_is_linear_in_the_gains():
    """What the search over kp and kd takes for the loop is the loop of the law."""
    rig = make_rig("torsional", 1)
    A, P, D = pd.sampled(rig)
    law = pd.near_pd(rig, "", 3.0, 0.4).law
    np.testing.assert_allclose(A + 3.0 * P + 0.4 * D, closed_by(rig, law), rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("kind", SHAFTS)
def test_a_sum_makes_up_for_a_push_and_follows_the_step_as_before(kind):
    rig = make_rig(kind, 2).changed(**FRICTIONLESS)
    model = rig.linear(AT)
    base = paper_sets(rig, (4,))[0]
    law = with_sum(rig, base, "")
    assert law.k_pf == pytest.approx(
        prefilter(model.A, model.B, model.C[-1], place(model.A, model.B, base.requested).K)
    )
    step, pushes = 0.4 * rig.limit / law.k_pf, np.full(9000, 0.1 * rig.limit)
    ends = [
        trial(rig, one.law, at=AT, start=np.zeros(4), seconds=3.0, reference=np.full(1, step), pushes=pushes).x[-1, 2]
        for one in (base, law)
    ]
    assert ends[0] - step == pytest.approx(0.1 * rig.limit / base.k_pf, rel=0.05)  # the loop's static force
    # what is left of the sum's slow pole, and two counts
    assert ends[1] == pytest.approx(step, abs=abs(ends[0] - step) * 3 * math.exp(3 * EXTRA) + 2 * rig.resolution[1])


@pytest.mark.parametrize("summed", [False, True])
@pytest.mark.parametrize("kind", SHAFTS)
def test_a_law_begins_where_the_rig_rests_without_a_jump(kind, summed):
    """Dry friction leaves a shaft twisted; at rest state feedback asks for -K q, its speeds being zero."""
    rig = make_rig(kind, 2)
    law = paper_sets(rig, (4,))[0]
    law = with_sum(rig, law, "") if summed else law
    q = np.array([3.0, -2.0]) * rig.resolution
    u, _ = law.law.follow(np.tile(q, (4, 1)))
    assert u[0] == pytest.approx(-law.K[::2] @ q, rel=1e-9)
    growth = -law.law.C[0, -1] * rig.period * q[1] if summed else 0.0
    np.testing.assert_allclose(np.diff(u, axis=0), growth, atol=1e-9 * abs(law.K[::2] @ q))


def test_disks_move_as_carts_do_in_other_units():
    """m - J, k - k_t, c - c_t, F - T: with factors that are powers of two even the rounding is the same."""
    carts = make_rig("rectilinear", 5)
    inertia, angle = 2.0**-7, 2.0**4  # kg m^2 per kg, rad per m
    p = carts.plant.parameters()
    same = {n.replace("m_", "J_"): v * inertia for n, v in p.items() if n[0] in "mkc"}
    dry = {n: v * inertia * angle for n, v in p.items() if n[0] == "f"}
    disks = carts.replace(plant=chain(2, "torsional")(**same, **dry), gain=carts.gain * inertia * angle,
        counts=[math.tau * n / angle for n in carts.counts], travel=math.inf,
    )  # fmt: skip
    carts = carts.replace(counts=[angle * n for n in disks.per_unit])  # to the last bit
    for one, other in zip(paper_sets(carts), paper_sets(disks), strict=True):
        np.testing.assert_allclose(other.K * angle, one.K, rtol=1e-9)
        step = 0.9 * carts.limit / one.k_pf
        scaled = tracker(disks, "", one.K / angle, one.k_pf / angle)
        line, turn = (
            trial(rig, law.law, at=AT, start=np.zeros(4), seconds=0.6, reference=np.full(1, size))
            for rig, law, size in ((carts, one, step), (disks, scaled, step * angle))
        )
        np.testing.assert_array_equal(turn.u, line.u)
        np.testing.assert_allclose(turn.x, line.x * angle, rtol=1e-9, atol=1e-15)


@pytest.mark.parametrize("twist", [0.05, 0.2])
def test_the_step_keeps_to_the_shaft_of_the_rig_at_hand(twist):
    """The loop is nearly linear, so the step scales with the twist allowed; where less is allowed, the rig trips."""
    rig = make_rig("torsional").replace(twist=twist)
    laws = paper_sets(rig, (1, 4))
    chosen = choose_step(rig, laws)
    other = choose_step(rig.replace(twist=2 * twist), laws)
    assert other.by_twist == pytest.approx(2 * chosen.by_twist, rel=1e-9)  # from the same run
    done = attempt(rig, laws[1], chosen.size)
    assert done.twist < twist
    assert math.isinf(done.tripped)
    tight = rig.replace(twist=0.5 * done.twist)
    assert attempt(tight, laws[1], chosen.size).tripped < 1.0


@pytest.mark.parametrize("kind", SHAFTS)
def test_a_step_is_followed_by_a_push_of_a_tenth_of_the_drive_s_limit_against_it(kind):
    """0.1 s of rest, 2 s of the step alone, 1.5 s of step and push; the rig's own limit, whatever its unit."""
    rig = make_rig(kind)
    for limit in (rig.limit, 3 * rig.limit):
        reference, pushes = levels_of(rig.replace(limit=limit), 0.02)
        t = np.arange(reference.size) * rig.period
        assert t[-1] == pytest.approx(3.6, abs=rig.period)
        half = rig.period / 2  # steps come at the nearest tick
        np.testing.assert_array_equal(reference, np.where(t < 0.1 - half, 0.0, 0.02))
        np.testing.assert_allclose(pushes, np.where(t < 2.1 - half, 0.0, -0.1 * limit), rtol=1e-15)


def test_pulses_stay_within_travel_and_twist():
    for kind in SHAFTS:
        for seed in range(12):
            rig = make_rig(kind, seed)
            for file in ("pulses.csv", "others.csv"):
                q = pulses(rig, file).y * rig.resolution
                assert np.abs(q).max() < rig.travel
                assert np.abs(q[:, 0] - q[:, 1]).max() < MAKES[kind].rig.twist


@pytest.mark.slow
@pytest.mark.parametrize("kind", SHAFTS)
def test_four_sets_follow_and_the_fourth_comes_close_to_the_limit(kind, tmp_path):
    done = run_tracking(kind, 4, tmp_path)
    truth = done.true.plant.parameters()
    for name in ("m_1", "m_2", "J_1", "J_2", "k_12"):
        if name in truth:
            low, high = done.fit.estimates[name].interval
            assert low < truth[name] < high
    shares = [o.measured.effort.share for o in done.sets]
    assert sorted(shares) == shares
    assert 0.85 < shares[-1] <= RESERVE  # two digits of the step may take a tenth off
    for o in done.sets:
        assert o.within
        assert o.measured.effort.peak == pytest.approx(o.law.k_pf * done.step.size, abs=done.rig.converter)
        assert o.measured.figures.settling_5 < 4.0 / o.law.decay
        assert (
            abs(o.measured.figures.error) < 1.4 * o.law.play + 2 * done.rig.resolution[1]
        )  # friction of the day: 13 %
    assert done.far.measured.tripped < 1.0
    assert done.stiff.measured.figures.settling_5 > 2 * done.sets[-1].measured.figures.settling_5
    assert done.pd.measured.give > 4 * done.sets[-1].measured.give


def test_the_fit_is_repeated_from_its_files(tmp_path):
    done = run_tracking("torsional", 6, tmp_path, which=(1,), stopped=lambda: True)
    assert done.interrupted
    study = load_study(tmp_path / "shaft.toml")
    again = identify(study.model, study.runs)
    written = json.loads((tmp_path / "fit.json").read_text(encoding="utf-8"))["parameters"]
    for name, e in again.estimates.items():
        assert written[name]["value"] == pytest.approx(e.value, rel=1e-9)


@pytest.mark.parametrize("scale", [0.5, 1.0])
def test_the_loop_does_not_depend_on_the_scale_of_the_inertias(tmp_path, scale):
    """Only ratios are seen: an inertia said to be half as large halves gain, springs and friction, and no gain in V."""
    rig = make_rig("torsional", 6)
    told = Known(name="J_1", value=scale * rig.plant.J_1, stderr=1e-3 * rig.plant.J_1)
    _, fit = identify_shaft(rig, 6, tmp_path, weighed=(told,))
    model = fitted(rig, fit)
    assert model.gain == pytest.approx(scale * rig.gain, rel=5e-3)
    assert model.plant.k_12 == pytest.approx(scale * rig.plant.k_12, rel=5e-3)
    (found,), (true,) = paper_sets(model, (4,)), paper_sets(rig, (4,))
    assert found.k_pf == pytest.approx(true.k_pf, rel=5e-3)


@pytest.mark.parametrize("kind", SHAFTS)
def test_no_pd_of_a_hundred_others_arrives_sooner_by_more_than_the_grid(kind):
    """The search's last grid has steps of 6 %; random pairs may beat it by little."""
    rig = make_rig(kind)
    step = 0.9 * rig.limit / paper_sets(rig, (4,))[0].k_pf
    _, found = pd.tune(rig, step, RESERVE * rig.limit)
    rng = np.random.default_rng(7)
    kp = np.exp(rng.uniform(np.log(0.03), 0, 100)) * RESERVE * rig.limit / step
    others = pd.tried(rig, np.column_stack([kp, kp * np.exp(rng.uniform(np.log(8e-3), np.log(0.25), 100))]), step)
    assert found.arrival.min() < 1.05 * others[:, 0].min()


@pytest.mark.parametrize("body", [0, 1])
def test_a_root_locus_of_a_free_mass_is_that_of_its_quadratic(body):
    """Two masses without a spring: the one under PD moves as s^2 + g kp r s + g kp = 0, the other stays as it is."""
    plant = chain(2, "rectilinear")(m_1=2.0, m_2=0.5, k_12=1e-12)
    model = plant.linear("origin" if "origin" in plant.equilibria else next(iter(plant.equilibria)))
    kp, rate = np.array([0.5, 8.0]), 0.4
    B = np.array(model.B)
    B[:] = 0.0
    B[2 * body + 1] = 3.0  # force on that body alone, for a locus of either
    found = pd.root_locus(replace(model, B=B), body, rate, kp)
    for k, poles in zip(kp, found, strict=True):
        expected = [*np.roots([1.0, 3 * k * rate, 3 * k]), 0.0, 0.0]
        assert np.sort_complex(poles) == pytest.approx(np.sort_complex(np.array(expected)), abs=1e-5)


def test_many_laws_tried_at_once_arrive_and_settle_as_each_does_alone():
    """A stiff PD arrives, friction holds a soft one off what it was asked for, and the softest where it was."""
    rig, step = make_rig("rectilinear", 2), 0.01
    pairs = np.array([(150.0, 15.0), (50.0, 1.5), (0.05, 5e-3)])
    found = pd.tried(rig, pairs, step)

    def stays(t, x, at):
        outside = np.flatnonzero(np.abs(x / at - 1) > 0.05)
        return t[outside[-1] + 1] if outside[-1] + 1 < t.size else math.inf

    for (kp, kd), (arrival, settling) in zip(pairs[:2].tolist(), found.tolist(), strict=False):
        alone = trial(rig, pd.near_pd(rig, "PD", kp, kd).law, at=AT, start=np.zeros(4),
                      seconds=pd.DWELL - rig.period, reference=np.full(1, step))  # fmt: skip
        x = alone.x[:, 2]
        assert arrival == pytest.approx(stays(alone.t, x, step), abs=1.01 * rig.period)
        assert settling == pytest.approx(stays(alone.t, x, x[-1]), abs=1.01 * rig.period)
    assert np.isinf(found).tolist() == [[False, False], [True, False], [True, True]]


def test_gains_are_searched_finer_about_the_best_within_the_command_allowed(monkeypatch):
    """Arrivals as a bowl in the logarithms of kp and of kd/kp: the second grid comes within a step of its bottom."""
    rig, step, most = make_rig("rectilinear"), 0.01, 5.0
    tried = []

    def bowl(bottom, rate):
        def arrivals(_rig, pairs, of):
            assert of == step
            tried.append(pairs)
            off = np.log(pairs[:, 0] / bottom) ** 2 + np.log(pairs[:, 1] / pairs[:, 0] / rate) ** 2
            return np.column_stack([1.0 + off, 2.0 + off])

        return arrivals

    monkeypatch.setattr(pd, "tried", bowl(0.4 * most / step, 0.03))
    law, searched = pd.tune(rig, step, most)
    finer = math.log(1.25 / 0.8) / 8  # of nine
    assert abs(math.log(law.k_pf / (0.4 * most / step))) <= finer
    assert abs(math.log(law.K[1] / law.K[0] / 0.03)) <= finer
    assert law.K.tolist() == [law.k_pf, law.K[1], 0.0, 0.0]
    assert searched.kp.size == searched.arrival.size == 18 * 18 + 9 * 9
    np.testing.assert_allclose(searched.settling, searched.arrival + 1.0)
    first = tried[0]
    assert (first[:, 0].min() * step / most, first[:, 0].max() * step / most) == pytest.approx((0.03, 1.0))
    rates = first[:, 1] / first[:, 0]
    assert (rates.min(), rates.max()) == pytest.approx((8e-3, 0.25))
    monkeypatch.setattr(pd, "tried", bowl(3.0 * most / step, 0.03))
    assert pd.tune(rig, step, most)[0].k_pf == pytest.approx(most / step)  # no more than the drive gives


def test_of_laws_that_arrive_at_once_the_one_that_rests_soonest_is_taken(monkeypatch):
    """Where friction keeps every one away none arrives at all."""

    def rests(_rig, pairs, _step):
        return np.column_stack([np.full(len(pairs), math.inf), np.abs(np.log(pairs[:, 0] / 100.0))])

    monkeypatch.setattr(pd, "tried", rests)
    law, _ = pd.tune(make_rig("rectilinear"), 0.01, 5.0)
    assert law.k_pf == pytest.approx(100.0, rel=0.06)


SETS = {}
"""Sets of Table 2 that were placed before, by plant and arguments."""


def placed(rig, *how):
    """The same as `paper_sets`, once."""
    key = (rig.plant, *map(str, how))
    if key not in SETS:
        SETS[key] = paper_sets(rig, *how)
    return SETS[key]


def some_damping(model, kp):
    """A PD this stiff, its damping not searched."""
    return pd.near_pd(model, "PD, as stiff", kp, 0.01 * kp)


@pytest.fixture
def tracked(monkeypatch, tmp_path):
    """An experiment whose runs are said beforehand: the trips that are predicted, and what was run on the stand."""

    def track(stand=None, *, tripped=math.inf, saturated=False, stops=99, rig=None, stiffest=some_damping, **more):
        rig, told, left = rig or make_rig("torsional"), [], [stops]
        step = SimpleNamespace(size=0.05, reason="as requested")
        expected = SimpleNamespace(tripped=tripped, effort=SimpleNamespace(saturated=saturated))

        def stopped():
            left[0] -= 1
            return left[0] < 0

        monkeypatch.setattr(tracking, "paper_sets", placed)
        monkeypatch.setattr(tracking, "stiffest_damped", stiffest)
        monkeypatch.setattr(tracking, "choose_step", lambda model, laws, size: step)
        monkeypatch.setattr(tracking, "attempt", lambda model, law, size: expected)
        monkeypatch.setattr(tracking, "figured", lambda trial, size: trial)
        monkeypatch.setattr(
            tracking, "tune", lambda model, size, most: (pd.near_pd(model, "PD", 2.0, 0.1), (size, most))
        )
        done = track_on(rig, stand, tmp_path, None, None, lambda _, share: told.append(share), stopped, **more)
        assert told == sorted(told)
        return done, expected

    return track


class Held:
    """A stand that notes the laws it is given."""

    performed = ""

    def __init__(self, rig, may_fall, make=None):
        self.rig, self.may_fall, self.make, self.held, self.asked = rig, may_fall, make, [], []
        self.names = [c.name for c in rig.plant.coordinates]

    def ask(self, sentence):
        self.asked.append(sentence)

    def hold(self, law, at, folder, stem, seconds, *, reference, pushes):
        self.held.append((stem, seconds, reference, pushes))
        return SimpleNamespace(trial=f"run of {stem}")


def test_every_law_is_tried_and_told_by_its_run(tracked):
    """Four sets, the strongest with a sum, a PD, one as stiff as the strongest, and one on the far encoder."""
    rig = make_rig("torsional")
    stand = Held(rig, True, MAKES["torsional"])
    done, expected = tracked(stand, stiffest=stiffest_damped)
    assert [stem for stem, *_ in stand.held] == [
        *(f"tracking_set_{i}" for i in range(1, 5)), "tracking_with_a_sum", "tracking_PD", "tracking_PD_as_stiff",
        "tracking_PD_far_encoder",
    ]  # fmt: skip
    assert [o.measured for o in done.outcomes] == [f"run of {stem}" for stem, *_ in stand.held]
    assert all(o.predicted is expected for o in done.outcomes)
    assert len(stand.asked) == 8
    (_, seconds, reference, pushes), *_ = stand.held
    np.testing.assert_array_equal(np.column_stack([reference, pushes]), np.column_stack(levels_of(rig, 0.05)))
    assert seconds == pytest.approx((reference.size - 1) * rig.period)
    strongest = max(placed(rig), key=lambda law: law.k_pf)
    np.testing.assert_allclose(done.summed.law.requested, [*strongest.requested, EXTRA])
    assert done.stiff.law.k_pf == strongest.k_pf
    for off in (0.5, 2.0):  # neither less nor more damping decays faster
        other = pd.near_pd(rig, "PD", strongest.k_pf, off * float(done.stiff.law.K[1]))
        assert other.decay < done.stiff.law.decay
    assert (done.far.law.K[2], done.far.law.K[3]) == (2.0, 0.1)
    assert done.search == (0.05, RESERVE * rig.limit)
    own = tracked(None, which=(1,), poles=np.array([-5.0, -6.0, -7.0, -8.0]))[0]
    assert [o.law.name for o in own.sets] == ["set 1", "own set"]
    assert [o.measured for o in own.outcomes] == [o.predicted for o in own.outcomes]  # nothing was run


@pytest.mark.parametrize(
    ("expected", "may_fall", "ran"),
    [({}, False, 7), ({"tripped": 0.3}, False, 0), ({"saturated": True}, False, 0), ({"tripped": 0.3}, True, 8)],
)
def test_a_live_shaft_is_not_asked_for_what_would_trip_saturate_or_grow(tracked, expected, may_fall, ran):
    """A PD on the far encoder is unstable whatever its gains, so that it is tried where nothing breaks."""
    stand = Held(make_rig("torsional"), may_fall, MAKES["torsional"])
    tracked(stand, **expected)
    assert len(stand.held) == ran
    assert not (ran == 7 and any("far" in stem for stem, *_ in stand.held))


@pytest.mark.parametrize(("stops", "there"), [(0, 4), (1, 6), (99, 8)])
def test_a_stop_between_trials_keeps_those_that_were_made(tracked, stops, there):
    done, _ = tracked(None, stops=stops)
    assert len(done.outcomes) == there
    assert done.interrupted == (stops < 2)


@pytest.mark.parametrize("faster", [1.0, 2.0])
def test_poles_for_a_shaft_of_one_s_own_are_as_much_faster_as_it_swings(tracked, faster):
    """A spring four times as stiff swings twice as fast, without friction."""
    nominal = MAKES["torsional"].rig.plant
    free = {n: 0.0 for n in nominal.names() if n.startswith("c_")}
    rig = make_rig("torsional").changed(k_12=faster**2 * nominal.k_12, **free)
    ratio = np.abs(rig.plant.linear(AT).poles().imag).max() / np.abs(nominal.linear(AT).poles().imag).max()
    assert ratio == pytest.approx(faster, rel=0.02)
    done, _ = tracked(Held(rig, True), rig=rig, stops=0)
    for outcome, printed in zip(done.sets, placed(rig), strict=True):
        np.testing.assert_allclose(outcome.law.requested, ratio * printed.requested)


@pytest.mark.parametrize("kind", SHAFTS)
def test_pulses_bring_what_is_free_back_to_where_it_began(kind):
    """A double integrator ends at rest and at zero; pauses of 0.35 s lie between six pulses, and four weaker ones."""
    rig = make_rig(kind, 2)
    dt = 5 * rig.period
    sizes = []
    logs = {"pulses.csv": (0.06, 0.10, 0.05, 0.08, 0.06, 0.04), "others.csv": (0.09, 0.05, 0.10, 0.07)}
    for file, widths in logs.items():
        log = pulses(rig, file)
        u = log["u"]
        assert log.period == pytest.approx(dt)
        speed = np.cumsum(u)
        assert speed[-1] == pytest.approx(0.0, abs=1e-9)
        assert np.cumsum(speed)[-1] == pytest.approx(0.0, abs=1e-9)
        sizes.append(np.abs(u).max())
        assert set(np.abs(u)) == {0.0, sizes[-1]}
        on = np.flatnonzero(np.diff(np.concatenate([[0], np.abs(u) > 0, [0]])))
        begins, ends = on[::2], on[1::2]
        np.testing.assert_allclose((ends - begins) * dt, 4 * np.array(widths), atol=2.01 * dt)
        np.testing.assert_allclose(np.diff(np.concatenate([[0], begins]))[0] * dt, 0.35, atol=0.51 * dt)
        np.testing.assert_allclose((begins[1:] - ends[:-1]) * dt, 0.35, atol=0.51 * dt)
        assert (u[begins] > 0).tolist() == [i % 2 == 0 for i in range(len(widths))]
        assert (u.size - ends[-1]) * dt == pytest.approx(0.35, abs=0.51 * dt)
    assert sizes == pytest.approx([MAKES[kind].pulse, 0.7 * MAKES[kind].pulse], abs=rig.converter)
    assert {log.units[n] for n in log.outputs} == {"counts"}


@pytest.mark.parametrize("kind", SHAFTS)
def test_the_study_of_a_shaft_starts_30_percent_off_and_knows_the_gain_or_what_was_weighed(kind):
    rig, make = make_rig(kind, 2), MAKES[kind]
    body = make.body
    design = make.rig.plant.parameters()
    alone = tomllib.loads(shaft_study(rig, 3))
    weighed = (Known(name=body, value=0.5, stderr=0.01), Known(name="k_12", value=9.0, stderr=0.1))
    known = tomllib.loads(shaft_study(rig, 3, weighed))
    for study in (alone, known):
        for name, entry in study["parameters"].items():
            if "guess" in entry:
                ratio = parse(entry["guess"], make.rig.plant.quantity(name).unit) / design[name]
                assert min(abs(ratio - 0.7), abs(ratio - 1.3)) < 1e-3
                assert entry["min"] == 0
        assert set(study["parameters"]) == {n for n, v in design.items() if v}
        assert parse(study["actuator"]["delay"], "s") == pytest.approx(rig.delay)
        assert parse(study["actuator"]["lag"], "s") == pytest.approx(rig.lag)
        assert {run["file"]: run["role"] for run in study["runs"]} == {"pulses.csv": "fit", "others.csv": "predict"}
        assert study["defaults"]["initial"] == dict.fromkeys(rig.plant.state_names()[1::2], 0.0)  # at rest
    unit = make.rig.plant.quantity(body).unit
    assert "guess" in alone["parameters"][body]
    assert parse(known["parameters"][body]["value"], unit) == pytest.approx(0.5)
    assert parse(known["parameters"][body]["uncertainty"], unit) == pytest.approx(0.01)
    assert "guess" in known["parameters"]["k_12"]  # it errs with the inertia
    assert alone["actuator"]["gain"]["uncertainty"] == "2 %"
    assert "guess" in known["actuator"]["gain"]


def test_a_shaft_with_a_spring_to_ground_is_not_tracked():
    rig = make_rig("torsional")
    assert rig_of_file(rig, "fit.json").name == "the rig of fit.json"
    for spring in ("k_1", "k_2"):
        with pytest.raises(BadInput, match="without springs to ground"):
            rig_of_file(rig.changed(**{spring: 1.0}), "fit.json")
    with pytest.raises(BadInput, match="two inertias on a shaft"):
        rig_of_file(make_rig("linear"), "fit.json")


@pytest.mark.parametrize("k_pf", [3.0, 7.7, 11.3, 19.9, 41.0, 0.067])
def test_a_step_has_two_digits_and_never_more_than_its_bound(monkeypatch, k_pf):
    """By effort alone: 95 % of the limit over the gain, cut off after two digits."""
    rig = make_rig("torsional")
    monkeypatch.setattr(tracking, "attempt", lambda *_: SimpleNamespace(twist=1e-9, travel=1e-9))
    laws = [SimpleNamespace(k_pf=k) for k in (0.5 * k_pf, -k_pf)]
    chosen = choose_step(rig, laws)
    most = 0.95 * rig.limit / k_pf
    assert chosen.by_effort == pytest.approx(most)
    assert chosen.size <= most
    exponent = math.floor(math.log10(most)) - 1
    assert chosen.size == pytest.approx(math.floor(most / 10.0**exponent) * 10.0**exponent)
    assert chosen.reason == "bounded by effort"
    asked = choose_step(rig, laws, 0.0123)
    assert (asked.size, asked.reason) == (0.0123, "as requested")


@pytest.mark.parametrize("which", [(5,), (1, 7), (0, 2)])
def test_a_set_that_table_2_has_not_is_refused_among_others_too(which):
    with pytest.raises(BadInput, match="Table 2 has sets 1 to 4"):
        pd.check_sets(which, None)
    pd.check_sets((1, 4), None)
    with pytest.raises(BadInput, match="nothing to follow with"):
        pd.check_sets((), None)
