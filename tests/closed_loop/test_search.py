"""Are held commands, limits and families told from the signals themselves, by counting?"""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from upright.closed_loop.recovery import Gain, Recovery, TriedStructure, as_json, loop_recovered, loop_written
from upright.closed_loop.regression import (
    Columns,
    Family,
    Regression,
    Signals,
    bracket,
    channels_of,
    columns,
    fit,
    gains_of,
    held_out,
    law_of,
    refine,
    structure,
)
from upright.closed_loop.search import Search, extremes, held_for, stepped
from upright.closed_loop.structures import Channel, Filter, finer, joined, memory_before
from upright.errors import NotIdentifiable
from upright.records import Provenance, Record

RNG = np.random.default_rng(7)
T = 0.01


@pytest.mark.parametrize(
    ("hold", "first", "found"),
    [(1, 0, (1, 0)), (3, 0, (3, 0)), (3, 1, (3, 1)), (50, 2, (50, 2)), (51, 0, (1, 0))],
)
def test_a_command_that_is_held_is_known_by_the_rows_at_which_it_changes(hold, first, found):
    u = np.repeat(np.arange(40.0), hold)
    u = np.concatenate([np.full(first, -1.0), u])
    assert held_for(u) == found
    junk = u.copy()
    junk[:3] = 7.0, 8.0, 9.0  # of a front end's memory
    assert held_for(junk) == found


@pytest.mark.parametrize(("changes", "found"), [(19, (1, 0)), (20, (4, 0))])
def test_twenty_changes_are_needed_to_call_a_command_held(changes, found):
    assert held_for(np.repeat(np.arange(changes + 1.0), 4)) == found


def test_a_command_is_at_its_limit_where_it_stays_for_three_rows():
    u = np.array([1.0, 5.0, 5.0, 5.0, 2.0, 5.0, -3.0, -3.0, 0.0])
    high, low = extremes(u)
    assert high.tolist() == [x == 5.0 for x in u]
    assert not low.any()  # two rows only
    high, low = extremes(-u)
    assert low.tolist() == [x == 5.0 for x in u]
    assert not high.any()
    assert not extremes(np.array([0.0, 0.0, 0.0, -1.0, -2.0]))[0].any()  # zero is no limit


def test_a_reference_steps_right_after_the_row_before():
    assert stepped(np.array([1.0, 2.0, 5.0]), 3).tolist() == [1, 2, 2, 2, 5, 5, 5]
    assert stepped(np.array([1.0, 2.0]), 1).tolist() == [1, 2]


def test_a_signal_between_its_rows_is_a_cubic_spline():
    x = RNG.normal(size=9)
    assert finer(x, 1) is x
    assert finer(x, 4) == pytest.approx(CubicSpline(np.arange(9), x)(np.arange(33) / 4))


def search(u=None, *, r=None, every=1, y=None):
    y = RNG.normal(size=200) if y is None else y
    u = RNG.normal(size=y.size) if u is None else u
    return Search(("y",), ("r",) if r is not None else (), [y], [] if r is None else [r], (), u, T, every)


def test_families_are_those_that_the_log_can_tell_apart_simplest_first():
    plain = {(f.smoothing, f.on, f.delay, f.hold) for f in search().families()}
    assert plain == {(s, "error", d, False) for s in ("difference", "two taps", "filter") for d in (0, 1)}
    coarse = {(f.smoothing, f.on) for f in search(every=2).families()}
    assert coarse == {("difference", "error"), ("filter", "error")}
    steps = np.repeat([0.0, 1.0], 100)
    assert {f.on for f in search(r=steps).families()} == {"error", "measurement"}
    assert {f.on for f in search(r=np.ones(200)).families()} == {"error"}
    limited = RNG.normal(size=200)
    limited[50:54] = 9.0
    families = search(limited).families()
    assert {f.hold for f in families} == {False, True}
    assert [f.extras for f in families] == sorted(f.extras for f in families)
    assert Family(smoothing="filter", delay=1, hold=True).extras == 3
    assert Family().extras == 0


def test_a_command_that_is_nearly_always_at_its_limit_shows_no_law():
    u = np.full(200, 9.0)
    u[3:42] = RNG.normal(size=39)
    with pytest.raises(NotIdentifiable, match="at its limit in all but 39 rows"):
        search(u).search()
    u[42] = 0.5
    assert search(u).search().gains.size > 0


def test_what_counts_as_missing_no_more_is_a_share_a_step_or_the_arithmetic():
    u = np.round(RNG.normal(size=200) * 4) / 4
    u[5] = 3.0
    made = search(u)
    assert made.resolution == pytest.approx(0.25)
    assert made.bar(10.0) == pytest.approx(10.03)
    assert made.bar(0.0) == pytest.approx(0.35 * 0.25)
    smooth = search(RNG.normal(size=200))
    assert smooth.bar(0.0) == pytest.approx(
        max(1e-12 * np.abs(smooth.u[3:]).max(), 0.35 * smooth.resolution)
    )  # fmt: skip


def test_the_first_three_rows_tell_nothing_of_the_step_of_a_command():
    u = 0.25 * RNG.integers(-9, 9, size=200)
    u[:3] = 0.1037, -7.77e-5, 0.013  # what a front end's memory held
    assert search(u).resolution == pytest.approx(0.25)


def regression(terms, gains, *, missed=0.0, pole=0.0, X=None, **family):
    X = np.zeros((8, len(terms))) if X is None else X
    made = Columns(terms=tuple(terms), X=X, slope=np.zeros_like(X))
    return Regression(family=Family(**family), pole=pole, columns=made, gains=np.array(gains), missed=missed)


def test_the_fewest_numbers_win_among_those_that_miss_alike():
    made = search()
    one = regression([("kp", 0)], [1.0], missed=1.0029)
    two = regression([("kp", 0), ("ki", 0)], [1.0, 1.0], missed=1.0)
    far = regression([("kp", 0)], [1.0], missed=1.0031)
    assert made.simplest([two, one]) is one
    assert made.simplest([two, far]) is two
    late = regression([("kp", 0), ("ki", 0)], [1.0, 1.0], missed=0.9999, delay=1)
    assert made.simplest([late, two]) is two
    assert [f for _, f in made.tried] == [two, one, two, far, late, two]
    assert made.dropped(one) == {("ki", 0), ("kd", 0)}


def test_a_limit_is_where_the_law_asked_for_more():
    u = np.clip(np.linspace(-3, 3, 200), -2.0, 2.5)
    made = search(u)
    asked = np.linspace(-3, 3, 200)[:, None]
    best = regression([("kp", 0)], [1.0], X=asked)
    assert made.limited(best).tolist() == ((u == 2.5) | (u == -2.0)).tolist()
    # what asks for less than the largest rests there by itself
    low = regression([("kp", 0)], [0.7], X=asked)
    assert not made.limited(low)[u == 2.5].any()
    exact = regression([("kp", 0)], [1.0], X=u[:, None])
    assert not made.limited(exact).any()
    rough = regression([("kp", 0)], [1.0], X=asked, missed=1.0)  # no better than what lies beyond
    assert not rough.missed * 3 < np.max(asked) - 2.5
    assert not made.limited(rough).any()


def signals(y, r=None, *, every=1, moving=None, feedforward=()):
    n = y.size
    return Signals(
        names=("y",), pairs=((y, r),), feedforward=feedforward, period=T, every=every,
        moving=np.ones(n) if moving is None else moving,
    )  # fmt: skip


def test_columns_are_what_a_program_would_compute():
    y, r = RNG.normal(size=30), RNG.normal(size=30)
    moving = (RNG.uniform(size=30) > 0.3).astype(float)
    fed = RNG.normal(size=30)
    s = signals(y, r, moving=moving, feedforward=(("f", fed),))
    e = r - y
    made = columns(s, Family(hold=True, smoothing="two taps"), 0.0)
    assert made.terms == (("kp", 0), ("ki", 0), ("kd", 0), ("kd2", 0), ("ff", 0), ("1", 0))
    quotient = np.concatenate([[0.0], np.diff(e) / T])
    expected = [e, T * np.cumsum(e * moving), quotient, np.concatenate([[0.0], quotient[:-1]]), fed, np.ones(30)]
    assert pytest.approx(np.column_stack(expected)) == made.X
    late = columns(s, Family(on="measurement", delay=1), 0.0, frozenset({("ki", 0)}))
    assert late.terms == (("kp", 0), ("kd", 0), ("ff", 0), ("1", 0))
    rate = np.concatenate([[0.0], -np.diff(y) / T])
    assert late.X[:, 0] == pytest.approx(np.concatenate([[e[0]], e[:-1]]))
    assert late.X[:, 1] == pytest.approx(np.concatenate([[0.0], rate[:-1]]))
    assert late.X[:, 2] == pytest.approx(fed)  # what is added is added at once
    zero = columns(signals(y), Family(), 0.0)
    assert zero.X[:, 0] == pytest.approx(-y)
    third = columns(signals(np.arange(31.0), every=3), Family(), 0.0)
    assert third.X[:, 0] == pytest.approx(-np.arange(0, 31, 3.0))
    assert third.X[:, 3].tolist() == [1.0] * 11


def test_a_filter_s_column_is_its_recursion_and_its_slope_a_difference():
    y, pole = RNG.normal(size=40), 0.7
    s = signals(y)
    made = columns(s, Family(smoothing="filter"), pole)
    assert made.terms == (("kp", 0), ("ki", 0), ("kd", 0), ("start", 0), ("1", 0))
    d = np.zeros(40)
    for k in range(40):
        d[k] = pole * (d[k - 1] if k else 0.0) + (1 - pole) * (-(y[k] - y[k - 1]) / T if k else 0.0)
    assert made.X[:, 2] == pytest.approx(d)
    assert made.X[:, 3] == pytest.approx(pole ** np.arange(40.0))
    h = 1e-6
    near = [columns(s, Family(smoothing="filter"), pole + k * h).X for k in (1, -1)]
    assert made.slope == pytest.approx((near[0] - near[1]) / (2 * h), abs=1e-5)
    dropped = columns(s, Family(smoothing="filter"), pole, frozenset({("kd", 0)}))
    assert dropped.terms == (("kp", 0), ("ki", 0), ("1", 0))


def test_every_second_of_forty_stretches_is_held_out():
    out = held_out(400)
    assert out.tolist() == [(k // 10) % 2 == 1 for k in range(400)]


def test_gains_of_columns_of_any_size_are_found_and_a_zero_column_gets_none():
    X = RNG.normal(size=(50, 3)) * [1e-9, 1.0, 1e9]
    X = np.column_stack([X, np.zeros(50)])
    gains = np.array([2e9, -3.0, 4e-9, 0.0])
    assert gains_of(X, X @ gains) == pytest.approx(gains)


def test_what_rows_held_out_miss_is_judged_by_gains_of_the_others():
    x = RNG.normal(size=400)
    out = held_out(400)
    u = np.where(out, 5.0, 2.0) * -x
    used = np.ones(400, dtype=bool)
    drop = frozenset({("ki", 0), ("kd", 0)})
    made = fit(signals(x), Family(), u, used, drop)
    # a gain of 2 by the rows fitted misses 3 times the signal where it was not
    assert made.missed == pytest.approx(3.0 * np.sqrt(np.mean(x[out] ** 2)), rel=0.05)
    # and the gain kept is that of all rows
    A = np.column_stack([-x, np.ones(400)])
    assert made.gains == pytest.approx(np.linalg.lstsq(A, u, rcond=None)[0])
    assert made.pole == 0.0
    assert fit(signals(x), Family(), u, used & ~out, drop).missed == math.inf
    assert made.parameters == 2
    assert made.predicted == pytest.approx(A @ made.gains)


@pytest.mark.parametrize("pole", [0.05, 0.55, 0.93, 0.998])
def test_the_pole_of_a_filter_is_searched_to_the_last_digit(pole):
    y = np.cumsum(RNG.normal(size=3000)) * 0.01
    s = signals(y)
    truth = columns(s, Family(smoothing="filter"), pole)
    u = truth.X @ np.array([2.0, 0.5, 0.1, 0.0, 0.3])
    rows = np.ones(3000, dtype=bool)

    def at(p):
        return columns(s, Family(smoothing="filter"), p)

    near = bracket(at, u, rows)
    assert near == pytest.approx(pole, abs=1e-3 * (1.001 - pole) + 1e-3)
    assert refine(at, u, rows, near) == pytest.approx(pole, abs=1e-7)


def test_taps_average_where_both_have_one_sign():
    def two(a, b):
        return regression([("kd", 0), ("kd2", 0)], [a, b], smoothing="two taps").averages

    assert two(1.0, 0.5)
    assert two(-1.0, -0.5)
    assert two(1.0, 0.0)
    assert not two(1.0, -0.5)


def test_channels_and_law_of_a_regression_are_a_program_line_by_line():
    terms = [("kp", 0), ("kd", 0), ("kd2", 0), ("kp", 1), ("ki", 1), ("1", 0)]
    made = regression(terms, [2.0, 0.3, 0.1, 0.0, 0.0, 5.0], smoothing="two taps", on="measurement")
    (only,) = channels_of(made, ["a", "b"], ["r"])
    assert only == Channel(
        measured="a", reference="r", kp=2.0, kd=0.4, on="measurement", filter=Filter(second=0.1 / 0.4)
    )
    y, r = RNG.normal(size=20), RNG.normal(size=20)
    s = Signals(names=("a", "b"), pairs=((y, r), (y, None)), feedforward=(), period=T, every=1, moving=np.ones(20))
    law = law_of(made, (only,), s, 50.0)
    assert (law.limit, law.windup, law.period, law.delay) == (50.0, "free", T, 0.0)
    u = replace(law, references=r[:, None]).follow(y[:, None])[0][:, 0]
    before, rate = y[0], 0.0
    for k in range(20):
        now = -(y[k] - before) / T
        assert u[k] == pytest.approx(np.clip(2.0 * (r[k] - y[k]) + 0.3 * now + 0.1 * rate + 5.0, -50, 50))
        before, rate = y[k], now
    held = law_of(regression(terms, [2.0, 0, 0, 0, 0, 0], hold=True, delay=1), (only,), s, 50.0)
    assert (held.windup, held.delay) == ("hold", 1.0)


def test_the_memory_of_a_law_before_its_first_sample_sees_no_jump():
    a = Channel(measured="a", reference="r", kp=1.0, ki=4.0, kd=2.0)
    b = Channel(measured="b", kd=5.0, ki=8.0)
    first = {"a": 3.0, "r": 10.0, "b": -2.0}
    # the sum of the first, error of a, its low pass, the sum of the second, error of b, its low pass
    assert memory_before([a, b], first, constant=6.0, smoothed={"b": 15.0}) == pytest.approx(
        [1.5, 7.0, 0.0, 0.0, 2.0, 3.0]
    )
    assert memory_before([Channel(measured="b", kp=1.0)], first, constant=6.0) == pytest.approx([6.0])
    assert memory_before([Channel(measured="b", kp=1.0)], first).size == 0
    on = Channel(measured="a", reference="r", kd=2.0, on="measurement")
    assert memory_before([on], first) == pytest.approx([-3.0, 0.0])


@pytest.mark.parametrize(
    ("terms", "family", "measured", "words"),
    [
        ([("kp", 0)], {}, ["a"], "P"),
        ([("kp", 0), ("ki", 0), ("kd", 0)], {}, ["a"], "PID; plain difference of the error"),
        ([("kp", 0), ("kd", 0)], {"smoothing": "filter", "on": "measurement"}, ["a"],
         "PD; filtered difference of the measurement"),
        ([("kp", 0), ("kp", 1)], {"delay": 1}, ["a", "b"], "P of a and b; one sample late"),
        ([("kp", 0), ("ki", 1)], {"hold": True}, ["a", "b"], "P of a, I of b; sum held at the limit"),
        ([("kd", 1), ("kd2", 1)], {"smoothing": "two taps"}, ["a", "b"], "D of b; two-tap difference of the error"),
    ],
)  # fmt: skip
def test_a_structure_is_named_by_its_terms(terms, family, measured, words):
    assert structure(regression(terms, [1.0] * len(terms), **family), measured) == words


def recovered(*channels, resolution=0.0, saturated=0.0, every=1, feedforward=None, missed=None, **law):
    made = joined(channels or [Channel(measured="y", reference="r", kp=2.0)], period=T, **law)
    u = RNG.normal(size=100)
    return Recovery(
        law=made, command="u", feedforward=feedforward or {}, channels=channels, structure="P",
        gains={"kp": Gain(value=2.0, stderr=0.1, interval=(1.8, 2.3), meaning="on y")}, rows=np.arange(100),
        recorded=u, reproduced=u - (np.zeros(100) if missed is None else missed), used=np.ones(100, dtype=bool),
        resolution=resolution, saturated=saturated, every=every, unit="V",
        candidates=(TriedStructure(name="P", parameters=2, missed=0.5),),
    )  # fmt: skip


def test_the_quality_of_a_law_is_what_its_largest_miss_and_the_column_s_steps_say():
    missed = np.zeros(100)
    missed[:3] = 9.0  # junk
    assert recovered(missed=missed).quality == "exact"
    missed[50] = 0.01
    stepped_ = recovered(missed=missed, resolution=0.01)
    assert (stepped_.quality, stepped_.largest) == ("rounding", pytest.approx(0.01))
    missed[51] = -0.004
    # 96 of 97 rows to half a step
    assert recovered(missed=missed, resolution=0.01).sentence == (
        "The law reproduces all 100 commands to 1.00 steps of the column (0.01 V), 99 % of them to its rounding: exact "
        "but for the rounding."
    )
    assert recovered(missed=missed, resolution=0.0099).quality == "partial"
    flat = recovered(missed=missed)
    assert flat.explained == pytest.approx(100 * (1 - np.sqrt(np.mean(missed[3:] ** 2)) / np.std(flat.recorded[3:])))


def test_a_law_is_written_into_a_study_key_by_key():
    pd = Channel(measured="y", reference="r", kp=2.0, kd=0.5, on="measurement", filter=Filter(pole=0.8, second=0.25))
    assert loop_written(recovered(pd, saturated=0.1, limit=5.0, windup="hold", delay=1.0, every=2)) == (
        'loop = { kind = "pid", kp = 2, kd = 0.5, tau = "0.04 s", taps = [0.75, 0.25], on = "measurement", '
        'measured = "COORDINATE OF y", reference = "r", limit = 5, windup = "hold", delay = 1, period = "10 ms", '
        'units = "log" }'
    )
    two = [Channel(measured="a", kp=2.0, ki=1.0), Channel(measured="b", kp=3.0)]
    assert loop_written(recovered(*two, limit=5.0)) == (
        'loop = { kind = "pid", kp = [2, 3], ki = [1, 0], measured = ["COORDINATE OF a", "COORDINATE OF b"], '
        'units = "log" }'
    )
    assert loop_written(recovered(pd, feedforward={"f": 1.0})) == ""
    assert loop_written(recovered(pd, Channel(measured="b", kp=1.0))) == ""
    assert loop_recovered(recovered(pd, feedforward={"f": 1.0})) == (
        'loop = { kind = "recover", command = "u", reference = "r", feedforward = "f" }'
    )
    assert loop_recovered(recovered(*two)) == 'loop = { kind = "recover", command = "u" }'


def test_everything_about_a_law_is_in_its_json():
    told = json.loads(as_json(recovered(Channel(measured="y", kp=2.0, ki=3.0), saturated=0.2, limit=5.0)))
    assert told["gains"] == {"kp": {"value": 2.0, "low": 1.8, "high": 2.3, "meaning": "on y"}}
    assert (told["period_s"], told["limit"], told["samples_per_row"]) == (T, 5.0, 1)
    assert told["tried"] == [{"name": "P", "numbers": 2, "missed": 0.5}]
    assert told["D"] == pytest.approx([-2.0 - 3.0 * T])
    assert json.loads(as_json(recovered(Channel(measured="y", kp=2.0), limit=5.0)))["limit"] is None


@pytest.mark.parametrize(
    ("gains", "depends"),
    [
        ({"kp": (2.0, 0.9)}, True),
        ({"kp": (-2.0, 0.9)}, True),
        ({"kp": (2.0, 1.1)}, False),  # not told from none by two standard errors
        ({"kp": (0.0, 0.0)}, False),  # none at all, however surely
        ({"kp": (0.1, 1.0), "kd y": (5.0, 1.0)}, True),
        ({"filter": (5.0, 0.1), "kp": (0.1, 1.0)}, False),  # what filters nothing is no law
    ],
)
def test_a_law_has_a_gain_that_is_more_than_two_standard_errors_from_none(monkeypatch, gains, depends):
    told = {n: Gain(value=v, stderr=s, interval=(v - 2 * s, v + 2 * s), meaning="") for n, (v, s) in gains.items()}
    monkeypatch.setattr("upright.closed_loop.search.gains_with_intervals", lambda *_: told)
    y = RNG.normal(size=200)
    made = search(-2 * y, y=y)
    record = Record(
        t=T * np.arange(200), signals={"u": made.u, "y": y}, units={"u": "V", "y": "rad"},
        provenance=Provenance(file="log.csv", reader="table"),
    )  # fmt: skip
    best = made.search()
    if depends:
        assert made.recovery(best, record, "u", np.arange(200)).gains == told
    else:
        with pytest.raises(NotIdentifiable, match="'u' does not depend on y: the loop is open"):
            made.recovery(best, record, "u", np.arange(200))
