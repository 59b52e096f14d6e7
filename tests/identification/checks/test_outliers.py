"""Stretches that something else than the input moved are named with their time, and left out; clean ones are not."""

from __future__ import annotations

import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tests.identification.twins import PENDULUM, noisy, rig, swing
from upright.identification.checks.outliers import (
    BUMPED,
    SELF_EXCITED,
    SPIKES,
    TOUCHED,
    UNEXPLAINED,
    Outlier,
    ProvisionalFit,
    Stretches,
    _compared,
    _spiky,
    _strange,
    _usual,
    explains_worse,
    half_swings,
    outliers,
    refit_without_outliers,
    without_outliers,
)
from upright.identification.estimate import identify
from upright.identification.model.runs import Run
from upright.physics import Pendulum, find
from upright.signals.spikes import spikes
from upright.simulation import simulate

GUESSES = {"J_p": 2.6e-3, "b_2": 1.4e-3, "b_2c": 2.6e-3}


def swings(seed: int, count: int = 3):
    """Clean noisy swings from different angles."""
    return [noisy(swing(angle=0.9 + 0.4 * k, label=f"swing {k}"), 1e-3, 10 * seed + k) for k in range(count)]


def pushed(run, at: float, speed: float):
    """The run as it goes on when a finger changes the pendulum's speed by `speed` [rad/s] at the time `at` [s]."""
    plant, dt, n = Pendulum(**PENDULUM), run.period, run.t.size
    x = simulate(plant, {}, [run.y[0, 0], 0.0], None, dt, samples=n, substeps=2)[:, :, 0]
    i = round(at / dt)
    x[i:] = simulate(plant, {}, x[i] + [0.0, speed], None, dt, samples=n - i, substeps=2)[:, :, 0]
    return replace(run, y=x[:, [0]])


def found(fit, runs):
    """Reasons and times by run, of the model that came out."""
    return [(o.run, o.reason, o.start, o.stop) for o in outliers(fit, fit.model, runs)]


@pytest.mark.parametrize("seed", range(5))
def test_clean_swings_raise_no_alarm(seed):
    runs = swings(seed)
    fit = identify(rig(Pendulum, PENDULUM, GUESSES), runs)
    assert found(fit, runs) == []
    assert not any("Outlier" in w for w in fit.warnings)
    assert without_outliers(runs, ()) == runs


def test_three_lost_counts_are_named_and_taken_out():
    runs = swings(7)
    y = runs[1].y.copy()
    at = [211, 500, 803]
    y[at, 0] += [0.4, -0.3, 0.35]
    clean, runs[1] = runs[1], replace(runs[1], y=y)
    fit = identify(rig(Pendulum, PENDULUM, GUESSES), runs)
    (told,) = [o for o in outliers(fit, fit.model, runs) if o.reason == SPIKES]
    assert (told.run, told.start, told.stop) == ("swing 1", pytest.approx(2.11), pytest.approx(8.03))
    assert all(f"{i * 0.01:.4g} s" in told.evidence for i in at)
    assert any("swing 1" in w and SPIKES in w for w in fit.warnings)
    # as if they had never been, but for the noise of three samples
    other = identify(rig(Pendulum, PENDULUM, GUESSES), [runs[0], clean, runs[2]])
    for n in GUESSES:
        assert fit.estimates[n].value == pytest.approx(other.estimates[n].value, abs=0.05 * other.estimates[n].stderr)


@pytest.mark.parametrize(("count", "listed", "more"), [(1, 1, False), (5, 5, False), (6, 5, True), (40, 5, True)])
def test_of_many_lost_counts_five_are_named_and_all_of_their_span(count, listed, more):
    (run,) = swings(7, 1)
    times = [0.25 * (k + 1) for k in range(count)]
    told = _spiky(run, [(t, "theta") for t in times])
    assert (told.start, told.stop) == (times[0], times[-1])
    assert told.evidence.count(" s") == listed
    assert told.evidence.startswith("theta at 0.25 s")
    assert told.evidence.endswith("and others") == more


def test_a_finger_is_named_with_its_time_and_left_out():
    runs = swings(3)
    runs[2] = noisy(pushed(runs[2], 5.03, 1.5), 1e-3, 99)
    fit = identify(rig(Pendulum, PENDULUM, GUESSES), runs)
    ((run, reason, start, stop),) = found(fit, runs)
    assert (run, reason) == ("swing 2", BUMPED)
    assert start <= 5.03 <= stop
    assert stop - start < 1.5  # half a swing takes 0.6 s
    for n in GUESSES:
        low, high = fit.estimates[n].interval
        assert low < PENDULUM[n] < high, n
    assert "swing 2" in fit.verdict
    assert {"swing 0", "swing 1", "swing 2"} <= set(fit.runs)
    assert all(s.role == "fit" for label, s in fit.runs.items() if label != "swing 2")
    # the finger would have bent the answer
    bent = identify(rig(Pendulum, PENDULUM, GUESSES), runs, watch=False)
    off = {n: abs(f.estimates[n].value - PENDULUM[n]) for f in (bent,) for n in GUESSES}
    assert any(off[n] > 5 * abs(fit.estimates[n].value - PENDULUM[n]) for n in GUESSES)


def test_a_hand_at_the_end_is_named():
    runs = swings(4)
    runs[0] = noisy(pushed(runs[0], 9.7, 1.5), 1e-3, 98)
    fit = identify(rig(Pendulum, PENDULUM, GUESSES), runs)
    ((run, reason, start, _),) = found(fit, runs)
    assert (run, reason) == ("swing 0", TOUCHED.format("end"))
    assert start <= 9.7


def test_a_swing_that_feeds_itself_is_named():
    # the same pendulum, driven by its own speed: scipy's integration of theta'' = -w^2 sin(theta) + 0.24 theta'
    runs = swings(5)
    p = PENDULUM
    w_2 = p["m_p"] * 9.81 * p["l_cg"] / (p["J_p"] + p["m_p"] * p["l_cg"] ** 2)
    s = solve_ivp(
        lambda _, x: [x[1], -w_2 * np.sin(x[0]) + 0.24 * x[1]], (0, 10), [0.3, 0], t_eval=runs[1].t, rtol=1e-9
    )
    growing = s.y[0]
    runs[1] = noisy(replace(runs[1], y=growing[:, None]), 1e-3, 97)
    fit = identify(rig(Pendulum, PENDULUM, GUESSES), runs)
    ((run, reason, start, stop),) = found(fit, runs)
    assert (run, reason) == ("swing 1", SELF_EXCITED)
    assert 0 < start < 8.5 < stop  # once the swing is large enough to count
    for n in GUESSES:
        low, high = fit.estimates[n].interval
        assert low < PENDULUM[n] < high, n


@pytest.mark.parametrize("small", [0.2, 0.4])
def test_the_only_fitted_run_is_not_judged_by_one_that_was_not_fitted(small):
    # drag that the model lacks is missed in a large swing and not in a small one
    truth = PENDULUM | {"b_2q": 5e-3}
    runs = [
        noisy(swing(truth, angle=2.5, label="fitted"), 1e-3, 1),
        noisy(swing(truth, angle=small, label="small", role="predict"), 1e-3, 2),
    ]
    fit = identify(rig(Pendulum, {n: v for n, v in PENDULUM.items() if n != "b_2q"}, GUESSES), runs)
    assert set(fit.runs) == {"fitted", "small"}
    assert "fitted" not in {run for run, *_ in found(fit, runs)}


def test_a_coordinate_that_only_one_run_measures_is_held_against_itself():
    values = {"J_1": 0.01, "J_2": 0.01, "k_12": 1.4, "c_1": 0.007, "c_2": 0.001}
    disks, dt, n = find("torsional-2"), 5e-3, 2000
    u = 0.3 * np.sin(3 * np.arange(n) * dt)[:, None]
    # drag on the second disk: every half swing is missed by a model that does not know it
    y = simulate(disks(**values, f_2q=0.01), {}, [0.0] * 4, u, dt, samples=n, substeps=4)[:, ::2, 0]
    both = Run(label="both", role="fit", t=np.arange(n) * dt, u=u, y=y, measured=("theta_1", "theta_2"))
    one = replace(both, label="one", y=y[:, :1], measured=("theta_1",))
    fit = identify(rig(disks, values, {"c_1": 0.005}), [both, one], watch=False)
    assert found(fit, [both, one]) == []


def test_what_a_stretch_is_missed_by_is_a_number_that_means_something():
    runs = swings(3)
    runs[2] = noisy(pushed(runs[2], 5.03, 1.5), 1e-3, 99)
    fit = identify(rig(Pendulum, PENDULUM, GUESSES), runs)
    (told,) = outliers(fit, fit.model, runs)
    times = re.search(r"missed (more than )?([\d.]+) times", told.evidence)
    assert times is not None
    assert 4 <= float(times[2]) < 100


@pytest.mark.parametrize(("samples", "left"), [(150, 0), (149, 4), (237, 4), (293, 4)])
def test_a_short_run_is_judged_to_its_end_even_where_an_eighth_of_it_is_half_a_sample_off(samples, left):
    """An eighth of 149 intervals of 10 ms rounds to 19, and the stretch added at the end ends where the run does.

    An eighth of 148, 236 and 292 is 18.5, 29.5 and 36.5: 8 times 18, 29 and 36 leave 4 intervals at most. In binary the
    end alone may round the other way, so that only one stretch fits into it and none is added.
    """
    run = swing(angle=0.9).samples(slice(samples))
    halves = half_swings(rig(Pendulum, PENDULUM, {}), run, {})
    assert halves is not None
    assert halves.start[0] == 0
    assert -1e-9 < run.t[-1] - halves.stop[-1] < left * 0.01 + 1e-9


def test_a_fast_motion_is_no_spike():
    # 20 samples a period: at every turn the middle of five samples is off by (1 - cos(2 pi/20)) of the amplitude
    x = np.sin(2 * np.pi * np.arange(400) / 20)
    assert spikes(x).size == 0
    steps = np.where(np.arange(400) // 50 % 2, 1.0, -1.0)
    assert spikes(steps).size == 0
    x[100] += 2.0
    assert spikes(x).tolist() == [100]


def ended(fit):
    """A search of which everything is known already."""
    return ProvisionalFit(fit=fit, whole=lambda: fit, interrupted=lambda: fit)


@pytest.mark.parametrize("interrupted", [False, True])
def test_reasons_are_those_of_the_last_fit_that_was_finished(interrupted):
    """A fit that was broken off is no model to judge by: what the first one found strange stays so."""
    question, runs = rig(Pendulum, PENDULUM, GUESSES), swings(3)
    runs[2] = noisy(pushed(runs[2], 5.03, 1.5), 1e-3, 99)
    first = identify(question, runs, watch=False)
    second = identify(question, without_outliers(runs, outliers(first, question, runs)), watch=False)
    # broken off where friction was still far too large, which misses other stretches
    b_2 = second.estimates["b_2"]
    wrong = {**second.estimates, "b_2": replace(b_2, value=3 * b_2.value)}
    broken = replace(second, estimates=wrong, interrupted=True)
    last = broken if interrupted else second
    calls = []

    def again(kept, near):
        assert near is (last if calls else first)
        calls.append(kept)
        return ended(last)

    fit = refit_without_outliers(ended(first), question, runs, again)
    by_first, by_last = ([o.sentence for o in outliers(f, question, runs)] for f in (first, last))
    assert by_first != by_last
    told = [w.removeprefix("Outlier: ") for w in fit.warnings if w.startswith("Outlier: ")]
    assert told == (by_first if interrupted else by_last)
    assert len(calls) == 1 or not interrupted
    assert fit.interrupted is interrupted


def test_where_nothing_is_strange_the_first_fit_stands(monkeypatch):
    monkeypatch.setattr("upright.identification.checks.outliers.outliers", lambda *_: ())
    first = ended(object())

    def again(kept, near):
        raise AssertionError("nothing was taken out, so nothing is to be fitted again")

    assert refit_without_outliers(first, rig(Pendulum, PENDULUM, GUESSES), swings(3), again) is first.fit


def test_a_fit_without_outliers_is_that_of_the_retained_runs_with_intervals_and_predictions():
    """As if the stretch had been cut out by hand: nothing is left at what the quick look at outliers needed."""
    question, runs = rig(Pendulum, PENDULUM, GUESSES), swings(3)
    runs[2] = noisy(pushed(runs[2], 5.03, 1.5), 1e-3, 99)
    runs.append(replace(swings(4, 1)[0], label="held out", role="predict"))
    fit = identify(question, runs)
    retained = without_outliers(runs, outliers(identify(question, runs, watch=False), question, runs))
    by_hand = identify(question, retained, watch=False)
    assert "outliers" in fit.verdict
    assert fit.trusted is by_hand.trusted
    assert re.sub(r"[\d.]+", "", fit.verdict).startswith(re.sub(r"[\d.]+", "", by_hand.verdict))
    assert fit.runs["held out"].fit_percent.keys() == by_hand.runs["held out"].fit_percent.keys()
    for name, e in by_hand.estimates.items():
        # both searches stop where a step would gain a millionth of the cost, a thousandth of a standard error
        assert fit.estimates[name].value == pytest.approx(e.value, abs=0.02 * e.stderr)
        assert fit.estimates[name].interval == pytest.approx(e.interval, abs=0.02 * e.stderr)
        assert fit.estimates[name].status == e.status


N = 24
"""Half swings of a second each, of 0.5 rad, that are missed by a hundredth of a radian."""


def missed(where, by=0.5, constant=True, moved=0.5, **more):
    """A run of half swings that is missed by more at some of them."""
    times = np.arange(N, dtype=float)
    far = np.full((N, 1), 0.01)
    far[list(where), 0] = by
    run = replace(swing(angle=0.5, label="a"), measured=("theta",))
    return Stretches(run=run, start=times, stop=times + 1, missed=far, moved=np.broadcast_to(moved, (N, 1)),
                     constant=np.broadcast_to(constant, N), resolution=np.array([1e-4]), **more)  # fmt: skip


def told_of(stretches, spread=0.4):
    return [(o.start, o.stop, o.reason) for o in _strange(stretches, [stretches], {"theta": spread})]


@pytest.mark.parametrize(
    ("where", "reason"),
    [
        ([0], TOUCHED.format("start")), ([1], TOUCHED.format("start")), ([2], BUMPED), ([10], BUMPED),
        ([N - 3], BUMPED), ([N - 2], TOUCHED.format("end")), ([N - 1], TOUCHED.format("end")),
        ([9, 10, 11], BUMPED), ([9, 10, 12], BUMPED), ([8, 9, 10, 11], UNEXPLAINED),
    ],
)  # fmt: skip
def test_a_push_is_told_from_hands_at_either_end_and_from_what_no_push_explains(where, reason):
    """Within two half swings of an end it is a hand; four half swings in a row are no single push."""
    falling = missed(where, moved=0.5 * 0.9 ** np.arange(N)[:, None])
    assert told_of(falling) == [(where[0], where[-1] + 1, reason)]


def test_pushes_that_are_apart_are_told_apart_and_where_the_command_changed_none_is():
    falling = 0.5 * 0.9 ** np.arange(N)[:, None]
    assert told_of(missed([5, 12], moved=falling)) == [(5, 6, BUMPED), (12, 13, BUMPED)]
    constant = np.ones(N, dtype=bool)
    constant[5] = False
    assert told_of(missed([5, 12], moved=falling, constant=constant)) == [(12, 13, BUMPED)]


def test_a_swing_that_goes_on_for_as_long_feeds_itself():
    assert told_of(missed(range(5, 10))) == [(5, 10, SELF_EXCITED)]
    assert told_of(missed(range(5, 10), moved=0.5 * 0.9 ** np.arange(N)[:, None])) == [(5, 10, UNEXPLAINED)]


@pytest.mark.parametrize(("by", "far"), [(0.039, False), (0.041, True)])
def test_four_times_the_usual_is_far(by, far):
    """Of a signal so small that a twentieth of it is less."""
    assert bool(told_of(missed([10], by=by, moved=0.5 * 0.9 ** np.arange(N)[:, None]), spread=0.1)) == far


@pytest.mark.parametrize(("by", "far"), [(0.049, False), (0.051, True)])
def test_a_twentieth_of_the_signal_is_far(by, far):
    assert bool(told_of(missed([10], by=by, moved=0.5 * 0.9 ** np.arange(N)[:, None]), spread=1.0)) == far


def test_how_far_is_told_up_to_a_hundredfold():
    falling = 0.5 * 0.9 ** np.arange(N)[:, None]
    for by, words in (
        (0.5, "missed 50 times as much as the other stretches"), (0.99, "missed 99 times as much"),
        (1.01, "missed more than 99 times as much"), (np.inf, "the simulation runs away there"),
    ):  # fmt: skip
        stretches = missed([10], by=by, moved=falling)
        (told,) = _strange(stretches, [stretches], {"theta": 0.4})
        assert told.evidence.startswith(words)


def test_a_run_is_judged_by_its_own_runs_that_move():
    """Half swings of less than three hundredths of the signal say nothing of what is usual."""
    moved = np.full((N, 1), 0.5)
    moved[: N // 2] = 0.02
    far = np.where(np.arange(N)[:, None] < N // 2, 1.0, 0.01)
    one = replace(missed([]), missed=far, moved=moved)
    assert _usual(one, [one], "theta", 1.0) == pytest.approx(0.01)
    assert _usual(one, [one], "theta", 0.5) == pytest.approx(1.0)
    quiet = replace(one, moved=np.full((N, 1), 0.01))
    assert _usual(one, [quiet], "theta", 1.0) == pytest.approx(0.01)  # where the others do not move, its own
    assert _usual(quiet, [quiet], "theta", 1.0) == 0.0


def scored(**percents):
    """A fit of runs explained by so many percent, signal by signal."""
    roles = {"other": "predict"}
    return SimpleNamespace(runs={
        label: SimpleNamespace(role=roles.get(label, "fit"), fit_percent=dict(zip("xy", p, strict=True)))
        for label, p in percents.items()
    })  # fmt: skip


@pytest.mark.parametrize(
    ("new", "worse"),
    [
        ({"a": (90, 80), "b": (70, 60)}, False), ({"a": (87.1, 77.1), "b": (67.1, 57.1)}, False),
        ({"a": (86.9, 95), "b": (95, 95)}, True), ({"a": (95, 95), "b": (95, 56.9)}, True),
        ({"a": (90, 80), "b": (70, 60), "new": (1, 1)}, False), ({"a": (90, 80), "other": (1, 1)}, False),
    ],
)  # fmt: skip
def test_a_fit_went_astray_where_one_signal_of_one_run_is_explained_three_percent_worse(new, worse):
    old = scored(a=(90, 80), b=(70, 60), other=(50, 50))
    assert explains_worse(scored(**new), old) is worse


def test_spikes_that_nobody_named_stay():
    (run,) = swings(7, 1)
    y = run.y.copy()
    y[[211, 500], 0] += 0.4
    spiked = replace(run, y=y)
    named = Outlier(run=spiked.label, start=2.0, stop=5.1, reason=SPIKES, evidence="")
    assert np.array_equal(without_outliers([spiked], [])[0].y, y)
    assert np.array_equal(without_outliers([spiked], [replace(named, run="another")])[0].y, y)
    (clean,) = without_outliers([spiked], [named])
    assert clean.y[[211, 500], 0] == pytest.approx(run.y[[211, 500], 0], abs=0.02)


@pytest.mark.parametrize(
    ("interval", "words"), [((0.9, 1.2), "stays within its interval"), ((1.05, 1.2), "1 instead of 1.1 kg")]
)
def test_what_outliers_do_to_a_number_is_told_where_it_leaves_its_interval(interval, words):
    before = SimpleNamespace(estimates={"m": SimpleNamespace(value=1.0)})
    after = SimpleNamespace(estimates={"m": SimpleNamespace(value=1.1, unit="kg", interval=interval)})
    assert words in _compared(before, after)
