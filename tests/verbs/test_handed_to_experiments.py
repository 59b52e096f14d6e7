"""Do the verbs of an experiment hand on what was asked, in SI, to the twin or the rig that was named?"""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest

from tests.exports.rigs import fit_file
from upright.errors import BadInput
from upright.experiments.frequency_1b import chapter as frequency_chapter
from upright.experiments.frequency_1b import run as frequency_run
from upright.experiments.regulation_2 import chapter as regulation_chapter
from upright.experiments.regulation_2 import run as regulation_run
from upright.experiments.swing_up_2b import chapter as swing_up_chapter
from upright.experiments.swing_up_2b import run as swing_up_run
from upright.experiments.tracking_3 import chapter as tracking_chapter
from upright.experiments.tracking_3 import run as tracking_run
from upright.report.page import Chapter
from upright.rig import Rig
from upright.rig.makes import hardware_of_make, make_rig
from upright.verbs.control.regulate import regulate
from upright.verbs.control.swing_up import _faulty, swing_up
from upright.verbs.control.track import _sets, track
from upright.verbs.model.frequency import _band, _count, frequency

PAGE = Chapter(title="Told", verdict="Told.", numbers={"x": 1.0})


@pytest.fixture
def handed(monkeypatch):
    """What a function was called with, which does nothing; its chapter is a page."""

    def stub(module, name, pages=(), **fields):
        calls = []

        def run(*args, **more):
            calls.append((args, more))
            return SimpleNamespace(rig=SimpleNamespace(name="rig"), answer=None, **fields)

        monkeypatch.setattr(module, name, run)
        for where, page in pages:
            monkeypatch.setattr(where, page, lambda *_, **__: PAGE)
        return calls

    return stub


@pytest.fixture
def fit(tmp_path):
    plant = make_rig("linear").plant
    counts = {"value": 16_000.0, "unit": "1/rev", "source": "known"}
    said = {
        "servo_period": {"value": 1e-3, "unit": "s", "source": "known"},
        "travel": {"value": 0.3, "unit": "m", "source": "known"},
        "counts.x": {"value": 20_000.0, "unit": "1/m", "source": "known"}, "counts.theta": counts,
    }  # fmt: skip
    return fit_file(tmp_path, plant, name="cart-pendulum", unit="N", **said)


def test_a_swing_up_runs_on_the_seed_s_twin_with_the_encoder_that_was_said_to_be_faulty(handed, tmp_path):
    calls = handed(swing_up_run, "run_swing_up", [(swing_up_chapter, "chapter")])
    answer = swing_up(rig="linear", seed=3, travel=0.1, seconds=9.0, fault="theta=2", out=tmp_path)
    ((model, stand, folder), more) = calls[0]
    assert (model, folder) == (make_rig("linear"), tmp_path)  # designed for the data sheet
    assert stand.rig.plant == make_rig("linear", 3).plant
    assert stand.rig.scales == (1.0, 2.0)
    assert more == {"known": None, "seconds": 9.0, "travel": 0.1, "source": ""}
    assert [f.name for f in answer.files] == ["swing_up.html", "swing_up.json"]
    swing_up(out=tmp_path)
    ((model, stand, _), more) = calls[1]
    assert (model, stand.rig, more["travel"]) == (make_rig("furuta"), make_rig("furuta", 1), None)
    with pytest.raises(BadInput, match="--limit is for a rig of your own"):
        swing_up(limit=5.0)
    for seconds in (1, 120):
        swing_up(seconds=seconds, out=tmp_path)
    for seconds in (0.99, 120.1):
        with pytest.raises(BadInput, match="from 1 to 120 s"):
            swing_up(seconds=seconds)


def test_a_swing_up_of_a_fit_meets_the_numbers_it_was_made_from_where_nothing_says_what_else_it_may_be(
    handed, fit, tmp_path
):
    calls = handed(swing_up_run, "run_swing_up", [(swing_up_chapter, "chapter")])
    answer = swing_up(fit, out=tmp_path / "out")
    ((model, stand, _), more) = calls[0]
    assert stand.rig == model
    assert (model.limit, model.travel, model.period) == (5.0, 0.3, 1e-3)
    assert str(fit) in more["source"] or fit.parent.name in more["source"]
    assert any("meets the numbers it was made from" in w for w in answer.chapter.warnings)
    checked = handed(swing_up_run, "scales_of_log", [(swing_up_chapter, "check_chapter")])
    log = tmp_path / "log.csv"
    log.write_text("t,u,x,theta\n" + "".join(f"{k / 1000},0,0,0\n" for k in range(20)), encoding="utf-8")
    seen = swing_up(fit, check=log, out=tmp_path / "checked")
    assert len(checked) == 1
    assert len(calls) == 1  # nothing was swung up
    assert [f.name for f in seen.files] == ["encoders.html"]
    assert not any("made from" in w for w in seen.chapter.warnings)


@pytest.mark.parametrize(
    ("fault", "scales"),
    [({"theta": 0.5}, (1.0, 0.5)), (" psi = -4 ", (-4.0, 1.0)), ({"psi": 100, "theta": 0.01}, (100.0, 0.01)),
     (None, None), ("", None), ({}, None)],
)  # fmt: skip
def test_a_faulty_encoder_shows_its_multiple_and_the_others_what_is_true(fault, scales):
    assert _faulty(make_rig("furuta"), fault).scales == scales


@pytest.mark.parametrize("fault", ["theta=0.009", "theta=101", "theta=x", "theta", {"theta": -0.001}])
def test_a_fault_is_a_factor_between_a_hundredth_and_a_hundred(fault):
    with pytest.raises(BadInput, match=r"between 0\.01 and 100"):
        _faulty(make_rig("furuta"), fault)


def test_tracking_takes_sets_poles_step_and_limit_in_their_units(handed, tmp_path):
    calls = handed(tracking_run, "run_tracking", [(tracking_chapter, "chapter")])
    answer = track(rig="rectilinear", seed=2, step="5 mm", limit="4 V", sets="1,4", out=tmp_path)
    ((model, seed, folder, _), more) = calls[0]
    assert model.plant == make_rig("rectilinear", 2).plant
    assert (model.limit, seed, folder) == (4.0, 2, tmp_path)
    assert more == {"which": (1, 4), "poles": None, "step": 0.005}
    assert answer.chapter.title == "Experiment 3: told, rig"
    assert answer.numbers["verdict"] == "Told."
    assert [f.name for f in answer.files] == ["track.json", "track.html"]
    track(rig="torsional", poles="-5, -6, -7+-1j", out=tmp_path)
    ((model, *_), more) = calls[1]
    assert model.limit == make_rig("torsional").limit
    assert (more["which"], more["step"]) == ((), None)
    np.testing.assert_allclose(np.sort_complex(more["poles"]), [-7 - 1j, -7 + 1j, -6, -5])
    track(rig="torsional", poles="-5, -6, -7+-1j", sets=2, out=tmp_path)
    assert calls[2][1]["which"] == (2,)
    track(rig="torsional", out=tmp_path)
    assert calls[3][1]["which"] == (1, 2, 3, 4)
    assert (_sets(None), _sets(3), _sets([1, 2]), _sets("2"), _sets("")) == ((), (3,), (1, 2), (2,), ())
    with pytest.raises(BadInput, match="separated by commas"):
        _sets("one")
    with pytest.raises(BadInput, match="--step needs a size above 0"):
        track(rig="torsional", step=0.0)


def test_a_twin_is_asked_by_the_excitation_named_and_a_log_within_its_band(handed, tmp_path):
    pages = [(frequency_chapter, "chapter"), (frequency_chapter, "log_chapter")]
    calls = handed(frequency_run, "run_frequency", pages)
    answer = frequency(rig="torsional", seed=5, ask="sweep", out=tmp_path)
    ((rig, seed, folder, _), more) = calls[0]
    assert (rig, seed, folder, more) == ("torsional", 5, tmp_path, {"kind": "sweep"})
    assert [f.name for f in answer.files] == ["frequency.csv", "sweep.csv", "fit.json", "report.html"]
    logs = handed(frequency_run, "response_of_logs", pages)
    answer = frequency(
        ["one.csv", "two.csv"], rig="furuta", seed=1, hold="2 ms", low=1.0, counts={"theta": "-2546.5"}, out=tmp_path,
        signal="theta=angle", command="volts", known={"m_p": "100 g +- 2 g", "actuator.delay": "3 ms"},
    )  # fmt: skip
    ((sources, request, folder), more) = logs[0]
    assert ([s.name for s in sources], folder, more) == (["one.csv", "two.csv"], tmp_path, {"data": None})
    assert (request.make, request.seed, request.command, request.hold) == ("furuta", 1, "volts", 0.002)
    assert (request.band, request.counts, request.signals) == ((1.0, math.inf), {"theta": -2546.5}, {"theta": "angle"})
    assert request.known["m_p"] == pytest.approx((0.1, 0.002))
    assert request.known["actuator.delay"] == (0.003, 0.0)
    assert (request.kind, [f.name for f in answer.files]) == (None, ["frequency.csv", "report.html"])
    for options, said in (
        ({"ask": "noise"}, "--ask is one of"), ({"kind": "noise"}, "--kind is one of"), ({}, "needs a log"),
        ({"rig": "furuta", "low": 1.0}, "--from belongs to a log"), ({"rig": "furuta", "high": 1.0}, "--to belongs"),
        ({"rig": "furuta", "data": "x"}, "--data belongs to a log"),
    ):  # fmt: skip
        with pytest.raises(BadInput, match=said):
            frequency(**options)


@pytest.mark.parametrize(
    ("low", "high", "band"),
    [(None, None, None), (2.0, None, (2.0, math.inf)), (None, 3.0, (0.0, 3.0)), (2.0, 3.0, (2.0, 3.0))],
)
def test_a_band_is_open_where_nothing_is_said(low, high, band):
    assert _band(low, high) == band


@pytest.mark.parametrize(
    ("low", "high", "said"), [(0.0, None, "--from needs"), (None, math.inf, "--to needs"), (3.0, 3.0, "must lie below"),
                              (3.0, 2.0, "must lie below")],
)  # fmt: skip
def test_a_band_that_is_none_is_refused(low, high, said):
    with pytest.raises(BadInput, match=said):
        _band(low, high)


@pytest.mark.parametrize("text", ["0", "x", math.inf])
def test_counts_are_a_number_that_is_not_zero(text):
    assert _count("theta", "-5") == -5.0
    with pytest.raises(BadInput, match="not 0"):
        _count("theta", text)


def test_regulation_of_a_twin_identifies_it_first_and_of_a_fit_runs_only_where_a_seed_is_named(
    handed, fit, tmp_path, monkeypatch
):
    true = make_rig("linear")
    known = Rig(plant=true.plant, name="rig", gain=true.gain, unit="V", hardware=hardware_of_make(true))
    found = handed(regulation_run, "identify_make")
    monkeypatch.setattr(regulation_run, "identify_make", lambda *a, **_: found.append(a) or known)
    calls = handed(regulation_run, "run_regulation", [(regulation_chapter, "chapter")])
    monkeypatch.setattr(regulation_chapter, "design_of_best", lambda result: None)
    told = []
    regulate(rig="linear", which=2, start="12 deg", seconds=4.0, draws=7, out=tmp_path,
             progress=lambda step, share: told.append(share))  # fmt: skip
    assert (found[0][0], found[0][1], found[0][-1]) == ("linear", 0, 7)
    ((model, stand, seed, folder, tell), more) = calls[0]
    assert (model.plant, stand.rig, seed, folder) == (known.plant, true, 0, tmp_path)  # a twin runs without a seed, too
    request = more["request"]
    assert list(request.poles) == ["set 2"]
    assert (request.tilt, request.push, request.seconds, request.draws) == (pytest.approx(math.radians(12)), None, 4, 7)
    tell("running", 0.5)
    assert told == [0.0, pytest.approx(0.8)]  # identifying is six tenths of it
    regulate(rig="linear", seed=3, poles="-4+-2j, -17, -3", out=tmp_path)
    ((_, stand, seed, *_), more) = calls[1]
    assert (stand.rig.plant, seed) == (make_rig("linear", 3).plant, 3)
    assert list(more["request"].poles) == ["your poles"]
    assert (more["request"].seconds, more["request"].draws, more["request"].speed) == (6.0, 200, "filtered")
    regulate(fit, out=tmp_path / "out")
    ((model, stand, *_), more) = calls[2]
    assert (model.limit, stand, len(found)) == (5.0, None, 2)
    assert list(more["request"].poles) == [f"set {i}" for i in range(1, 5)]
