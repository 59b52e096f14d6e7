"""Does the experiment check, swing, tell, and refuse to close a loop on a lying encoder?"""

from __future__ import annotations

import json
import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from upright.control.score import FALLEN
from upright.control.watch import Suspicion
from upright.errors import BadInput, NotIdentifiable, RigStopped
from upright.experiments.stand.twin import TwinStand
from upright.experiments.swing_up_2b import run as swing_up
from upright.experiments.swing_up_2b.chapter import chapter, check_chapter
from upright.experiments.swing_up_2b.run import FAULTS, known_of, run_swing_up, scales_of_log
from upright.files import plain_values
from upright.physics import Furuta
from upright.records import Record
from upright.report.html import write_html
from upright.rig import Rig
from upright.rig.makes import make_rig


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    return run_swing_up(make_rig("furuta"), TwinStand(rig=make_rig("furuta", 3)), tmp_path_factory.mktemp("up"))


@pytest.mark.slow
def test_it_stands_and_says_so(done, tmp_path):
    assert done.caught
    told = chapter(done)
    # the law is that of the make's data sheet: caught, on numbers that nobody identified
    assert (told.sound, told.numbers["basis"]["level"]) == (False, "with reservations")
    assert f"{done.ascent.up:.2f} s" in told.verdict
    page = write_html(tmp_path / "page.html", told).read_text(encoding="utf-8")
    assert page.count('<div class="still') == 4  # the rig stands first
    assert "http://" not in page.replace("http://www.w3.org", "")
    json.dumps(plain_values(told.numbers), allow_nan=False)


@pytest.mark.slow
def test_the_logs_are_those_of_a_program_at_the_rig(done):
    log = Record.from_csv(done.folder / "swing_up.csv")
    assert np.allclose(
        log["theta"], np.round(log["theta"] / done.truth.resolution[1]) * done.truth.resolution[1], atol=1e-9
    )
    assert np.abs(log["u"]).max() == pytest.approx(done.ascent.peak)
    assert abs(log["theta"][0]) < 1e-9
    assert math.cos(log["theta"][-1]) < -0.99


@pytest.mark.slow
def test_every_lie_is_told_before_a_loop_is_closed_or_falls(done):
    assert len(done.faulty) == len(FAULTS)
    for lie in done.faulty:
        assert lie.refused
        assert lie.estimate == pytest.approx(lie.factor, rel=0.02)
        if math.isfinite(lie.fell):
            assert lie.spoke < lie.fell
    assert any(math.isfinite(lie.fell) for lie in done.faulty)


def test_no_loop_is_closed_on_a_lying_encoder(tmp_path):
    liar = replace(make_rig("furuta", 3), scales=(1.0, 2.0))
    done = run_swing_up(make_rig("furuta"), TwinStand(rig=liar), tmp_path)
    assert done.ascent is None
    assert not done.caught
    told = chapter(done)
    assert not told.sound
    assert "No loop was closed. The encoder of theta shows 2" in told.verdict
    assert not (tmp_path / "swing_up.csv").exists()


@pytest.mark.slow
def test_a_log_of_one_s_own_is_checked_in_any_unit(done):
    model, log = done.model, Record.from_csv(done.folder / "sensors.csv")
    counts = {"psi": np.round(log["psi"] / model.resolution[0]), "theta": np.degrees(log["theta"]) * 2, "u": log["u"]}
    found = scales_of_log(model, log.replace(signals=counts, units={"psi": "counts", "theta": "deg", "u": "V"}))
    assert found.value == pytest.approx([1.0, 2.0], rel=0.01)
    assert found.wrong == ("theta",)
    told = check_chapter(model, found, "own.csv")
    assert not told.sound
    assert "encoder of theta shows 2" in told.verdict
    with pytest.raises(BadInput, match="needs a column 'psi'"):
        scales_of_log(
            make_rig("furuta"), log.replace(signals={n: log[n] for n in ("theta", "u")}, outputs=("theta",), units={})
        )
    with pytest.raises(BadInput, match="'psi' is in m"):
        scales_of_log(model, log.replace(units={"psi": "m", "theta": "rad", "u": "V"}))
    small = {"psi": log["psi"], "theta": log["theta"], "u": 0.1 * log["u"]}
    with pytest.raises(NotIdentifiable, match="drive it to 40 or more"):
        scales_of_log(model, log.replace(signals=small))


def test_what_a_fit_knows_is_the_spread_of_the_rigs_that_it_allows():
    nominal = make_rig("furuta")
    plant = nominal.plant
    assert isinstance(plant, Furuta)
    others = tuple((plant.replace(m_p=plant.m_p * f, b_1=plant.b_1 * f), nominal.gain * f) for f in (0.98, 1.0, 1.02))
    file = Rig(plant=plant, name="furuta", gain=nominal.gain, unit="V", draws=others)
    known = known_of(file)
    spread = 0.02 * math.sqrt(2 / 3)
    assert known["m_p"] == pytest.approx(spread)
    assert known["gain"] == pytest.approx(spread)
    assert known["b_1"] == 0.2  # friction differs from day to day, however well one day knows it
    assert "l_cg" not in known


def test_a_friction_that_the_fit_puts_at_its_bound_still_lets_the_encoders_be_scales_of_log():
    plant = make_rig("furuta").plant
    some = np.random.default_rng(5)
    others = tuple((plant.replace(b_2=abs(some.normal(0, 1.5e-5))), 0.65) for _ in range(50))
    file = Rig(plant=plant.replace(b_2=1e-21), name="furuta", gain=0.65, unit="V", draws=others)
    # factors of the model's numbers are exp(z size): a size of 1e16 is no number any more
    assert max(known_of(file).values()) < 5


def swung(model, degrees, **units):
    """Two seconds of a pendulum that was driven at first: every column as its model moves, to that amplitude."""
    n = 400
    t = np.arange(n) * model.period * 10
    u = np.where(t < 0.5, 1.0, 0.0)
    theta = math.radians(degrees) * np.sin(6 * t)
    return Record(t=t, signals={"psi": 5.0 + 0.2 * np.sin(6 * t), "theta": 2.0 + theta, "u": u}, units=units)


@pytest.fixture
def scaled(monkeypatch):
    """What the encoders are compared with is noted instead; the model swings by `true` radians."""
    seen = []

    def compare(model, log, known):
        seen.append((log, known))
        return SimpleNamespace(motion=np.column_stack([log["psi"], 2.0 * log["theta"]]), value=np.array([1.0, 2.0]))

    monkeypatch.setattr(swing_up, "scales", compare)
    return seen


def test_a_log_is_read_in_any_unit_from_where_it_began(scaled):
    """In counts by the model's, in degrees by their size, in nothing as it stands; psi from 5, theta from 2."""
    model = make_rig("furuta")
    by = {"rad": 1.0, "deg": 180 / math.pi, "counts": 1 / model.resolution[1], "": 1.0}
    for unit, per in by.items():
        log = swung(model, 60)
        shown = log.replace(signals={**log.signals, "theta": per * log["theta"]}, units={"theta": unit})
        scales_of_log(model, shown, {"m_p": 0.01})
        seen, known = scaled[-1]
        np.testing.assert_allclose(seen["theta"], log["theta"] - 2.0, atol=1e-9)
        np.testing.assert_allclose(seen["psi"], log["psi"] - 5.0)
        np.testing.assert_array_equal(seen["u"], log["u"])
        assert seen.units == {"psi": "rad", "theta": "rad", "u": model.unit}
        assert (seen.inputs, seen.outputs) == (("u",), ("psi", "theta"))
        assert known == {"m_p": 0.01}
    for missing in ("u", "psi", "theta"):
        rest = {n: v for n, v in log.signals.items() if n != missing}
        with pytest.raises(BadInput, match=f"column '{missing}'"):
            scales_of_log(model, log.replace(signals=rest, units={}))
    with pytest.raises(BadInput, match="'theta' is in m, and rad or counts were needed"):
        scales_of_log(model, log.replace(units={"theta": "m"}))


@pytest.mark.parametrize(("degrees", "enough"), [(39.5, False), (40.5, True)])
def test_a_pendulum_must_swing_to_forty_degrees_by_the_model_whatever_its_encoder_shows(scaled, degrees, enough):
    model = make_rig("furuta")
    if enough:
        scales_of_log(model, swung(model, degrees))
    else:
        with pytest.raises(NotIdentifiable, match=r"swings to 39 degrees only.*drive it to 40 or more"):
            scales_of_log(model, swung(model, degrees))


def test_a_faulty_encoder_is_told_with_the_tilt_at_which_it_was_told_and_when_it_fell(monkeypatch):
    """The pendulum leans by 0.1 rad for every tenth of a second; the watch speaks after 0.3 s, or never."""
    model = make_rig("furuta", 3)
    n = round(2.0 / model.period) + 1
    t = np.arange(n) * model.period
    tried = []

    def trial(rig, law, *, at, start, seconds, rest):
        tried.append((rig.scales, at, start, seconds))
        falls = 2.0 if rig.scales[1] == -1.0 else 0.1
        lean = np.column_stack([0 * t, falls * t])
        x = np.column_stack([0 * t, 0 * t, math.pi + falls * t, 0 * t])
        shown = lean * np.array(rig.scales) + rest
        log = Record(t=t, signals={"psi": shown[:, 0], "theta": shown[:, 1]})
        return SimpleNamespace(record=log, u=np.full(n, 0.1), deviation=lean, x=x)

    class Watching:
        def __init__(self, of):
            assert of is model

        def over(self, measured, commands):
            assert measured.shape == (n, 2, len(FAULTS))
            np.testing.assert_allclose(measured[:, 1, 0], -2.0 * t, atol=1e-12)  # counted from rest
            assert commands.shape == (n, len(FAULTS))
            sample = np.full(len(FAULTS), -1)
            sample[:3] = np.searchsorted(t, 0.3)
            what = np.array([Suspicion() for _ in FAULTS], dtype=object)
            what[1] = Suspicion(name="theta", factor=0.25)
            return SimpleNamespace(sample=sample, what=what)

    def compare(of, log, known):
        return SimpleNamespace(value=np.array([1.0, 0.5]), error=np.array([0.01, 0.02]), wrong=("theta",))

    monkeypatch.setattr(swing_up, "trial", trial)
    monkeypatch.setattr(swing_up, "Watch", Watching)
    monkeypatch.setattr(swing_up, "scales", compare)
    monkeypatch.setattr(swing_up, "shown_by_encoders", lambda rig, command: None)
    law = SimpleNamespace(memory=0.5, K=np.ones(4))
    lies = swing_up._faulty_encoders(model, model, law, np.zeros(5), None)
    assert [(lie.name, lie.factor) for lie in lies] == [(name or "psi", factor) for name, factor in FAULTS]
    assert [scales[0 if lie.name == "psi" else 1] for lie, (scales, *_) in zip(lies, tried, strict=True)] == [
        factor for _, factor in FAULTS
    ]  # fmt: skip
    assert all(scales[1 if lie.name == "psi" else 0] == 1.0 for lie, (scales, *_) in zip(lies, tried, strict=True))
    assert {(at, tuple(start), seconds) for _, at, start, seconds in tried} == {
        ("inverted", (0.0, 0.0, math.radians(3), 0.0), 2.0)
    }  # fmt: skip
    told = lies[:3]
    assert [lie.spoke for lie in told] == pytest.approx([0.3] * 3, abs=model.period)
    assert [lie.tilt for lie in told] == pytest.approx([0.6, 0.03, 0.03], abs=3 * model.period)
    assert [bool(lie.suspicion) for lie in told] == [False, True, False]
    for lie in lies[3:]:
        assert (lie.spoke, lie.tilt, lie.suspicion) == (math.inf, 0.0, "")
    assert lies[0].fell == pytest.approx(FALLEN / 2.0, abs=2 * model.period)
    assert {lie.fell for lie in lies[1:]} == {math.inf}
    assert [(lie.estimate, lie.error, lie.refused) for lie in lies] == [
        (1.0, 0.01, False) if lie.name == "psi" else (0.5, 0.02, True) for lie in lies
    ]  # fmt: skip


class Scripted:
    """A stand whose encoders begin elsewhere and whose run ends as it is told."""

    rig = make_rig("furuta", 3)
    names, resting, travel, speeds, performed = ("psi", "theta"), "hanging", 1.5, (7.0, math.inf), ""

    def __init__(self, *, exact=None, ended=None):
        self.exact, self.ended, self.asked = exact, ended, []

    def ask(self, sentence):
        self.asked.append(sentence)

    def run(self, samples, folder, stem):
        t = 3.0 + np.arange(len(samples)) * 0.1
        columns = {"u_applied": np.array(samples), "psi": 7.0 + t, "theta": 1.0 - t}
        return Record(t=t, signals=columns, units={"psi": "rad", "theta": "rad"})

    def hold(self, rule, at, folder, stem, seconds):
        self.held = (rule, at, stem, seconds)
        return SimpleNamespace(trial=SimpleNamespace(t=np.array([0.0, 2.5]), record=self.run([0.0, 0.0], folder, stem)),
                               ended=self.ended)  # fmt: skip


@pytest.mark.parametrize(("travel", "room"), [(None, 1.5), (0.4, 0.4)])
def test_a_swing_up_checks_what_it_saw_from_rest_and_goes_on_within_the_travel(tmp_path, monkeypatch, travel, room):
    asked, seen = [], []
    sound = SimpleNamespace(sound=True)

    def design(model, *, travel, speeds):
        asked.append((travel, speeds))
        return SimpleNamespace(rule=lambda rig, start: ("rule", start.tolist()))

    monkeypatch.setattr(swing_up, "design_swing_up", design)
    monkeypatch.setattr(swing_up, "probe", lambda model, law: np.array([1.0, -1.0]))
    monkeypatch.setattr(swing_up, "scales", lambda model, log, known: seen.append(log) or sound)
    monkeypatch.setattr(swing_up, "ascent_of", lambda trial, law, rule: SimpleNamespace(trial=trial))
    monkeypatch.setattr(swing_up, "_faulty_encoders", lambda *_: ("tried",))
    told = []
    stand = Scripted()
    done = run_swing_up(
        Scripted.rig, stand, tmp_path, lambda step, share: told.append(share), travel=travel, seconds=9.0
    )
    assert asked == [(room, (7.0, math.inf))]
    (log,) = seen
    assert log["u"].tolist() == [1.0, -1.0, 0.0]
    np.testing.assert_allclose(
        [log.t, log["psi"], log["theta"]], [[0, 0.1, 0.2], [0, 0.1, 0.2], [0, -0.1, -0.2]], atol=1e-9
    )
    assert (log.inputs, log.outputs, log.units["u"]) == (("u",), ("psi", "theta"), "V")
    assert stand.held == (("rule", [0.0] * 4), "inverted", "swing_up", 9.0)
    assert len(stand.asked) == 2
    assert told == sorted(told)
    assert (done.faulty, done.truth is Scripted.rig, done.performed) == ((), True, "")
    assert (tmp_path / "sensors.csv").exists()
    assert (tmp_path / "swing_up.csv").exists()
    truth = make_rig("furuta", 5)
    known = Scripted(exact=truth)
    twin = run_swing_up(Scripted.rig, known, tmp_path)
    assert (twin.faulty, twin.truth) == (("tried",), truth)
    assert run_swing_up(Scripted.rig, known, tmp_path, stopped=lambda: True).faulty == ()
    with pytest.raises(RigStopped, match=r"stopped 2\.5 s after its start: a limit"):
        run_swing_up(Scripted.rig, Scripted(ended="a limit"), tmp_path)
    sound.sound = False
    wrong = run_swing_up(Scripted.rig, known, tmp_path)
    assert (wrong.ascent, wrong.faulty) == (None, ())
