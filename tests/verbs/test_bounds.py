"""Do the verbs take what is just within their bounds and refuse what is just beyond, before any work is done?"""

from __future__ import annotations

import math

import numpy as np
import pytest

import upright as up
from tests.gains.furuta import RIG as FURUTA
from upright.errors import BadInput

TOWER = up.StateSpace(
    [[0.0, 1.0], [4.0, 0.0]], [0.0, 2.0], states=("x", "v"), inputs=("F",), units={"x": "mm", "F": "V"}
)
ASKED = {"poles": "-4, -5", "period": "2 ms"}


def wish(model=TOWER, **options):
    return up.design(model, **(ASKED | options)).value.request


def test_a_design_of_matrices_takes_period_limit_and_start_as_they_are_typed():
    asked = wish(limit=3.0, start="x = 5 mm, v=2")
    assert (asked.period, asked.limit) == (pytest.approx(2e-3), 3.0)
    assert asked.start == pytest.approx((5.0, 2.0))  # in the model's own unit
    assert wish(start={"x": 5.0}).start == (5.0, 0.0)
    sampled = TOWER.to_sampled(0.02)
    assert wish(sampled, period="").period == 0.02


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"period": ""}, "these matrices are continuous, and a computer closes the loop"),
        ({"model": TOWER.to_sampled(0.02), "period": "21 ms"}, "every 20 ms, and a period of 21 ms is requested"),
        ({"at": "inverted"}, "are of a rig"), ({"counts": 4096}, "are of a rig"),
        ({"vendor": "ECP 210"}, "are of a rig"),
        ({"start": "x=0 mm"}, "must leave the equilibrium"), ({"start": "y=1"}, "names states as in"),
        ({"poles": "", "lqr": "1,a"}, "weights are numbers separated by commas"),
        ({"poles": "-1, -2", "lqr": "1,1"}, "not both"),
    ],
)  # fmt: skip
def test_a_design_of_matrices_that_cannot_be_is_refused(options, said):
    with pytest.raises(BadInput, match=said):
        wish(**options)


def of_rig(**options):
    return up.design(FURUTA, **({"poles": "-4+-2j, -17, -3", "period": "2 ms", "counts": 4000, "limit": 5.0} | options))


@pytest.mark.parametrize(
    ("counts", "resolution"),
    [
        (4000, (4000, 4000)), ({"psi": 1000, "theta": 2000}, (1000, 2000)), ("4000, psi=1000", (1000, 4000)),
    ],
)  # fmt: skip
def test_counts_are_per_turn_of_all_or_of_each(counts, resolution):
    done = of_rig(counts=counts)
    assert done.value.request.resolution == pytest.approx([2 * math.pi / n for n in resolution])
    assert (done.value.request.at, done.value.request.limit, done.value.request.period) == ("inverted", 5.0, 2e-3)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"counts": "psi=0"}, "counts takes numbers above 0, got 'psi=0'"), ({"counts": "many"}, "got 'many'"),
        ({"counts": 1e15}, "numbers above 0"), ({"counts": "phi=10"}, "names coordinates as in"),
        ({"limit": 0.0}, "limit must be above 0 and below 1e9 N m, got 0"), ({"limit": 1e9}, "got 1000000000"),
        ({"limit": "2 kg"}, "kg"), ({"limit": "0 N mm"}, "got 0 N mm"),
        ({"period": 0.9e-6}, "every 1e-6 to 10 s"), ({"period": 10.1}, "every 1e-6 to 10 s, got a period of 10.1 s"),
        ({"speed": "observer"}, "speed is plain, filtered or kalman, got 'observer'"),
    ],
)  # fmt: skip
def test_an_option_of_a_rig_beyond_its_bounds_is_refused(options, said):
    with pytest.raises(BadInput, match=said):
        of_rig(**options)


@pytest.fixture(autouse=True)
def elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: up.swing_up(seconds=0.99), "from 1 to 120 s, got 0.99"),
        (lambda: up.swing_up(seconds=120.1), "from 1 to 120 s, got 120.1"),
        (lambda: up.swing_up(travel=0.0), "travel must be above 0 .*, got 0"),
        (lambda: up.swing_up(limit=1.0), "limit is for a rig of your own"),
        (lambda: up.swing_up(period=1.0), "period is for a rig of your own"),
        (lambda: up.swing_up(counts=0), "counts is for a rig of your own"),
        (lambda: up.swing_up(vendor="ECP 210"), "vendor is for a rig of your own"),
        (lambda: up.swing_up(fault={"theta": 0.0099}), "a factor between 0.01 and 100, .* got '0.0099'"),
        (lambda: up.swing_up(fault={"theta": -100.1}), "got '-100.1'"),
        (lambda: up.swing_up(fault="theta=a"), "got 'a'"),
        (lambda: up.regulate(which=0), "which is 1 to 4, or all, got '0'"),
        (lambda: up.regulate(which="set 1"), "which is 1 to 4, or all, got 'set 1'"),
        (lambda: up.regulate(which="all", poles=[-1, -2, -3, -4]), "give either which"),
        (lambda: up.regulate(FURUTA, rig="linear"), "is a 'furuta', not 'linear'; leave rig out"),
        (lambda: up.track(limit=0.0), "limit must be above 0 .*, got 0"),
        (lambda: up.track(step=0.0), "a size above 0, got '0.0'"),
        (lambda: up.track(sets="1,b"), "sets takes numbers of Table 2"), (lambda: up.track(sets=[0]), "sets 1 to 4"),
        (lambda: up.track(sets=[1, 5]), "sets 1 to 4"),
        (lambda: up.frequency(low=0.0), "low needs a frequency above 0 rad/s, got 0"),
        (lambda: up.frequency(high=-1.0), "high needs a frequency above 0 rad/s, got -1"),
        (lambda: up.frequency(high=math.inf), "high needs a frequency above 0 rad/s, got inf"),
        (lambda: up.frequency(low=2.0, high=2.0), "low must lie below high, got 2 and 2 rad/s"),
        (lambda: up.frequency(ask="noise"), "ask is one of"),
        (lambda: up.frequency(kind="noise"), "kind is one of"),
        (lambda: up.frequency(), "frequency needs a log, a frequency.csv or a study"),
        (lambda: up.frequency(rig="furuta", low=2.0), "low belongs to a log"),
        (lambda: up.frequency(rig="furuta", high=2.0), "high belongs to a log"),
        (lambda: up.frequency(rig="furuta", data="."), "data belongs to a log"),
        (lambda: up.frequency(rig="furuta", hold=0.1), "hold belongs to a log"),
        (lambda: up.frequency("a.csv", counts={"x": 0}), "counts x needs a finite number that is not 0, got '0'"),
        (lambda: up.frequency("a.csv", counts={"x": "b"}), "needs a finite number that is not 0, got 'b'"),
        (lambda: up.frequency("a.csv", counts={"x": math.inf}), "needs a finite number"),
        (lambda: up.frequency("a.csv", known={"m_p": 0.1}), "known belongs to a fit; name the rig"),
        (lambda: up.plan_inertias(runs=1, levels=2), "runs needs a whole number from 2 to 16, got 1"),
        (lambda: up.plan_inertias(runs=17), "runs needs a whole number from 2 to 16, got 17"),
        (lambda: up.plan_inertias(levels=1), "levels needs a whole number from 2 to 5, got 1"),
        (lambda: up.plan_inertias(levels=6), "levels needs a whole number from 2 to 5, got 6"),
        (lambda: up.plan_inertias(error=0.5), "error needs a share between 0 and 50 %, got '0.5'"),
        (lambda: up.plan_inertias(tolerance=-0.01), "tolerance needs a share"),
        (lambda: up.plan_inertias(target=0.5, runs=3), "target needs a share"),
        (lambda: up.plan_inertias(out="plan.pdf"), "a picture is a file ending in"),
        (lambda: up.loadings(rig="rectilinear", added="1 kg"), "takes no logs"),
        (lambda: up.chance(FURUTA, [0, 0, 0, 0], speed="fast"), "velocities come from"),
        (lambda: up.chance(FURUTA, [0, 0, 0, 0], seconds=0.0), "more than 0 and at most 120 s, got 0 s"),
        (lambda: up.chance(FURUTA, [0, 0, 0, 0], seconds=120.1), "at most 120 s, got 120.1 s"),
        (lambda: up.chance(FURUTA, [0, 0, 0, 0], draws=0), "at least 1, got 0"),
        (lambda: up.chance(FURUTA, [0, 0, 0, 0], counts=[1, 2, 3]), r"one for each of psi, theta, .* got \[1, 2, 3\]"),
    ],
)  # fmt: skip
def test_what_lies_just_beyond_is_refused_before_the_work_begins(call, said, tmp_path):
    with pytest.raises(BadInput, match=said):
        call()
    assert list(tmp_path.iterdir()) == []


def test_a_plan_of_few_runs_is_made_at_the_ends_of_its_bounds():
    assert list(up.plan_inertias(runs=2, levels=2, error=1e-3, tolerance=0.0).value) == [2]
    assert list(up.plan_inertias(runs=4, levels=3).value) == [3, 4]


def test_a_ladder_looks_at_the_folder_that_it_is_to_write_to_before_it_climbs(tmp_path):
    """Where a folder bears the name of its file, neither a study's file nor a study in memory is climbed."""
    from upright.study.load import load_study

    t = np.arange(500) * 0.01
    up.init(up.Record(t=t, signals={"theta": np.exp(-0.2 * t) * np.cos(7 * t)}, units={"theta": "rad"}), out="s.toml")
    (tmp_path / "mine" / "ladder.json").mkdir(parents=True)
    for study in ("s.toml", load_study(tmp_path / "s.toml")):
        with pytest.raises(BadInput, match=r"mine/ladder\.json' is a folder"):
            up.ladder(study, out="mine")
    assert not list((tmp_path / "mine" / "ladder.json").iterdir())
